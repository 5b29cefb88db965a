//! Tone mapping: from scene-linear radiance to the code values of an sRGB display.
//!
//! A curve is for display only; the film records linear radiance.

use crate::math::{LUMINANCE, Rgb};
use crate::simd::{Kernel, Lanes, Level, exp2_unfused, log2_unfused};
use fearless_simd::prelude::*;
use std::ops::{Add, Div, Mul};

/// How unbounded radiance is compressed into the range of a display.
///
/// Every curve takes linear Rec. 709 primaries and yields sRGB code values in [0, 1].
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum ToneCurve {
    /// `AgX`, the base look: highlights desaturate as on film \[Sobotka22, Wrensch23\].
    #[default]
    Agx,
    /// None: clipped at 1, then encoded according to IEC 61966-2-1.
    Linear,
    /// Luminance `L` becomes `L / (1 + L)` \[Reinhard02, eq. 3\]; saturated channels clip.
    Reinhard,
    /// A rational fit of the ACES reference transform, each channel by itself \[Narkowicz16\].
    Aces,
}

impl ToneCurve {
    /// The sRGB code values, in [0, 1], that show `linear` brightened by `2^exposure_stops`.
    ///
    /// Negative and undefined channels show as black, infinite ones as the brightest value.
    #[must_use]
    pub fn map(self, linear: Rgb, exposure_stops: f32) -> Rgb {
        Level::best().run(MapOne { curve: self, linear: linear * exposure_stops.exp2() })
    }
}

/// Maps a single pixel.
struct MapOne {
    curve: ToneCurve,
    linear: Rgb,
}

impl Kernel for MapOne {
    type Output = Rgb;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Rgb {
        let Rgb { r, g, b } = self.linear;
        let linear = [S::f32s::splat(simd, r), S::f32s::splat(simd, g), S::f32s::splat(simd, b)];
        let [r, g, b] = shown(simd, self.curve, linear);
        Rgb::new(r.as_slice()[0], g.as_slice()[0], b.as_slice()[0])
    }
}

/// The code values, in [0, 1], that show a linear colour.
#[inline(always)]
pub(super) fn shown<S: Lanes>(simd: S, curve: ToneCurve, [r, g, b]: [S::f32s; 3]) -> [S::f32s; 3] {
    let [r, g, b] = [clip(simd, r, BRIGHTEST), clip(simd, g, BRIGHTEST), clip(simd, b, BRIGHTEST)];
    match curve {
        ToneCurve::Agx => agx(simd, [r, g, b]),
        ToneCurve::Linear => encode_all(simd, [r, g, b]),
        ToneCurve::Reinhard => {
            let [red, green, blue] = LUMINANCE;
            let white = r * red + g * green + b * blue + 1.0;
            encode_all(simd, [r / white, g / white, b / white])
        }
        ToneCurve::Aces => encode_all(simd, [aces(r), aces(g), aces(b)]),
    }
}

/// The sRGB code value of a linear one [IEC 61966-2-1]; values outside [0, 1] are clipped, NaN becomes 0.
#[must_use]
pub fn encode_srgb(linear: f32) -> f32 {
    let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The nearest of the 256 levels of [0, 1]; values outside are clipped, NaN becomes 0.
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN becomes 0")]
pub fn quantize(x: f32) -> u8 {
    (x * 255.0).round() as u8
}

/// Scene values are clipped to this before a curve: all curves are flat far below it, and its square is finite.
const BRIGHTEST: f32 = 1e10;

/// Clamps to [0, high]; NaN becomes 0.
#[inline(always)]
pub(super) fn clip<S: Lanes>(simd: S, x: S::f32s, high: f32) -> S::f32s {
    let zero = S::f32s::splat(simd, 0.0);
    x.simd_gt(zero).select(x.min(high), zero)
}

/// [`encode_srgb`] in lanes; the root is computed from logarithms.
#[inline(always)]
fn encode_lanes<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    let x = clip(simd, x, 1.0);
    let root = exp2_unfused(simd, log2_unfused(simd, x.max(f32::MIN_POSITIVE)) * (1.0 / 2.4));
    let linear = S::f32s::splat(simd, 0.003_130_8);
    // Rounding may exceed 1.
    x.simd_le(linear).select(x * 12.92, root * 1.055 - 0.055).min(1.0)
}

