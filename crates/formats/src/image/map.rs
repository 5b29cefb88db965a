//! Environment maps: radiance by direction, read from files.

use std::path::Path;

use tyndall::light::BRIGHTEST;

use super::error::ImageError;
use super::texels::{MOST_TEXELS, Map, MapFailure};
use super::{exr, lower_extension, open, radiance};

/// Reads an environment map: OpenEXR (.exr, the first layer with R, G and B) or Radiance (.hdr).
///
/// # Errors
/// [`ImageError::Extension`] for another kind, [`ImageError::Unreadable`] if the file cannot be read,
/// [`ImageError::Malformed`] for a damaged file, [`ImageError::TooLarge`] beyond 2^28 texels,
/// [`ImageError::Texel`] for one that is negative, NaN or above [`BRIGHTEST`].
pub fn read_map(path: &Path) -> Result<Map, ImageError> {
    let extension = lower_extension(path);
    let kind = match extension.as_str() {
        "exr" => "OpenEXR",
        "hdr" => "Radiance",
        _ => return Err(ImageError::extension(path, ".exr or .hdr")),
    };
    let (file, length) = open(path)?;
    let read =
        if extension == "exr" { exr::read_map(file, length) } else { radiance::read_map(file, length) };
    let map = read.map_err(|failure| match failure {
        MapFailure::Malformed(reason) => ImageError::malformed(path, kind, reason),
        MapFailure::TooLarge { width, height } => ImageError::TooLarge {
            path: path.to_owned(),
            width,
            height,
            limit: format!("{MOST_TEXELS} in all"),
            fix: "scale the map down",
        },
    })?;
    let fits = |x: f32| (0.0..=BRIGHTEST).contains(&x);
    match map.pixels.iter().position(|p| !p.to_array().into_iter().all(fits)) {
        Some(bad) => Err(ImageError::Texel {
            path: path.to_owned(),
            x: bad % map.width,
            y: bad / map.width,
            value: map.pixels[bad].to_array(),
        }),
        None => Ok(map),
    }
}
