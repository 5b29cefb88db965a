//! Functions that the lanes' library lacks.

use super::Lanes;
use fearless_simd::prelude::*;

/// `1 - exp(-x)` for `x >= 0`, to 3e-7 of itself: the share of light that an optical thickness takes.
#[inline(always)]
pub(crate) fn one_minus_exp<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    // exp(-x) = 2^n e^r with |r| <= ln 2 / 2; below 2^-60 nothing is left of it beside 1.
    let n = (x * -std::f32::consts::LOG2_E).max(-60.0).round_ties_even();
    let r = (n * -LN_2_LOW) + (n * -LN_2_HIGH - x.min(60.0));
    // Taylor's series of e^r - 1 keeps small thicknesses exact.
    let mut series = S::f32s::splat(simd, 1.0 / 5040.0);
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0] {
        series = series.mul_add(r, S::f32s::splat(simd, coefficient));
    }
    let power: S::i32s = (n.to_int::<S::i32s>() + 127) << 23;
    let power: S::u32s = power.bitcast();
    let power = S::f32s::from_bits(power);
    let one = S::f32s::splat(simd, 1.0);
    (one - power) - power * (series * r)
}

/// ln 2 in two parts, of which multiples of the first up to 2^8 are exact.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cast;
    use crate::simd::{Kernel, Level};

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
}
