//! Where texels are.

use crate::math::{Binade, Mat3, Vec3, cast};
use crate::volume::Grid;

/// Points between the faces of the medium's box, equally far apart along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    /// Texels along each axis.
    texels: [usize; 3],
    /// Voxels from texel to texel.
    spacing: [f32; 3],
}

impl Lattice {
    /// With texels this many voxels apart, or a little less, so that the first and the last are on the faces of the box.
    pub fn new(grid: &Grid, voxels: f32) -> Self {
        let cells = grid.dims().map(|n| cast::index((n as f32 / voxels).ceil()).max(1));
        let dims = grid.dims();
        let spacing = std::array::from_fn(|a| dims[a] as f32 / cells[a] as f32);
        Self { texels: cells.map(|n| n + 1), spacing }
    }

    /// Texels along each axis.
    pub fn texels(&self) -> [usize; 3] {
        self.texels
    }

    /// Voxels along a cell's edges.
    pub fn spacing(&self) -> [f32; 3] {
        self.spacing
    }

    /// A position of index space in units of the lattice, in which texels have whole coordinates.
    #[inline(always)]
    pub fn index_to_lattice(&self, position: Vec3) -> Vec3 {
        (position + 0.5) / Vec3::from_array(self.spacing)
    }

    /// The index-space coordinate along an axis of the texel with a number.
    pub fn index_at(&self, a: usize, number: f32) -> f32 {
        number * self.spacing[a] - 0.5
    }

    /// The unit of lengths in which squares of those between texels are far from the ends of single precision, in world units.
    pub fn length_unit(grid: &Grid) -> f32 {
        Binade::of(grid.voxel_size()).size()
    }

    /// The vectors of the lattice's units, in lengths of [`Self::length_unit`].
    pub fn units(&self, grid: &Grid) -> Mat3 {
        let origin = grid.index_to_world(Vec3::ZERO);
        let inverse = Binade::of(grid.voxel_size()).inverse();
        let [x, y, z] = self.spacing;
        let unit = |axis: Vec3| (grid.index_to_world(axis) - origin) * inverse;
        Mat3::from_cols(unit(Vec3::X * x), unit(Vec3::Y * y), unit(Vec3::Z * z))
    }
}
