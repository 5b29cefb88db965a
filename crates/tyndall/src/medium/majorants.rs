//! Opacity bounds per cell and the walk of a ray through the cells (3D-DDA \[Amanatides87\]).

use super::{Track, reach};
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
    /// How many cells to every side hold the same single opacity: a ray crosses them in one stretch.
    reach: Vec<u8>,
}

/// The stretch of a track inside one cell, or inside several of the same single opacity.
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
        let opacities: Vec<[f32; 2]> =
            bricks.ranges().par_iter().map(|&values| transfer.opacity_range(values)).collect();
        Self {
            dims: bricks.dims().map(|n| cast::fit_u32(n).cast_signed()),
            cell: bricks.cell() as f32,
            reach: reach::reach(bricks.dims(), &opacities),
            opacities,
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
        let mut inverse = [f32::INFINITY; 3];
        let mut sign = [0_i32; 3];
        for axis in 0..3 {
            let d = direction[axis];
            if d != 0.0 {
                inverse[axis] = d.recip();
                sign[axis] = if d > 0.0 { 1 } else { -1 };
                next[axis] = ((place[axis] + i32::from(d > 0.0)) as f32 - entry[axis]) * inverse[axis];
            }
        }
        let mut cell = place[0] as isize + place[1] as isize * strides[1] + place[2] as isize * strides[2];
        let mut start = 0.0_f32;
        loop {
            let reach = i32::from(self.reach[cell.cast_unsigned()]);
            if reach > 0 {
                // Across all alike cells at once, and into the cell behind them.
                let mut leave = f32::INFINITY;
                let mut through = 0;
                for axis in 0..3 {
                    let border = place[axis] + i32::from(sign[axis] > 0) + reach * sign[axis];
                    let t = (border as f32 - entry[axis]) * inverse[axis];
                    if sign[axis] != 0 && t < leave {
                        (leave, through) = (t, axis);
                    }
                }
                let end = leave.min(track.length);
                if end > start {
                    let [least, most] = self.opacities[cell.cast_unsigned()];
                    visit(CellStretch { start, end, least, most })?;
                    start = end;
                }
                if start >= track.length {
                    return ControlFlow::Continue(());
                }
                let there = entry + direction * leave;
                for axis in 0..3 {
                    let moved = if axis == through {
                        place[axis] + sign[axis] * (reach + 1)
                    } else {
                        cast::floor_i32(there[axis]).clamp(place[axis] - reach, place[axis] + reach)
                    };
                    place[axis] = moved;
                    if moved < 0 || moved >= self.dims[axis] {
                        return ControlFlow::Continue(());
                    }
                    if sign[axis] != 0 {
                        next[axis] =
                            ((moved + i32::from(sign[axis] > 0)) as f32 - entry[axis]) * inverse[axis];
                    }
                }
                cell = place[0] as isize + place[1] as isize * strides[1] + place[2] as isize * strides[2];
                continue;
            }
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
            next[axis] = ((place[axis] + i32::from(sign[axis] > 0)) as f32 - entry[axis]) * inverse[axis];
        }
    }
}
