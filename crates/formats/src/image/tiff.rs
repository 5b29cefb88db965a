//! TIFF: 8 bits, sRGB, deflated; straight alpha if the picture is transparent; metadata as JSON in ImageDescription.

use std::io::{BufRead, Cursor, ErrorKind, Read, Seek, SeekFrom};

use tiff::TiffError;
use tiff::encoder::colortype::RGB8;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder};
use tiff::tags::{ExtraSamples, Tag, Type};

use super::error::EncodeFailure;
use super::{Metadata, Picture, Tone, display};

/// Most bytes of text that are read from one picture, whatever the file's length.
const TEXT_LIMIT: u64 = 64 << 20;

pub(super) fn encode(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, EncodeFailure> {
    try_encode(picture, tone, metadata).map_err(|error| EncodeFailure::library(&error))
}

fn try_encode(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, TiffError> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder =
        TiffEncoder::new(&mut file)?.with_compression(Compression::Deflate(DeflateLevel::Balanced));
    let mut image = encoder.new_image::<RGB8>(picture.width, picture.height)?;
    if !metadata.is_empty() {
        image.encoder().write_tag(Tag::ImageDescription, metadata.to_ascii_json().as_str())?;
    }
    if picture.transparent {
        image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?;
        image.write_data(&display::straight_rgba8(picture, tone))?;
    } else {
        image.write_data(&display::rgb8(picture, tone))?;
    }
    Ok(file.into_inner())
}

/// The text of the first directory's ImageDescription.
///
/// Given a damaged file, the library prints to standard error and allocates more memory than the file holds, so the
/// few fields needed are read here. Tyndall does not write BigTIFF.
pub(super) fn read_metadata(mut file: impl BufRead + Seek, length: u64) -> Result<Metadata, String> {
    let mut order = [0; 4];
    file.read_exact(&mut order).map_err(read_error)?;
    let mut fields = Directory { file, little: order[0] == b'I' };
    if (if fields.little { order[2] } else { order[3] }) == 43 {
        return Ok(Metadata::default());
    }
    let directory = fields.u32()?;
    fields.file.seek(SeekFrom::Start(directory.into())).map_err(read_error)?;
    for _ in 0..fields.u16()? {
        let [tag, kind] = [fields.u16()?, fields.u16()?];
        let [count, place] = [fields.u32()?, fields.u32()?];
        // A text of four bytes or fewer would be stored in `place` itself, and cannot be ours.
        if tag != Tag::ImageDescription.to_u16() || kind != Type::ASCII.to_u16() || count <= 4 {
            continue;
        }
        if u64::from(place) + u64::from(count) > length || u64::from(count) > TEXT_LIMIT {
            return Err(format!(
                "found a description of {count} bytes at {place}, expected it within the file"
            ));
        }
        fields.file.seek(SeekFrom::Start(place.into())).map_err(read_error)?;
        let mut text = vec![0; count as usize];
        fields.file.read_exact(&mut text).map_err(read_error)?;
        let text = text.split(|&b| b == 0).next().unwrap_or_default();
        // A description that is not our JSON is another program's.
        return Ok(std::str::from_utf8(text).ok().and_then(Metadata::from_json).unwrap_or_default());
    }
    Ok(Metadata::default())
}

/// Reads consecutive numbers in the file's byte order.
struct Directory<F> {
    file: F,
    little: bool,
}

impl<F: Read> Directory<F> {
    fn u16(&mut self) -> Result<u16, String> {
        let mut bytes = [0; 2];
        self.file.read_exact(&mut bytes).map_err(read_error)?;
        Ok(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn u32(&mut self) -> Result<u32, String> {
        let mut bytes = [0; 4];
        self.file.read_exact(&mut bytes).map_err(read_error)?;
        Ok(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }
}

#[expect(clippy::needless_pass_by_value, reason = "the signature that `map_err` needs")]
fn read_error(error: std::io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => "the file ends inside its directory".to_owned(),
        _ => error.to_string(),
    }
}
