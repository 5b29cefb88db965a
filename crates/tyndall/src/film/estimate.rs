//! Estimates from the samples of a pixel: chunks of samples, summed in double precision, are merged in a fixed tree.
//!
//! Chunk `k` holds the samples from number `k * CHUNK` on. Every four consecutive chunks are merged into a node, every four
//! consecutive nodes into a node of the next level, and so on. The order of all additions follows from the sample numbers alone,
//! so that parts of a picture that were rendered separately merge to the bits of the whole; and no sum grows so large that
//! further samples are lost in rounding.

use super::{PixelSample, luminance_of};
use crate::math::cast;
use bytemuck::{Pod, Zeroable};

/// Number of quantities that are estimated for each pixel; [`Sums`] and [`Estimate`] have them in the same order.
pub(super) const QUANTITIES: usize = 9;

/// Position of the luminance's squares, or deviations, among the quantities.
pub(super) const LUMINANCE_SPREAD: usize = 6;

/// Position of alpha among the quantities.
pub(super) const ALPHA: usize = 7;

/// Samples in a chunk.
pub(super) const CHUNK: u32 = 16;

/// Children of a node: chunks, or nodes of the level below.
pub(super) const FAN_OUT: u32 = 4;

/// Number of samples in a child of a node of this level; the children of level 0 are chunks.
pub(super) fn samples_per_child(level: usize) -> u64 {
    u64::from(CHUNK) * u64::from(FAN_OUT).pow(cast::fit_u32(level))
}

/// Sums over the samples of an incomplete chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Sums {
    radiance: [f64; 3],
    squares: [f64; 3],
    /// Sum of squared luminances, which cannot be derived from the channels.
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

    /// The estimate from these samples, whose number is `n`.
    pub fn estimate(&self, n: f64) -> Estimate {
        // Rounding may make this negative if all samples are equal.
        let spread = |squares: f64, sum: f64| cast::single((squares - sum * sum / n).max(0.0));
        let mean = |sum: f64| mean_of(sum, n);
        Estimate {
            mean: self.radiance.map(mean),
            spread: std::array::from_fn(|c| spread(self.squares[c], self.radiance[c])),
            luminance_spread: spread(self.luminance_squares, luminance_of(self.radiance)),
            alpha: mean(self.alpha),
            depth: mean(self.depth),
        }
    }
}

/// The mean of `n` samples with this sum. Equal samples have exactly their own value as their mean, since the error of the
/// product vanishes in single precision.
#[inline(always)]
pub(super) fn mean_of(sum: f64, n: f64) -> f32 {
    cast::single(sum * n.recip())
}

/// The mean of all samples, where `share` is the fraction of them that the second mean represents.
#[inline(always)]
pub(super) fn merged_mean(a: f32, b: f32, share: f64) -> f32 {
    cast::single(f64::from(a) + (f64::from(b) - f64::from(a)) * share)
}

/// Means over samples, and sums of squared deviations from them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Estimate {
    pub mean: [f32; 3],
    /// Sum of squared deviations from the mean.
    pub spread: [f32; 3],
    /// The same of the luminance.
    pub luminance_spread: f32,
    pub alpha: f32,
    /// Mean of distance times alpha.
    pub depth: f32,
}

impl Estimate {
    /// Merges the estimates from `n` samples here and `m` there, in double precision \[Chan83\].
    pub fn merged(&self, n: f64, other: &Self, m: f64) -> Self {
        let share = m / (n + m);
        let mean = |a: f32, b: f32| merged_mean(a, b, share);
        let spread = |[a, b]: [f32; 2], apart: f64| {
            cast::single(f64::from(a) + f64::from(b) + apart * apart * n * share)
        };
        let apart: [f64; 3] = std::array::from_fn(|c| f64::from(other.mean[c]) - f64::from(self.mean[c]));
        Self {
            mean: std::array::from_fn(|c| mean(self.mean[c], other.mean[c])),
            spread: std::array::from_fn(|c| spread([self.spread[c], other.spread[c]], apart[c])),
            luminance_spread: spread([self.luminance_spread, other.luminance_spread], luminance_of(apart)),
            alpha: mean(self.alpha, other.alpha),
            depth: mean(self.depth, other.depth),
        }
    }
}
