//! A grid whose cells are as wide as a gather's radius, so that a gather finds everything in its own cell and the
//! neighbouring ones.

use crate::math::{Bounds, DMat3, DVec3, Mat3, Vec3, cast};
use crate::volume::Grid;

/// Maximum number of cells: for a smaller radius the cells are wider than the radius.
const MOST_CELLS: f32 = (1 << 24) as f32;

/// Margin by which a cell is wider than the radius: more than the rounding error of a position in single precision, so
/// that a position rounded into the neighbouring cell still finds everything within its radius. In a volume many radii
/// wide the error grows with the volume's extent.
const MARGIN: f32 = 1e-4;
const MARGIN_OF_EXTENT: f32 = 1.0 / (1 << 22) as f32;

/// Bits per axis of the spatial history of \[Jonsson12, sec. 4.3.2\].
const AXIS_BITS: f32 = 64.0;

/// Cells over the medium's box in *metric* space: world space relative to the box's middle, in units of the radius,
/// which keeps numbers near 1 whatever the world's unit is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellGrid {
    middle: Vec3,
    linear: Mat3,
    origin: Vec3,
    edge: f32,
    /// As a share of the edge.
    margin: f32,
    per_edge: f32,
    dims: [usize; 3],
    index_reach: Vec3,
    /// From metric vectors to index space.
    to_index: Mat3,
}

impl CellGrid {
    /// Over a volume's box, for a radius in world units and gathers that reach up to `reach` radii along an axis.
    pub fn new(grid: &Grid, radius: f32, reach: f32) -> Self {
        let middle = grid.index_bounds().center();
        let direction = DMat3::from_cols_array_2d(&grid.direction()).transpose();
        let per_radius = DVec3::from_array(grid.spacing()) / f64::from(radius);
        let linear = direction * DMat3::from_diagonal(per_radius);
        let (linear, to_index) = (linear.as_mat3(), linear.inverse().as_mat3());
        let around = Bounds::around(grid.index_bounds().corners().map(|p| linear * (p - middle)));
        let cells = |edge: f32| (around.size() / edge).ceil().max(Vec3::ONE);
        let margin = MARGIN.max(MARGIN_OF_EXTENT * around.size().max_element() / reach);
        let mut edge = reach * (1.0 + margin);
        while cells(edge).element_product() > MOST_CELLS {
            edge *= 1.1;
        }
        let dims = cells(edge).to_array().map(cast::index);
        // The extent of a box along an axis of index space is the sum of the absolute entries of that row of the
        // inverse.
        let rows = to_index.transpose();
        let entries = |row: Vec3| row.abs().element_sum();
        let box_ = Vec3::new(entries(rows.x_axis), entries(rows.y_axis), entries(rows.z_axis));
        let index_reach = box_ * (2.0 * edge * (1.0 + margin)) + MARGIN;
        let per_edge = 1.0 / edge;
        Self { middle, linear, origin: around.min, edge, margin, per_edge, dims, index_reach, to_index }
    }

    /// The matrix from metric vectors to index space.
    #[inline(always)]
    pub fn index_per_metric(&self) -> &Mat3 {
        &self.to_index
    }

    /// How far a cell and its neighbours extend at most from a position in the cell, along each axis of index space.
    pub fn index_reach(&self) -> Vec3 {
        self.index_reach
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// From index space to metric space.
    #[inline(always)]
    pub fn to_metric(self, position: Vec3) -> Vec3 {
        self.linear * (position - self.middle)
    }

    /// The cell of a metric position, clamped to the grid.
    #[inline]
    pub fn cell(&self, p: Vec3) -> [usize; 3] {
        let along = |axis: usize| self.along(p[axis], axis);
        [along(0), along(1), along(2)]
    }

    #[inline(always)]
    fn along(&self, x: f32, axis: usize) -> usize {
        cast::index((x - self.origin[axis]) * self.per_edge).min(self.dims[axis] - 1)
    }

    /// The index of a cell, x fastest.
    #[inline(always)]
    pub fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.dims[0] * (y + self.dims[1] * z)
    }

