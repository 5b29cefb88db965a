//! The pictures that are written when a comparison fails.

use crate::cast::level;
use crate::picture::Picture;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::Path;

/// Fraction of the reference's values that are shown without clipping, so that a few highlights do not darken the rest.
const UNCLIPPED: f64 = 0.99;

type Pixel = [u8; 3];

/// How far apart two pictures are, block by block.
pub(crate) struct Error {
    /// Edge length of a block in pixels.
    pub block: usize,
    /// Blocks in a row.
    pub columns: usize,
    /// Per block, from -1 (too dark) to 1 (too bright); values outside are shown as the nearer end.
    pub signed: Vec<f64>,
}

/// Writes image, reference and error to a folder, which is created if it does not exist.
pub(crate) fn write(image: &Picture, reference: &Picture, error: &Error, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let white = white(reference);
    for (name, picture) in [("image.png", image), ("reference.png", reference)] {
        let pixels = picture.mean.iter().map(|rgb| rgb.map(|x| level(srgb(f64::from(x) / white))));
        write_png(&folder.join(name), picture, pixels)?;
    }
    let pixels = (0..image.width * image.height).map(|i| {
        let (x, y) = (i % image.width / error.block, i / image.width / error.block);
        diverging(error.signed[y * error.columns + x])
    });
    write_png(&folder.join("error.png"), image, pixels)
}

fn write_png(path: &Path, size: &Picture, pixels: impl Iterator<Item = Pixel>) -> io::Result<()> {
    let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "picture too large for PNG");
    let [width, height] = [size.width, size.height].map(|n| u32::try_from(n).map_err(too_large));
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), width?, height?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.collect::<Vec<_>>().as_flattened())?;
    Ok(writer.finish()?)
}

/// The value that is shown as white.
fn white(reference: &Picture) -> f64 {
    let mut values: Vec<f32> = reference.mean.iter().flatten().copied().filter(|x| x.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let highest = values.get(crate::cast::cell(UNCLIPPED, values.len().max(1)));
    highest.filter(|&&x| x > 0.0).map_or(1.0, |&x| f64::from(x))
}

/// Transfer curve of sRGB [IEC 61966-2-1].
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// From blue (-1) through white (0) to red (+1).
fn diverging(signed: f64) -> Pixel {
    let faded = level(1.0 - signed.abs());
    if signed < 0.0 { [faded, faded, 255] } else { [255, faded, faded] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_have_colours() {
        let colours = [-9.0, -1.0, 0.0, 0.5, 1.0, f64::INFINITY].map(diverging);
        let expected = [[0, 0, 255], [0, 0, 255], [255; 3], [255, 128, 128], [255, 0, 0], [255, 0, 0]];
        assert_eq!(colours, expected);
    }

    #[test]
    fn the_curve_is_continuous_and_ends_in_white() {
        assert!((srgb(0.003_130_8) - srgb(0.003_130_9)).abs() < 1e-5);
        assert!((srgb(1.0) - 1.0).abs() < 1e-12 && (srgb(0.214_041_14) - 0.5).abs() < 1e-6);
        let dark = Picture::new(2, 1, vec![[0.0; 3], [f32::NAN; 3]], None);
        assert_eq!(white(&dark), 1.0);
    }
}
