//! MetaImage as ITK reads it: a text header, and the samples after it (`.mha`) or in files that it names (`.mhd`).

mod header;
#[cfg(test)]
mod tests;

use super::detached;
use super::error::ReadError;
use super::fields::Fields;
use super::layout::{Axis, Layout, Samples};
use super::placement;
use super::sample_type::{Endian, SampleType};
use super::stream::{self, Coding, Start};
use super::{Loaded, Parsed};
pub(super) use header::recognises;
use std::path::Path;
use tyndall::volume::{Grid, Space, ValueMap};

/// Most axes that MetaImage allows.
const MOST_AXES: usize = 10;

/// Reads a `.mha` or `.mhd` file.
pub(super) fn read(path: &Path) -> Result<Loaded, ReadError> {
    let mut file = stream::open(path)?;
    let header::Header { fields, listed } = header::read(path, &mut file)?;
    let sizes = sizes(&fields)?;
    let grid = grid(&fields, &sizes)?;
    let channels = fields.one(&["ElementNumberOfChannels"], "a number of at least 1")?.unwrap_or(1);
    let mut axes = vec![(channels, Axis::Channel)];
    axes.extend(sizes.iter().enumerate().map(|(i, &n)| (n, if i < 3 { Axis::Space } else { Axis::Time })));
    let text = !parse_bool(&fields, &["BinaryData"], true)?;
    let layout = Layout::new(path, "DimSize", axes, sample_type(&fields)?, endian(&fields)?)?;
    let layout = Layout { text, ..layout };
    let coding = if parse_bool(&fields, &["CompressedData"], false)? { Coding::Zlib } else { Coding::Raw };
    let start = match fields.one::<i64>(&["HeaderSize"], "a number of bytes, or -1")? {
        None | Some(0) => None,
        Some(-1) => Some(Start::AtEnd),
        Some(n) => match u64::try_from(n) {
            Ok(n) => Some(Start::After(n)),
            Err(_) => {
                return Err(ReadError::header(
                    path,
                    "HeaderSize",
                    &n.to_string(),
                    "a number of bytes, or -1",
                ));
            }
        },
    };
    let value = fields.need(&["ElementDataFile"], "LOCAL, or the name of the file with the samples")?;
    let Samples { voxels, notes } = if value.eq_ignore_ascii_case("LOCAL") {
        // `HeaderSize` counts from the beginning of the file.
        let file = if start.is_some() { stream::open(path)? } else { file };
        let start = start.unwrap_or(Start::After(0));
        layout.read(path, stream::samples(path, file, coding, start, layout.bytes())?)?
    } else {
        let names = detached::names(path, "ElementDataFile", value, listed, *sizes.last().unwrap_or(&1))?;
        let start = start.unwrap_or(Start::After(0));
        detached::read(path, &names, &layout, |path, needed| {
            stream::samples(path, stream::open(path)?, coding, start, needed)
        })?
    };
    let values = ValueMap {
        slope: number(&fields, "ElementToIntensityFunctionSlope", 1.0)?,
        intercept: number(&fields, "ElementToIntensityFunctionOffset", 0.0)?,
    };
    let times = layout.count(Axis::Time);
    Parsed { grid, voxels, values, channels, times, notes }.load(path)
}

fn sizes(fields: &Fields) -> Result<Vec<usize>, ReadError> {
    let expected = "a number from 1 to 10";
    let count: usize = fields
        .one(&["NDims"], expected)?
        .ok_or_else(|| ReadError::missing(fields.path, "NDims", expected))?;
    if count == 0 || count > MOST_AXES {
        return Err(ReadError::header(fields.path, "NDims", &count.to_string(), expected));
    }
    let expected = "whole numbers of at least 1";
    fields
        .list(&["DimSize"], count, expected, |word| word.parse().ok().filter(|&n| n > 0))?
        .ok_or_else(|| ReadError::missing(fields.path, "DimSize", &format!("{count} {expected}")))
}

