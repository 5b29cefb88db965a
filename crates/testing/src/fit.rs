//! How well counts fit their expected shares: Pearson's chi-square test.

use crate::significance::sidak;
use statrs::function::gamma::gamma_ur;
use std::fmt;
use thiserror::Error;

/// Cells with fewer expected samples are pooled: below about five, counts are too far from normally distributed for
/// the statistic to follow the chi-square distribution \[Cochran54\].
const LEAST_EXPECTED: f64 = 5.0;

/// How far the sum of shares may be off: allows for quadrature and single precision, but not for a missing factor.
pub(crate) const MASS_TOLERANCE: f64 = 1e-3;

/// An error that is evident without statistics.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Fault {
    /// The density does not integrate to the fraction of samples that succeed, or the shares do not sum to 1.
    #[error("total mass {mass:.6}, expected {expected:.6} within {tolerance:.1e}")]
    Mass {
        /// What the density integrates to, or the shares sum to.
        mass: f64,
        /// What it should be.
        expected: f64,
        /// How far off it may be.
        tolerance: f64,
    },
    /// A density or share is negative or not a number.
    #[error("a density or share of {0}, expected a number of at least 0")]
    Density(f64),
    /// Samples fell where the density is zero, or made a choice of zero probability.
    #[error("{0} samples fell where the density is zero")]
    Impossible(u64),
    /// Samples are not unit vectors, not numbers, or outside the range of the distribution.
    #[error("{0} samples are not unit vectors, or not within the range of the distribution")]
    Stray(u64),
    /// Fewer than two cells have enough expected samples, so every sampler would pass.
    #[error("nothing to compare: fewer than two cells expect {LEAST_EXPECTED} samples")]
    OneCell,
}

/// The cell that contributes most to the statistic.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WorstCell {
    pub index: usize,
    /// Its position, as text.
    pub place: String,
    pub expected: f64,
    pub count: u64,
}

/// The result of comparing counts with expected counts.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "a verdict says nothing until `assert` or `passes` is called"]
pub struct Fit {
    /// Pearson's statistic: the sum of `(count - expected)^2 / expected` over the pooled cells.
    pub statistic: f64,
    /// Number of pooled cells minus one.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least this large, if the code is right.
    pub p_value: f64,
    /// The p-value below which the fit is rejected.
    pub significance: f64,
    /// An error that is evident without statistics.
    pub fault: Option<Fault>,
    pub(crate) worst: Option<WorstCell>,
}

impl Fit {
    /// Compares counts with shares of their total; the shares are first scaled to sum to 1.
    ///
    /// # Panics
    /// If the numbers of counts and shares differ.
    pub(crate) fn new(shares: &[f64], counts: &[u64], tests: usize) -> Self {
        assert_eq!(shares.len(), counts.len(), "as many counts as shares");
        let mass: f64 = shares.iter().sum();
        let total = counts.iter().sum::<u64>() as f64;
        let expected: Vec<f64> = shares.iter().map(|share| share / mass * total).collect();
        let excess = |i: usize| (counts[i] as f64 - expected[i]).powi(2) / expected[i].max(LEAST_EXPECTED);
        let worst = (0..counts.len()).max_by(|&a, &b| excess(a).total_cmp(&excess(b)));
        let worst = worst.map(|i| WorstCell {
            index: i,
            place: format!("cell {i}"),
            expected: expected[i],
            count: counts[i],
        });

        let pools = pool(&expected, counts);
        let statistic = pools.iter().map(|&(expected, count)| (count - expected).powi(2) / expected).sum();
        let degrees_of_freedom = pools.len().saturating_sub(1);
        let fault = match shares.iter().find(|&&share| share.is_nan() || share < 0.0) {
            Some(&share) => Some(Fault::Density(share)),
            None if degrees_of_freedom == 0 => Some(Fault::OneCell),
            None => None,
        };
        let p_value = if fault.is_some() { 0.0 } else { tail(degrees_of_freedom, statistic) };
        Self { statistic, degrees_of_freedom, p_value, significance: sidak(tests), fault, worst }
    }

    /// Describes where the worst cell is.
    pub(crate) fn placed(mut self, place: impl Fn(usize) -> String) -> Self {
        if let Some(worst) = &mut self.worst {
            worst.place = place(worst.index);
        }
        self
    }

    /// Gives `fault` precedence over any fault found so far, which it may have caused.
    pub(crate) fn with_fault(mut self, fault: Option<Fault>) -> Self {
        self.fault = fault.or(self.fault);
        if self.fault.is_some() {
            self.p_value = 0.0;
        }
        self
    }

