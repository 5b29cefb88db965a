//! Smallest and largest value per cell: what skipping and majorants stand on.

use super::voxels::with_voxels;
use super::{Grid, ValueMap, Voxel, Voxels};
use crate::math::{Bounds, Vec3, cast};
use rayon::prelude::*;

/// A coarse grid over the medium's box: each cell knows the range of the interpolated field inside it.
///
/// Cell `i` covers `[cell * i - 1/2, cell * (i + 1) - 1/2]` in index space; trilinear reading there
/// touches the voxels from one before to one after, which its range includes.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    cell: usize,
    dims: [usize; 3],
    ranges: Vec<[f32; 2]>,
}

impl Bricks {
    /// Voxels along a cell's edge unless told otherwise: the best or second best of 4, 8 and 16
    /// for CT and clouds alike.
    pub const CELL: usize = 8;

    /// `cell` voxels along each edge; `0` is one cell around everything.
    pub(super) fn new(grid: &Grid, voxels: &Voxels, values: ValueMap, cell: usize) -> Self {
        let n = grid.dims();
        let cell = if cell == 0 { n.into_iter().max().unwrap_or(1) } else { cell };
        let dims = n.map(|n| n.div_ceil(cell));
        let ranges = with_voxels!(voxels, data => ranges(data, n, cell, dims, values));
        Self { cell, dims, ranges }
    }

    /// Voxels along a cell's edge.
    #[must_use]
    pub fn cell(&self) -> usize {
        self.cell
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

    /// The number of the cell at an index-space place, clamped to the grid.
    #[must_use]
    pub fn cell_at(&self, p: Vec3) -> usize {
        let place = (p + 0.5) / self.cell as f32;
        let [nx, ny, nz] = self.dims;
        let pick = |x: f32, n: usize| cast::index(x).min(n - 1);
        pick(place.x, nx) + nx * (pick(place.y, ny) + ny * pick(place.z, nz))
    }

    /// The part of index space that a cell covers, cut to the medium's box.
    #[must_use]
    pub fn cell_bounds(&self, cell: usize, medium: &Bounds) -> Bounds {
        let [nx, ny, _] = self.dims;
        let place = [cell % nx, cell / nx % ny, cell / (nx * ny)].map(|i| (i * self.cell) as f32 - 0.5);
        let min = Vec3::from_array(place);
        Bounds::new(min, (min + Vec3::splat(self.cell as f32)).min(medium.max))
    }
}

fn ranges<T: Voxel>(
    data: &[T],
    n: [usize; 3],
    cell: usize,
    dims: [usize; 3],
    values: ValueMap,
) -> Vec<[f32; 2]> {
    // Separable: first along x within each row, so that the wide loops run over contiguous memory.
    let [cx, cy, cz] = dims;
    let touched = |i: usize, n: usize| (i * cell).saturating_sub(1)..(i * cell + cell + 1).min(n);
    let layer = |k: usize| -> Vec<[f32; 2]> {
        let mut out = vec![[f32::INFINITY, f32::NEG_INFINITY]; cx * cy];
        for z in touched(k, n[2]) {
            for (j, out) in out.chunks_mut(cx).enumerate() {
                for y in touched(j, n[1]) {
                    let row = &data[n[0] * (y + n[1] * z)..][..n[0]];
                    for (i, range) in out.iter_mut().enumerate() {
                        for v in &row[touched(i, n[0])] {
                            let v = v.to_f32();
                            *range = [range[0].min(v), range[1].max(v)];
                        }
                    }
                }
            }
        }
        out
    };
    let to_value = |stored: f32| cast::single(values.apply(f64::from(stored)));
    let ordered = |[a, b]: [f32; 2]| [a.min(b), a.max(b)];
    (0..cz).into_par_iter().flat_map_iter(layer).map(|r| ordered(r.map(to_value))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Volume;

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
            let bricks = volume.bricks_of(size);
            let mut touched_ends = 0;
            for (i, &[lo, hi]) in bricks.ranges().iter().enumerate() {
                let b = bricks.cell_bounds(i, &medium);
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
