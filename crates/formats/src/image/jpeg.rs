//! JPEG: 8 bits, sRGB, opaque; metadata as JSON in comment segments.
//!
//! A segment holds at most 65533 bytes, so the JSON, in ASCII, is split into parts. Part k of n is one COM
//! segment: the line `tyndall k/n`, then its part of the text. The parts follow the JFIF header in order.

use std::io::{BufRead, Read};

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::error::EncodeFailure;
use super::{Metadata, Picture, Tone, display};

/// Out of 100; the loss is not visible.
const QUALITY: u8 = 95;
/// Bytes of text in one segment; the rest of the 65533 is for the framing line.
const SHARE: usize = 65_000;

const START_OF_IMAGE: u8 = 0xD8;
const START_OF_SCAN: u8 = 0xDA;
const END_OF_IMAGE: u8 = 0xD9;
const COMMENT: u8 = 0xFE;

pub(super) fn encode(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, EncodeFailure> {
    let (Ok(width), Ok(height)) = (u16::try_from(picture.width), u16::try_from(picture.height)) else {
        let limit = "65535 x 65535 in JPEG".to_owned();
        return Err(EncodeFailure::TooLarge { width: picture.width, height: picture.height, limit });
    };
    let mut coded = Vec::new();
    let mut encoder = Encoder::new(&mut coded, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    encoder.set_optimized_huffman_tables(true);
    encoder
        .encode(&display::rgb8(picture, tone), width, height, ColorType::Rgb)
        .map_err(|error| EncodeFailure::library(&error))?;
    Ok(insert_after_header(coded, &comments(metadata)))
}

fn comments(metadata: &Metadata) -> Vec<u8> {
    if metadata.is_empty() {
        return Vec::new();
    }
    let text = metadata.to_ascii_json();
    let shares = text.as_bytes().chunks(SHARE);
    let count = shares.len();
    let mut segments = Vec::new();
    for (index, share) in shares.enumerate() {
        let framing = format!("tyndall {}/{count}\n", index + 1);
        // The length includes its own two bytes.
        let length =
            u16::try_from(2 + framing.len() + share.len()).expect("a share leaves room for its framing");
        segments.extend([0xFF, COMMENT]);
        segments.extend(length.to_be_bytes());
        segments.extend(framing.as_bytes());
        segments.extend(share);
    }
    segments
}

/// JFIF requires its own segment, which the encoder writes first, right after the start of the image.
fn insert_after_header(mut coded: Vec<u8>, segments: &[u8]) -> Vec<u8> {
    let header = usize::from(u16::from_be_bytes([coded[4], coded[5]]));
    let place = 4 + header;
    coded.splice(place..place, segments.iter().copied());
    coded
}

pub(super) fn read_metadata(mut file: impl BufRead) -> Result<Metadata, String> {
    let mut text = Vec::new();
    let mut expected = None;
    while let Some(comment) = next_comment(&mut file)? {
        let Some((part, count, share)) = parse_part(&comment) else { continue };
        let (next, parts) = expected.unwrap_or((1, count));
        if (part, count) != (next, parts) {
            return Err(format!("found metadata part {part}/{count}, expected {next}/{parts}"));
        }
        text.extend(share);
        expected = Some((next + 1, parts));
    }
    match expected {
        None => Ok(Metadata::default()),
        Some((next, parts)) if next <= parts => {
            Err(format!("expected metadata part {next}/{parts}, found none"))
        }
        Some(_) => Metadata::from_json(&String::from_utf8_lossy(&text))
            .ok_or_else(|| "the metadata in its comments is not JSON".to_owned()),
    }
}

/// The content of the next comment segment before the pixels.
fn next_comment(file: &mut impl BufRead) -> Result<Option<Vec<u8>>, String> {
    loop {
        let [lead, mut marker] = bytes(file)?;
        if lead != 0xFF {
            return Err(format!("found byte {lead:#04x}, expected a segment's 0xff"));
        }
        // Any number of 0xFF may pad a marker.
        while marker == 0xFF {
            [marker] = bytes(file)?;
        }
        match marker {
            START_OF_IMAGE => continue,
            START_OF_SCAN | END_OF_IMAGE => return Ok(None),
            _ => {}
        }
        let length = u16::from_be_bytes(bytes(file)?);
        let length = length.checked_sub(2).ok_or("a segment's length is below 2")?;
        let mut content = Vec::new();
        file.take(length.into()).read_to_end(&mut content).map_err(|error| error.to_string())?;
        if content.len() < length.into() {
            return Err(format!("the file ends inside segment {marker:#04x}"));
        }
        if marker == COMMENT {
            return Ok(Some(content));
        }
    }
}

fn bytes<const N: usize>(file: &mut impl BufRead) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).map_err(|_| "the file ends before its pixels".to_owned())?;
    Ok(bytes)
}

fn parse_part(comment: &[u8]) -> Option<(usize, usize, &[u8])> {
    let line = comment.iter().position(|&b| b == b'\n')?;
    let framing = std::str::from_utf8(&comment[..line]).ok()?.strip_prefix("tyndall ")?;
    let (part, count) = framing.split_once('/')?;
    Some((part.parse().ok()?, count.parse().ok()?, &comment[line + 1..]))
}