    /// Whether chance explains the counts.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.fault.is_none() && self.p_value >= self.significance
    }

    /// Panics unless the fit [`passes`](Self::passes).
    ///
    /// # Panics
    /// If the fit fails.
    #[track_caller]
    pub fn assert(&self) {
        assert!(self.passes(), "{self}");
    }
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(fault) = self.fault {
            write!(f, "{fault}; ")?;
        }
        let Self { statistic, degrees_of_freedom, p_value, significance, .. } = self;
        write!(f, "chi-square {statistic:.1} at {degrees_of_freedom} degrees of freedom, ")?;
        write!(f, "p = {p_value:.3e}, rejected below {significance:.3e}")?;
        if let Some(WorstCell { place, expected, count, .. }) = &self.worst {
            write!(f, "; worst: {place} expected {expected:.1} samples, got {count}")?;
        }
        Ok(())
    }
}

/// Cells of (expected, counted), smallest first, merged until each expects at least [`LEAST_EXPECTED`].
fn pool(expected: &[f64], counts: &[u64]) -> Vec<(f64, f64)> {
    let mut cells: Vec<(f64, f64)> = expected.iter().zip(counts).map(|(&e, &c)| (e, c as f64)).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pools: Vec<(f64, f64)> = Vec::with_capacity(cells.len());
    for cell in cells {
        match pools.last_mut() {
            Some(last) if last.0 < LEAST_EXPECTED => *last = (last.0 + cell.0, last.1 + cell.1),
            _ => pools.push(cell),
        }
    }
    // Only the last pool can still be too small, and then it is the only one: cells come in increasing order.
    pools.retain(|pool| pool.0 >= LEAST_EXPECTED);
    pools
}

/// Probability that a chi-square distributed number is at least `statistic`.
fn tail(degrees_of_freedom: usize, statistic: f64) -> f64 {
    match statistic {
        // Counts that equal their expectation exactly; the incomplete gamma function is not defined there.
        0.0 => 1.0,
        _ if statistic.is_finite() => gamma_ur(0.5 * degrees_of_freedom as f64, 0.5 * statistic),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_worked_by_hand() {
        // 44 and 56 where 50 and 50 were expected: 2 * 36 / 50.
        let fit = Fit::new(&[0.5, 0.5], &[44, 56], 1);
        assert!((fit.statistic - 1.44).abs() < 1e-12 && fit.degrees_of_freedom == 1, "{fit}");
        assert!((fit.p_value - 0.230_139_340).abs() < 1e-8, "{fit}");
        // The 99 % quantile at 10 degrees of freedom, and at 1000.
        assert!((tail(10, 23.209_251_16) - 0.01).abs() < 1e-9, "{}", tail(10, 23.209_251_16));
        assert!((tail(1000, 1_106.968_996) - 0.01).abs() < 1e-6, "{}", tail(1000, 1_106.968_996));
        assert_eq!((tail(500, 1e9), tail(1, 0.0)), (0.0, 1.0));
        assert!(tail(1, 1e-300) > 1.0 - 1e-9 && tail(1000, 1e-300) > 1.0 - 1e-9);
        assert!(Fit::new(&[0.5, 0.5], &[50, 50], 1).passes());
    }

    #[test]
    fn rare_cells_are_pooled_until_large_enough() {
        let pools = pool(&[3.0, 100.0, 0.0, 1.0, 3.0, 50.0], &[2, 90, 0, 4, 1, 60]);
        assert_eq!(pools, [(7.0, 7.0), (50.0, 60.0), (100.0, 90.0)]);
        assert!(pool(&[1.0, 2.0], &[1, 2]).is_empty());
    }

    #[test]
    fn errors_evident_without_statistics_are_faults() {
        let fault = |shares: &[f64], counts: &[u64]| Fit::new(shares, counts, 1).fault;
        assert_eq!(fault(&[1.5, -0.5], &[1000, 0]), Some(Fault::Density(-0.5)));
        assert_eq!(fault(&[1.0], &[1000]), Some(Fault::OneCell));
        assert_eq!(fault(&[0.5, 0.5], &[3, 3]), Some(Fault::OneCell));
        assert!(matches!(fault(&[0.5, f64::NAN], &[500, 500]), Some(Fault::Density(_))));
        assert!(!Fit::new(&[f64::NAN, 0.5], &[500, 500], 1).passes());
        assert!(!Fit::new(&[], &[], 1).passes() && !Fit::new(&[0.5, 0.5], &[0, 0], 1).passes());
    }
}
