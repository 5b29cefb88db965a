//! Functions that `fearless_simd` lacks.

use super::Lanes;
use crate::math::direction::HALF;
use fearless_simd::prelude::*;

/// `1 - exp(-x)` for `x >= 0`, with a relative error of 3e-7: the fraction of light removed by an optical thickness.
#[inline(always)]
pub(crate) fn one_minus_exp<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    // exp(-x) = 2^n e^r with |r| <= ln 2 / 2; below 2^-60 it is negligible next to 1.
    let n = (x * -std::f32::consts::LOG2_E).max(-60.0).round_ties_even();
    let r = (n * -LN_2_LOW) + (n * -LN_2_HIGH - x.min(60.0));
    // The Taylor series of e^r - 1 keeps small thicknesses accurate.
    let mut series = S::f32s::splat(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0] {
        series = series.mul_add(r, S::f32s::splat(simd, coefficient));
    }
    let power: S::i32s = (n.to_int::<S::i32s>() + 127) << 23;
    let power: S::f32s = power.bitcast();
    let one = S::f32s::splat(simd, 1.0);
    (one - power) - power * (series * r)
}

/// ln 2 in two parts; multiples of the first up to 2^8 are exact.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;

/// `log2(x)` of normal positive numbers, to 3e-7 of itself or of 1. Nothing is fused, so that every level gives the same bits.
#[inline(always)]
pub(crate) fn log2_unfused<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    /// Of the square root of a half, above which mantissas are taken, and below twice which.
    const ROOT: u32 = 0x3f35_04f3;
    let bits: S::i32s = x.bitcast();
    let root = ROOT.cast_signed();
    let exponent: S::i32s = (bits - root) >> 23;
    let m: S::f32s = (bits - (exponent << 23)).bitcast();
    // log(m) = 2 artanh((m - 1) / (m + 1)).
    let one = S::f32s::splat(simd, 1.0);
    let s = (m - one) / (m + one);
    let z = s * s;
    let series = ((z * (1.0 / 9.0) + 1.0 / 7.0) * z + 1.0 / 5.0) * z + 1.0 / 3.0;
    (series * z + 1.0) * s * (2.0 * std::f32::consts::LOG2_E) + exponent.to_float::<S::f32s>()
}

/// `2^x` for `x` from -126 to 127, to 3e-7 of itself. Nothing is fused, so that every level gives the same bits.
#[inline(always)]
pub(crate) fn exp2_unfused<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    let n = x.round_ties_even();
    let r = (x - n) * std::f32::consts::LN_2;
    let mut series = S::f32s::splat(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        series = series * r + coefficient;
    }
    let power: S::i32s = (n.to_int::<S::i32s>() + 127) << 23;
    let power: S::f32s = power.bitcast();
    series * power
}

/// Unpacks [`PackedDirection`](crate::math::PackedDirection)s to unit vectors.
#[inline(always)]
pub(crate) fn unpack_directions<S: Lanes>(simd: S, words: S::u32s) -> [S::f32s; 3] {
    let (low, high): (S::i32s, S::i32s) = ((words & 0xffff).bitcast(), (words >> 16).bitcast());
    let zero = S::f32s::splat(simd, 0.0);
    let scale = S::f32s::splat(simd, 1.0 / HALF);
    let x = (low.to_float::<S::f32s>() - (HALF + 1.0)) * scale;
    let y = (high.to_float::<S::f32s>() - (HALF + 1.0)) * scale;
    let z = S::f32s::splat(simd, 1.0) - x.abs() - y.abs();
    let fold = (-z).max(zero);
    let [x, y] = [x - fold.copysign(x), y - fold.copysign(y)];
    let scale = S::f32s::splat(simd, 1.0) / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PackedDirection, Vec3, cast};
    use crate::simd::{Kernel, Level};

    struct Unpack<'a>(&'a [u32]);

    impl Kernel for Unpack<'_> {
        type Output = Vec<Vec3>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<Vec3> {
            let mut found = Vec::new();
            for words in self.0.chunks_exact(S::WIDTH) {
                let [x, y, z] = unpack_directions(simd, S::u32s::from_slice(simd, words));
                let of = |lane: usize| Vec3::new(x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane]);
                found.extend((0..S::WIDTH).map(of));
            }
            found
        }
    }

    #[test]
    fn every_level_unpacks_the_same_directions() {
        let words: Vec<u32> = (0..4096_u32)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f32 + 0.5) / 4096.0;
                let (s, c) = (i as f32 * 2.4).sin_cos();
                PackedDirection::new(Vec3::new((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z)).word()
            })
            .collect();
        for level in Level::available() {
            for (&word, found) in words.iter().zip(level.run(Unpack(&words))) {
                let expected = PackedDirection::from_word(word).unpack();
                assert!((found - expected).length() < 3e-7, "{found}, expected {expected} with {level:?}");
            }
        }
    }

    struct Shares<'a>(&'a [f32]);

    impl Kernel for Shares<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<f32> {
            let of = |x: &[f32]| one_minus_exp(simd, S::f32s::from_slice(simd, x)).as_slice().to_vec();
            self.0.chunks_exact(S::WIDTH).flat_map(of).collect()
        }
    }

    #[test]
    fn shares_agree_with_double_precision() {
        let xs: Vec<f32> =
            (0..16_000).map(|i| cast::single(1e-7 * 1.0015_f64.powi(i))).chain([0.0; 16]).collect();
        for level in Level::available() {
            for (&x, found) in xs.iter().zip(level.run(Shares(&xs))) {
                let expected = -(-f64::from(x)).exp_m1();
                let apart = (f64::from(found) - expected).abs();
                assert!(apart <= 3e-7 * expected, "{found}, expected {expected} at {x} with {level:?}");
            }
        }
    }

    /// A function of each number.
    struct Each<'a>(&'a [f32], bool);

    impl Kernel for Each<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<f32> {
            let Self(numbers, is_log) = self;
            let of = |x: &[f32]| {
                let x = S::f32s::from_slice(simd, x);
                if is_log { log2_unfused(simd, x) } else { exp2_unfused(simd, x) }.as_slice().to_vec()
            };
            numbers.chunks_exact(S::WIDTH).flat_map(of).collect()
        }
    }

    #[test]
    fn logarithms_and_powers_are_right_and_alike_on_every_level() {
        let numbers: Vec<f32> = (0..16_000).map(|i| cast::single(1.2e-38 * 1.011_f64.powi(i))).collect();
        let exponents: Vec<f32> = (0..16_000).map(|i| -126.0 + i as f32 * (252.9 / 16_000.0)).collect();
        let first = Level::available()[0];
        for level in Level::available() {
            let (logs, powers) = (level.run(Each(&numbers, true)), level.run(Each(&exponents, false)));
            assert_eq!(logs, first.run(Each(&numbers, true)), "{level:?}");
            assert_eq!(powers, first.run(Each(&exponents, false)), "{level:?}");
            for (&x, found) in numbers.iter().zip(logs) {
                let expected = f64::from(x).log2();
                let apart = (f64::from(found) - expected).abs();
                assert!(apart <= 3e-7 * expected.abs().max(1.0), "{found}, expected {expected} at {x}");
            }
            for (&x, found) in exponents.iter().zip(powers) {
                let expected = f64::from(x).exp2();
                assert!(
                    (f64::from(found) / expected - 1.0).abs() < 3e-7,
                    "{found}, expected {expected} at {x}"
                );
            }
        }
    }
}
