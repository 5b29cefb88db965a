//! From a stream of bytes to typed samples: which axes the file has, and what is kept of them.

use super::error::ReadError;
use super::sample_type::{Endian, SampleType};
use super::stream::{KeepEvery, Stream, fill};
use super::surplus::{Amount, Decoded, LOOK_AHEAD, Surplus};
use crate::memory::available;
use bytemuck::Pod;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::str::FromStr;
use tyndall::message::excerpt;
use tyndall::volume::{Bricks, Voxels};

/// # Errors
/// [`ReadError::Memory`] if `needed` more bytes are not available.
pub(super) fn check_memory(path: &Path, needed: u64) -> Result<(), ReadError> {
    match available() {
        Some(available) if needed > available => {
            Err(ReadError::Memory { path: path.into(), needed, available })
        }
        _ => Ok(()),
    }
}

/// What was read.
#[derive(Debug)]
pub(super) struct Samples {
    pub voxels: Voxels,
    /// What the user should know of it.
    pub notes: Vec<String>,
}

/// What an axis of a file stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    Space,
    /// Components of one voxel; the first is kept.
    Channel,
    /// Time steps; the first is kept.
    Time,
}

/// The array that a file holds.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Length and meaning of each axis, fastest first.
    pub axes: Vec<(usize, Axis)>,
    pub sample: SampleType,
    pub endian: Endian,
    /// Whether samples are stored as text, not binary.
    pub text: bool,
}

impl Layout {
    /// An array without axes of length zero, whose size in bytes does not overflow.
    ///
    /// # Errors
    /// [`ReadError::Header`] naming `key`.
    pub fn new(
        path: &Path,
        key: &str,
        axes: Vec<(usize, Axis)>,
        sample: SampleType,
        endian: Endian,
    ) -> Result<Self, ReadError> {
        let bytes = axes.iter().try_fold(sample.size(), |bytes, &(n, _)| bytes.checked_mul(n));
        if bytes.is_none_or(|bytes| bytes == 0 || isize::try_from(bytes).is_err()) {
            let sizes: Vec<String> = axes.iter().map(|(n, _)| n.to_string()).collect();
            let expected = "sizes of at least 1 whose product fits the address space";
            return Err(ReadError::header(path, key, &sizes.join(" "), expected));
        }
        Ok(Self { axes, sample, endian, text: false })
    }

    /// The product of the lengths of all axes of that meaning.
    pub fn count(&self, meaning: Axis) -> usize {
        self.axes.iter().filter(|(_, axis)| *axis == meaning).map(|(n, _)| n).product()
    }

    /// Bytes of the whole array.
    pub fn bytes(&self) -> u64 {
        self.samples() as u64 * self.sample.size() as u64
    }

    /// Peak bytes while the volume is loaded: it is held in the file's order and in bricks at the same time.
    fn memory(&self) -> u64 {
        let mut lengths = self.axes.iter().filter(|(_, axis)| *axis == Axis::Space).map(|(n, _)| *n);
        let mut dims = [1; 3].map(|one| lengths.next().unwrap_or(one));
        // More than three spatial axes are refused elsewhere; here they only have to be counted.
        dims[2] = dims[2].saturating_mul(lengths.product());
        let bricks = Bricks::bytes(dims, self.sample.size()).unwrap_or(u64::MAX);
        (self.count(Axis::Space) as u64 * self.sample.size() as u64).saturating_add(bricks)
    }

    fn samples(&self) -> usize {
        self.axes.iter().map(|(n, _)| n).product()
    }

    /// Reads the first channel at the first time; `path` is the file that the stream comes from.
    pub fn read(&self, path: &Path, stream: Stream<'_>) -> Result<Samples, ReadError> {
        let Stream { reader, available, decoded, surplus } = stream;
        if let Some(found) = available
            && !self.text
            && found < self.bytes()
        {
            return Err(ReadError::Short { path: path.into(), found, expected: self.bytes() });
        }
        check_memory(path, self.memory())?;
        let voxels = if self.text {
            self.read_text(path, reader, &surplus)?
        } else {
            if let Some(found) = available {
                surplus.samples(path, Amount::Bytes(found), self.bytes());
            }
            self.read_bytes(path, reader, available.is_some(), decoded.map(|decoded| (decoded, &surplus)))?
        };
        Ok(Samples { voxels, notes: surplus.notes() })
    }

