//! TIFF: 8 bits, sRGB, deflated; opacity straight where the picture is transparent; metadata as JSON in ImageDescription.

use std::io::{BufRead, Cursor, Seek};

use tiff::TiffError;
use tiff::decoder::{Decoder, Limits};
use tiff::encoder::colortype::RGB8;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder};
use tiff::tags::{ExtraSamples, Tag};

use super::error::EncodeFailure;
use super::{Display, Metadata, Picture, display};

/// Most bytes of text that are read from one picture, however long the file is.
const TEXT_LIMIT: u64 = 64 << 20;

pub(super) fn encode(
    picture: &Picture,
    display: &Display,
    metadata: &Metadata,
) -> Result<Vec<u8>, EncodeFailure> {
    try_encode(picture, display, metadata).map_err(|error| EncodeFailure::library(&error))
}

fn try_encode(picture: &Picture, display: &Display, metadata: &Metadata) -> Result<Vec<u8>, TiffError> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder =
        TiffEncoder::new(&mut file)?.with_compression(Compression::Deflate(DeflateLevel::Balanced));
    let mut image = encoder.new_image::<RGB8>(picture.width, picture.height)?;
    if !metadata.is_empty() {
        image.encoder().write_tag(Tag::ImageDescription, metadata.to_ascii_json().as_str())?;
    }
    if picture.transparent {
        image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?;
        image.write_data(&display::straight_rgba8(picture, display))?;
    } else {
        image.write_data(&display::rgb8(picture, display))?;
    }
    Ok(file.into_inner())
}

pub(super) fn read_metadata(file: impl BufRead + Seek, length: u64) -> Result<Metadata, String> {
    let mut limits = Limits::default();
    limits.ifd_value_size = usize::try_from(length.min(TEXT_LIMIT)).unwrap_or(usize::MAX);
    let mut decoder = Decoder::new(file).map_err(|error| error.to_string())?.with_limits(limits);
    let description = decoder.find_tag(Tag::ImageDescription).map_err(|error| error.to_string())?;
    // A description that is not our JSON is another program's.
    let ours =
        description.and_then(|value| value.into_string().ok()).and_then(|text| Metadata::from_json(&text));
    Ok(ours.unwrap_or_default())
}