    /// Indices of a cell and its neighbours.
    pub fn neighbours(&self, [x, y, z]: [usize; 3]) -> impl Iterator<Item = usize> {
        let near = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        let [nx, ny, nz] = self.dims;
        near(z, nz).flat_map(move |z| {
            near(y, ny).flat_map(move |y| near(x, nx).map(move |x| self.number([x, y, z])))
        })
    }

    /// The cells that may contain items within reach of a metric position: first and last along each axis.
    #[inline(always)]
    pub fn around(&self, p: Vec3, reach: Vec3) -> [[usize; 2]; 3] {
        let (lo, hi) = (p - reach, p + reach);
        [
            [self.along(lo.x, 0), self.along(hi.x, 0)],
            [self.along(lo.y, 1), self.along(hi.y, 1)],
            [self.along(lo.z, 2), self.along(hi.z, 2)],
        ]
    }

    /// Along each axis, which of the 64 bits a metric position belongs to.
    pub fn axis_bins(&self, p: Vec3) -> [u32; 3] {
        [0, 1, 2].map(|axis| self.axis_bin(p[axis], axis))
    }

    fn axis_bin(&self, x: f32, axis: usize) -> u32 {
        let share = (x - self.origin[axis]) / (self.edge * self.dims[axis] as f32);
        cast::fit_u32(cast::index(share * AXIS_BITS).min(63))
    }

    /// Along each axis, the bits that overlap the cell of a metric position or its neighbours.
    pub fn axis_reach(&self, p: Vec3) -> [u64; 3] {
        let r = 2.0 * self.edge * (1.0 + self.margin);
        [0, 1, 2].map(|axis| {
            let [first, last] = [p[axis] - r, p[axis] + r].map(|x| self.axis_bin(x, axis));
            u64::MAX << first & u64::MAX >> (63 - last)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Space;
    use tyndall_testing::SplitMix;

    fn skewed() -> Grid {
        let (s, c) = (0.6, 0.8);
        let direction = [[c, -s, 0.1], [s, c, 0.0], [0.0, 0.0, -0.995]];
        Grid::new([30, 20, 25], [0.5, 1.0, 2.0], direction, [1e4, -20.0, 5.0], Space::Plain).unwrap()
    }

    #[test]
    fn what_is_within_the_radius_is_in_the_cells_around_and_among_the_neighbours() {
        let grid = skewed();
        let cells = CellGrid::new(&grid, 1.7, 1.0);
        let mut random = SplitMix::new(5);
        let mut near = 0;
        for _ in 0..20_000 {
            let mut pick = || {
                let u = Vec3::from_array(random.uniforms());
                grid.index_bounds().min + grid.index_bounds().size() * u
            };
            let (a, b) = (pick(), pick());
            let (p, q) = (cells.to_metric(a), cells.to_metric(b));
            let apart = grid.index_to_world(a).distance(grid.index_to_world(b));
            assert!((p.distance(q) * 1.7 - apart).abs() < 1e-2, "{apart}");
            if p.distance(q) > 1.0 {
                continue;
            }
            near += 1;
            let number = cells.number(cells.cell(q));
            assert!(cells.neighbours(cells.cell(p)).any(|i| i == number));
            let around = cells.around(p, Vec3::ONE);
            let at = cells.cell(q);
            assert!((0..3).all(|a| (around[a][0]..=around[a][1]).contains(&at[a])), "{p} {q}");
            let (bins, reach) = (cells.axis_bins(q), cells.axis_reach(p));
            assert!(bins.iter().zip(reach).all(|(bin, reach)| reach >> bin & 1 == 1));
        }
        assert!(near > 20, "{near}");
    }

    #[test]
    fn a_tiny_radius_asks_for_no_more_cells_than_there_may_be() {
        let cells = CellGrid::new(&skewed(), 1e-6, 1.0);
        assert!(cells.len() <= 1 << 24 && cells.len() > 1 << 22, "{}", cells.len());
    }
}
