//! Environment maps: radiance by direction, read from files.

use std::path::Path;

use tyndall::light::BRIGHTEST;
use tyndall::math::Rgb;

use super::error::ImageError;
use super::{exr, lower_extension, open, radiance};

/// Linear radiance in Rec. 709 primaries, rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Every texel; each channel from 0 to [`BRIGHTEST`].
    pub pixels: Vec<Rgb>,
}

/// Most texels of a map: 16384 x 16384, 3 GiB.
const MOST_TEXELS: u64 = 1 << 28;

impl Map {
    /// Refuses a size that no map has, before memory is taken for it.
    pub(super) fn check_size(width: u64, height: u64) -> Result<(), MapFailure> {
        if width == 0 || height == 0 {
            return Err(MapFailure::Malformed(format!(
                "found {width} x {height} pixels, expected at least one"
            )));
        }
        if width.saturating_mul(height) > MOST_TEXELS {
            return Err(MapFailure::TooLarge { width, height });
        }
        Ok(())
    }
}

/// Why a map's reader gave up, before the file is known.
#[derive(Debug)]
pub(super) enum MapFailure {
    TooLarge { width: u64, height: u64 },
    Malformed(String),
}

/// Reads an environment map: OpenEXR (.exr, the first layer with R, G and B) or Radiance (.hdr).
///
/// # Errors
/// [`ImageError::Extension`] for another kind, [`ImageError::Unreadable`] if the disk refuses,
/// [`ImageError::Malformed`] for a damaged file, [`ImageError::TooLarge`] beyond 2^28 texels,
/// [`ImageError::Texel`] for one that is negative, undefined or beyond [`BRIGHTEST`].
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
            mend: "scale the map down",
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