    fn read_bytes<'a>(
        &self,
        path: &Path,
        mut reader: Box<dyn BufRead + 'a>,
        all_there: bool,
        decoded: Option<(Decoded, &Surplus)>,
    ) -> Result<Voxels, ReadError> {
        let mut inner = self.sample.size();
        let mut slower = self.samples();
        for &(n, axis) in &self.axes {
            slower /= n;
            // On the slowest axis only the first block is kept, so reading stops after it: no need to skip.
            if axis != Axis::Space && n > 1 && slower > 1 {
                reader = Box::new(BufReader::new(KeepEvery::new(reader, inner, inner * n)));
            }
            if axis == Axis::Space {
                inner *= n;
            }
        }
        let count = self.count(Axis::Space);
        let mut voxels =
            of_type!(self.sample, read_vec(&mut *reader, count, all_there).map_err(|stop| stop.at(path))?);
        let whole = self.samples() == count;
        let end = match decoded {
            Some((decoded, surplus)) => decoded.finish(path, &mut *reader, self.bytes(), whole, surplus),
            // The last of several files notes what is behind its samples.
            None if whole && !all_there => reader.fill_buf().map(|_| ()),
            None => Ok(()),
        };
        end.map_err(|error| Stop::Io(error).at(path))?;
        if self.endian != Endian::NATIVE {
            swap_bytes(&mut voxels);
        }
        Ok(voxels)
    }

    fn read_text(
        &self,
        path: &Path,
        mut reader: Box<dyn BufRead + '_>,
        surplus: &Surplus,
    ) -> Result<Voxels, ReadError> {
        let voxels = of_type!(self.sample, self.parse_words(path, &mut *reader)?);
        let stated = self.samples() as u64;
        let mut found = stated;
        let mut ahead = reader.take(LOOK_AHEAD);
        while next_word(&mut ahead).is_ok_and(|word| !word.is_empty()) {
            found += 1;
        }
        surplus.samples(path, Amount::Numbers(found), stated);
        Ok(voxels)
    }

    fn parse_words<T: FromStr>(&self, path: &Path, reader: &mut dyn BufRead) -> Result<Vec<T>, ReadError> {
        let mut data = Vec::new();
        for index in 0..self.samples() {
            let word = next_word(reader).map_err(|e| ReadError::io(path, e))?;
            if word.is_empty() {
                let (found, expected) = (index as u64, self.samples() as u64);
                return Err(ReadError::Short { path: path.into(), found, expected });
            }
            let value = word.parse().map_err(|_| ReadError::Damaged {
                path: path.into(),
                message: format!(
                    "sample {index}: found `{}`, expected a {} number",
                    excerpt(&word),
                    self.sample.name()
                ),
            })?;
            if self.keeps(index) {
                data.push(value);
            }
        }
        Ok(data)
    }

    /// Whether the sample is in the first channel at the first time.
    fn keeps(&self, mut index: usize) -> bool {
        self.axes.iter().all(|&(n, axis)| {
            let here = index % n;
            index /= n;
            axis == Axis::Space || here == 0
        })
    }
}

/// Makes [`Voxels`] of the type that a [`SampleType`] names; `$data` is an expression generic in its element type.
macro_rules! of_type {
    ($sample:expr, $data:expr) => {
        match $sample {
            SampleType::U8 => Voxels::U8($data),
            SampleType::I8 => Voxels::I8($data),
            SampleType::U16 => Voxels::U16($data),
            SampleType::I16 => Voxels::I16($data),
            SampleType::U32 => Voxels::U32($data),
            SampleType::I32 => Voxels::I32($data),
            SampleType::F32 => Voxels::F32($data),
            SampleType::F64 => Voxels::F64($data),
        }
    };
}
use of_type;

/// Why reading the samples stopped early.
enum Stop {
    Short { found: u64, expected: u64 },
    Io(io::Error),
    Memory { needed: u64 },
}

impl Stop {
    fn at(self, path: &Path) -> ReadError {
        let path = path.to_path_buf();
        match self {
            Self::Short { found, expected } => ReadError::Short { path, found, expected },
            Self::Memory { needed } => {
                ReadError::Memory { path, needed, available: available().unwrap_or(0) }
            }
            Self::Io(error) => match error.downcast::<ReadError>() {
                Ok(inner) => inner,
                Err(e) if e.raw_os_error().is_some() => ReadError::Io { path, source: e },
                Err(e) => ReadError::Damaged { path, message: e.to_string() },
            },
        }
    }
}

/// Reads `count` samples in the file's order. Unless all are known to be there, memory grows with what
/// arrives, so that a header with a wrong size costs no more than its file holds.
fn read_vec<T: Pod>(reader: &mut dyn Read, count: usize, all_there: bool) -> Result<Vec<T>, Stop> {
    let size = size_of::<T>();
    let expected = count as u64 * size as u64;
    let first = if all_there { count } else { (1 << 20) / size };
    let mut data: Vec<T> = Vec::new();
    while data.len() < count {
        let have = data.len();
        let step = (count - have).min(have.max(first));
        data.try_reserve_exact(step).map_err(|_| Stop::Memory { needed: expected })?;
        data.resize(have + step, T::zeroed());
        let got = fill(reader, bytemuck::cast_slice_mut(&mut data[have..])).map_err(Stop::Io)?;
        if got < step * size {
            return Err(Stop::Short { found: (have * size + got) as u64, expected });
        }
    }
    Ok(data)
}

