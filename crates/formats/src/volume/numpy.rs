//! NumPy arrays (`.npy`, format versions 1 to 3), indexed `[z][y][x]`.
//!
//! The header is a line of Python, which is parsed here: a general NumPy library would read element by
//! element, whereas here samples are read in one block.

use super::error::ReadError;
use super::layout::{Axis, Layout, Samples, check_memory};
use super::sample_type::{Endian, SampleType};
use super::stream::{self, Coding, Start};
use super::{Loaded, Parsed};
use std::io::Read;
use std::path::Path;
use tyndall::volume::{Bricks, Grid, ValueMap, Voxels};

/// If the last of four or five axes is at most this long, it holds channels.
const MOST_CHANNELS: usize = 4;

/// Reads a `.npy` file.
pub(super) fn read(path: &Path) -> Result<Loaded, ReadError> {
    let mut file = stream::open(path)?;
    let text = header(path, &mut file)?;
    let (stored, endian) = sample_type(path, entry(path, &text, "descr")?)?;
    let fortran = match entry(path, &text, "fortran_order")? {
        value if value.starts_with("True") => true,
        value if value.starts_with("False") => false,
        value => return Err(ReadError::header(path, "fortran_order", value, "True or False")),
    };
    let shape = shape(path, entry(path, &text, "shape")?)?;
    // Axes in the order in which the array is indexed; in C order the last is fastest.
    let mut axes = meanings(path, &shape)?;
    let spatial: Vec<usize> = axes.iter().filter(|(_, a)| *a == Axis::Space).map(|(n, _)| *n).rev().collect();
    let dims = std::array::from_fn(|i| spatial.get(i).copied().unwrap_or(1));
    if !fortran {
        axes.reverse();
    }
    let layout = Layout::new(path, "shape", axes, stored.raw(), endian)?;
    let grid =
        Grid::centred(dims, [1.0; 3]).map_err(|source| ReadError::Grid { path: path.into(), source })?;
    let samples = stream::samples(path, file, Coding::Raw, Start::After(0), layout.bytes())?;
    let Samples { mut voxels, notes } = layout.read(path, samples)?;
    if stored == Stored::Half {
        let bricks = Bricks::bytes(grid.dims(), 4).unwrap_or(u64::MAX);
        check_memory(path, (4 * grid.len() as u64).saturating_add(bricks))?;
        voxels = widen(voxels);
    }
    if fortran {
        check_memory(path, grid.len() as u64 * layout.sample.size() as u64)?;
        voxels = transposed(voxels, dims);
    }
    let (channels, times) = (layout.count(Axis::Channel), layout.count(Axis::Time));
    Parsed { grid, voxels, values: ValueMap::IDENTITY, channels, times, notes }.load(path)
}

/// The dictionary before the samples, as text.
fn header(path: &Path, file: &mut dyn Read) -> Result<String, ReadError> {
    let trouble = |source| ReadError::io(path, source);
    let cut = |_| ReadError::missing(path, "header", "a NumPy header");
    let mut start = [0; 8];
    file.read_exact(&mut start).map_err(cut)?;
    let length = match (&start[..6], start[6]) {
        (b"\x93NUMPY", 1) => {
            let mut bytes = [0; 2];
            file.read_exact(&mut bytes).map_err(cut)?;
            u32::from(u16::from_le_bytes(bytes))
        }
        (b"\x93NUMPY", 2 | 3) => {
            let mut bytes = [0; 4];
            file.read_exact(&mut bytes).map_err(cut)?;
            u32::from_le_bytes(bytes)
        }
        (b"\x93NUMPY", version) => {
            return Err(ReadError::header(path, "format version", &version.to_string(), "1, 2 or 3"));
        }
        (mark, _) => {
            let found = String::from_utf8_lossy(mark);
            return Err(ReadError::header(path, "first bytes", &found, "\\x93NUMPY"));
        }
    };
    // As much as there is: the length may be wrong.
    let mut text = Vec::new();
    let got = file.take(length.into()).read_to_end(&mut text).map_err(trouble)?;
    if got < length as usize {
        let expected = format!("at most the {got} bytes that follow");
        return Err(ReadError::header(path, "header length", &length.to_string(), &expected));
    }
    Ok(String::from_utf8_lossy(&text).into_owned())
}

