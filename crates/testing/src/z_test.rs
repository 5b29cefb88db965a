//! Whether an estimate agrees with its expected value.

use crate::ROUNDING;
use crate::significance::{sidak, two_sided};
use std::fmt;

/// Running mean and variance of a sequence of numbers \[Welford62\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    count: u64,
    mean: f64,
    /// Sum of the squared distances from the mean.
    scatter: f64,
}

impl Mean {
    /// Adds a number.
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let distance = x - self.mean;
        self.mean += distance / self.count as f64;
        self.scatter += distance * (x - self.mean);
    }

    /// Adds all numbers that were added to `other` \[Chan83\].
    pub fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count == 0 {
            return;
        }
        let (own, others) = (self.count as f64, other.count as f64);
        let distance = other.mean - self.mean;
        self.mean += distance * others / (own + others);
        self.scatter += other.scatter + distance * distance * own * others / (own + others);
        self.count = count;
    }

    /// How many numbers were added.
    #[must_use]
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; 0 before the first.
    #[must_use]
    pub const fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased estimate of the variance of one number; NaN before the second.
    #[must_use]
    pub fn variance(&self) -> f64 {
        if self.count < 2 { f64::NAN } else { self.scatter / (self.count - 1) as f64 }
    }

    /// Estimate of the variance of the mean; NaN before the second number.
    #[must_use]
    pub fn variance_of_mean(&self) -> f64 {
        self.variance() / self.count as f64
    }

    /// This mean, to be tested against its expected value.
    #[must_use]
    pub fn against(&self, expected: f64) -> ZTest {
        ZTest::new(self.mean, self.variance_of_mean(), expected)
    }
}

impl Extend<f64> for Mean {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, numbers: T) {
        numbers.into_iter().for_each(|x| self.push(x));
    }
}

impl FromIterator<f64> for Mean {
    fn from_iter<T: IntoIterator<Item = f64>>(numbers: T) -> Self {
        let mut mean = Self::default();
        mean.extend(numbers);
        mean
    }
}

/// An estimate to be tested against its expected value.
///
/// The estimate must be the mean of enough numbers to be normally distributed: a hundred for well-behaved ones,
/// many more where rare large ones dominate the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// The estimate.
    pub mean: f64,
    /// Standard deviation of the estimate.
    pub standard_error: f64,
    /// Its expected value.
    pub expected: f64,
    /// How many tests share one significance; see [`sidak`].
    pub tests: usize,
}

impl ZTest {
    /// From an estimate and the variance of this estimate (not of one sample).
    #[must_use]
    pub fn new(mean: f64, variance_of_mean: f64, expected: f64) -> Self {
        Self { mean, standard_error: variance_of_mean.sqrt(), expected, tests: 1 }
    }

    /// The same test, as one of `tests` that share one significance.
    #[must_use]
    pub const fn among(self, tests: usize) -> Self {
        Self { tests, ..self }
    }

    /// Signed difference from the expected value in standard errors, which include [`ROUNDING`].
    #[must_use]
    pub fn z(&self) -> f64 {
        let distance = self.mean - self.expected;
        if !self.standard_error.is_finite() {
            // Anything would agree with an estimate of infinite error.
            return f64::NAN;
        }
        if distance == 0.0 {
            // Avoids 0 / 0 where the error is zero too.
            return 0.0;
        }
        distance / self.standard_error.hypot(ROUNDING * self.expected)
    }

    /// Probability of an estimate at least this far off, if the code is right.
    #[must_use]
    pub fn p_value(&self) -> f64 {
        two_sided(self.z())
    }

    /// Whether the estimate is no farther off than chance explains. False if any number is not finite.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.p_value() >= sidak(self.tests)
    }

    /// Whether the estimate is precise (its standard error is at most `relative` times the expected value) and
    /// accurate (it is at most `standard_errors` away). If 0 is expected, the standard error must be exactly 0.
    #[must_use]
    pub fn is_within(&self, standard_errors: f64, relative: f64) -> bool {
        self.is_sharp(relative) && self.z().abs() <= standard_errors
    }

    /// Panics unless the test [`passes`](Self::passes).
    ///
    /// # Panics
    /// If the test fails.
    #[track_caller]
    pub fn assert(&self) {
        assert!(
            self.passes(),
            "{self}; p = {:.3e}, rejected below {:.3e}",
            self.p_value(),
            sidak(self.tests)
        );
    }

    /// Panics unless the estimate [`is_within`](Self::is_within).
    ///
    /// # Panics
    /// If it is not.
    #[track_caller]
    pub fn assert_within(&self, standard_errors: f64, relative: f64) {
        assert!(
            self.is_sharp(relative),
            "{self}; too noisy to tell: the standard error may be at most {relative:e} of the expected value"
        );
        assert!(self.is_within(standard_errors, relative), "{self}; allowed {standard_errors}");
    }

    fn is_sharp(&self, relative: f64) -> bool {
        self.standard_error <= relative * self.expected.abs()
    }
}

