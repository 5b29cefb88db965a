//! Skipping of empty space.

use super::Medium;
use super::march_notes::MarchNotes;
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Skips empty space, lane by lane.
pub(super) struct Skip<'a, S: Lanes> {
    simd: S,
    /// See [`MajorantGrid::empty`](super::MajorantGrid::empty).
    empty: &'a [u8],
    dims: [i32; 3],
    edge: f32,
    step: f32,
    origin: [S::f32s; 3],
    inverse: [S::f32s; 3],
    /// Infinite where a track does not advance along the axis, so never leaves a cell there; else 0.
    never: [S::f32s; 3],
    forward: [S::mask32s; 3],
}

/// How near to a region's border, in steps, a step may begin without surely being in the region.
const UNSURE: f32 = 1.0 / 64.0;

/// The cells that the lanes are in.
pub(super) struct LaneCells<S: Lanes> {
    position: [S::i32s; 3],
    /// Whether they hold no matter.
    pub empty: S::mask32s,
    /// Cells until the empty region ends; 0 where there is matter.
    extent: S::i32s,
    pub number: S::u32s,
}

impl<'a, S: Lanes> Skip<'a, S> {
    #[inline(always)]
    pub fn new(
        simd: S,
        medium: &'a Medium,
        origin: [S::f32s; 3],
        direction: [S::f32s; 3],
        step: f32,
    ) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        let one = S::f32s::splat(simd, 1.0);
        let [x, y, z] = direction;
        let [u, v, w] = [x.simd_eq(zero), y.simd_eq(zero), z.simd_eq(zero)];
        let far = S::f32s::splat(simd, f32::INFINITY);
        Self {
            simd,
            empty: medium.majorants.empty(),
            dims: medium.majorants.dims(),
            edge: medium.majorants.edge(),
            step,
            origin,
            inverse: [u.select(zero, one / x), v.select(zero, one / y), w.select(zero, one / z)],
            never: [u.select(far, zero), v.select(far, zero), w.select(far, zero)],
            forward: [x.simd_gt(zero), y.simd_gt(zero), z.simd_gt(zero)],
        }
    }

    #[inline(always)]
    pub fn cells<N: MarchNotes<S>>(&self, position: [S::f32s; 3]) -> LaneCells<S> {
        let position = [self.cell(position[0], 0), self.cell(position[1], 1), self.cell(position[2], 2)];
        let number: S::u32s =
            (position[0] + (position[1] + position[2] * self.dims[1]) * self.dims[0]).bitcast();
        let extent: S::i32s = (self.simd.words(self.empty, number) & 0xff).bitcast();
        let empty = extent.simd_gt(S::i32s::splat(self.simd, 0));
        let extent = if N::EACH_CELL { extent.min(S::i32s::splat(self.simd, 1)) } else { extent };
        LaneCells { position, empty, extent, number }
    }

    #[inline(always)]
    fn cell(&self, x: S::f32s, axis: usize) -> S::i32s {
        let cell: S::i32s = (x * (1.0 / self.edge)).max(0.0).to_int();
        cell.min(S::i32s::splat(self.simd, self.dims[axis] - 1))
    }

    /// The last step that surely begins in the same empty region or in the same cell with matter as step `k` does.
    #[inline(always)]
    pub fn leap(&self, k: S::i32s, cells: &LaneCells<S>) -> S::i32s {
        let one = S::i32s::splat(self.simd, 1);
        let extent = cells.extent.max(one);
        let leave =
            self.leave(0, cells, extent).min(self.leave(1, cells, extent)).min(self.leave(2, cells, extent));
        // Past the end of every track, and far from the end of the integers.
        let last = (leave * (1.0 / self.step) - UNSURE).max(0.0).min(1e9);
        let last: S::i32s = last.to_int();
        last.max(k)
    }

    /// Where the tracks leave that region or cell along an axis.
    #[inline(always)]
    fn leave(&self, a: usize, cells: &LaneCells<S>, extent: S::i32s) -> S::f32s {
        let border = cells.position[a] + self.forward[a].select(extent, -(extent - 1));
        (border.to_float::<S::f32s>() * self.edge - self.origin[a]) * self.inverse[a] + self.never[a]
    }
}
