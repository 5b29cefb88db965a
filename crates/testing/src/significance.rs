//! How improbable a result must be to be rejected.

use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// Probability with which a whole test rejects correct code.
///
/// Seeds are fixed, so this chance is taken once, when a test is written, and not on each run; one in a hundred keeps
/// the tests sensitive and false alarms rare.
pub const SIGNIFICANCE: f64 = 0.01;

/// Significance of each of `tests` independent tests such that all together have [`SIGNIFICANCE`] \[Sidak67\].
///
/// # Panics
/// If `tests` is zero.
#[must_use]
pub fn sidak(tests: usize) -> f64 {
    assert!(tests > 0, "a family of tests cannot be empty");
    // 1 - (1 - s)^(1/n), which loses all digits when written so and n is the number of pixels.
    -((-SIGNIFICANCE).ln_1p() / tests as f64).exp_m1()
}

/// Probability that a standard normal number is at least `z` away from 0 on either side.
pub(crate) fn two_sided(z: f64) -> f64 {
    erfc(z.abs() / SQRT_2)
}

/// The distance from 0 that a standard normal number exceeds, on either side, with this probability.
pub(crate) fn two_sided_threshold(probability: f64) -> f64 {
    SQRT_2 * erfc_inv(probability)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_keeps_the_significance() {
        assert!((sidak(1) - SIGNIFICANCE).abs() < 1e-15);
        for tests in [2, 30, 3_000_000] {
            let family = 1.0 - (1.0 - sidak(tests)).powf(tests as f64);
            assert!((family - SIGNIFICANCE).abs() < 1e-6, "{tests} tests: {family}");
        }
    }

    #[test]
    fn known_quantiles_of_the_normal_distribution() {
        assert!((two_sided(1.959_963_985) - 0.05).abs() < 1e-9);
        assert!((two_sided(-3.0) - 0.002_699_796).abs() < 1e-9);
        // Far in the tail, where the correction for a million pixels puts the threshold.
        assert!((two_sided_threshold(two_sided(6.5)) - 6.5).abs() < 1e-6);
    }
}
