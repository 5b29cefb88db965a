//! From a film's radiance to the 8 bits of a display: exposure, the tone curve, and the colour behind the matter.

use super::tone::{ToneCurve, clip, encode_all, shown};
use crate::math::Rgb;
use crate::simd::{Kernel, Lanes, Level};
use fearless_simd::prelude::*;

/// How radiance is shown on a display.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// The curve.
    pub curve: ToneCurve,
    /// Brightens by `2^stops`.
    pub stops: f32,
    /// The colour behind the matter, if there is one.
    pub backdrop: Option<Backdrop>,
}

/// A colour behind the matter. It is paper rather than light: it is shown as it is, without exposure or curve, so that white is white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backdrop {
    /// Linear, from 0 to 1; what is brighter is shown as 1.
    pub color: Rgb,
    /// Whether the radiance includes it, times `1 - alpha`, as that of a film does.
    pub in_radiance: bool,
}

impl Tone {
    /// The nearest of 256 code values of many pixels, each with its premultiplied radiance and its alpha, which counts only before a
    /// backdrop: `sRGB(color) (1 - alpha)` plus the code value of the light alone. Every vector level gives the same bytes.
    ///
    /// # Panics
    /// If there are not as many `codes` as `pixels`.
    pub fn encode(self, level: Level, pixels: &[[f32; 4]], codes: &mut [[u8; 3]]) {
        assert_eq!(pixels.len(), codes.len(), "pixels and their codes");
        let (mut planes, mut alpha) = ([[0.0; BATCH]; 3], [0.0; BATCH]);
        for (pixels, codes) in pixels.chunks(BATCH).zip(codes.chunks_mut(BATCH)) {
            for (i, pixel) in pixels.iter().enumerate() {
                [planes[0][i], planes[1][i], planes[2][i], alpha[i]] = *pixel;
            }
            level.run(Encode { tone: self, planes: &planes, alpha: &alpha, codes });
        }
    }
}

/// Number of pixels that are encoded at once.
pub(super) const BATCH: usize = 256;

/// Radiance of a batch of pixels, channel by channel.
pub(super) type Planes = [[f32; BATCH]; 3];

/// Encodes the first pixels of a batch, a vector of them at a time.
pub(super) struct Encode<'a> {
    pub tone: Tone,
    pub planes: &'a Planes,
    /// Read only before a backdrop.
    pub alpha: &'a [f32; BATCH],
    /// Of at most [`BATCH`] pixels.
    pub codes: &'a mut [[u8; 3]],
}

impl Kernel for Encode<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { tone: Tone { curve, stops, backdrop }, planes: [red, green, blue], alpha, codes } = self;
        let gain = stops.exp2();
        for (batch, codes) in codes.chunks_mut(S::WIDTH).enumerate() {
            let lanes = batch * S::WIDTH..(batch + 1) * S::WIDTH;
            let mut r = S::f32s::from_slice(simd, &red[lanes.clone()]);
            let mut g = S::f32s::from_slice(simd, &green[lanes.clone()]);
            let mut b = S::f32s::from_slice(simd, &blue[lanes.clone()]);
            if let Some(backdrop) = backdrop {
                let seen = clip(simd, -S::f32s::from_slice(simd, &alpha[lanes]) + 1.0, 1.0);
                let Rgb { r: red, g: green, b: blue } = backdrop.color;
                if backdrop.in_radiance {
                    r = without(simd, r, seen, red);
                    g = without(simd, g, seen, green);
                    b = without(simd, b, seen, blue);
                }
                [r, g, b] = shown(simd, curve, [r * gain, g * gain, b * gain]);
                let color =
                    [S::f32s::splat(simd, red), S::f32s::splat(simd, green), S::f32s::splat(simd, blue)];
                let [red, green, blue] = encode_all(simd, color);
                r = (r + red * seen).min(1.0);
                g = (g + green * seen).min(1.0);
                b = (b + blue * seen).min(1.0);
            } else {
                [r, g, b] = shown(simd, curve, [r * gain, g * gain, b * gain]);
            }
            // One number for each pixel, since storing single bytes takes longer than the curve.
            let packed = level_of::<S>(r) | level_of::<S>(g) << 8 | level_of::<S>(b) << 16;
            for (code, packed) in codes.iter_mut().zip(packed.as_slice()) {
                let [r, g, b, _] = packed.to_le_bytes();
                *code = [r, g, b];
            }
        }
    }
}

/// Error of a film's radiance, relative to the colour behind it: means of samples are rounded a few times, and so is alpha.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// The radiance without the colour behind the matter. What rounding may have left of that is no light: a curve may raise it until it shows.
#[inline(always)]
fn without<S: Lanes>(simd: S, radiance: S::f32s, seen: S::f32s, color: f32) -> S::f32s {
    let light = radiance - seen * color;
    light.simd_gt(S::f32s::splat(simd, color * ROUNDING)).select(light, S::f32s::splat(simd, 0.0))
}

/// The nearest of 256 levels.
#[inline(always)]
fn level_of<S: Lanes>(shown: S::f32s) -> S::i32s {
    (shown * 255.0 + 0.5).to_int()
}

