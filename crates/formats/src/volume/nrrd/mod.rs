//! NRRD, versions 1 to 5, as defined by Teem: a text header, with the samples after it or in files that it names.

mod header;
mod orientation;
#[cfg(test)]
mod tests;

use super::detached;
use super::error::ReadError;
use super::fields::Fields;
use super::layout::{Axis, Layout, Samples};
use super::sample_type::{Endian, SampleType};
use super::stream::{self, Coding, Start, Stream};
use super::{Loaded, Parsed};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use tyndall::volume::ValueMap;

/// Reads a `.nrrd` or `.nhdr` file.
pub(super) fn read(path: &Path) -> Result<Loaded, ReadError> {
    let mut file = stream::open(path)?;
    let header::Header { fields, listed } = header::read(path, &mut file)?;
    let shape = orientation::Shape::new(&fields)?;
    let grid = shape.grid(&fields)?;
    let (coding, text) = encoding(&fields)?;
    let sample = sample_type(&fields)?;
    let endian = endian(&fields, sample, text)?;
    let layout = Layout { text, ..Layout::new(path, "sizes", shape.axes.clone(), sample, endian)? };
    let data = Data { coding, skip: Skip::new(&fields)? };
    let Samples { voxels, notes: found } = match fields.get(&["data file"]) {
        None => layout.read(path, data.open(path, file, layout.bytes())?)?,
        Some(value) => {
            let slowest = layout.axes.last().map_or(1, |(n, _)| *n);
            let names = detached::names(path, "data file", value, listed, slowest)?;
            detached::read(path, &names, &layout, |path, needed| {
                data.open(path, stream::open(path)?, needed)
            })?
        }
    };
    let (channels, times) = (layout.count(Axis::Channel), layout.count(Axis::Time));
    let notes = shape.notes.into_iter().chain(found).collect();
    Parsed { grid, voxels, values: ValueMap::IDENTITY, channels, times, notes }.load(path)
}

/// How to get from a data file to its samples.
struct Data {
    coding: Coding,
    skip: Skip,
}

impl Data {
    fn open(
        &self,
        path: &Path,
        mut file: BufReader<File>,
        needed: u64,
    ) -> Result<Stream<'static>, ReadError> {
        // Lines are counted before decompression, bytes after it.
        for _ in 0..self.skip.lines {
            let end = skip_line(&mut file).map_err(|source| ReadError::io(path, source))?;
            if end {
                return Err(ReadError::Short { path: path.into(), found: 0, expected: needed });
            }
        }
        stream::samples(path, file, self.coding, self.skip.bytes, needed)
    }
}

/// What to skip before the samples of a data file.
struct Skip {
    lines: u64,
    bytes: Start,
}

impl Skip {
    fn new(fields: &Fields) -> Result<Self, ReadError> {
        let lines = fields.one(&["line skip"], "a number of lines")?.unwrap_or(0);
        let bytes: i64 = fields.one(&["byte skip"], "a number of bytes, or -1")?.unwrap_or(0);
        let bytes = match (bytes, u64::try_from(bytes)) {
            (_, Ok(bytes)) => Start::After(bytes),
            (-1, _) => Start::AtEnd,
            _ => {
                let found = bytes.to_string();
                return Err(ReadError::header(
                    fields.path,
                    "byte skip",
                    &found,
                    "0, a positive number, or -1",
                ));
            }
        };
        Ok(Self { lines, bytes })
    }
}

/// Skips a line of any length; true if the file had already ended.
fn skip_line(file: &mut BufReader<File>) -> std::io::Result<bool> {
    let mut read = 0;
    for byte in file.by_ref().bytes() {
        read += 1;
        if byte? == b'\n' {
            break;
        }
    }
    Ok(read == 0)
}

fn encoding(fields: &Fields) -> Result<(Coding, bool), ReadError> {
    let names = "raw, ascii, gzip or bzip2";
    let name = fields.need(&["encoding"], names)?.to_lowercase();
    Ok(match name.as_str() {
        "raw" => (Coding::Raw, false),
        "ascii" | "text" | "txt" => (Coding::Raw, true),
        "gzip" | "gz" => (Coding::Gzip, false),
        "bzip2" | "bz2" => (Coding::Bzip2, false),
        "hex" | "zrl" => {
            let fix = format!("convert the file to {names}, e.g. with `unu save -f nrrd -e gzip`");
            return Err(ReadError::unsupported(fields.path, format!("encoding `{name}`"), fix));
        }
        _ => return Err(ReadError::header(fields.path, "encoding", &name, names)),
    })
}

fn endian(fields: &Fields, sample: SampleType, text: bool) -> Result<Endian, ReadError> {
    if sample.size() == 1 || text {
        return Ok(Endian::NATIVE);
    }
    let expected = "little or big, required for samples of several bytes";
    let name = fields.need(&["endian"], expected)?.to_lowercase();
    name.parse().map_err(|_| ReadError::header(fields.path, "endian", &name, expected))
}

fn sample_type(fields: &Fields) -> Result<SampleType, ReadError> {
    let expected = "int8, uint8, int16, uint16, int32, uint32, float or double";
    let name = fields.need(&["type"], expected)?.to_lowercase();
    let words: Vec<&str> = name.split_whitespace().collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => SampleType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => SampleType::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => SampleType::U16,
        "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t"
        | "ulonglong"
        | "unsigned long long"
        | "unsigned long long int"
        | "uint64"
        | "uint64_t"
        | "block" => {
            let fix = format!("convert the samples to {expected}, e.g. with `unu convert -t int32`");
            return Err(ReadError::unsupported(fields.path, format!("type `{name}`"), fix));
        }
        _ => return Err(ReadError::header(fields.path, "type", &name, expected)),
    })
}
