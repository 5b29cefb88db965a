//! Chi-square tests of whether a sampler follows its claimed density: for directions, distances and discrete choices.

use crate::ROUNDING;
use crate::cast::{cell, single};
use crate::fit::{Fault, Fit, MASS_TOLERANCE};
use crate::sphere_grid::SphereGrid;
use crate::split_mix::SplitMix;
use std::cell::Cell;
use std::f64::consts::TAU;

/// How far the squared length of a sampled direction may be from 1: allows for single precision after a few rotations.
const UNIT_TOLERANCE: f64 = 1e-4;

/// Standard errors by which the fraction of successful samples may miss the density's integral, in addition to
/// [`MASS_TOLERANCE`]. Generous, because failed samples are also a cell of the chi-square test.
const MASS_STANDARD_ERRORS: f64 = 4.0;

/// Fraction of the directions that may fall where the density is zero: rounding to single precision puts a few just
/// past the edge of a lobe with a discontinuous edge.
const EDGE_SHARE: f64 = 3e-6;

/// A chi-square test: how many samples to draw and where to count them.
///
/// ```
/// use tyndall_testing::ChiSquare;
///
/// // Distances to a collision, in mean free paths.
/// let free_flight = |u: f64| -(1.0 - u).ln();
/// let mut random = tyndall_testing::SplitMix::new(1);
/// let distances = (0..100_000).map(|_| free_flight(random.uniform()));
/// ChiSquare::default().against_cdf(distances, |t| 1.0 - (-t).exp(), 100).assert();
///
/// // One of three materials.
/// assert!(!ChiSquare::default().discrete(&[0.2, 0.3, 0.5], &[2000, 3500, 4500]).passes());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// Directions to draw.
    pub samples: usize,
    /// Rows of equal cos theta, about the z axis. Cells with a large share of the density are halved further.
    pub rows: usize,
    /// Columns of equal phi.
    pub columns: usize,
    /// How many tests share one significance; see [`crate::sidak`].
    pub tests: usize,
    /// Seed of the uniform numbers.
    pub seed: u64,
}

impl Default for ChiSquare {
    /// A million samples, which detect a density that is wrong by a few percent in one cell of a thousand.
    fn default() -> Self {
        Self { samples: 1_000_000, rows: 16, columns: 32, tests: 1, seed: 0 }
    }
}

impl ChiSquare {
    /// The default test, as one of `tests` that share one significance.
    #[must_use]
    pub fn among(tests: usize) -> Self {
        Self { tests, ..Self::default() }
    }

    /// Tests a sampler of unit vectors against its density over solid angle, [1/sr].
    ///
    /// `sample` maps `D` uniform numbers to a direction, or to `None` if it fails. The density must integrate to the
    /// fraction of samples that succeed, 1 if it never fails. Samples must not fall where the density is zero. A lobe
    /// narrower than a degree can fall between the quadrature points, and is then reported as missing mass: use
    /// more `rows` and `columns`, or point it along the z axis.
    ///
    /// # Panics
    /// If `rows` or `columns` is zero.
    pub fn directions<const D: usize>(
        &self,
        mut sample: impl FnMut([f32; D]) -> Option<[f32; 3]>,
        pdf: impl Fn([f32; 3]) -> f64,
    ) -> Fit {
        assert!(self.rows > 0 && self.columns > 0, "{} x {} cells", self.rows, self.columns);
        let lowest_density = Cell::new(0.0_f64);
        let pdf = |w: [f32; 3]| {
            let density = pdf(w);
            if density.is_nan() || density < lowest_density.get() {
                lowest_density.set(density);
            }
            density
        };
        let grid = SphereGrid::new(self.rows, self.columns, |cos_theta, phi| pdf(direction(cos_theta, phi)));

        let mut node_counts = vec![0; grid.len()];
        let (mut failed, mut stray, mut impossible) = (0, 0, 0_u64);
        let mut random = SplitMix::new(self.seed);
        for _ in 0..self.samples {
            let Some(w) = sample(random.uniforms()) else {
                failed += 1;
                continue;
            };
            let Some([cos_theta, phi]) = spherical(w) else {
                stray += 1;
                continue;
            };
            impossible += u64::from(pdf(w) == 0.0);
            node_counts[grid.find(cos_theta, phi)] += 1;
        }

        let (nodes, mut shares): (Vec<usize>, Vec<f64>) = grid.leaves().unzip();
        let mut counts: Vec<u64> = nodes.iter().map(|&node| node_counts[node]).collect();
        let mass: f64 = shares.iter().sum();
        if mass < 1.0 - MASS_TOLERANCE {
            shares.push(1.0 - mass);
            counts.push(failed);
        }
        let lowest = lowest_density.get();
        let fault = if lowest.is_nan() || lowest < 0.0 {
            Some(Fault::Density(lowest))
        } else if stray > 0 {
            Some(Fault::Stray(stray))
        } else if impossible as f64 > EDGE_SHARE * self.samples as f64 {
            Some(Fault::Impossible(impossible))
        } else {
            wrong_mass(mass, failed, self.samples)
        };
        Fit::new(&shares, &counts, self.tests).with_fault(fault).placed(|i| match nodes.get(i) {
            Some(&node) => {
                let [cos_theta, phi] = grid.ranges(node);
                format!("cos_theta {cos_theta:.4?}, phi {phi:.4?}")
            }
            None => "failed samples".to_owned(),
        })
    }

