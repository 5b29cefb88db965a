//! The number conversions that may lose bits, in one place.

/// Which of `count` equal cells of [0, 1] a fraction falls into; 1 belongs to the last.
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, and truncation is the purpose")]
pub fn cell(share: f64, count: usize) -> usize {
    ((share * count as f64) as usize).min(count - 1)
}

/// Nearest single-precision number.
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is the purpose")]
pub fn single(x: f64) -> f32 {
    x as f32
}

/// A fraction in [0, 1] as one of 256 levels; values outside saturate.
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, as documented")]
pub fn level(share: f64) -> u8 {
    (share * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_the_first_and_the_last() {
        assert_eq!([cell(0.0, 4), cell(0.25, 4), cell(0.999, 4), cell(1.0, 4)], [0, 1, 3, 3]);
        assert_eq!([level(-1.0), level(0.0), level(1.0), level(7.0)], [0, 0, 255, 255]);
    }
}
