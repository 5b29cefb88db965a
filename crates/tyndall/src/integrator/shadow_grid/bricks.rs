//! Which texels are kept: those near matter, since shadows are looked up only where matter is.

use super::Lattice;
use crate::math::cast;
use crate::medium::Medium;

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

/// Voxels along the edges of cells that are tested for matter.
const CELL: usize = 4;

impl Bricks {
    /// Keeps every brick with a texel that is a corner of a cell in which there may be matter.
    pub fn new(lattice: &Lattice, medium: &Medium) -> Self {
        let cells = medium.volume().cells_of(CELL);
        let opaque: Vec<bool> =
            cells.ranges().iter().map(|&values| medium.transfer().opacity_range(values)[1] > 0.0).collect();
        let counts = lattice.texels().map(|n| n.div_ceil(EDGE));
        // Along an axis, the cells in the space of which texels of the `b`-th brick are corners.
        let around = |a: usize, b: usize| {
            let cell = |texel: f32| {
                let cell = (lattice.index_at(a, texel) / CELL as f32).max(0.0);
                cast::index(cell).min(cells.dims()[a] - 1)
            };
            cell((b * EDGE) as f32 - 1.0)..=cell(((b + 1) * EDGE) as f32)
        };
        let [nx, ny, _] = cells.dims();
        let mut bricks = Self { counts, numbers: Vec::with_capacity(counts.iter().product()), kept: Vec::new() };
        for bz in 0..counts[2] {
            for by in 0..counts[1] {
                for bx in 0..counts[0] {
                    let [xs, ys, zs] = [around(0, bx), around(1, by), around(2, bz)];
                    let has_matter = zs.into_iter().any(|z| {
                        ys.clone().any(|y| opaque[nx * (y + ny * z)..][xs.clone()].contains(&true))
                    });
                    if has_matter {
                        bricks.kept.push([bx, by, bz]);
                    }
                    bricks.numbers.push(if has_matter { cast::fit_u32(bricks.kept.len()) } else { 0 });
                }
            }
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