    /// Tests numbers against their cumulative distribution function, counted in `bins` of equal probability.
    ///
    /// If some samples give no number, as when light leaves the medium, pass `f64::INFINITY` for those; they are
    /// counted in a bin of their own, of probability `1 - cdf(f64::INFINITY)`.
    ///
    /// # Panics
    /// If `bins` is zero.
    pub fn against_cdf(
        &self,
        samples: impl IntoIterator<Item = f64>,
        cdf: impl Fn(f64) -> f64,
        bins: usize,
    ) -> Fit {
        assert!(bins > 0, "no bins");
        let mass = cdf(f64::INFINITY);
        let mut counts = vec![0; bins];
        let (mut endless, mut stray) = (0, 0);
        for x in samples {
            let below = cdf(x);
            if x == f64::INFINITY {
                endless += 1;
            } else if x.is_nan() || !(-ROUNDING..=mass + ROUNDING).contains(&below) {
                stray += 1;
            } else {
                counts[cell(below / mass, bins)] += 1;
            }
        }
        let mut shares = vec![mass / bins as f64; bins];
        let rest = 1.0 - mass;
        shares.push(if (-ROUNDING..0.0).contains(&rest) { 0.0 } else { rest });
        counts.push(endless);
        let fault = (stray > 0).then_some(Fault::Stray(stray)).or_else(|| impossible(&shares, &counts));
        Fit::new(&shares, &counts, self.tests).with_fault(fault).placed(|i| {
            let share = |i: usize| mass * i as f64 / bins as f64;
            if i < bins {
                format!("cdf {:.4}..{:.4}", share(i), share(i + 1))
            } else {
                "endless samples".to_owned()
            }
        })
    }

    /// Tests how often each of a few choices was made against its probability.
    ///
    /// # Panics
    /// If the numbers of counts and probabilities differ.
    pub fn discrete(&self, probabilities: &[f64], counts: &[u64]) -> Fit {
        let mass: f64 = probabilities.iter().sum();
        Fit::new(probabilities, counts, self.tests)
            .with_fault(wrong_mass(mass, 0, 1).or_else(|| impossible(probabilities, counts)))
            .placed(|i| format!("choice {i}"))
    }
}

/// Compares the integral of a density with the fraction of samples that did not fail.
fn wrong_mass(mass: f64, failed: u64, samples: usize) -> Option<Fault> {
    let expected = 1.0 - failed as f64 / samples as f64;
    let standard_error = (expected * (1.0 - expected) / samples as f64).sqrt();
    let tolerance = MASS_TOLERANCE + MASS_STANDARD_ERRORS * standard_error;
    let right = (mass - expected).abs() <= tolerance;
    (!right).then_some(Fault::Mass { mass, expected, tolerance })
}

/// Reports samples counted in cells of zero probability.
fn impossible(shares: &[f64], counts: &[u64]) -> Option<Fault> {
    let count = shares.iter().zip(counts).filter(|&(&share, _)| share == 0.0).map(|(_, &count)| count).sum();
    (count > 0).then_some(Fault::Impossible(count))
}

/// The unit vector at cos theta and phi.
fn direction(cos_theta: f64, phi: f64) -> [f32; 3] {
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    [sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta].map(single)
}

/// The cos theta and phi, in [0, 2 pi), of a unit vector; `None` if the vector is not of unit length.
///
/// Dividing by the length recovers the digits that z alone loses near the poles.
fn spherical(w: [f32; 3]) -> Option<[f64; 2]> {
    let [x, y, z] = w.map(f64::from);
    let square = x * x + y * y + z * z;
    let unit = (square - 1.0).abs() <= UNIT_TOLERANCE;
    unit.then(|| [(z / square.sqrt()).clamp(-1.0, 1.0), y.atan2(x).rem_euclid(TAU)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_angles_are_inverse() {
        for (cos_theta, phi) in [(0.3, 1.0), (-0.7, 4.0), (1.0, 0.0), (0.0, 6.2), (0.999_999_9, 3.0)] {
            let [c, p] = spherical(direction(cos_theta, phi)).unwrap();
            assert!((c - cos_theta).abs() < 1e-7, "{c} for {cos_theta}");
            assert!(cos_theta == 1.0 || (p - phi).abs() < 1e-6, "{p} for {phi}");
        }
        // Single-precision z alone has steps of 6e-8 here.
        let [c, _] = spherical(direction(1.0 - 1e-9, 0.0)).unwrap();
        assert!((1.0 - c - 1e-9).abs() < 1e-12, "{c}");
        assert_eq!(spherical([0.0, 0.0, -0.5]), None);
    }
}
