//! A stream of independent random numbers addressed by a counter.

use super::philox;
use crate::math::cast;

/// Uniform numbers of one address under a seed; two streams with different addresses never overlap.
#[derive(Clone, Debug)]
pub struct Stream {
    pub(super) key: [u32; 2],
    /// Block number, then the address.
    pub(super) counter: [u32; 4],
    block: [u32; 4],
    left: usize,
}

impl Stream {
    /// The stream of `[a, b, c]` under a seed, for numbers outside a picture; those of a picture may have the same
    /// address.
    #[must_use]
    pub fn new(seed: u64, [a, b, c]: [u32; 3]) -> Self {
        Self::at(key(seed, 0), [0, a, b, c])
    }

    #[inline]
    pub(super) fn at(key: [u32; 2], counter: [u32; 4]) -> Self {
        Self { key, counter, block: [0; 4], left: 0 }
    }

    /// 32 random bits.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        if self.left == 0 {
            self.block = philox(self.counter, self.key);
            self.counter[0] = self.counter[0].wrapping_add(1);
            self.left = 4;
        }
        self.left -= 1;
        self.block[self.left]
    }

    /// Uniform in [0, 1), on multiples of 2^-24.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        unit(self.bits())
    }

    /// Optical depth to the next event of a Poisson process of rate 1, in (0, 16.7].
    #[inline]
    pub fn exponential(&mut self) -> f32 {
        exponential(self.uniform())
    }
}

/// The golden ratio spreads passes over all seeds; it is odd, so that no two passes share a key. The first pass uses
/// the seed itself.
#[inline]
pub(super) fn key(seed: u64, pass: u32) -> [u32; 2] {
    let seed = seed.wrapping_add(u64::from(pass).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    [cast::low_u32(seed), cast::low_u32(seed >> 32)]
}

/// The top 24 bits as a number in [0, 1).
#[inline]
pub(super) fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// Inverts `1 - exp(-x)` for a uniform number in [0, 1).
#[inline]
#[must_use]
pub(crate) fn exponential(u: f32) -> f32 {
    -(1.0 - u).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, address| {
            let mut s = Stream::new(seed, address);
            (0..9).map(|_| s.bits()).collect::<Vec<_>>()
        };
        assert_eq!(draw(7, [1, 2, 3]), draw(7, [1, 2, 3]));
        assert_ne!(draw(7, [1, 2, 3]), draw(8, [1, 2, 3]));
        assert_ne!(draw(7, [1, 2, 3]), draw(7, [1, 3, 3]));
        let mut distinct = draw(7, [1, 2, 3]);
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), 9, "blocks do not repeat");
    }

    #[test]
    fn uniform_numbers_have_the_moments_of_uniform_numbers() {
        let mut s = Stream::new(1, [0, 0, 0]);
        let n = 1_000_000;
        let (mut mean, mut square) = (0.0_f64, 0.0_f64);
        for _ in 0..n {
            let u = f64::from(s.uniform());
            assert!((0.0..1.0).contains(&u));
            mean += u;
            square += u * u;
        }
        // Standard errors: 0.289 / 1000 and 0.298 / 1000; four of them.
        assert!((mean / f64::from(n) - 0.5).abs() < 1.2e-3);
        assert!((square / f64::from(n) - 1.0 / 3.0).abs() < 1.2e-3);
        assert!(exponential(0.0) == 0.0 && exponential(1.0_f32.next_down()) < 16.7);
    }
}
