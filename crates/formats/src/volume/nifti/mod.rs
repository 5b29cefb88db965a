//! NIfTI-1 and NIfTI-2: a binary header, with the samples after it (`.nii`) or in a second file (`.hdr`, `.img`).

mod header;
mod orientation;
#[cfg(test)]
mod tests;

use super::error::ReadError;
use super::layout::{Axis, Layout, Samples};
use super::members::GZIP;
use super::sample_type::SampleType;
use super::stream::{self, Coding, Start};
use super::{Loaded, Parsed};
pub(super) use header::recognises;
use header::{Header, Storage};
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use tyndall::message::path_name;
use tyndall::volume::ValueMap;

/// Reads a `.nii`, `.hdr` or `.img` file, also compressed with gzip.
pub(super) fn read(path: &Path) -> Result<Loaded, ReadError> {
    let header_path = if has_extension(path, "img") { other_file(path, "hdr")? } else { path.to_path_buf() };
    let path = header_path.as_path();
    let mut notes = Vec::new();
    let header = Header::parse(path, &stream::first_bytes(path)?)?;
    let grid = orientation::grid(path, &header, &mut notes)?;
    let (sample, components) = sample_type(path, header.datatype)?;
    let [x, y, z, times, channels @ ..] = header.dims;
    let mut axes = vec![(components, Axis::Channel), (x, Axis::Space), (y, Axis::Space), (z, Axis::Space)];
    axes.push((times, Axis::Time));
    axes.extend(channels.map(|n| (n, Axis::Channel)));
    let layout = Layout::new(path, "dim", axes, sample, header.endian)?;
    let values = if components == 1 { scaling(path, &header)? } else { ValueMap::IDENTITY };
    let read_from = |data: &Path| {
        let (file, coding) = open(data)?;
        let samples = stream::samples(data, file, coding, Start::After(header.offset), layout.bytes())?;
        layout.read(data, samples)
    };
    let Samples { voxels, notes: found } = match header.storage {
        Storage::Single => read_from(path)?,
        Storage::Pair => read_from(&other_file(path, "img")?).map_err(|error| error.in_data_file(path))?,
    };
    notes.extend(found);
    let (channels, times) = (layout.count(Axis::Channel), layout.count(Axis::Time));
    Parsed { grid, voxels, values, channels, times, notes }.load(path)
}

fn open(path: &Path) -> Result<(BufReader<File>, Coding), ReadError> {
    let mut file = stream::open(path)?;
    let start = file.fill_buf().map_err(|source| ReadError::io(path, source))?;
    let coding = if start.starts_with(&GZIP) { Coding::Gzip } else { Coding::Raw };
    Ok((file, coding))
}

/// The type of a sample and its number of components.
fn sample_type(path: &Path, code: i32) -> Result<(SampleType, usize), ReadError> {
    let what = match code {
        2 => return Ok((SampleType::U8, 1)),
        4 => return Ok((SampleType::I16, 1)),
        8 => return Ok((SampleType::I32, 1)),
        16 => return Ok((SampleType::F32, 1)),
        64 => return Ok((SampleType::F64, 1)),
        128 => return Ok((SampleType::U8, 3)),
        256 => return Ok((SampleType::I8, 1)),
        512 => return Ok((SampleType::U16, 1)),
        768 => return Ok((SampleType::U32, 1)),
        2304 => return Ok((SampleType::U8, 4)),
        1 => "binary",
        32 => "complex64",
        1024 => "int64",
        1280 => "uint64",
        1536 => "float128",
        1792 => "complex128",
        2048 => "complex256",
        _ => {
            return Err(ReadError::header(
                path,
                "datatype",
                &code.to_string(),
                "a code of the NIfTI standard",
            ));
        }
    };
    let fix = "convert the samples to float32, e.g. with nibabel's `set_data_dtype`";
    Err(ReadError::unsupported(path, format!("datatype {code} ({what})"), fix))
}

/// Slope and intercept; a slope that is zero or not finite means no scaling.
fn scaling(path: &Path, header: &Header) -> Result<ValueMap, ReadError> {
    let Header { slope, intercept, .. } = *header;
    if !slope.is_finite() || slope == 0.0 {
        return Ok(ValueMap::IDENTITY);
    }
    if !intercept.is_finite() {
        let expected = "a finite number, because scl_slope is set";
        return Err(ReadError::header(path, "scl_inter", &intercept.to_string(), expected));
    }
    Ok(ValueMap { slope, intercept })
}

/// Whether the name has this extension, ignoring case and a final `.gz`.
fn has_extension(path: &Path, extension: &str) -> bool {
    split(path).1.eq_ignore_ascii_case(extension)
}

/// The path without extensions, and the extension before any `.gz`.
fn split(path: &Path) -> (PathBuf, String) {
    let bare = match path.extension() {
        Some(e) if e.eq_ignore_ascii_case("gz") => path.with_extension(""),
        _ => path.to_path_buf(),
    };
    let extension = bare.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    (bare.with_extension(""), extension)
}

/// The other file of a pair: the same name with another extension. If this file is compressed, a compressed
/// one is tried first.
fn other_file(path: &Path, extension: &str) -> Result<PathBuf, ReadError> {
    let stem = split(path).0;
    let upper = extension.to_uppercase();
    let mut endings =
        [extension.to_string(), format!("{extension}.gz"), upper.clone(), format!("{upper}.GZ")];
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
        endings.swap(0, 1);
        endings.swap(2, 3);
    }
    for ending in endings {
        let mut name = OsString::from(stem.as_os_str());
        name.push(".");
        name.push(ending);
        let candidate = PathBuf::from(name);
        if candidate.is_file() {
            return Ok(candidate);
        }
    }
    let expected = format!("{}.{extension} or .{extension}.gz other_file it", path_name(&stem));
    Err(ReadError::missing(path, "the other file of the pair", &expected))
}
