//! Where the texels are.

use super::padded;
use crate::math::{Mat3, Vec3, cast};
use crate::volume::Grid;

/// A lattice from the first voxel's centre to the last one's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::integrator) struct Lattice {
    /// Texels along each axis.
    texels: [usize; 3],
    /// Voxels from texel to texel.
    spacing: [f32; 3],
}

/// Widest cells, in voxels.
const WIDEST: usize = 8;

impl Lattice {
    /// The finest lattice, of cells of one to eight voxels, whose texels take at most `most_bytes`; `None` if there is none.
    pub fn within(grid: &Grid, points: usize, most_bytes: usize) -> Option<Self> {
        let fits = |lattice: &Self| lattice.bytes(points).is_some_and(|bytes| bytes <= most_bytes);
        (1..=WIDEST).map(|voxels| Self::of(grid, voxels)).find(fits)
    }

    /// With cells of this many voxels, or a little less, so that a whole number fits.
    fn of(grid: &Grid, voxels: usize) -> Self {
        let spans = grid.dims().map(|n| n - 1);
        let cells = spans.map(|n| n.div_ceil(voxels));
        let spacing = std::array::from_fn(|a| if cells[a] > 0 { spans[a] as f32 / cells[a] as f32 } else { 1.0 });
        Self { texels: cells.map(|n| n + 1), spacing }
    }

    /// Bytes that all texels take; `None` where the number overflows.
    pub fn bytes(&self, points: usize) -> Option<usize> {
        let [x, y, z] = self.texels();
        x.checked_mul(y)?.checked_mul(z)?.checked_mul(padded(points))
    }

    /// Texels along each axis.
    pub fn texels(&self) -> [usize; 3] {
        self.texels
    }

    /// Voxels along a cell's edges.
    pub fn spacing(&self) -> [f32; 3] {
        self.spacing
    }

    /// Whether cells are wider than a voxel.
    pub fn is_coarse(&self) -> bool {
        self.spacing.iter().any(|&voxels| voxels > 1.0)
    }

    /// A position of index space in units of the lattice.
    pub fn from_index(&self, position: Vec3) -> Vec3 {
        position / Vec3::from_array(self.spacing)
    }

    /// The world vectors of the lattice's units.
    pub fn units(&self, grid: &Grid) -> Mat3 {
        let origin = grid.index_to_world(Vec3::ZERO);
        let [x, y, z] = self.spacing;
        let unit = |axis: Vec3| grid.index_to_world(axis) - origin;
        Mat3::from_cols(unit(Vec3::X * x), unit(Vec3::Y * y), unit(Vec3::Z * z))
    }

    /// The cell that holds an index-space position; the outer ones extend to the faces of the box.
    #[inline(always)]
    pub(super) fn cell(&self, position: Vec3) -> Cell {
        let ([x, fx], [y, fy], [z, fz]) =
            (self.along(0, position.x), self.along(1, position.y), self.along(2, position.z));
        let [nx, ny, _] = self.texels;
        Cell { first: cast::index(x) + nx * (cast::index(y) + ny * cast::index(z)), within: [fx, fy, fz] }
    }

    /// Its number along an axis, and the position in it.
    #[inline(always)]
    fn along(&self, a: usize, x: f32) -> [f32; 2] {
        let x = x / self.spacing[a];
        let cell = x.floor().clamp(0.0, self.texels[a].saturating_sub(2) as f32);
        [cell, (x - cell).clamp(0.0, 1.0)]
    }
}

/// A cell and a position in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// The number of the texel at its lower corner.
    pub first: usize,
    /// From 0 to 1 along each axis.
    pub within: [f32; 3],
}
