//! A source of uniform numbers for tests.

/// The `SplitMix64` generator \[Steele14\]: small, sound enough for the tests here, and the same on every machine.
///
/// Separate from the renderer's generator, so that a test of its sampler does not depend on its random numbers.
#[derive(Clone, Debug)]
pub struct SplitMix {
    state: u64,
}

impl SplitMix {
    /// The stream of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in [0, 1), with 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next `D` numbers in [0, 1), with 24 random bits each.
    pub fn uniforms<const D: usize>(&mut self) -> [f32; D] {
        std::array::from_fn(|_| (self.bits() >> 40) as f32 / (1_u32 << 24) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers_of_the_published_generator() {
        let mut random = SplitMix::new(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([random.bits(), random.bits(), random.bits()], expected);
    }

    #[test]
    fn numbers_stay_below_one_and_average_one_half() {
        let mut random = SplitMix::new(7);
        let mut sum = 0.0;
        for _ in 0..100_000 {
            let [a, b] = random.uniforms::<2>();
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b), "{a} {b}");
            sum += f64::from(a) + f64::from(b);
        }
        let mean = sum / 200_000.0;
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0_f64 / 200_000.0).sqrt(), "mean {mean}");
    }
}