/// The grid of the first three axes. The matrix is stored axis by axis: its first `NDims` numbers
/// are the direction of the first index axis.
fn grid(fields: &Fields, sizes: &[usize]) -> Result<Grid, ReadError> {
    let count = sizes.len();
    let spacing =
        fields.numbers(&["ElementSpacing", "ElementSize"], count)?.unwrap_or_else(|| vec![1.0; count]);
    let origin =
        fields.numbers(&["Offset", "Position", "Origin"], count)?.unwrap_or_else(|| vec![0.0; count]);
    let matrix = fields.numbers(&["TransformMatrix", "Rotation", "Orientation"], count * count)?;
    let along = |axis: usize, i: usize| match &matrix {
        Some(matrix) => matrix[axis * count + i],
        None => f64::from(u8::from(axis == i)),
    };
    let step = |axis: usize| -> Option<[f64; 3]> {
        (axis < count)
            .then(|| std::array::from_fn(|i| if i < count { spacing[axis] * along(axis, i) } else { 0.0 }))
    };
    let dims = std::array::from_fn(|axis| sizes.get(axis).copied().unwrap_or(1));
    let origin = std::array::from_fn(|i| origin.get(i).copied().unwrap_or(0.0));
    // ITK states the orientation of every volume it writes; `???` or no entry means that it is unknown.
    let space = match fields.get(&["AnatomicalOrientation"]) {
        None | Some("" | "???") => Space::Plain,
        Some(_) => Space::Anatomical,
    };
    placement::grid(fields.path, dims, std::array::from_fn(step), origin, space)
}

fn number(fields: &Fields, key: &str, default: f64) -> Result<f64, ReadError> {
    Ok(fields.numbers(&[key], 1)?.map_or(default, |numbers| numbers[0]))
}

/// True or False; only the first letter counts, as in MetaIO.
fn parse_bool(fields: &Fields, keys: &[&str], default: bool) -> Result<bool, ReadError> {
    match fields.get(keys).map(|text| (text, text.chars().next())) {
        None => Ok(default),
        Some((_, Some('T' | 't' | 'Y' | 'y' | '1'))) => Ok(true),
        Some((_, Some('F' | 'f' | 'N' | 'n' | '0'))) => Ok(false),
        Some((text, _)) => Err(ReadError::header(fields.path, keys[0], text, "True or False")),
    }
}

fn endian(fields: &Fields) -> Result<Endian, ReadError> {
    let big = parse_bool(fields, &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"], false)?;
    Ok(if big { Endian::Big } else { Endian::Little })
}

fn sample_type(fields: &Fields) -> Result<SampleType, ReadError> {
    let expected = "MET_CHAR, MET_UCHAR, MET_SHORT, MET_USHORT, MET_INT, MET_UINT, MET_FLOAT or MET_DOUBLE";
    let name = fields.need(&["ElementType"], expected)?;
    // An array of channels has the type of its components.
    Ok(match name.strip_suffix("_ARRAY").unwrap_or(name) {
        "MET_CHAR" | "MET_ASCII_CHAR" => SampleType::I8,
        "MET_UCHAR" => SampleType::U8,
        "MET_SHORT" => SampleType::I16,
        "MET_USHORT" => SampleType::U16,
        // MetaIO stores its `long` in four bytes.
        "MET_INT" | "MET_LONG" => SampleType::I32,
        "MET_UINT" | "MET_ULONG" => SampleType::U32,
        "MET_FLOAT" => SampleType::F32,
        "MET_DOUBLE" => SampleType::F64,
        "MET_LONG_LONG" | "MET_ULONG_LONG" => {
            let fix = "convert the samples to MET_INT or MET_FLOAT, e.g. with SimpleITK's `Cast`";
            return Err(ReadError::unsupported(fields.path, format!("ElementType {name}"), fix));
        }
        _ => return Err(ReadError::header(fields.path, "ElementType", name, expected)),
    })
}
