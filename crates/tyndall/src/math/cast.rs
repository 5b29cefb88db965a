//! All number conversions that may lose bits; each documents how it rounds or saturates.

/// Rounds down; saturates at the ends of `i32`; NaN becomes 0.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, which is what is documented")]
pub fn floor_i32(x: f32) -> i32 {
    // Without SSE4.1, which a portable build cannot assume, `f32::floor` is a function call.
    let towards_zero = x as i32;
    towards_zero.saturating_sub(i32::from(x < towards_zero as f32))
}

/// Truncates towards zero; saturates at the ends of `i32`; NaN becomes 0.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, which is what is documented")]
pub fn truncate(x: f32) -> i32 {
    x as i32
}

/// The lowest byte of a whole number.
#[inline]
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the lowest byte is what is documented"
)]
pub fn low_u8(x: i32) -> u8 {
    x as u8
}

/// Truncates a non-negative number; negative numbers and NaN become 0.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, which is what is documented")]
pub fn index(x: f32) -> usize {
    x as usize
}

/// Nearest whole number; saturates at the ends of `u16`; NaN becomes 0.
#[inline]
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates, which is what is documented"
)]
pub fn round_u16(x: f32) -> u16 {
    (x + 0.5) as u16
}

/// Truncates a non-negative number; saturates at the largest `u64`; negative numbers and NaN become 0.
#[inline]
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates, which is what is documented"
)]
pub fn whole(x: f64) -> u64 {
    x as u64
}

/// Nearest whole number; saturates at the ends of `i32`; NaN becomes 0.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "`as` saturates, which is what is documented")]
pub fn round_i32(x: f64) -> i32 {
    x.round() as i32
}

/// Nearest single-precision number.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is the purpose")]
pub fn single(x: f64) -> f32 {
    x as f32
}

/// The low 32 bits, for hashing and counters.
#[inline]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "keeping the low half is the purpose")]
pub fn low_u32(x: u64) -> u32 {
    x as u32
}

/// An index known to fit in 32 bits, because the sizes of films and grids are limited far below that.
///
/// # Panics
/// If it does not fit: a broken invariant, never user data.
#[inline]
#[must_use]
pub fn fit_u32(x: usize) -> u32 {
    u32::try_from(x).expect("index within 32 bits")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_of_any_number() {
        for (x, floor) in
            [(1.5, 1), (-1.5, -2), (-2.0, -2), (0.0, 0), (-0.0, 0), (-1e-9, -1), (16_777_216.0, 16_777_216)]
        {
            assert_eq!(floor_i32(x), floor, "{x}");
        }
        assert_eq!((floor_i32(f32::NAN), floor_i32(1e30), floor_i32(-1e30)), (0, i32::MAX, i32::MIN));
    }
}
