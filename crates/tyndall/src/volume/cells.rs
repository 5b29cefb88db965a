//! Smallest and largest value per cell: the basis of skipping and majorants.

use super::bricks::{BRICK, Bricks};
use super::{Grid, ValueMap};
use crate::math::{Bounds, Vec3, cast};
use rayon::prelude::*;

/// A coarse grid over the medium's box: each cell holds the range of the interpolated field inside it.
///
/// Cell `i` covers `[cell * i, cell * (i + 1)]` in index space, so that reads there touch only the voxels from
/// `cell * i` to `cell * (i + 1)`; the outermost cells extend to the border of the box, half a voxel
/// past the outer centres.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    edge: usize,
    dims: [usize; 3],
    ranges: Vec<[f32; 2]>,
}

impl Cells {
    /// Default number of voxels along a cell's edge: that of a brick, and the best or second best of 4, 8 and
    /// 16 for CT and clouds alike.
    pub const EDGE: usize = BRICK;

    /// Cells of [`Self::EDGE`], from the smallest and largest sample of each brick.
    pub(super) fn of_bricks(bricks: &Bricks, ranges: &[[f64; 2]], values: ValueMap) -> Self {
        let ranges = ranges.iter().map(|&r| to_values(values, r)).collect();
        Self { edge: Self::EDGE, dims: bricks.counts(), ranges }
    }

    /// `edge` voxels along each side; `0` is one cell around everything.
    pub(super) fn new(grid: &Grid, bricks: &Bricks, values: ValueMap, edge: usize) -> Self {
        let n = grid.dims();
        let edge = if edge == 0 { n.into_iter().max().unwrap_or(1) } else { edge };
        let dims = n.map(|n| (n - 1).div_ceil(edge).max(1));
        let range = |number: usize| {
            let first = coordinates(number, dims).map(|i| i * edge);
            let last = std::array::from_fn(|a| (first[a] + edge).min(n[a] - 1));
            to_values(values, bricks.extremes(first, last))
        };
        let ranges = (0..dims.iter().product::<usize>()).into_par_iter().map(range).collect();
        Self { edge, dims, ranges }
    }

    /// Voxels along a cell's edge.
    #[must_use]
    pub fn edge(&self) -> usize {
        self.edge
    }

    /// Cells along each axis.
    #[must_use]
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// `[smallest, largest]` data value per cell, x fastest.
    #[must_use]
    pub fn ranges(&self) -> &[[f32; 2]] {
        &self.ranges
    }

    /// The number of the cell at an index-space position, clamped to the grid.
    #[must_use]
    pub fn cell_at(&self, p: Vec3) -> usize {
        let position = p / self.edge as f32;
        let [nx, ny, nz] = self.dims;
        let pick = |x: f32, n: usize| cast::index(x).min(n - 1);
        pick(position.x, nx) + nx * (pick(position.y, ny) + ny * pick(position.z, nz))
    }

    /// The cells that meet the box that extends by `reach` to both sides of an index-space position along each axis.
    pub fn cells_within(&self, p: Vec3, reach: Vec3) -> impl Iterator<Item = usize> {
        let [first, last] = [p - reach, p + reach].map(|p| coordinates(self.cell_at(p), self.dims));
        let [nx, ny, _] = self.dims;
        (first[2]..=last[2]).flat_map(move |z| {
            (first[1]..=last[1]).flat_map(move |y| (first[0]..=last[0]).map(move |x| x + nx * (y + ny * z)))
        })
    }

    /// The part of index space that a cell covers in the medium's box.
    #[must_use]
    pub fn cell_bounds(&self, cell: usize, medium: &Bounds) -> Bounds {
        let at = coordinates(cell, self.dims);
        let border = |i: usize| (i * self.edge) as f32;
        let min = |a: usize| if at[a] == 0 { medium.min[a] } else { border(at[a]) };
        let max = |a: usize| if at[a] + 1 == self.dims[a] { medium.max[a] } else { border(at[a] + 1) };
        Bounds::new(Vec3::new(min(0), min(1), min(2)), Vec3::new(max(0), max(1), max(2)))
    }
}

fn coordinates(number: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [number % nx, number / nx % ny, number / (nx * ny)]
}

/// Rounds as look-ups do, so that a cell with a single value holds exactly what is read there.
fn to_values(values: ValueMap, stored: [f64; 2]) -> [f32; 2] {
    let [slope, intercept] = [values.slope, values.intercept].map(cast::single);
    let [a, b] = stored.map(|v| slope * cast::single(v) + intercept);
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Volume, Voxels};

    #[test]
    fn a_cell_of_one_value_holds_what_is_read_there() {
        let mut random = tyndall_testing::SplitMix::new(2);
        for _ in 0..2000 {
            let values = ValueMap { slope: random.uniform() - 0.5, intercept: 1e3 * random.uniform() };
            let stored = cast::round_u16(cast::single(60_000.0 * random.uniform()));
            let grid = Grid::centred([3; 3], [1.0; 3]).unwrap();
            let volume = Volume::new(grid, Voxels::U16(vec![stored; 27]), values).unwrap();
            let value = volume.value(Vec3::ONE);
            assert_eq!(volume.cells_of(0).ranges(), [[value; 2]], "{values:?} of {stored}");
        }
    }

    #[test]
    fn no_point_of_a_cell_leaves_its_range() {
        let n = [19, 8, 11];
        let data: Vec<u16> = (0..u16::try_from(n.iter().product::<usize>()).unwrap())
            .map(|i| i.wrapping_mul(i).wrapping_mul(7919) % 997)
            .collect();
        let grid = Grid::centred(n, [1.0; 3]).unwrap();
        let values = ValueMap { slope: -0.5, intercept: 3.0 };
        let volume = Volume::new(grid, Voxels::U16(data), values).unwrap();
        let medium = volume.grid().index_bounds();
        for size in [0, 1, 4, 8] {
            let cells = volume.cells_of(size);
            let mut touched_ends = 0;
            for (i, &[lo, hi]) in cells.ranges().iter().enumerate() {
                let b = cells.cell_bounds(i, &medium);
                for s in 0..1000 {
                    let t = Vec3::new((s % 10) as f32, (s / 10 % 10) as f32, (s / 100) as f32) / 9.0;
                    let v = volume.value(b.min + b.size() * t);
                    assert!(lo - 1e-3 <= v && v <= hi + 1e-3, "cell {i} of {size}: {v} outside [{lo}, {hi}]");
                    touched_ends += usize::from(v < lo + 1e-3 || v > hi - 1e-3);
                }
            }
            assert!(size == 0 || touched_ends > 0, "the ranges are not loose");
        }
    }
}
