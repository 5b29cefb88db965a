//! The picture as 8-bit code values.

use tyndall::film::tone::quantize;
use tyndall::math::Rgb;
use tyndall::simd::Level;

use super::{Backdrop, Picture, Tone};

/// Opaque RGB, three bytes a pixel; a transparent picture is shown over white.
pub(super) fn rgb8(picture: &Picture, tone: &Tone) -> Vec<u8> {
    let white = Backdrop { color: Rgb::WHITE, in_radiance: false };
    let tone = if picture.transparent { Tone { backdrop: Some(white), ..*tone } } else { *tone };
    let mut codes = vec![[0; 3]; picture.rgba.len()];
    tone.encode(Level::best(), &picture.rgba, &mut codes);
    codes.into_flattened()
}

/// Pixels whose colours are divided by their opacity at once.
const BATCH: usize = 4096;

/// Straight RGBA, four bytes a pixel: colours are divided by opacity before the tone curve; opacity stays linear.
///
/// Where the opacity is 0 the pixel is transparent black: straight alpha cannot represent light at zero opacity.
pub(super) fn straight_rgba8(picture: &Picture, tone: &Tone) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 * picture.rgba.len());
    let mut codes = [[0; 3]; BATCH];
    for pixels in picture.rgba.chunks(BATCH) {
        let straight: Vec<_> = pixels.iter().map(|&[r, g, b, a]| [r / a, g / a, b / a, 1.0]).collect();
        let codes = &mut codes[..pixels.len()];
        tone.encode(Level::best(), &straight, codes);
        bytes.extend(pixels.iter().zip(codes).flat_map(
            |(&[_, _, _, alpha], &mut [r, g, b])| match quantize(alpha) {
                0 => [0; 4],
                opacity => [r, g, b, opacity],
            },
        ));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use tyndall::film::tone::ToneCurve;

    use super::*;

    const LINEAR: Tone = Tone { curve: ToneCurve::Linear, stops: 0.0, backdrop: None };

    fn picture(rgba: [f32; 4]) -> Picture {
        Picture { width: 1, height: 1, rgba: vec![rgba], transparent: true, ..Picture::default() }
    }

    #[test]
    fn straight_colours_do_not_darken_with_opacity() {
        for alpha in [1.0, 0.5, 0.1] {
            let bytes = straight_rgba8(&picture([0.18 * alpha, 0.0, alpha, alpha]), &LINEAR);
            assert_eq!(bytes, [118, 0, 255, quantize(alpha)]);
        }
        assert_eq!(straight_rgba8(&picture([0.5, 0.5, 0.5, 0.0]), &LINEAR), [0; 4]);
    }

    #[test]
    fn what_cannot_be_transparent_is_over_white() {
        assert_eq!(rgb8(&picture([0.18, 0.0, 0.5, 0.6]), &LINEAR), [220, 102, 255]);
        assert_eq!(rgb8(&picture([0.0; 4]), &LINEAR), [255; 3]);
        let opaque = Picture { transparent: false, ..picture([0.18, 0.0, 0.5, 0.5]) };
        assert_eq!(rgb8(&opaque, &LINEAR), [118, 0, 188]);
    }
}
