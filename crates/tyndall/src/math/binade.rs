//! Powers of two, by which scaling rounds nothing.

/// The largest power of two up to a number's magnitude, from 2^-126 to 2^126.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binade(f32);

/// Smallest and largest power of two whose inverse is a normal number too.
const ENDS: [f32; 2] = [f32::MIN_POSITIVE, 1.0 / f32::MIN_POSITIVE];

impl Binade {
    /// That of a number; the nearest end for numbers outside, NaN among them.
    #[inline]
    #[must_use]
    pub fn of(x: f32) -> Self {
        const EXPONENT: u32 = 0x7f80_0000;
        Self(f32::from_bits(x.to_bits() & EXPONENT).clamp(ENDS[0], ENDS[1]))
    }

    /// The power of two.
    #[inline]
    #[must_use]
    pub fn size(self) -> f32 {
        self.0
    }

    /// Its inverse, exactly.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> f32 {
        1.0 / self.0
    }

    /// Twice the size; at most the largest.
    #[inline]
    #[must_use]
    pub fn doubled(self) -> Self {
        Self((self.0 + self.0).min(ENDS[1]))
    }

    /// How many times the other it is: exactly, or 0 or infinite where single precision ends.
    #[inline]
    #[must_use]
    pub fn over(self, other: Self) -> f32 {
        self.0 / other.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_binade_is_the_power_of_two_below() {
        for (x, power) in [(1.0, 0), (1.99, 0), (-2.0, 1), (0.3, -2), (1e30, 99), (-1e-30, -100)] {
            let binade = Binade::of(x);
            assert_eq!(binade.size(), 2.0_f32.powi(power), "{x}");
            assert_eq!(binade.size() * binade.inverse(), 1.0, "{x}");
        }
        assert_eq!([0.0, 1e-45].map(|x| Binade::of(x).size()), [f32::MIN_POSITIVE; 2]);
        assert_eq!([f32::MAX, f32::INFINITY, f32::NAN].map(|x| Binade::of(x).size()), [2.0_f32.powi(126); 3]);
        assert_eq!(Binade::of(3.0).doubled().over(Binade::of(9.0)), 0.5);
    }
}
