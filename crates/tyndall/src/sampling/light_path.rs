//! The random numbers of one light path: each depends only on seed, pass, light, path, bounce and dimension, so that a
//! path retraced from its start or from any scattering event draws the same numbers.

use super::Stream;
use super::address::{Purpose, SEQUENCE, SOBOL_BOUNCES};
use super::sampler::BounceSample;
use sobol_burley::sample_4d;

/// Owen-scrambled Sobol points \[Burley20\] over the paths of a light, and a [`Stream`] per flight.
#[derive(Clone, Copy, Debug)]
pub struct LightPathSampler {
    seed: u64,
    pass: u32,
    emitter: u32,
    path: u32,
    scramble: u32,
}

impl LightPathSampler {
    /// The numbers of an emitter's `path`-th path in a pass; paths of other passes and emitters draw independently.
    #[must_use]
    pub fn new(seed: u64, pass: u32, emitter: u32, path: u32) -> Self {
        let scramble = Purpose::LightScramble { pass, emitter, sequence: path / SEQUENCE }.bits(seed);
        Self { seed, pass, emitter, path, scramble }
    }

    /// Number of successive paths over which each dimension is stratified.
    pub const STRATIFIED: u32 = SEQUENCE;

    /// The four numbers that decide where and in which direction the path starts.
    #[must_use]
    pub fn emission(&self) -> [f32; 4] {
        sample_4d(self.path % SEQUENCE, 0, self.scramble)
    }

    /// The numbers of the `bounce`-th flight and of the scattering at its end, counted from 0.
    #[inline]
    #[must_use]
    pub fn bounce(&self, bounce: u32) -> BounceSample {
        let [a, b] = if bounce < SOBOL_BOUNCES {
            [1, 2].map(|k| sample_4d(self.path % SEQUENCE, k + 2 * bounce, self.scramble))
        } else {
            let Self { seed, pass, emitter, path, .. } = *self;
            let mut stream = Purpose::LightLateBounce { pass, emitter, path, bounce }.stream(seed);
            [(); 2].map(|()| [(); 4].map(|()| stream.uniform()))
        };
        BounceSample::of(a, b)
    }

    /// Numbers for the tracking of the `bounce`-th flight, whose count is not known beforehand.
    #[inline]
    #[must_use]
    pub fn stream(&self, bounce: u32) -> Stream {
        let Self { seed, pass, emitter, path, .. } = *self;
        Purpose::LightTracking { pass, emitter, path, bounce }.stream(seed)
    }

    /// Numbers for where in a glowing cell the path begins.
    #[must_use]
    pub fn matter_emission(&self) -> Stream {
        Purpose::MatterEmission { pass: self.pass, path: self.path }.stream(self.seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cast;

    #[test]
    fn numbers_follow_from_the_address_alone() {
        let of = |seed, pass, light, path| {
            let numbers = LightPathSampler::new(seed, pass, light, path);
            (numbers.emission(), numbers.bounce(3), numbers.bounce(40), numbers.stream(5).bits())
        };
        assert_eq!(of(1, 0, 2, 70_000), of(1, 0, 2, 70_000));
        let others = [of(2, 0, 2, 70_000), of(1, 1, 2, 70_000), of(1, 0, 3, 70_000), of(1, 0, 2, 70_001)];
        let here = of(1, 0, 2, 70_000);
        for other in others {
            assert!(here.0 != other.0 && here.1 != other.1 && here.2 != other.2 && here.3 != other.3);
        }
    }

    #[test]
    fn the_paths_of_a_light_are_stratified() {
        let mut strata = [0; 256];
        for path in 0..256 {
            let [u, v, ..] = LightPathSampler::new(9, 0, 1, path).emission();
            strata[cast::index(u * 16.0) * 16 + cast::index(v * 16.0)] += 1;
        }
        assert_eq!(strata, [1; 256]);
        let late = (0..4096).map(|path| f64::from(LightPathSampler::new(9, 0, 1, path).bounce(100).flight));
        assert!((late.sum::<f64>() / 4096.0 - 0.5).abs() < 4.0 * 0.289 / 64.0);
    }
}
