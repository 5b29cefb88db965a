//! How much memory it takes to write a picture.

use super::Kind;
use std::path::Path;

/// Bytes for each pixel of the picture itself: colour, opacity, variance and depth in single precision.
const PICTURE: u64 = 32;

/// Bytes for each pixel of an 8-bit picture while it is written: its codes, an encoder's copy (JPEG: 2 bytes for each of three
/// coefficients, in a list that may have doubled), and what is coded, also in a list that may have doubled. Noise cannot be compressed.
const CODES: u64 = 32;

/// Copies of an OpenEXR file's channels: the encoder's, and the coded file in a list that may have doubled, and is then copied.
const COPIES: u64 = 4;

/// For headers, tables, blocks on their way through threads, and the threads.
const BESIDES: u64 = 32 << 20;

/// Upper bound of the bytes that a picture takes from when it leaves the film to when it is written, in the kind given by the path's
/// extension; PNG if it has none. `state` is the number of bytes of samples for each pixel that an OpenEXR file is to hold.
#[must_use]
pub fn bytes_to_write(path: &Path, pixels: u64, state: u64) -> u64 {
    let each = match Kind::of_extension(path) {
        // The state leaves the film in double precision.
        Some(Kind::Exr) => (PICTURE + state).saturating_mul(1 + COPIES),
        Some(Kind::Png | Kind::Jpeg | Kind::Tiff) | None => PICTURE + CODES,
    };
    pixels.saturating_mul(each).saturating_add(BESIDES)
}
