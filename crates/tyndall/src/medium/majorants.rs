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
        let number = |[x, y, z]: [i32; 3]| {
            (x as isize + y as isize * strides[1] + z as isize * strides[2]).cast_unsigned()
        };
        let sign = [0, 1, 2].map(|a| i32::from(direction[a] > 0.0) - i32::from(direction[a] < 0.0));
        let inverse = [0, 1, 2].map(|a| direction[a].recip());
        // Where the ray leaves the cells up to `last` along an axis.
        let exit = |axis: usize, last: i32| match sign[axis] {
            0 => f32::INFINITY,
            forward => ((last + i32::from(forward > 0)) as f32 - entry[axis]) * inverse[axis],
        };
        let mut next = [0, 1, 2].map(|axis| exit(axis, place[axis]));
        let mut start = 0.0_f32;
        loop {
            let cell = number(place);
            let reach = i32::from(self.reach[cell]);
            let (through, leave) = if reach == 0 {
                nearest(next)
            } else {
                nearest([0, 1, 2].map(|axis| exit(axis, place[axis] + reach * sign[axis])))
            };
            let end = leave.min(track.length);
            if end > start {
                let [least, most] = self.opacities[cell];
                visit(CellStretch { start, end, least, most })?;
                start = end;
            }
            if start >= track.length {
                return ControlFlow::Continue(());
            }
            if reach > 0 {
                // Across all alike cells at once: the other axes have moved on as well.
                let there = entry + direction * leave;
                for axis in (0..3).filter(|&axis| axis != through) {
                    let (first, last) = (place[axis] - reach, place[axis] + reach);
                    place[axis] =
                        cast::floor_i32(there[axis]).clamp(first.max(0), last.min(self.dims[axis] - 1));
                    next[axis] = exit(axis, place[axis]);
                }
            }
            place[through] += sign[through] * (reach + 1);
            if place[through] < 0 || place[through] >= self.dims[through] {
                return ControlFlow::Continue(());
            }
            next[through] = exit(through, place[through]);
        }
    }
}

/// The axis whose border comes first, and where.
#[inline]
fn nearest(borders: [f32; 3]) -> (usize, f32) {
    let axis = if borders[0] < borders[1] {
        if borders[0] < borders[2] { 0 } else { 2 }
    } else if borders[1] < borders[2] {
        1
    } else {
        2
    };
    (axis, borders[axis])
}
