//! OpenEXR: linear radiance in 32-bit float, compressed without loss.
//!
//! One part whose channels are named by layer, as other programs expect: `R G B A` premultiplied,
//! `variance.R variance.G variance.B` of the pixel's mean, `depth.Z`, and the layers of the samples' state. Metadata are string
//! attributes in UTF-8.

use std::io::{BufRead, Cursor, Seek};

use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, ChannelList, Compression, LineOrder, Text};
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use tyndall::film::{StateLayer, StateValues};
use tyndall::math::Rgb;

use super::error::EncodeFailure;
use super::texels::{Map, MapFailure};
use super::{Metadata, Picture, PictureState};

const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: exr::image::Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

pub(super) fn encode(picture: &Picture, metadata: &Metadata) -> Result<Vec<u8>, EncodeFailure> {
    let mut channels = Vec::new();
    for (index, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        channels.push(channel(name, picture.rgba.iter().map(|pixel| pixel[index])));
    }
    if let Some(variance) = &picture.variance {
        for (index, name) in ["variance.R", "variance.G", "variance.B"].into_iter().enumerate() {
            channels.push(channel(name, variance.iter().map(|pixel| pixel[index])));
        }
    }
    if let Some(depth) = &picture.depth {
        channels.push(channel("depth.Z", depth.iter().copied()));
    }
    for StateLayer { name, values } in &picture.state {
        let samples = match values {
            StateValues::Float(values) => FlatSamples::F32(values.clone()),
            StateValues::Whole(values) => FlatSamples::U32(values.clone()),
        };
        let name = format!("{STATE}{name}");
        channels.push(AnyChannel { quantize_linearly: false, ..AnyChannel::new(name.as_str(), samples) });
    }
    let size = Vec2(picture.width as usize, picture.height as usize);
    let mut image = Image::from_encoded_channels(size, ENCODING, AnyChannels::sort(channels.into()));
    for (key, text) in metadata.iter() {
        let text = AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()));
        image.attributes.other.insert(Text::from(key), text);
    }
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).map_err(|error| EncodeFailure::library(&error))?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn channel(name: &str, samples: impl Iterator<Item = f32>) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(samples.collect()))
}

/// Puts the header's attributes in the order of their names.
///
/// The library keeps custom ones in a randomly seeded hash table; the same picture must give the same bytes.
fn sort_attributes(file: &mut [u8]) {
    let start = 8; // after magic number and version
    let mut end = start;
    let mut attributes = Vec::new();
    while file[end] != 0 {
        let mut value = end;
        for _name_then_type in 0..2 {
            value += 1 + file[value..].iter().position(|&b| b == 0).expect("names end with zero");
        }
        let size = [file[value], file[value + 1], file[value + 2], file[value + 3]];
        let next = value + 4 + u32::from_le_bytes(size) as usize;
        attributes.push(file[end..next].to_vec());
        end = next;
    }
    attributes.sort();
    file[start..end].copy_from_slice(&attributes.concat());
}

pub(super) fn read_metadata(file: impl BufRead) -> Result<Metadata, String> {
    let headers = MetaData::read_from_buffered(file, false).map_err(|error| error.to_string())?.headers;
    let mut found: Vec<_> = headers
        .iter()
        .flat_map(|header| header.shared_attributes.other.iter().chain(&header.own_attributes.other))
        .filter_map(|(name, value)| Some((name.to_string(), value.to_text().ok()?)))
        .collect();
    found.sort_by(|(one, _), (other, _)| one.cmp(other));
    let mut metadata = Metadata::default();
    for (key, text) in found {
        metadata.accept(&key, String::from_utf8_lossy(text.as_slice()).into_owned());
    }
    Ok(metadata)
}

/// Begins the names of the channels with the samples' state.
const STATE: &str = "state.";

