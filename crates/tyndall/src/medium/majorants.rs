//! Opacity bounds per cell and the walk of a ray through the cells (3D-DDA [Amanatides87]).

use super::Track;
use crate::math::cast;
use crate::transfer::TransferFunction;
use crate::volume::Volume;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Smallest and largest opacity per cell. Independent of the density, so that scaling it costs nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct MajorantGrid {
    dims: [i32; 3],
    cell: f32,
    opacities: Vec<[f32; 2]>,
}

/// The stretch of a track inside one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellStretch {
    /// Distance where it begins.
    pub start: f32,
    /// Distance where it ends.
    pub end: f32,
    /// Smallest opacity in the cell.
    pub least: f32,
    /// Largest opacity in the cell.
    pub most: f32,
}

impl MajorantGrid {
    /// Bounds for cells of `cell` voxels (0: one cell around everything), in parallel on the current pool.
    #[must_use]
    pub fn new(volume: &Volume, transfer: &TransferFunction, cell: usize) -> Self {
        let bricks = volume.bricks_of(cell);
        Self {
            dims: bricks.dims().map(|n| cast::fit_u32(n).cast_signed()),
            cell: bricks.cell() as f32,
            opacities: bricks.ranges().par_iter().map(|&values| transfer.opacity_range(values)).collect(),
        }
    }

    /// `[smallest, largest]` opacity per cell, x fastest.
    #[must_use]
    pub fn opacities(&self) -> &[[f32; 2]] {
        &self.opacities
    }

    /// Visits the cells along a track in order until `visit` breaks.
    #[inline]
    pub fn walk<B>(
        &self,
        track: &Track,
        mut visit: impl FnMut(CellStretch) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if track.length <= 0.0 {
            return ControlFlow::Continue(());
        }
        let per_cell = 1.0 / self.cell;
        let entry = (track.ray.origin + 0.5) * per_cell;
        let direction = track.ray.direction * per_cell;
        let [nx, ny, nz] = self.dims;
        let mut place = [
            cast::floor_i32(entry.x).clamp(0, nx - 1),
            cast::floor_i32(entry.y).clamp(0, ny - 1),
            cast::floor_i32(entry.z).clamp(0, nz - 1),
        ];
        let strides = [1, nx as isize, nx as isize * ny as isize];
        let mut next = [f32::INFINITY; 3];
        let mut delta = [f32::INFINITY; 3];
        let mut sign = [0_i32; 3];
        for axis in 0..3 {
            let d = direction[axis];
            if d != 0.0 {
                let border = place[axis] + i32::from(d > 0.0);
                next[axis] = (border as f32 - entry[axis]) / d;
                delta[axis] = d.abs().recip();
                sign[axis] = if d > 0.0 { 1 } else { -1 };
            }
        }
        let mut cell = place[0] as isize + place[1] as isize * strides[1] + place[2] as isize * strides[2];
        let mut start = 0.0_f32;
        loop {
            let axis = if next[0] < next[1] {
                if next[0] < next[2] { 0 } else { 2 }
            } else if next[1] < next[2] {
                1
            } else {
                2
            };
            let end = next[axis].min(track.length);
            if end > start {
                let [least, most] = self.opacities[cell.cast_unsigned()];
                visit(CellStretch { start, end, least, most })?;
                start = end;
            }
            if start >= track.length {
                return ControlFlow::Continue(());
            }
            place[axis] += sign[axis];
            if place[axis] < 0 || place[axis] >= self.dims[axis] {
                return ControlFlow::Continue(());
            }
            cell += strides[axis] * sign[axis] as isize;
            next[axis] += delta[axis];
        }
    }
}
