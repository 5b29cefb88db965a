//! Equal bins over the data's values, used by tables of optics and histories of light.

use crate::math::cast;
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// [`Self::INSIDE`] equal bins over a range of values, one more for all below it, and one for all above.
///
/// They depend on the data alone, so that no edit of a transfer function moves them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueBins {
    /// Half the lower end, and bins per half unit of value: differences of halves never overflow.
    half_first: f32,
    per_half: f32,
}

impl ValueBins {
    /// Bins over the range itself.
    pub const INSIDE: usize = 1024;

    /// All bins.
    pub const COUNT: usize = Self::INSIDE + 2;

    /// Over a range; where that is a single value, a bin is two units wide.
    #[must_use]
    pub fn new([first, last]: [f32; 2]) -> Self {
        let half_span = 0.5 * last - 0.5 * first;
        let per_half = if half_span > 0.0 { Self::INSIDE as f32 / half_span } else { 1.0 };
        Self { half_first: 0.5 * first, per_half }
    }

    /// Whether single precision can tell the bins apart.
    #[must_use]
    pub fn are_distinct(self) -> bool {
        self.per_half.is_normal()
    }

    /// The bin of a value, plus the position in it from 0 to 1; never decreases as values increase.
    #[inline]
    #[must_use]
    pub fn position(self, value: f32) -> f32 {
        self.unbounded(value).max(0.0).min((Self::COUNT - 1) as f32)
    }

    /// For lanes, which compute the same: what [`Self::position`] subtracts from half a value, and what it then
    /// multiplies the difference by, before it adds 1 and clamps; each operation rounds.
    #[inline]
    pub(crate) fn numbers(self) -> [f32; 2] {
        [self.half_first, self.per_half]
    }

    fn unbounded(self, value: f32) -> f32 {
        (value * 0.5 - self.half_first) * self.per_half + 1.0
    }

    /// [`Self::position`] without clamping: rounded as there where it does not clamp, else in double precision.
    pub(crate) fn position_beyond(self, value: f32) -> f64 {
        let rounded = self.unbounded(value);
        if (0.0..Self::COUNT as f32).contains(&rounded) {
            return f64::from(rounded);
        }
        (f64::from(value) * 0.5 - f64::from(self.half_first)) * f64::from(self.per_half) + 1.0
    }

    /// The value at a position, up to rounding.
    #[must_use]
    pub fn value(self, position: f32) -> f32 {
        ((position - 1.0) / self.per_half + self.half_first) * 2.0
    }

    /// [`Self::bin`] of a value per lane.
    #[inline(always)]
    pub(crate) fn bin_lanes<S: Lanes>(self, simd: S, values: S::f32s) -> S::i32s {
        let top = S::f32s::splat(simd, (Self::COUNT - 1) as f32);
        // Without fused operations, as in `position`.
        ((values * 0.5 - self.half_first) * self.per_half + 1.0).max(0.0).min(top).to_int()
    }

    /// The bin of a value.
    #[inline]
    #[must_use]
    pub fn bin(self, value: f32) -> usize {
        cast::index(self.position(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_range_fill_the_inner_bins() {
        let bins = ValueBins::new([-1000.0, 3096.0]);
        assert_eq!([-1000.5, -1000.0, -996.0, 3095.9, 3096.0].map(|v| bins.bin(v)), [0, 1, 2, 1024, 1025]);
        assert_eq!([f32::MIN, f32::MAX].map(|v| bins.bin(v)), [0, ValueBins::COUNT - 1]);
        assert!((bins.position_beyond(-9000.0) + 1999.0).abs() < 1e-9);
        assert_eq!(bins.position_beyond(-996.5), f64::from(bins.position(-996.5)));
    }

    #[test]
    fn any_range_has_bins() {
        let one = ValueBins::new([7.0, 7.0]);
        assert!(one.bin(6.0) < one.bin(7.0) && one.bin(7.0) < one.bin(10.0));
        let all = ValueBins::new([f32::MIN, f32::MAX]);
        assert_eq!([f32::MIN, 0.0, f32::MAX].map(|v| all.bin(v)), [1, 513, 1025]);
        assert!(all.are_distinct() && !ValueBins::new([0.0, 4e-45]).are_distinct());
    }
}