impl fmt::Display for ZTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Two digits of the error, and as many decimal places of the other numbers.
        let places = match self.standard_error.log10().floor() {
            magnitude if magnitude.is_finite() => {
                (0..=17).find(|&p| f64::from(p) >= 1.0 - magnitude).unwrap_or(17)
            }
            _ => 9,
        };
        let places = usize::try_from(places).unwrap_or(0);
        let Self { mean, standard_error, expected, .. } = self;
        write!(f, "mean {mean:.places$} +- {standard_error:.places$}, expected {expected:.places$}")?;
        write!(f, ", z = {:.2}", self.z())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ChiSquare, SplitMix};

    #[test]
    fn mean_and_variance_of_known_numbers() {
        let mean: Mean = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0].into_iter().collect();
        assert_eq!((mean.count(), mean.mean()), (8, 5.0));
        assert!((mean.variance() - 32.0 / 7.0).abs() < 1e-14, "{}", mean.variance());
        assert!((mean.variance_of_mean() - 4.0 / 7.0).abs() < 1e-15, "{}", mean.variance_of_mean());
    }

    #[test]
    fn a_large_offset_costs_no_digits() {
        let mean: Mean = (0..1000).map(|i| 1e9 + f64::from(i % 2)).collect();
        assert!((mean.variance() - 250.0 / 999.0).abs() < 1e-9, "{}", mean.variance());
    }

    #[test]
    fn merging_equals_pushing() {
        let mut random = SplitMix::new(3);
        let numbers: Vec<f64> = (0..1000).map(|_| random.uniform().powi(3)).collect();
        let whole: Mean = numbers.iter().copied().collect();
        let mut merged = Mean::default();
        for part in [&numbers[..0], &numbers[..10], &numbers[10..700], &numbers[700..]] {
            merged.merge(&part.iter().copied().collect());
        }
        assert_eq!(merged.count(), whole.count());
        assert!((merged.mean() - whole.mean()).abs() < 1e-14, "{merged:?} {whole:?}");
        assert!((merged.variance() - whole.variance()).abs() < 1e-14, "{merged:?} {whole:?}");
    }

    #[test]
    fn p_values_of_correct_repetitions_are_uniform() {
        let mut random = SplitMix::new(11);
        let mut p_value = |_| {
            let mean: Mean = (0..500).map(|_| random.uniform()).collect();
            mean.against(0.5).p_value()
        };
        let p_values: Vec<f64> = (0..10_000).map(&mut p_value).collect();
        ChiSquare::default().against_cdf(p_values.iter().copied(), |p| p.clamp(0.0, 1.0), 20).assert();
        let rejected = p_values.iter().filter(|&&p| p < 0.01).count();
        // 100 on average, with a standard deviation of 10.
        assert!((70..=130).contains(&rejected), "{rejected} of 10000");
    }

    #[test]
    fn a_bias_of_five_standard_errors_is_rejected() {
        ZTest::new(1.02, 1e-4, 1.0).assert();
        assert!(!ZTest::new(1.05, 1e-4, 1.0).passes());
        assert!(!ZTest::new(0.95, 1e-4, 1.0).passes());
        // Three standard errors are too many for one test, and unremarkable among a thousand.
        let off = ZTest::new(1.03, 1e-4, 1.0);
        assert!(!off.passes() && off.among(1000).passes());
    }

    #[test]
    fn what_is_not_a_number_never_passes() {
        let one: Mean = [1.0].into_iter().collect();
        for test in [
            one.against(1.0),
            ZTest::new(f64::NAN, 1.0, 1.0),
            ZTest::new(1.0, -1.0, 1.0),
            ZTest::new(f64::INFINITY, 1.0, 1.0),
            ZTest::new(1.0, f64::INFINITY, 1.0),
            [1.0, f64::INFINITY].into_iter().collect::<Mean>().against(1.0),
        ] {
            assert!(!test.passes() && !test.is_within(3.0, 1.0), "{test:?}");
        }
    }

    #[test]
    fn without_noise_only_rounding_is_allowed() {
        assert!(ZTest::new(0.5 + 1e-8, 0.0, 0.5).is_within(3.0, 1e-3));
        assert!(!ZTest::new(0.5 + 1e-5, 0.0, 0.5).is_within(3.0, 1e-3));
        assert!(ZTest::new(0.0, 0.0, 0.0).is_within(3.0, 1e-3));
        assert!(!ZTest::new(1e-30, 0.0, 0.0).is_within(3.0, 1e-3));
    }

    #[test]
    fn acceptance_needs_both_precision_and_accuracy() {
        ZTest::new(1.0025, 1e-6, 1.0).assert_within(3.0, 1e-3);
        assert!(!ZTest::new(1.0035, 1e-6, 1.0).is_within(3.0, 1e-3), "off by 3.5 standard errors");
        assert!(!ZTest::new(1.0, 1.1e-6, 1.0).is_within(3.0, 1e-3), "precise to 1.05e-3 only");
    }

    #[test]
    fn the_message_shows_the_digits_that_matter() {
        let test = ZTest::new(0.341_234, 9e-8, 0.341_333);
        assert_eq!(test.to_string(), "mean 0.34123 +- 0.00030, expected 0.34133, z = -0.33");
    }

    #[test]
    #[should_panic(expected = "too noisy to tell")]
    fn noise_is_not_agreement() {
        ZTest::new(1.0, 1.0, 1.0).assert_within(3.0, 1e-3);
    }
}
