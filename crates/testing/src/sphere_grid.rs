//! The sphere divided into cells of (cos theta, phi), each with its share of a density.

use crate::cast::cell;
use crate::quadrature::{Tolerance, integrate_2d_to};
use std::f64::consts::TAU;
use std::ops::Range;

/// Cells with more than this many times the mean share are halved. A peaked lobe would otherwise fall in a handful
/// of cells, and its shape inside them would go untested.
const HEAVY: f64 = 2.0;

/// How many times a cell is halved at most; stops the halving where all the mass is at one point.
const MOST_HALVINGS: usize = 24;

/// Target error of a cell's share. With a million samples it would move the statistic by 0.1, while the statistic
/// itself varies by 25 and more.
const RELATIVE_ERROR: f64 = 3e-4;

/// Pieces of a cell's range. The last digits of a density in single precision are noise, which more pieces do not
/// smooth; what varies in a cell after its halvings needs few.
const MOST_PIECES: usize = 8;

/// Cells of equal solid angle, the heavy ones halved repeatedly.
pub struct SphereGrid {
    rows: usize,
    columns: usize,
    nodes: Vec<Node>,
}

/// A cell, and where its halves are if it has been halved.
struct Node {
    cell: Cell,
    share: f64,
    halves: Option<Halves>,
}

/// Where a cell was halved; its two halves are consecutive nodes.
#[derive(Clone, Copy)]
struct Halves {
    axis: usize,
    middle: f64,
    first: usize,
}

/// A rectangle in (cos theta, phi).
#[derive(Clone, Copy)]
struct Cell {
    low: [f64; 2],
    high: [f64; 2],
}

impl Cell {
    fn halves(self, axis: usize) -> (f64, [Self; 2]) {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let mut halves = [self; 2];
        halves[0].high[axis] = middle;
        halves[1].low[axis] = middle;
        (middle, halves)
    }
}

impl SphereGrid {
    /// Integrates a density over solid angle, as a function of (cos theta, phi), over each cell.
    pub fn new(rows: usize, columns: usize, density: impl Fn(f64, f64) -> f64) -> Self {
        let mean_share = 1.0 / (rows * columns) as f64;
        let tolerance = Tolerance {
            absolute: RELATIVE_ERROR * mean_share,
            relative: RELATIVE_ERROR,
            most_pieces: MOST_PIECES,
        };
        let share = |cell: Cell| {
            let [cos_theta, phi] = [0, 1].map(|axis| [cell.low[axis], cell.high[axis]]);
            integrate_2d_to(tolerance, &density, cos_theta, phi).value
        };
        let mut grid = Self { rows, columns, nodes: Vec::with_capacity(2 * rows * columns) };
        for row in 0..rows {
            for column in 0..columns {
                let edges = |row: usize, column: usize| {
                    [2.0 * row as f64 / rows as f64 - 1.0, TAU * column as f64 / columns as f64]
                };
                let cell = Cell { low: edges(row, column), high: edges(row + 1, column + 1) };
                grid.nodes.push(Node { cell, share: share(cell), halves: None });
            }
        }
        for node in 0..rows * columns {
            grid.halve_heavy(node, HEAVY * mean_share, MOST_HALVINGS, &share);
        }
        grid
    }

    /// Halves a cell along the axis that divides its share less evenly, until no part is heavy.
    fn halve_heavy(&mut self, node: usize, heavy: f64, halvings: usize, share: &impl Fn(Cell) -> f64) {
        let Node { cell, share: whole, .. } = self.nodes[node];
        // A share that is not a number is not heavy either.
        if whole.is_nan() || whole <= heavy || halvings == 0 {
            return;
        }
        let [cut_cos_theta, cut_phi] = [0, 1].map(|axis| {
            let (middle, halves) = cell.halves(axis);
            (axis, middle, halves.map(|half| Node { cell: half, share: share(half), halves: None }))
        });
        let contrast = |halves: &[Node; 2]| (halves[0].share - halves[1].share).abs();
        let (axis, middle, halves) =
            if contrast(&cut_phi.2) > contrast(&cut_cos_theta.2) { cut_phi } else { cut_cos_theta };
        let first = self.nodes.len();
        self.nodes[node].halves = Some(Halves { axis, middle, first });
        self.nodes.extend(halves);
        self.halve_heavy(first, heavy, halvings - 1, share);
        self.halve_heavy(first + 1, heavy, halvings - 1, share);
    }

