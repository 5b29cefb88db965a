//! The picture as 8-bit code values.

use tyndall::film::tone::quantize;
use tyndall::math::Rgb;

use super::{Display, Picture};

/// Opaque RGB, three bytes a pixel; premultiplied colours of a transparent picture already are the picture over black.
pub(super) fn rgb8(picture: &Picture, display: &Display) -> Vec<u8> {
    picture.rgba.iter().flat_map(|&[r, g, b, _]| shown(Rgb::new(r, g, b), display)).collect()
}

/// Straight RGBA, four bytes a pixel: colours are divided by opacity before the tone curve; opacity stays linear.
///
/// Where the opacity is 0 the pixel is transparent black: straight alpha cannot represent light at zero opacity.
pub(super) fn straight_rgba8(picture: &Picture, display: &Display) -> Vec<u8> {
    let pixel = |&[r, g, b, alpha]: &[f32; 4]| {
        let opacity = quantize(alpha);
        if opacity == 0 {
            return [0; 4];
        }
        let [r, g, b] = shown(Rgb::new(r, g, b) / alpha, display);
        [r, g, b, opacity]
    };
    picture.rgba.iter().flat_map(pixel).collect()
}

fn shown(linear: Rgb, display: &Display) -> [u8; 3] {
    display.tone.map(linear, display.exposure).to_array().map(quantize)
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
