//! The texels of an environment map, and why they could not be read.

use tyndall::math::Rgb;

/// Linear radiance in Rec. 709 primaries, rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Every texel; each channel from 0 to [`BRIGHTEST`](tyndall::light::BRIGHTEST).
    pub pixels: Vec<Rgb>,
}

/// Most texels of a map: 16384 x 16384, 3 GiB.
pub(super) const MOST_TEXELS: u64 = 1 << 28;

impl Map {
    /// Refuses a size of zero or above the limit, before memory is allocated for it.
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

/// Why a map could not be read; the path is added later.
#[derive(Debug)]
pub(super) enum MapFailure {
    TooLarge { width: u64, height: u64 },
    Malformed(String),
}
