//! The numbers of one camera path: low discrepancy for its first bounces, a random stream after.

use super::Stream;
use super::address::{Purpose, SEQUENCE, SOBOL_BOUNCES};
use super::stream::exponential;
use sobol_burley::sample_4d;

/// The numbers of one scattering event, each in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BounceSample {
    /// Length of the flight that leads here; see [`Self::flight_depth`].
    pub flight: f32,
    /// Which light.
    pub light_choice: f32,
    /// Where on the light.
    pub light: [f32; 2],
    /// Which lobe, and the direction in it.
    pub scatter: [f32; 3],
    /// Whether the path goes on.
    pub roulette: f32,
}

impl BounceSample {
    /// From eight numbers.
    #[inline]
    pub(super) fn of(a: [f32; 4], b: [f32; 4]) -> Self {
        Self {
            flight: a[0],
            light_choice: a[1],
            light: [a[2], a[3]],
            scatter: [b[0], b[1], b[2]],
            roulette: b[3],
        }
    }

    /// Optical depth to the flight's first tentative collision, exponentially distributed.
    #[inline]
    #[must_use]
    pub fn flight_depth(&self) -> f32 {
        exponential(self.flight)
    }
}

/// Owen-scrambled Sobol points \[Burley20\] per pixel, and a [`Stream`] for what has no fixed number of draws.
#[derive(Clone, Debug)]
pub struct PathSampler {
    index: u32,
    scramble: u32,
    /// Numbers for tracking, whose count is not known beforehand.
    pub stream: Stream,
}

impl PathSampler {
    /// The numbers of a pixel's `sample`-th path.
    #[must_use]
    pub fn new(seed: u64, pixel: u32, sample: u32) -> Self {
        let scramble = Purpose::CameraScramble { pixel, sequence: sample / SEQUENCE }.bits(seed);
        let stream = Purpose::CameraTracking { pixel, sample }.stream(seed);
        Self { index: sample % SEQUENCE, scramble, stream }
    }

    /// Position in the pixel, then on the lens.
    #[must_use]
    pub fn camera(&self) -> ([f32; 2], [f32; 2]) {
        let [x, y, u, v] = sample_4d(self.index, 0, self.scramble);
        ([x, y], [u, v])
    }

    /// The numbers of the `bounce`-th flight and event, counted from 0.
    #[inline]
    pub fn bounce(&mut self, bounce: u32) -> BounceSample {
        let (a, b) = if bounce < SOBOL_BOUNCES {
            let set = |k: u32| sample_4d(self.index, 1 + 2 * bounce + k, self.scramble);
            (set(0), set(1))
        } else {
            let mut block = || [(); 4].map(|()| self.stream.uniform());
            (block(), block())
        };
        BounceSample::of(a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn early_bounces_are_stratified_and_late_ones_uniform() {
        // 256 Sobol points put exactly one in each of 256 strata of a dimension.
        let mut strata = [0; 256];
        for sample in 0..256 {
            let u = PathSampler::new(5, 99, sample).bounce(3).flight;
            strata[crate::math::cast::index(u * 256.0)] += 1;
        }
        assert_eq!(strata, [1; 256]);
        let late = (0..4096).map(|s| f64::from(PathSampler::new(5, 99, s).bounce(100).flight));
        assert!((late.sum::<f64>() / 4096.0 - 0.5).abs() < 4.0 * 0.289 / 64.0);
    }

    #[test]
    fn pixels_and_later_sequences_are_scrambled_apart() {
        let first = |pixel, sample| PathSampler::new(0, pixel, sample).camera();
        assert_ne!(first(0, 0), first(1, 0));
        assert_ne!(first(0, 0), first(0, SEQUENCE));
        assert_eq!(first(3, 8), first(3, 8));
    }
}
