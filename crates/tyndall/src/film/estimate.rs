//! What the samples of a pixel add up to: chunks of samples, summed in double precision, that meet in a fixed tree.
//!
//! Chunk `k` holds the samples from `k * CHUNK` on. Chunks 0 to 3 meet in a node, and so on with every four; the nodes of four
//! such nodes again. The order of all additions follows from the numbers of the samples alone, so that parts of a picture that
//! were rendered apart add up to the bits of the whole; and no sum ever grows so large that a further sample is lost in it.

use super::{PixelSample, luminance_of};
use crate::math::cast;

/// Samples that are summed one by one.
pub(super) const CHUNK: u32 = 16;

/// Chunks, or nodes of the tree, that meet in a node.
pub(super) const FAN_OUT: u32 = 4;

/// Samples below a node of a level; chunks are level 0.
pub(super) fn samples_below(level: usize) -> u32 {
    CHUNK * FAN_OUT.pow(cast::fit_u32(level))
}

/// Sums over the samples of a chunk that is not yet complete.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    radiance: [f64; 3],
    squares: [f64; 3],
    /// Squares of the luminance, which those of the channels do not determine.
    luminance_squares: f64,
    alpha: f64,
    depth: f64,
}

impl Sums {
    pub fn add(&mut self, sample: &PixelSample) {
        let radiance = sample.radiance.to_array().map(f64::from);
        for ((sum, squares), x) in self.radiance.iter_mut().zip(&mut self.squares).zip(radiance) {
            *sum += x;
            *squares += x * x;
        }
        self.luminance_squares += luminance_of(radiance).powi(2);
        self.alpha += f64::from(sample.alpha);
        self.depth += f64::from(sample.depth);
    }

    /// The mean radiance of these samples, whose number is `n`: that of [`Self::estimate`].
    #[inline]
    pub fn mean(&self, n: u32) -> [f32; 3] {
        self.radiance.map(|sum| cast::single(sum / f64::from(n)))
    }

    /// The estimate from these samples, whose number is `count`.
    pub fn estimate(&self, count: u32) -> Estimate {
        let n = f64::from(count);
        // What rounding leaves of samples that are all alike may be negative.
        let scatter = |squares: f64, sum: f64| cast::single((squares - sum * sum / n).max(0.0));
        let mean = |sum: f64| cast::single(sum / n);
        Estimate {
            mean: self.mean(count),
            scatter: std::array::from_fn(|c| scatter(self.squares[c], self.radiance[c])),
            luminance_scatter: scatter(self.luminance_squares, luminance_of(self.radiance)),
            alpha: mean(self.alpha),
            depth: mean(self.depth),
        }
    }
}

/// The mean of all samples, of which the second mean stands for a share.
#[inline(always)]
pub(super) fn merged_mean(a: f32, b: f32, share: f64) -> f32 {
    cast::single(f64::from(a) + (f64::from(b) - f64::from(a)) * share)
}

/// Means over samples and the scatter about them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Estimate {
    pub mean: [f32; 3],
    /// Sum of squared deviations from the mean.
    pub scatter: [f32; 3],
    /// The same of the luminance.
    pub luminance_scatter: f32,
    pub alpha: f32,
    /// Mean of distance times alpha.
    pub depth: f32,
}

impl Estimate {
    /// The estimate from the samples of two, in double precision \[Chan83\]; `n` samples here and `m` there.
    pub fn merged(&self, n: u32, other: &Self, m: u32) -> Self {
        let (n, m) = (f64::from(n), f64::from(m));
        let share = m / (n + m);
        let mean = |a: f32, b: f32| merged_mean(a, b, share);
        let scatter = |[a, b]: [f32; 2], apart: f64| {
            cast::single(f64::from(a) + f64::from(b) + apart * apart * n * share)
        };
        let apart: [f64; 3] = std::array::from_fn(|c| f64::from(other.mean[c]) - f64::from(self.mean[c]));
        Self {
            mean: std::array::from_fn(|c| mean(self.mean[c], other.mean[c])),
            scatter: std::array::from_fn(|c| scatter([self.scatter[c], other.scatter[c]], apart[c])),
            luminance_scatter: scatter(
                [self.luminance_scatter, other.luminance_scatter],
                luminance_of(apart),
            ),
            alpha: mean(self.alpha, other.alpha),
            depth: mean(self.depth, other.depth),
        }
    }
}