/// The size and the layers of the samples' state.
pub(super) fn read_state(mut file: impl BufRead + Seek, length: u64) -> Result<PictureState, MapFailure> {
    let malformed = |error: exr::error::Error| MapFailure::Malformed(error.to_string());
    let headers = MetaData::read_from_buffered(&mut file, false).map_err(malformed)?.headers;
    let [header] = headers.as_slice() else {
        let found = format!("found {} images in one file, expected one", headers.len());
        return Err(MapFailure::Malformed(found));
    };
    check_size(header, length)?;
    let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
    // The library's copy of the pixels, and ours.
    let needed = 2 * (width * height).saturating_mul(header.channels.bytes_per_pixel as u64);
    if crate::memory::available().is_some_and(|available| needed > available) {
        return Err(MapFailure::TooLarge { width, height });
    }
    file.rewind().map_err(|error| MapFailure::Malformed(error.to_string()))?;
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(malformed)?;
    let of_channel = |channel: AnyChannel<FlatSamples>| {
        let name = channel.name.to_string();
        let values = match channel.sample_data {
            FlatSamples::F32(values) => StateValues::Float(values),
            FlatSamples::U32(values) => StateValues::Whole(values),
            FlatSamples::F16(_) => return None,
        };
        name.strip_prefix(STATE).map(|name| StateLayer { name: name.to_owned(), values })
    };
    let layers = image.layer_data.channel_data.list.into_iter().filter_map(of_channel).collect();
    // Both are within the limits of a map.
    let size = [width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    Ok(PictureState { size, layers })
}

/// The largest compression ratio of the format's codecs. Deflate, the best, reaches 1032; the lossy DCT of DWA
/// leaves it 1 of 64 coefficients of a flat field.
const SHRINKS_LOSSLESS: u64 = 1100;
const SHRINKS_DCT: u64 = 64 * SHRINKS_LOSSLESS;

/// The first layer that has red, green and blue, by plain names or by `layer.R` and so on.
pub(super) fn read_map(mut file: impl BufRead + Seek, length: u64) -> Result<Map, MapFailure> {
    let malformed = |error: exr::error::Error| MapFailure::Malformed(error.to_string());
    let headers = MetaData::read_from_buffered(&mut file, false).map_err(malformed)?.headers;
    let mut layers = headers.iter().filter(|header| !header.deep);
    let found = layers.find_map(|header| Some((header, rgb_names(&header.channels)?)));
    let Some((header, [red, green, blue])) = found else {
        let names = headers.iter().flat_map(|header| header.channels.list.iter().map(|c| c.name.to_string()));
        let names = names.take(20).collect::<Vec<_>>().join(", ");
        return Err(MapFailure::Malformed(format!("found channels {names}, expected R, G and B")));
    };
    // All are checked, because the library chooses the layer by its own rule.
    headers.iter().try_for_each(|header| check_size(header, length))?;
    if header.shared_attributes.display_window != header.data_window() {
        let reason =
            "found pixels that do not cover the frame (data and display window differ), expected a whole map";
        return Err(MapFailure::Malformed(reason.to_owned()));
    }

    file.rewind().map_err(|error| MapFailure::Malformed(error.to_string()))?;
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(red)
        .required(green)
        .required(blue)
        .collect_pixels(
            |size, _| (size.width(), vec![Rgb::BLACK; size.area()]),
            |(width, pixels): &mut (usize, Vec<Rgb>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = Rgb::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(malformed)?;
    let size = image.layer_data.size;
    Ok(Map { width: size.width(), height: size.height(), pixels: image.layer_data.channel_data.pixels.1 })
}

fn rgb_names(channels: &ChannelList) -> Option<[Text; 3]> {
    let whole = |name: &str| channels.list.iter().any(|c| c.name.eq(name) && c.sampling == Vec2(1, 1));
    let names = channels.list.iter().map(|channel| channel.name.to_string());
    let mut layers: Vec<_> = names.filter_map(|name| Some(name.strip_suffix('R')?.to_owned())).collect();
    layers.retain(|layer| layer.is_empty() || layer.ends_with('.'));
    layers.sort();
    layers.into_iter().map(|layer| ["R", "G", "B"].map(|c| format!("{layer}{c}"))).find_map(|names| {
        names.iter().all(|name| whole(name)).then(|| names.map(|name| Text::from(name.as_str())))
    })
}

/// Tiles of up to this many pixels are accepted even if they exceed the picture.
const LARGEST_TILE: u64 = 1 << 20;

fn check_size(header: &Header, length: u64) -> Result<(), MapFailure> {
    let [width, height] = [header.layer_size.width() as u64, header.layer_size.height() as u64];
    Map::check_size(width, height)?;
    let shrinks = match header.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => SHRINKS_DCT,
        _ => SHRINKS_LOSSLESS,
    };
    let bytes = (width * height).saturating_mul(header.channels.bytes_per_pixel as u64);
    // The library allocates whole tiles, even where the picture is smaller.
    if let BlockDescription::Tiles(tiles) = header.blocks {
        let [across, down] = [tiles.tile_size.width() as u64, tiles.tile_size.height() as u64];
        if across.saturating_mul(down) > LARGEST_TILE.max(width * height) {
            let found = format!("found tiles of {across} x {down} for {width} x {height} pixels");
            return Err(MapFailure::Malformed(format!("{found}, expected tiles within the picture")));
        }
    }
    if bytes / shrinks > length {
        let found = format!("{length} bytes for {width} x {height} pixels");
        return Err(MapFailure::Malformed(format!(
            "found {found}, expected more: the file is cut off or its header is wrong"
        )));
    }
    Ok(())
}