/// The text from an entry's value to the end of the dictionary.
fn entry<'a>(path: &Path, text: &'a str, key: &str) -> Result<&'a str, ReadError> {
    ['\'', '"']
        .iter()
        .find_map(|quote| text.split_once(&format!("{quote}{key}{quote}")))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix(':'))
        .map(str::trim_start)
        .ok_or_else(|| ReadError::missing(path, key, "an entry of the header"))
}

/// How samples are stored in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stored {
    As(SampleType),
    /// Half precision, which is converted to single.
    Half,
}

impl Stored {
    /// The type as which the file's bytes are read.
    fn raw(self) -> SampleType {
        match self {
            Self::As(sample) => sample,
            Self::Half => SampleType::U16,
        }
    }
}

fn sample_type(path: &Path, descr: &str) -> Result<(Stored, Endian), ReadError> {
    let expected = "|u1, |i1, <u2, <i2, <u4, <i4, <f2, <f4, <f8 or |b1, or > for big-endian";
    let wrong = || ReadError::header(path, "descr", descr, expected);
    let fix = "save it with `.astype(numpy.float32)` or another type of at most 4 bytes, or float64";
    if descr.starts_with('[') {
        return Err(ReadError::unsupported(path, "an array of records", "save one of its fields"));
    }
    let name = descr.strip_prefix(['\'', '"']).and_then(|d| d.split(['\'', '"']).next()).ok_or_else(wrong)?;
    let endian = match name.chars().next() {
        Some('>') => Endian::Big,
        Some('<' | '|' | '=') => Endian::Little,
        _ => return Err(wrong()),
    };
    let sample = match &name[1..] {
        "u1" | "b1" => SampleType::U8,
        "i1" => SampleType::I8,
        "u2" => SampleType::U16,
        "i2" => SampleType::I16,
        "u4" => SampleType::U32,
        "i4" => SampleType::I32,
        "f4" => SampleType::F32,
        "f8" => SampleType::F64,
        "f2" => return Ok((Stored::Half, endian)),
        "i8" | "u8" | "f16" | "c8" | "c16" | "O" => {
            return Err(ReadError::unsupported(path, format!("an array of `{name}`"), fix));
        }
        _ => return Err(wrong()),
    };
    Ok((Stored::As(sample), endian))
}

/// The numbers of a tuple such as `(3, 4, 5)`.
fn shape(path: &Path, text: &str) -> Result<Vec<usize>, ReadError> {
    let wrong = || ReadError::header(path, "shape", text, "a tuple of whole numbers");
    let inside = text.strip_prefix('(').and_then(|t| t.split_once(')')).ok_or_else(wrong)?.0;
    let words = inside.split(',').map(str::trim).filter(|word| !word.is_empty());
    words.map(|word| word.trim_end_matches('L').parse().map_err(|_| wrong())).collect()
}

/// Of four axes, a short last one holds channels; otherwise the first one is time.
fn meanings(path: &Path, shape: &[usize]) -> Result<Vec<(usize, Axis)>, ReadError> {
    let mut axes: Vec<(usize, Axis)> = shape.iter().map(|&n| (n, Axis::Space)).collect();
    match shape {
        [_] | [_, _] | [_, _, _] => {}
        [_, _, _, last] if *last <= MOST_CHANNELS => axes[3].1 = Axis::Channel,
        [_, _, _, _] => axes[0].1 = Axis::Time,
        [_, _, _, _, _] => {
            axes[0].1 = Axis::Time;
            let channel = if shape[4] <= MOST_CHANNELS { 4 } else { 1 };
            axes[channel].1 = Axis::Channel;
        }
        _ => {
            let found = format!("{} axes", shape.len());
            return Err(ReadError::header(path, "shape", &found, "1 to 5 axes"));
        }
    }
    Ok(axes)
}

fn widen(voxels: Voxels) -> Voxels {
    match voxels {
        Voxels::U16(bits) => {
            Voxels::F32(bits.into_iter().map(|b| half::f16::from_bits(b).to_f32()).collect())
        }
        other => other,
    }
}

