//! The binary header: 348 bytes in version 1, 540 in version 2, in either byte order.

use super::super::error::ReadError;
use super::super::sample_type::Endian;
use std::path::Path;

const SIZE_1: usize = 348;
const SIZE_2: usize = 540;

/// Where the samples are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Storage {
    /// After the header, in the same file.
    Single,
    /// In the `.img` file.
    Pair,
}

/// The entries that both versions have, each in the wider of their types.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub endian: Endian,
    pub storage: Storage,
    /// x, y, z, time, and three more; 1 where absent.
    pub dims: [usize; 7],
    pub datatype: i32,
    pub pixdim: [f64; 8],
    /// Bytes before the first sample.
    pub offset: u64,
    pub slope: f64,
    pub intercept: f64,
    pub units: u8,
    pub qform_code: i32,
    pub sform_code: i32,
    /// b, c, d.
    pub quaternion: [f64; 3],
    pub quaternion_offset: [f64; 3],
    pub sform: [[f64; 4]; 3],
}

/// Whether a file that begins with `head` is NIfTI or its predecessor Analyze, which the reader then refuses.
pub(in super::super) fn recognises(head: &[u8]) -> bool {
    version(head).is_some()
}

/// The size of the header and the byte order, from its first number.
fn version(head: &[u8]) -> Option<(usize, Endian)> {
    let first: [u8; 4] = head.get(..4)?.try_into().ok()?;
    for (endian, number) in
        [(Endian::Little, u32::from_le_bytes(first)), (Endian::Big, u32::from_be_bytes(first))]
    {
        for size in [SIZE_1, SIZE_2] {
            if number as usize == size {
                return Some((size, endian));
            }
        }
    }
    None
}

/// Reads numbers at fixed positions of a header, which must be long enough.
struct Bytes<'a> {
    head: &'a [u8],
    endian: Endian,
}

impl Bytes<'_> {
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.head[at..at + N]);
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }
    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.take(at))
    }
    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.take(at))
    }
    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.take(at))
    }
    fn f32(&self, at: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.take(at)))
    }
    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.take(at))
    }
}

impl Header {
    pub fn parse(path: &Path, head: &[u8]) -> Result<Self, ReadError> {
        let Some((size, endian)) = version(head) else {
            let found = head.get(..4).map_or("fewer bytes".into(), |b| format!("{b:?}"));
            return Err(ReadError::header(path, "sizeof_hdr", &found, "348 (NIfTI-1) or 540 (NIfTI-2)"));
        };
        if head.len() < size {
            let found = format!("{} bytes", head.len());
            return Err(ReadError::header(path, "header", &found, &format!("{size} bytes")));
        }
        let bytes = Bytes { head, endian };
        if size == SIZE_1 { Self::parse_1(path, &bytes) } else { Self::parse_2(path, &bytes) }
    }

    fn parse_1(path: &Path, b: &Bytes) -> Result<Self, ReadError> {
        let storage = match &b.head[344..348] {
            b"n+1\0" => Storage::Single,
            b"ni1\0" => Storage::Pair,
            b"\0\0\0\0" => {
                let fix = "convert it to NIfTI: Analyze does not say where left and right are";
                return Err(ReadError::unsupported(
                    path,
                    "Analyze 7.5 (a header without the NIfTI mark)",
                    fix,
                ));
            }
            other => return Err(wrong_mark(path, other, "n+1 or ni1")),
        };
        let offset = b.f32(108);
        Ok(Self {
            endian: b.endian,
            storage,
            dims: dims(path, std::array::from_fn(|i| i64::from(b.i16(40 + 2 * i))))?,
            datatype: i32::from(b.i16(70)),
            pixdim: std::array::from_fn(|i| b.f32(76 + 4 * i)),
            offset: whole(offset)
                .and_then(|n| place(n, storage, 352))
                .ok_or_else(|| wrong_offset(path, offset))?,
            slope: b.f32(112),
            intercept: b.f32(116),
            units: b.head[123],
            qform_code: i32::from(b.i16(252)),
            sform_code: i32::from(b.i16(254)),
            quaternion: std::array::from_fn(|i| b.f32(256 + 4 * i)),
            quaternion_offset: std::array::from_fn(|i| b.f32(268 + 4 * i)),
            sform: std::array::from_fn(|row| std::array::from_fn(|i| b.f32(280 + 16 * row + 4 * i))),
        })
    }

    fn parse_2(path: &Path, b: &Bytes) -> Result<Self, ReadError> {
        let storage = match &b.head[4..8] {
            b"n+2\0" => Storage::Single,
            b"ni2\0" => Storage::Pair,
            other => return Err(wrong_mark(path, other, "n+2 or ni2")),
        };
        let offset = b.i64(168);
        Ok(Self {
            endian: b.endian,
            storage,
            dims: dims(path, std::array::from_fn(|i| b.i64(16 + 8 * i)))?,
            datatype: i32::from(b.i16(12)),
            pixdim: std::array::from_fn(|i| b.f64(104 + 8 * i)),
            offset: place(offset, storage, 544).ok_or_else(|| wrong_offset(path, offset as f64))?,
            slope: b.f64(176),
            intercept: b.f64(184),
            units: b.head[if b.endian == Endian::Little { 500 } else { 503 }],
            qform_code: b.i32(344),
            sform_code: b.i32(348),
            quaternion: std::array::from_fn(|i| b.f64(352 + 8 * i)),
            quaternion_offset: std::array::from_fn(|i| b.f64(376 + 8 * i)),
            sform: std::array::from_fn(|row| std::array::from_fn(|i| b.f64(400 + 32 * row + 8 * i))),
        })
    }
}

fn wrong_mark(path: &Path, found: &[u8], expected: &str) -> ReadError {
    ReadError::header(path, "magic", &String::from_utf8_lossy(found), expected)
}

fn wrong_offset(path: &Path, found: f64) -> ReadError {
    ReadError::header(path, "vox_offset", &found.to_string(), "the byte where samples begin, past the header")
}

/// The number as an integer, if it is one and is exact.
#[expect(clippy::cast_possible_truncation, reason = "whole numbers below 2^53 only")]
fn whole(x: f64) -> Option<i64> {
    (x.fract() == 0.0 && x.abs() < 9e15).then_some(x as i64)
}

/// Where the samples begin; in a single file, zero means right after the header and its four flag bytes.
fn place(offset: i64, storage: Storage, behind: u64) -> Option<u64> {
    let offset = u64::try_from(offset).ok()?;
    match storage {
        Storage::Pair => Some(offset),
        Storage::Single if offset == 0 => Some(behind),
        Storage::Single => (offset + 4 >= behind).then_some(offset),
    }
}

/// Lengths of the axes; `dim[0]` is their number.
fn dims(path: &Path, dim: [i64; 8]) -> Result<[usize; 7], ReadError> {
    let found = dim.map(|n| n.to_string()).join(" ");
    let wrong = || ReadError::header(path, "dim", &found, "1 to 7 axes, each of at least 1 voxel");
    let count = usize::try_from(dim[0]).ok().filter(|n| (1..=7).contains(n)).ok_or_else(wrong)?;
    let mut sizes = [1; 7];
    for (size, n) in sizes.iter_mut().zip(&dim[1..=count]) {
        *size = usize::try_from(*n).ok().filter(|&n| n > 0).ok_or_else(wrong)?;
    }
    Ok(sizes)
}
