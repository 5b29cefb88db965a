//! Which texels are kept: those near matter, since shadows are looked up only where matter is.

use super::lattice::Lattice;
use crate::math::cast;
use crate::medium::Medium;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Texels along the edge of a brick, which are kept together or not at all.
pub(super) const EDGE: usize = 8;

/// Bricks of texels, the outer ones filled up; x fastest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bricks {
    counts: [usize; 3],
    /// Per brick 1 plus its number among those that are kept; 0 for those that are not.
    numbers: Vec<u32>,
    /// Coordinates of those that are kept.
    kept: Vec<[usize; 3]>,
}

/// Where there may be matter: per cell of a few voxels, whether any value in it is opaque.
#[derive(Debug)]
pub(super) struct OpaqueCells {
    dims: [usize; 3],
    is_opaque: Vec<bool>,
}

/// Voxels along a cell's edges.
const CELL: usize = 4;

impl OpaqueCells {
    /// In parallel on the current pool.
    pub fn new(medium: &Medium) -> Self {
        let cells = medium.volume().cells_of(CELL);
        let is_opaque = |&values: &[f32; 2]| medium.transfer().opacity_range(values)[1] > 0.0;
        let is_opaque = cells.ranges().par_iter().with_min_len(1 << 12).map(is_opaque).collect();
        Self { dims: cells.dims(), is_opaque }
    }

    /// The cell at an index-space coordinate along an axis; the nearest for those outside.
    fn cell(&self, a: usize, index: f32) -> usize {
        cast::index(index.max(0.0) / CELL as f32).min(self.dims[a] - 1)
    }

    /// Whether there may be matter in some of these cells.
    fn any(&self, [xs, ys, zs]: [RangeInclusive<usize>; 3]) -> bool {
        let [nx, ny, _] = self.dims;
        zs.into_iter()
            .any(|z| ys.clone().any(|y| self.is_opaque[nx * (y + ny * z)..][xs.clone()].contains(&true)))
    }
}

impl Bricks {
    /// How many there are in a lattice, kept or not.
    pub fn number(lattice: &Lattice) -> usize {
        lattice.texels().iter().map(|n| n.div_ceil(EDGE)).fold(1, usize::saturating_mul)
    }

    /// Keeps every brick with a texel that is a corner of a cell of the lattice in which there may be matter; in parallel on the current pool.
    pub fn new(lattice: &Lattice, opaque: &OpaqueCells) -> Self {
        let counts = lattice.texels().map(|n| n.div_ceil(EDGE));
        // Along an axis, the opaque cells in the space of which texels of the `b`-th brick are corners.
        let around = |a: usize, b: usize| {
            let cell = |texel: f32| opaque.cell(a, lattice.index_at(a, texel));
            cell((b * EDGE) as f32 - 1.0)..=cell(((b + 1) * EDGE) as f32)
        };
        let at = |i: usize| [i % counts[0], i / counts[0] % counts[1], i / (counts[0] * counts[1])];
        let has_matter = |i: usize| {
            let [x, y, z] = at(i);
            opaque.any([around(0, x), around(1, y), around(2, z)])
        };
        let keep: Vec<bool> =
            (0..counts.iter().product()).into_par_iter().with_min_len(1 << 10).map(has_matter).collect();
        let mut bricks = Self { counts, numbers: Vec::with_capacity(keep.len()), kept: Vec::new() };
        for (i, keep) in keep.into_iter().enumerate() {
            if keep {
                bricks.kept.push(at(i));
            }
            bricks.numbers.push(if keep { cast::fit_u32(bricks.kept.len()) } else { 0 });
        }
        bricks
    }

    /// Number of texels that are kept.
    pub fn texels(&self) -> usize {
        self.kept.len() * EDGE * EDGE * EDGE
    }

    /// Where a brick's texels begin, in texels, if it is kept.
    #[inline(always)]
    pub fn first_texel(&self, [x, y, z]: [usize; 3]) -> Option<usize> {
        let [nx, ny, _] = self.counts;
        let number = self.numbers[x + nx * (y + ny * z)] as usize;
        number.checked_sub(1).map(|number| number * EDGE * EDGE * EDGE)
    }

    /// Coordinates of the bricks that are kept, in the order of their texels.
    pub fn kept(&self) -> &[[usize; 3]] {
        &self.kept
    }
}
