//! PNG: 8 bits, sRGB; straight alpha if the picture is transparent; metadata as compressed UTF-8 texts (iTXt).

use std::io::{BufRead, Seek, Write};

use png::text_metadata::ITXtChunk;
use png::{BitDepth, ColorType, Decoder, Encoder, EncodingError, SrgbRenderingIntent, Writer};

use super::error::EncodeFailure;
use super::metadata::{Metadata, is_own};
use super::{Picture, Tone, display};

/// Most bytes of text that are decompressed from one picture.
const TEXT_LIMIT: usize = 64 << 20;

pub(super) fn encode(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, EncodeFailure> {
    try_encode(picture, tone, metadata).map_err(|error| EncodeFailure::library(&error))
}

fn try_encode(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let encoder = Encoder::new(&mut bytes, picture.width, picture.height);
    let mut writer = begin(encoder, picture.transparent, metadata)?;
    let pixels = if picture.transparent {
        display::straight_rgba8(picture, tone)
    } else {
        display::rgb8(picture, tone)
    };
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// Writes what comes before the pixels.
pub(super) fn begin<W: Write>(
    mut encoder: Encoder<'_, W>,
    transparent: bool,
    metadata: &Metadata,
) -> Result<Writer<W>, EncodingError> {
    encoder.set_color(if transparent { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    for (key, text) in metadata.iter() {
        let mut chunk = ITXtChunk::new(key, text);
        chunk.compressed = true;
        writer.write_text_chunk(&chunk)?;
    }
    Ok(writer)
}

pub(super) fn encode_codes([width, height]: [u32; 2], codes: &[[u8; 3]]) -> Result<Vec<u8>, EncodeFailure> {
    let encode = || {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(codes.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    };
    encode().map_err(|error: EncodingError| EncodeFailure::library(&error))
}

pub(super) fn read_metadata(file: impl BufRead + Seek) -> Result<Metadata, String> {
    let decoder = Decoder::new_with_limits(file, png::Limits { bytes: TEXT_LIMIT });
    let reader = decoder.read_info().map_err(|error| error.to_string())?;
    let mut metadata = Metadata::default();
    let mut left = TEXT_LIMIT;
    for chunk in reader.info().utf8_text.iter().filter(|chunk| is_own(&chunk.keyword)) {
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(left).map_err(|error| error.to_string())?;
        let text = chunk.get_text().map_err(|error| error.to_string())?;
        left = left.saturating_sub(text.len());
        metadata.accept(&chunk.keyword, text);
    }
    Ok(metadata)
}
