//! A running estimate of a picture's noise: each tile measures its own from time to time, while it is in the processor's cache.

use super::encode::BATCH;
use super::tree::{Tree, pieces};

/// A tile measures again once it has this many times the samples.
const GROWTH: f64 = 1.1;

/// The noise of a tile when it was last measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TileNoise {
    /// Samples per pixel at that time; 0 if it was not measured yet.
    samples: f64,
    /// Sum of the pixels' mean luminances.
    luminance: f64,
    /// Sum over the pixels of variance / (mean^2 + 0.01 M^2), where M is the picture's mean.
    relative_variance: f64,
}

impl TileNoise {
    /// Measures again if there are enough new samples: `tree` has the samples before `end` of its first `pixels` pixels, and
    /// `whole` is the mean luminance of the picture.
    pub fn measure(&mut self, tree: &Tree, pixels: usize, end: u32, whole: f64) {
        let n = f64::from(end - tree.first());
        if n < 1.0 || n < GROWTH * self.samples {
            return;
        }
        let (mut mean, mut spread) = ([0.0; BATCH], [0.0; BATCH]);
        tree.luminance(&pieces(tree.first(), end), &mut mean, &mut spread);
        let dark = (0.01 * whole * whole).max(f64::MIN_POSITIVE);
        let mut noise = Self { samples: n, luminance: 0.0, relative_variance: 0.0 };
        for (mean, spread) in mean[..pixels].iter().zip(&spread[..pixels]) {
            noise.luminance += mean;
            // With one sample the spread is 0.
            noise.relative_variance += spread / (n * (n - 1.0)).max(1.0) / (mean * mean + dark);
        }
        *self = noise;
    }

    /// The sum of the pixels' mean luminances.
    pub fn luminance(&self) -> f64 {
        self.luminance
    }

    /// The sum of the pixels' relative variances now that they have this many samples; `None` before two were measured.
    pub fn relative_variance(&self, samples: f64) -> Option<f64> {
        (self.samples >= 2.0).then(|| self.relative_variance * self.samples / samples)
    }
}
