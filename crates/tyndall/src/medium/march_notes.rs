//! What a march reports of everything that it reads.

use crate::simd::Lanes;

/// Listener to everything that the lanes of a packet read.
pub(crate) trait MarchNotes<S: Lanes> {
    /// Whether empty space is crossed cell by cell, so that each cell is reported.
    const EACH_CELL: bool;

    /// All values between the two that some lanes read at the ends of a step.
    fn between(&mut self, simd: S, lanes: S::mask32s, values: [S::f32s; 2]);

    /// Values that one lane reads around its sample.
    fn values_about(&mut self, simd: S, lane: usize, read: S::mask32s, values: S::f32s);

    /// All values between two, in those of the lanes `read`, that one lane reads around its sample.
    fn values_between_about(&mut self, simd: S, lane: usize, read: S::mask32s, ends: [S::f32s; 2]);

    /// Numbers of the empty cells that some lanes skip, x fastest.
    fn cells(&mut self, simd: S, lanes: S::mask32s, cells: S::u32s);
}

/// No listener.
impl<S: Lanes> MarchNotes<S> for () {
    const EACH_CELL: bool = false;

    #[inline(always)]
    fn between(&mut self, _: S, _: S::mask32s, _: [S::f32s; 2]) {}

    #[inline(always)]
    fn values_about(&mut self, _: S, _: usize, _: S::mask32s, _: S::f32s) {}

    #[inline(always)]
    fn values_between_about(&mut self, _: S, _: usize, _: S::mask32s, _: [S::f32s; 2]) {}

    #[inline(always)]
    fn cells(&mut self, _: S, _: S::mask32s, _: S::u32s) {}
}