/// Reverses the byte order of every sample.
fn swap_bytes(voxels: &mut Voxels) {
    fn two<T: Pod>(data: &mut [T]) {
        bytemuck::cast_slice_mut::<T, u16>(data).iter_mut().for_each(|v| *v = v.swap_bytes());
    }
    fn four<T: Pod>(data: &mut [T]) {
        bytemuck::cast_slice_mut::<T, u32>(data).iter_mut().for_each(|v| *v = v.swap_bytes());
    }
    match voxels {
        Voxels::U8(_) | Voxels::I8(_) => {}
        Voxels::U16(data) => two(data),
        Voxels::I16(data) => two(data),
        Voxels::U32(data) => four(data),
        Voxels::I32(data) => four(data),
        Voxels::F32(data) => four(data),
        Voxels::F64(data) => {
            bytemuck::cast_slice_mut::<f64, u64>(data).iter_mut().for_each(|v| *v = v.swap_bytes());
        }
    }
}

/// The next word, delimited by whitespace or commas and cut at 64 bytes; empty at the end.
fn next_word(reader: &mut dyn BufRead) -> io::Result<String> {
    let mut word = Vec::new();
    loop {
        let input = reader.fill_buf()?;
        if input.is_empty() {
            break;
        }
        let separates = |b: &u8| b.is_ascii_whitespace() || *b == b',';
        if word.is_empty() {
            let blank = input.iter().take_while(|b| separates(b)).count();
            if blank > 0 {
                reader.consume(blank);
                continue;
            }
        }
        let length = input.iter().take_while(|b| !separates(b)).count();
        let ended = length < input.len();
        word.extend_from_slice(&input[..length.min(64_usize.saturating_sub(word.len()))]);
        reader.consume(length);
        if ended {
            break;
        }
    }
    Ok(String::from_utf8_lossy(&word).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(axes: &[(usize, Axis)]) -> Layout {
        Layout::new(Path::new("test"), "sizes", axes.to_vec(), SampleType::U16, Endian::Big).unwrap()
    }

    fn read(layout: &Layout, bytes: &[u8]) -> Result<Voxels, ReadError> {
        let reader = Box::new(io::Cursor::new(bytes.to_vec()));
        layout.read(Path::new("test"), Stream::of(reader)).map(|samples| samples.voxels)
    }

    #[test]
    fn the_first_channel_at_the_first_time_is_kept_whatever_the_order_of_axes() {
        use Axis::{Channel, Space, Time};
        type Case = (&'static [(usize, Axis)], &'static [u16]);
        let cases: [Case; 5] = [
            (&[(2, Space), (3, Space)], &[0, 1, 2, 3, 4, 5]),
            (&[(3, Channel), (2, Space), (2, Space)], &[0, 3, 6, 9]),
            (&[(2, Space), (3, Channel), (2, Space)], &[0, 1, 6, 7]),
            (&[(2, Space), (2, Space), (3, Time)], &[0, 1, 2, 3]),
            (&[(2, Channel), (2, Space), (2, Time), (2, Space), (2, Time)], &[0, 2, 8, 10]),
        ];
        for (axes, expected) in cases {
            let mut layout = layout(axes);
            let all: Vec<u16> = (0..32).collect();
            let bytes: Vec<u8> = all.iter().flat_map(|v| v.to_be_bytes()).collect();
            assert_eq!(read(&layout, &bytes).unwrap(), Voxels::U16(expected.to_vec()), "{axes:?}");
            layout.text = true;
            let words: Vec<String> = all.iter().map(u16::to_string).collect();
            let voxels = read(&layout, words.join(" , \n").as_bytes()).unwrap();
            assert_eq!(voxels, Voxels::U16(expected.to_vec()), "text {axes:?}");
        }
    }

    #[test]
    fn a_short_file_is_reported_with_its_size() {
        let error = read(&layout(&[(10, Axis::Space)]), &[0; 13]).unwrap_err();
        assert!(matches!(error, ReadError::Short { found: 13, expected: 20, .. }), "{error}");
    }

    #[test]
    fn impossible_sizes_are_refused() {
        for sizes in [[0, 5], [1 << 40, 1 << 40]] {
            let axes = sizes.map(|n| (n, Axis::Space)).to_vec();
            let made = Layout::new(Path::new("test"), "sizes", axes, SampleType::U8, Endian::Little);
            assert!(matches!(made, Err(ReadError::Header { .. })));
        }
    }
}