/// From z fastest, as Fortran order stores `[z][y][x]`, to x fastest.
fn transposed(voxels: Voxels, dims: [usize; 3]) -> Voxels {
    fn turn<T: Copy>(data: &[T], [nx, ny, nz]: [usize; 3]) -> Vec<T> {
        let mut turned = Vec::with_capacity(data.len());
        for z in 0..nz {
            for y in 0..ny {
                turned.extend((0..nx).map(|x| data[z + nz * (y + ny * x)]));
            }
        }
        turned
    }
    match voxels {
        Voxels::U8(data) => Voxels::U8(turn(&data, dims)),
        Voxels::I8(data) => Voxels::I8(turn(&data, dims)),
        Voxels::U16(data) => Voxels::U16(turn(&data, dims)),
        Voxels::I16(data) => Voxels::I16(turn(&data, dims)),
        Voxels::U32(data) => Voxels::U32(turn(&data, dims)),
        Voxels::I32(data) => Voxels::I32(turn(&data, dims)),
        Voxels::F32(data) => Voxels::F32(turn(&data, dims)),
        Voxels::F64(data) => Voxels::F64(turn(&data, dims)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::super::tests::folder_with;
    use super::*;

    fn load(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Result<Loaded, ReadError> {
        let text = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        let bytes = [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), data].concat();
        let (_folder, path) = folder_with("a.npy", &bytes);
        read(&path)
    }

    #[test]
    fn both_orders_are_indexed_z_y_x() {
        let c_order: Vec<u8> = (0..24).collect();
        let mut fortran = Vec::new();
        for x in 0..4 {
            for y in 0..3 {
                fortran.extend((0..2).map(|z| c_order[x + 4 * (y + 3 * z)]));
            }
        }
        for (flag, data) in [("False", &c_order), ("True", &fortran)] {
            let volume = load("'|u1'", flag, "(2, 3, 4)", data).unwrap().volume;
            assert_eq!(volume.grid().dims(), [4, 3, 2]);
            assert_eq!(volume.voxels(), Voxels::U8(c_order.clone()), "fortran_order {flag}");
            assert_eq!(volume.grid().origin(), [-1.5, -1.0, -0.5]);
        }
    }

    #[test]
    fn four_axes_hold_channels_or_times() {
        let data: Vec<u8> = (0..24).collect();
        let cases: [(&str, &str, usize, usize, &[u8]); 4] = [
            ("False", "(2, 2, 2, 3)", 3, 1, &[0, 3, 6, 9, 12, 15, 18, 21]),
            ("False", "(2, 2, 1, 6)", 1, 2, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]),
            ("True", "(2, 2, 2, 3)", 3, 1, &[0, 4, 2, 6, 1, 5, 3, 7]),
            ("True", "(2, 2, 1, 6)", 1, 2, &[0, 4, 8, 12, 16, 20, 2, 6, 10, 14, 18, 22]),
        ];
        for (order, shape, channels, times, expected) in cases {
            let loaded = load("'|u1'", order, shape, &data).unwrap();
            assert_eq!((loaded.channels, loaded.times), (channels, times), "{shape}");
            assert_eq!(loaded.volume.voxels(), Voxels::U8(expected.to_vec()), "{order} {shape}");
        }
    }

    #[test]
    fn half_precision_is_widened_in_either_byte_order() {
        let little = load("'<f2'", "False", "(2,)", &[0x00, 0x3e, 0x00, 0xc0]).unwrap();
        let big = load("'>f2'", "False", "(2,)", &[0x3e, 0x00, 0xc0, 0x00]).unwrap();
        assert_eq!(little.volume.voxels(), Voxels::F32(vec![1.5, -2.0]));
        assert_eq!(little.volume.voxels(), big.volume.voxels());
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let cases = [
            ("'<i8'", "False", "(1,)", "astype"),
            ("[('a', '<f4')]", "False", "(1,)", "records"),
            ("'<x4'", "False", "(1,)", "descr"),
            ("'\u{e9}4'", "False", "(1,)", "descr"),
            ("'<f4'", "Maybe", "(1,)", "fortran_order"),
            ("'<f4'", "False", "()", "shape"),
            ("'<f4'", "False", "(0, 3)", "shape"),
            ("'<f4'", "False", "(-1, 3)", "shape"),
            ("'<f4'", "False", "(99999999999, 99999999999)", "shape"),
            ("'<f4'", "False", "(2,)", "4 bytes of samples, expected 8"),
        ];
        for (descr, fortran, shape, word) in cases {
            let message = load(descr, fortran, shape, &[0; 4]).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("a.npy"), "{descr} {shape}: {message}");
        }
    }
}