#[cfg(test)]
mod tests {
    use super::super::tone::{encode_srgb, quantize};
    use super::*;

    const CURVES: [ToneCurve; 4] = [ToneCurve::Agx, ToneCurve::Linear, ToneCurve::Reinhard, ToneCurve::Aces];

    /// Pixels of all magnitudes and odd ones, more than fill the last vector.
    fn pixels() -> Vec<[f32; 4]> {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-40, -1.0, 0.0, 1.0];
        let of = |i: u32, turn: u32| match i.wrapping_mul(turn) >> 8 {
            bits if bits % 50 == 0 => odd[bits as usize / 50 % 8],
            bits => (bits as f32 / (1 << 24) as f32 * 40.0 - 30.0).exp2(),
        };
        let pixel = |i: u32| {
            let [r, g, b] = [2_654_435_769, 2_246_822_519, 3_266_489_917].map(|turn| of(i, turn));
            [r, g, b, (i % 101) as f32 / 100.0]
        };
        (1..20_000).map(pixel).collect()
    }

    fn encoded(tone: Tone, level: Level, pixels: &[[f32; 4]]) -> Vec<[u8; 3]> {
        let mut codes = vec![[0; 3]; pixels.len()];
        tone.encode(level, pixels, &mut codes);
        codes
    }

    #[test]
    fn every_level_gives_the_same_bytes_and_they_are_those_of_the_single_pixel() {
        let pixels = pixels();
        let color = Rgb::new(0.9, 0.3, 7.0);
        let backdrops = [true, false].map(|in_radiance| Some(Backdrop { color, in_radiance }));
        for curve in CURVES {
            for stops in [0.0, -1.3, 4.0] {
                for backdrop in [None, backdrops[0], backdrops[1]] {
                    let tone = Tone { curve, stops, backdrop };
                    let scalar = encoded(tone, Level::available()[0], &pixels);
                    for level in Level::available() {
                        assert!(encoded(tone, level, &pixels) == scalar, "{tone:?} with {level:?}");
                    }
                    if backdrop.is_some() {
                        continue;
                    }
                    for (&[r, g, b, alpha], codes) in pixels.iter().zip(&scalar) {
                        let alone = curve.map(Rgb::new(r, g, b), stops).to_array().map(quantize);
                        assert_eq!(alone, *codes, "{curve:?} of {:?}", [r, g, b, alpha]);
                    }
                }
            }
        }
    }

    /// The rule in double precision, except for the curve: `sRGB(color) (1 - alpha) + curve(2^stops light)`.
    #[test]
    fn a_backdrop_is_shown_as_it_is_and_light_before_it_by_the_curve() {
        let colors = [Rgb::WHITE, Rgb::new(0.2, 0.5, 0.0), Rgb::splat(30.0)];
        for (curve, color) in CURVES.into_iter().flat_map(|curve| colors.map(|color| (curve, color))) {
            for (stops, alpha, light) in [
                (0.0, 0.0, Rgb::BLACK),
                (6.0, 0.0, Rgb::BLACK),
                (0.0, 0.25, Rgb::new(0.1, 0.02, 0.0)),
                (-2.0, 0.5, Rgb::splat(1.5)),
                (3.0, 0.9, Rgb::splat(0.01)),
                (0.0, 1.0, Rgb::new(0.3, 0.2, 0.1)),
            ] {
                let behind = color * (1.0 - alpha);
                let toned = curve.map(light, stops).to_array();
                let expected: [u8; 3] = std::array::from_fn(|c| {
                    quantize(encode_srgb(color.to_array()[c]) * (1.0 - alpha) + toned[c])
                });
                for (in_radiance, seen) in [(true, light + behind), (false, light)] {
                    let tone = Tone { curve, stops, backdrop: Some(Backdrop { color, in_radiance }) };
                    let [r, g, b] = seen.to_array();
                    let found = encoded(tone, Level::best(), &[[r, g, b, alpha]])[0];
                    let near = found.iter().zip(expected).all(|(&a, b)| a.abs_diff(b) <= 1);
                    assert!(
                        near,
                        "{tone:?}, light {light:?}, alpha {alpha}: {found:?}, expected {expected:?}"
                    );
                }
            }
            let tone = Tone {
                curve,
                stops: 100.0,
                backdrop: Some(Backdrop { color: Rgb::WHITE, in_radiance: true }),
            };
            assert_eq!(encoded(tone, Level::best(), &[[1.0, 1.0, 1.0, 0.0]]), [[255; 3]], "{curve:?}");
            // A black channel of a colour is no light, however much the film's rounding is raised.
            let color = Rgb::new(0.7, 0.0, 0.7);
            let tone = Tone { backdrop: Some(Backdrop { color, in_radiance: true }), ..tone };
            let [r, g, b] = (color * 0.3).to_array();
            let found = encoded(tone, Level::best(), &[[r, g, b, 0.7]])[0];
            let dim = quantize(encode_srgb(0.7) * 0.3);
            assert!(found[1] == 0 && found[0].abs_diff(dim) <= 1, "{curve:?}: {found:?}, expected {dim}");
        }
    }
}