/// [`encode_lanes`] of each channel.
#[inline(always)]
pub(super) fn encode_all<S: Lanes>(simd: S, [r, g, b]: [S::f32s; 3]) -> [S::f32s; 3] {
    [encode_lanes(simd, r), encode_lanes(simd, g), encode_lanes(simd, b)]
}

/// \[Narkowicz16\]: five numbers fitted to the reference and output device transforms.
#[inline(always)]
fn aces<V: Copy + Mul<f32, Output = V> + Mul<V, Output = V> + Add<f32, Output = V> + Div<V, Output = V>>(
    x: V,
) -> V {
    (x * (x * 2.51 + 0.03)) / (x * (x * 2.43 + 0.59) + 0.14)
}

type Matrix = [[f32; 3]; 3];

/// Range of scene values that `AgX` covers, as log2 of the linear value \[Sobotka22\].
const AGX_STOPS: [f32; 2] = [-12.473_93, 4.026_069];

/// Moves pure colours towards white, so that bright ones desaturate instead of clipping \[Wrensch23\].
const AGX_INSET: Matrix = rows_to_one([
    [0.842_479_06, 0.078_433_6, 0.079_223_745],
    [0.042_328_242, 0.878_468_64, 0.079_166_13],
    [0.042_375_655, 0.078_433_6, 0.879_143],
]);

/// The inverse matrix, applied after the contrast curve \[Wrensch23\].
const AGX_OUTSET: Matrix = rows_to_one([
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_85, 1.151_903_1, -0.098_961_18],
    [-0.052_971_635, -0.098_043_45, 1.151_073_7],
]);

/// Normalizes the rows: the sums of the published ones differ from 1 by up to 2e-4, and grey must stay grey.
const fn rows_to_one(rows: Matrix) -> Matrix {
    let mut result = rows;
    let mut i = 0;
    while i < 3 {
        let sum = rows[i][0] + rows[i][1] + rows[i][2];
        result[i] = [rows[i][0] / sum, rows[i][1] / sum, rows[i][2] / sum];
        i += 1;
    }
    result
}

/// \[Wrensch23\]'s fit of the base look of \[Sobotka22\]; the output is already encoded for the display.
#[inline(always)]
fn agx<S: Lanes>(simd: S, scene: [S::f32s; 3]) -> [S::f32s; 3] {
    let [r, g, b] = multiply(AGX_INSET, scene);
    let [r, g, b] = multiply(AGX_OUTSET, [agx_of(simd, r), agx_of(simd, g), agx_of(simd, b)]);
    [clip(simd, r, 1.0), clip(simd, g, 1.0), clip(simd, b, 1.0)]
}

/// One channel between the two matrices.
#[inline(always)]
fn agx_of<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    let [low, high] = AGX_STOPS;
    let log = log2_unfused(simd, x.max(f32::MIN_POSITIVE)).max(low).min(high);
    agx_contrast((log - low) * (1.0 / (high - low)))
}

/// The sigmoid over the log range, as a polynomial of degree 6 \[Wrensch23\].
#[inline(always)]
fn agx_contrast<V: Copy + Mul<f32, Output = V> + Mul<V, Output = V> + Add<f32, Output = V>>(x: V) -> V {
    let higher = ((x * 15.5 + -40.14) * x + 31.96) * x + -6.868;
    ((higher * x + 0.429_8) * x + 0.119_1) * x + -0.002_32
}