    /// Number of cells, including those that were halved.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The cell that contains a direction, given by cos theta in [-1, 1] and phi in [0, 2 pi].
    pub fn find(&self, cos_theta: f64, phi: f64) -> usize {
        let row = cell(0.5 * (cos_theta + 1.0), self.rows);
        let mut node = row * self.columns + cell(phi / TAU, self.columns);
        while let Some(Halves { axis, middle, first }) = self.nodes[node].halves {
            node = if [cos_theta, phi][axis] < middle { first } else { first + 1 };
        }
        node
    }

    /// The cells that were not halved, each with its share of the density.
    pub fn leaves(&self) -> impl Iterator<Item = (usize, f64)> {
        let leaves = self.nodes.iter().enumerate().filter(|(_, node)| node.halves.is_none());
        leaves.map(|(index, node)| (index, node.share))
    }

    /// The ranges of cos theta and of phi in a cell.
    pub fn ranges(&self, node: usize) -> [Range<f64>; 2] {
        let Cell { low, high } = self.nodes[node].cell;
        [0, 1].map(|axis| low[axis]..high[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Henyey-Greenstein about the pole, per solid angle.
    fn henyey_greenstein(g: f64, cos_theta: f64) -> f64 {
        0.25 / PI * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5)
    }

    #[test]
    fn shares_of_a_peaked_lobe_equal_its_cumulative_distribution() {
        let g = 0.95;
        let grid = SphereGrid::new(16, 32, |cos_theta, _| henyey_greenstein(g, cos_theta));
        let cumulative =
            |c: f64| (1.0 - g * g) / (2.0 * g) * ((1.0 + g * g - 2.0 * g * c).powf(-0.5) - 1.0 / (1.0 + g));
        let mut total = 0.0;
        for (node, share) in grid.leaves() {
            let [cos_theta, phi] = grid.ranges(node);
            let exact =
                (cumulative(cos_theta.end) - cumulative(cos_theta.start)) * (phi.end - phi.start) / TAU;
            assert!((share - exact).abs() < 1e-4 * exact, "{cos_theta:?} {phi:?}: {share} for {exact}");
            assert!(share < 2.0 / 512.0 * 1.001, "{cos_theta:?} {phi:?} is still heavy: {share}");
            total += share;
        }
        assert!((total - 1.0).abs() < 1e-4, "{total}");
        assert!(grid.len() < 2000, "{} cells", grid.len());
    }

    #[test]
    fn a_direction_is_found_in_the_cell_around_it() {
        let grid =
            SphereGrid::new(4, 8, |cos_theta, phi| henyey_greenstein(0.9, cos_theta) * (1.0 + phi.sin()));
        assert!(grid.len() > 32, "nothing was halved");
        for i in 0..1000 {
            let (cos_theta, phi) = (f64::from(i) / 500.0 - 1.0, TAU * f64::from(i * 7919 % 1000) / 1000.0);
            let node = grid.find(cos_theta, phi);
            let [cos_range, phi_range] = grid.ranges(node);
            assert!(cos_range.contains(&cos_theta) && phi_range.contains(&phi), "{cos_theta} {phi}");
            assert!(grid.leaves().any(|(leaf, _)| leaf == node));
        }
        for (cos_theta, phi) in [(1.0, TAU), (-1.0, 0.0)] {
            assert!(grid.leaves().any(|(leaf, _)| leaf == grid.find(cos_theta, phi)));
        }
    }
}
