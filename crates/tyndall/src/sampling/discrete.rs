//! Choosing one of several by weight.

/// A discrete distribution, sampled by inversion so that strata stay together.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    /// Running sums of the weights; the last is their total.
    cumulative: Vec<f64>,
}

/// The outcome of a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Index of the chosen one.
    pub index: usize,
    /// Its probability.
    pub probability: f32,
    /// A fresh uniform number in [0, 1), left over from the choice.
    pub leftover: f32,
}

impl Discrete {
    /// From weights that are finite and not negative; `None` if there is no positive one.
    #[must_use]
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let cumulative: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                total += w;
                total
            })
            .collect();
        (total > 0.0 && total.is_finite()).then_some(Self { cumulative })
    }

    /// Sum of the weights.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.cumulative[self.cumulative.len() - 1]
    }

    /// Chooses by a uniform number in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f32) -> Choice {
        let wanted = f64::from(u) * self.total();
        let last = self.cumulative.partition_point(|&c| c < self.total());
        let index = self.cumulative.partition_point(|&c| c <= wanted).min(last);
        let (below, weight) = self.slice(index);
        let left = ((wanted - below) / weight).clamp(0.0, 1.0 - f64::EPSILON);
        Choice {
            index,
            probability: self.share(weight),
            leftover: crate::math::cast::single(left).min(1.0_f32.next_down()),
        }
    }

    /// Probability of an index.
    #[inline]
    #[must_use]
    pub fn probability(&self, index: usize) -> f32 {
        self.share(self.slice(index).1)
    }

    #[inline]
    fn slice(&self, index: usize) -> (f64, f64) {
        let below = if index > 0 { self.cumulative[index - 1] } else { 0.0 };
        (below, self.cumulative[index] - below)
    }

    #[inline]
    fn share(&self, weight: f64) -> f32 {
        crate::math::cast::single(weight / self.total())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_follow_weights_and_zero_is_never_chosen() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 4.0, 0.0]).unwrap();
        let mut counts = [0; 6];
        for i in 0..8000 {
            let Choice { index: k, probability: p, leftover: left } = d.sample((i as f32 + 0.5) / 8000.0);
            assert!((0.0..1.0).contains(&left));
            assert_eq!(p, d.probability(k));
            counts[k] += 1;
        }
        assert_eq!(counts, [0, 1000, 0, 3000, 4000, 0]);
        assert_eq!(d.sample(1.0_f32.next_down()).index, 4);
        assert!(Discrete::new([0.0, 0.0]).is_none() && Discrete::new([]).is_none());
    }
}