#[inline(always)]
fn multiply<V: Copy + Mul<f32, Output = V> + Add<V, Output = V>>(rows: Matrix, [r, g, b]: [V; 3]) -> [V; 3] {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = rows;
    [r * ax + g * ay + b * az, r * bx + g * by + b * bz, r * cx + g * cy + b * cz]
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneCurve; 4] = [ToneCurve::Agx, ToneCurve::Linear, ToneCurve::Reinhard, ToneCurve::Aces];

    fn shown(curve: ToneCurve, linear: Rgb) -> [u8; 3] {
        curve.map(linear, 0.0).to_array().map(quantize)
    }

    #[test]
    fn linear_is_srgb_at_each_of_the_256_levels() {
        for level in 0..=255_u8 {
            let code = f64::from(level) / 255.0;
            let linear = if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) };
            let grey = Rgb::splat(crate::math::cast::single(linear));
            assert_eq!(shown(ToneCurve::Linear, grey), [level; 3]);
        }
        assert_eq!(shown(ToneCurve::Linear, Rgb::splat(0.18)), [118; 3]);
    }

    /// The curve for sRGB in lanes against the standard library's power function.
    #[test]
    fn srgb_in_lanes_is_srgb() {
        for i in 0..100_000 {
            let x = i as f32 / 99_999.0;
            let found = ToneCurve::Linear.map(Rgb::splat(x), 0.0).g;
            assert!((found - encode_srgb(x)).abs() < 5e-7, "{found} at {x}");
        }
    }

    #[test]
    fn levels_are_the_nearest_ones() {
        for (x, level) in
            [(-1.0, 0), (0.4999 / 255.0, 0), (0.5001 / 255.0, 1), (254.4999 / 255.0, 254), (2.0, 255)]
        {
            assert_eq!(quantize(x), level, "{x}");
        }
    }

    #[test]
    fn black_stays_black_and_bright_ends_white() {
        for curve in CURVES {
            assert_eq!(shown(curve, Rgb::BLACK), [0; 3], "{curve:?}");
            assert_eq!(shown(curve, Rgb::splat(1e6)), [255; 3], "{curve:?}");
        }
    }

    /// A rounding error of the `AgX` polynomial, whose coefficients add up to 95; the published rows are off grey by
    /// 7e-5.
    const ROUNDING: f32 = 95.0 * f32::EPSILON;

    #[test]
    fn grey_stays_grey_and_monotonic() {
        for curve in CURVES {
            let mut last = 0.0;
            for step in -400_i16..400 {
                let grey = curve.map(Rgb::splat((f32::from(step) / 25.0).exp2()), 0.0);
                assert!(grey.max_component() - grey.min_component() < ROUNDING, "{curve:?} {step}: {grey:?}");
                assert!(grey.g >= last - ROUNDING, "{curve:?} falls at {step}: {last} to {grey:?}");
                last = grey.g.max(last);
            }
        }
    }

    #[test]
    fn a_stop_of_exposure_doubles_the_light() {
        let colour = Rgb::new(0.3, 0.1, 0.05);
        for curve in CURVES {
            assert_eq!(curve.map(colour, 1.0), curve.map(colour * 2.0, 0.0), "{curve:?}");
            assert_ne!(curve.map(colour, 1.0), curve.map(colour, 0.0), "{curve:?}");
        }
    }

    /// Code values of the sources' formulas, evaluated in double precision with the published matrices.
    #[test]
    fn curves_follow_their_sources() {
        let orange = Rgb::new(0.8, 0.3, 0.05);
        for (curve, colour, expected) in [
            (ToneCurve::Agx, Rgb::splat(0.18), [0.49668, 0.49674, 0.49675]),
            (ToneCurve::Agx, orange, [0.78080, 0.60112, 0.35850]),
            (ToneCurve::Agx, orange * 16.0, [1.00000, 0.95356, 0.83389]),
            (ToneCurve::Reinhard, Rgb::splat(0.18), [0.42695, 0.42695, 0.42695]),
            (ToneCurve::Reinhard, orange, [0.78352, 0.50222, 0.20912]),
            (ToneCurve::Reinhard, orange * 16.0, [1.00000, 0.83539, 0.36704]),
            (ToneCurve::Aces, Rgb::splat(0.18), [0.55346, 0.55346, 0.55346]),
            (ToneCurve::Aces, orange, [0.88202, 0.69329, 0.23286]),
            (ToneCurve::Aces, orange * 16.0, [1.00000, 0.99262, 0.88202]),
        ] {
            let got = curve.map(colour, 0.0);
            for (x, y) in got.to_array().into_iter().zip(expected) {
                assert!((x - y).abs() < 3e-4, "{curve:?} of {colour:?}: {got:?}, expected {expected:?}");
            }
        }
    }

    #[test]
    fn undefined_light_never_panics() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -1.0, 0.0];
        for curve in CURVES {
            for r in odd {
                for g in odd {
                    for stops in [0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 200.0] {
                        let shown = curve.map(Rgb::new(r, g, 0.5), stops);
                        let fits = |x: f32| (0.0..=1.0).contains(&x);
                        assert!(fits(shown.r) && fits(shown.g) && fits(shown.b), "{curve:?}: {shown:?}");
                    }
                }
            }
            assert_eq!(shown(curve, Rgb::splat(f32::NAN)), [0; 3]);
            assert_eq!(shown(curve, Rgb::splat(f32::INFINITY)), [255; 3]);
        }
    }
}
