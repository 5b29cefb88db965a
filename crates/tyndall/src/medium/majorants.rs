//! Opacity bounds per cell and the walk of a ray through the cells (3D-DDA \[Amanatides87\]).

use super::{Track, reach};
use crate::math::{Vec3, cast};
use crate::transfer::TransferFunction;
use crate::volume::Volume;
use rayon::prelude::*;

/// Smallest and largest opacity per cell. Independent of the density, so that scaling it costs nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct MajorantGrid {
    dims: [i32; 3],
    edge: f32,
    opacities: Vec<[f32; 2]>,
    /// How many cells to every side hold the same single opacity: a ray crosses them in one stretch.
    reach: Vec<u8>,
    /// One more than the reach of an empty cell, 0 for one that holds matter; for kernels over lanes, which may read
    /// some bytes past a cell's.
    empty: Vec<u8>,
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
    /// The cell's number, x fastest; the first one's of several.
    pub cell: usize,
}

impl MajorantGrid {
    /// Bounds for cells of `edge` voxels (0: one cell around everything), in parallel on the current pool.
    #[must_use]
    pub fn new(volume: &Volume, transfer: &TransferFunction, edge: usize) -> Self {
        let cells = volume.cells_of(edge);
        let opacities: Vec<[f32; 2]> =
            cells.ranges().par_iter().map(|&values| transfer.opacity_range(values)).collect();
        let reach = reach::reach(cells.dims(), &opacities);
        let empty = opacities.iter().zip(&reach).map(|(o, reach)| if o[1] <= 0.0 { reach + 1 } else { 0 });
        Self {
            dims: cells.dims().map(|n| cast::fit_u32(n).cast_signed()),
            edge: cells.edge() as f32,
            empty: empty.chain([0; 3]).collect(),
            reach,
            opacities,
        }
    }

    /// `[smallest, largest]` opacity per cell, x fastest.
    #[must_use]
    pub fn opacities(&self) -> &[[f32; 2]] {
        &self.opacities
    }

    /// Cells along each axis.
    pub(super) fn dims(&self) -> [i32; 3] {
        self.dims
    }

    /// Voxels along a cell's edge.
    #[must_use]
    pub fn edge(&self) -> f32 {
        self.edge
    }

    /// Voxels along a cell's edge, as a whole number.
    pub(crate) fn voxels(&self) -> usize {
        cast::index(self.edge)
    }

    /// Per cell how many cells on to each side end what is empty around it, itself included; 0 where there is matter.
    pub(super) fn empty(&self) -> &[u8] {
        &self.empty
    }

    /// The cells along a track in order, those that are alike in one stretch.
    #[inline]
    #[must_use]
    pub fn walk(&self, track: &Track) -> CellWalk<'_> {
        CellWalk::new(self, track)
    }

    /// The cells along a track in order, each by itself: where stretches begin and end does not depend on what is in them.
    #[inline]
    #[must_use]
    pub fn walk_singly(&self, track: &Track) -> CellWalk<'_, false> {
        CellWalk::new(self, track)
    }
}

/// Goes along a track from cell to cell, at once over those that are `ALIKE` if told so; the stretches join without gaps.
#[derive(Clone, Debug)]
pub struct CellWalk<'a, const ALIKE: bool = true> {
    grid: &'a MajorantGrid,
    /// Where the track begins, and where it goes, in cells.
    entry: Vec3,
    direction: Vec3,
    inverse: Vec3,
    sign: [i32; 3],
    /// The present cell.
    place: [i32; 3],
    /// Where the track leaves it along each axis.
    next: [f32; 3],
    start: f32,
    length: f32,
}

impl<'a, const ALIKE: bool> CellWalk<'a, ALIKE> {
    #[inline]
    fn new(grid: &'a MajorantGrid, track: &Track) -> Self {
        let per_cell = 1.0 / grid.edge;
        let entry = track.ray.origin * per_cell;
        let direction = track.ray.direction * per_cell;
        let along = |a: usize| cast::floor_i32(entry[a]).clamp(0, grid.dims[a] - 1);
        let sign = |a: usize| i32::from(direction[a] > 0.0) - i32::from(direction[a] < 0.0);
        let mut walk = Self {
            grid,
            entry,
            direction,
            inverse: Vec3::new(direction.x.recip(), direction.y.recip(), direction.z.recip()),
            sign: [sign(0), sign(1), sign(2)],
            place: [along(0), along(1), along(2)],
            next: [0.0; 3],
            start: 0.0,
            length: track.length,
        };
        walk.next = walk.exits(0);
        walk
    }

    /// Where the track leaves the cells up to `reach` away, along each axis.
    #[inline(always)]
    fn exits(&self, reach: i32) -> [f32; 3] {
        let exit = |axis: usize| self.exit(axis, self.place[axis] + reach * self.sign[axis]);
        [exit(0), exit(1), exit(2)]
    }

    /// Where the track leaves the cells up to `last` along an axis; the outermost reach to the track's end.
    #[inline(always)]
    fn exit(&self, axis: usize, last: i32) -> f32 {
        let border = last + i32::from(self.sign[axis] > 0);
        if self.sign[axis] != 0 && border > 0 && border < self.grid.dims[axis] {
            (border as f32 - self.entry[axis]) * self.inverse[axis]
        } else {
            f32::INFINITY
        }
    }
}

impl<const ALIKE: bool> Iterator for CellWalk<'_, ALIKE> {
    type Item = CellStretch;

    // Kernels over lanes must find it inside themselves.
    #[inline(always)]
    fn next(&mut self) -> Option<CellStretch> {
        let (nx, ny) = (self.grid.dims[0] as isize, self.grid.dims[1] as isize);
        while self.start < self.length {
            let [x, y, z] = self.place;
            let (x, y, z) = (x as isize, y as isize, z as isize);
            let cell = (x + nx * (y + ny * z)).cast_unsigned();
            let reach = if ALIKE { i32::from(self.grid.reach[cell]) } else { 0 };
            let (through, leave) = if reach == 0 { nearest(self.next) } else { nearest(self.exits(reach)) };
            let start = self.start;
            let end = leave.min(self.length);
            if end < self.length {
                self.step(through, leave, reach);
            }
            if end > start {
                self.start = end;
                let [least, most] = self.grid.opacities[cell];
                return Some(CellStretch { start, end, least, most, cell });
            }
        }
        None
    }
}

impl<const ALIKE: bool> CellWalk<'_, ALIKE> {
    /// Into the next cell through the border of `axis` at distance `leave`.
    #[inline]
    fn step(&mut self, through: usize, leave: f32, reach: i32) {
        if reach > 0 {
            // Across all alike cells at once: the other axes have moved on as well.
            let there = self.entry + self.direction * leave;
            for axis in (0..3).filter(|&axis| axis != through) {
                let (first, last) = (self.place[axis] - reach, self.place[axis] + reach);
                self.place[axis] =
                    cast::floor_i32(there[axis]).clamp(first.max(0), last.min(self.grid.dims[axis] - 1));
                self.next[axis] = self.exit(axis, self.place[axis]);
            }
        }
        self.place[through] += self.sign[through] * (reach + 1);
        self.next[through] = self.exit(through, self.place[through]);
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
