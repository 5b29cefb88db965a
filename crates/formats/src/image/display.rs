//! The picture as 8-bit code values.

use tyndall::film::tone::quantize;
use tyndall::simd::Level;

use super::{Display, Picture};

/// Opaque RGB, three bytes a pixel; premultiplied colours of a transparent picture already are the picture over black.
pub(super) fn rgb8(picture: &Picture, display: &Display) -> Vec<u8> {
    encoded(picture.rgba.iter().map(|&[r, g, b, _]| [r, g, b]), display).into_flattened()
}

/// Straight RGBA, four bytes a pixel: colours are divided by opacity before the tone curve; opacity stays linear.
///
/// Where the opacity is 0 the pixel is transparent black: straight alpha cannot represent light at zero opacity.
pub(super) fn straight_rgba8(picture: &Picture, display: &Display) -> Vec<u8> {
    let codes = encoded(picture.rgba.iter().map(|&[r, g, b, alpha]| [r, g, b].map(|x| x / alpha)), display);
    let pixel = |(&[_, _, _, alpha], [r, g, b]): (&[f32; 4], [u8; 3])| match quantize(alpha) {
        0 => [0; 4],
        opacity => [r, g, b, opacity],
    };
    picture.rgba.iter().zip(codes).flat_map(pixel).collect()
}

fn encoded(pixels: impl Iterator<Item = [f32; 3]>, display: &Display) -> Vec<[u8; 3]> {
    let pixels: Vec<[f32; 3]> = pixels.collect();
    let mut codes = vec![[0; 3]; pixels.len()];
    display.tone.encode(Level::best(), display.exposure, &pixels, &mut codes);
    codes
}

#[cfg(test)]
mod tests {
    use tyndall::film::tone::ToneCurve;

    use super::*;

    const LINEAR: Display = Display { tone: ToneCurve::Linear, exposure: 0.0 };

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
    fn over_black_is_premultiplied() {
        assert_eq!(rgb8(&picture([0.18, 0.0, 0.5, 0.5]), &LINEAR), [118, 0, 188]);
    }
}
