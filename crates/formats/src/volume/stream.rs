//! Opens files, skips to their samples and decompresses them.

use super::error::ReadError;
use super::members::{GZIP, Members};
use super::surplus::{Amount, Counted, Decoded, Surplus};
use bzip2::bufread::BzDecoder;
use flate2::bufread::{GzDecoder, ZlibDecoder};
use std::cell::Cell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom, Take};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// How the samples were compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coding {
    Raw,
    Gzip,
    Bzip2,
    /// zlib, or gzip if the stream begins with its signature.
    Zlib,
}

impl Coding {
    /// Upper limit of the compression ratio: a header that needs more is wrong, and is refused before decompression.
    fn largest_factor(self) -> u64 {
        match self {
            Self::Raw => 1,
            // Two bits for 258 bytes, plus a few bytes at the start of each block.
            Self::Gzip | Self::Zlib => 1100,
            // A block of 900,000 bytes, each five of which repeat one byte 259 times, in some 40 bytes.
            Self::Bzip2 => 2_000_000,
        }
    }
}

/// Where in a file the samples begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// This many bytes past the current position, counted after decompression.
    After(u64),
    /// Such that they end where the file ends; only if not compressed.
    AtEnd,
}

/// The bytes of the samples, from the first sample on.
pub(super) struct Stream<'a> {
    pub reader: Box<dyn BufRead + 'a>,
    /// Bytes left; known only if they are not compressed.
    pub available: Option<u64>,
    /// How far they are decompressed, if they are compressed.
    pub decoded: Option<Decoded>,
    /// What was found behind the samples.
    pub surplus: Surplus,
}

impl<'a> Stream<'a> {
    /// Bytes of which neither the number is known nor where they come from.
    pub fn of(reader: Box<dyn BufRead + 'a>) -> Self {
        Self { reader, available: None, decoded: None, surplus: Surplus::default() }
    }
}

/// Opens a regular file that is not empty.
pub(super) fn open(path: &Path) -> Result<BufReader<File>, ReadError> {
    let trouble = |source| ReadError::io(path, source);
    // Checked before opening: opening a pipe would block until its other end is opened.
    let meta = std::fs::metadata(path).map_err(trouble)?;
    if !meta.is_file() {
        let found = if meta.is_dir() { "a folder" } else { "a pipe or a device" };
        return Err(ReadError::NotAFile { path: path.into(), found });
    }
    if meta.len() == 0 {
        return Err(ReadError::Empty { path: path.into() });
    }
    Ok(BufReader::with_capacity(1 << 16, File::open(path).map_err(trouble)?))
}

/// The first 1024 bytes of a file, decompressed if it is gzip; fewer if it is shorter.
pub(super) fn first_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let trouble = |source| ReadError::io(path, source);
    let mut file = open(path)?;
    let gzip = file.fill_buf().map_err(trouble)?.starts_with(&GZIP);
    let coding = if gzip { Coding::Gzip } else { Coding::Raw };
    let mut reader = decode(file, coding, &Rc::default()).map_err(trouble)?;
    let mut head = vec![0; 1024];
    // Damage is not reported here but by the reader that is then chosen by the file's name.
    let got = fill(&mut *reader, &mut head).unwrap_or(0);
    head.truncate(got);
    Ok(head)
}

/// The bytes from `start` on; `needed` is the number of bytes of samples that the header states.
pub(super) fn samples(
    path: &Path,
    mut file: BufReader<File>,
    coding: Coding,
    start: Start,
    needed: u64,
) -> Result<Stream<'static>, ReadError> {
    let trouble = |source| ReadError::io(path, source);
    if coding != Coding::Raw {
        let length = file.get_ref().metadata().map_err(trouble)?.len();
        if needed / coding.largest_factor() > length {
            let message = format!("{length} bytes cannot hold {needed} bytes of samples, expected more");
            return Err(ReadError::Damaged { path: path.into(), message });
        }
        let behind = Rc::default();
        let mut reader = decode(file, coding, &behind).map_err(trouble)?;
        let Start::After(bytes) = start else {
            let fix = "state the number of bytes to skip, or store the samples uncompressed";
            return Err(ReadError::unsupported(path, "skipping to the end of compressed data", fix));
        };
        let skipped = io::copy(&mut reader.by_ref().take(bytes), &mut io::sink())
            .map_err(|e| ReadError::Damaged { path: path.into(), message: e.to_string() })?;
        if skipped < bytes {
            return Err(ReadError::Short { path: path.into(), found: 0, expected: needed });
        }
        let decoded = Decoded { count: Rc::default(), behind };
        let reader = Box::new(Counted { inner: reader, count: Rc::clone(&decoded.count) });
        return Ok(Stream { decoded: Some(decoded), ..Stream::of(reader) });
    }
    let length = file.get_ref().metadata().map_err(trouble)?.len();
    let position = file.stream_position().map_err(trouble)?;
    let begin = match start {
        Start::After(bytes) => position.saturating_add(bytes).min(length),
        Start::AtEnd => length.saturating_sub(needed),
    };
    file.seek(SeekFrom::Start(begin)).map_err(trouble)?;
    Ok(Stream { available: Some(length - begin), ..Stream::of(Box::new(file)) })
}

/// The decompressed bytes from the current position on; at their end `behind` is set to the number of bytes of the file that follow.
fn decode(mut file: BufReader<File>, coding: Coding, behind: &Rc<Cell<u64>>) -> io::Result<Box<dyn BufRead>> {
    const CHUNK: usize = 1 << 17;
    let coding = match coding {
        Coding::Zlib if file.fill_buf()?.starts_with(&GZIP) => Coding::Gzip,
        other => other,
    };
    Ok(match coding {
        Coding::Raw => Box::new(file),
        Coding::Gzip => Box::new(BufReader::with_capacity(CHUNK, Members::<GzDecoder<_>>::new(file, behind))),
        Coding::Zlib => {
            Box::new(BufReader::with_capacity(CHUNK, Members::<ZlibDecoder<_>>::new(file, behind)))
        }
        Coding::Bzip2 => {
            Box::new(BufReader::with_capacity(CHUNK, Members::<BzDecoder<_>>::new(file, behind)))
        }
    })
}

/// Reads until `out` is full or the stream ends; returns the number of bytes read.
///
/// A decoder reports a truncated stream as `UnexpectedEof`, which is treated as the end of the stream.
pub(super) fn fill(reader: &mut dyn Read, mut out: &mut [u8]) -> io::Result<usize> {
    let asked = out.len();
    while !out.is_empty() {
        match reader.read(out) {
            Ok(0) => break,
            Ok(n) => out = &mut out[n..],
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e)
                if e.kind() == ErrorKind::UnexpectedEof
                    && e.get_ref().is_none_or(|e| !e.is::<ReadError>()) =>
            {
                break;
            }
            Err(e) => return Err(e),
        }
    }
    Ok(asked - out.len())
}

/// Keeps the first `keep` of every `period` bytes: the first of several interleaved channels.
pub(super) struct KeepEvery<R> {
    inner: R,
    keep: usize,
    period: usize,
    position: usize,
}

impl<R: BufRead> KeepEvery<R> {
    /// Requires `0 < keep <= period`.
    pub fn new(inner: R, keep: usize, period: usize) -> Self {
        assert!(0 < keep && keep <= period, "keep {keep} of {period}");
        Self { inner, keep, period, position: 0 }
    }
}

impl<R: BufRead> Read for KeepEvery<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written == 0 && !out.is_empty() {
            let input = self.inner.fill_buf()?;
            if input.is_empty() {
                break;
            }
            let mut used = 0;
            while used < input.len() && written < out.len() {
                let left = input.len() - used;
                let step = if self.position < self.keep {
                    let n = (self.keep - self.position).min(left).min(out.len() - written);
                    out[written..written + n].copy_from_slice(&input[used..used + n]);
                    written += n;
                    n
                } else {
                    (self.period - self.position).min(left)
                };
                used += step;
                self.position += step;
                if self.position == self.period {
                    self.position = 0;
                }
            }
            self.inner.consume(used);
        }
        Ok(written)
    }
}

/// Several files read one after the other, the same number of bytes from each; each is opened when reached.
pub(super) struct Concatenated<F> {
    left: VecDeque<PathBuf>,
    bytes_each: u64,
    open: F,
    current: Option<Part>,
    surplus: Surplus,
}

/// The file that is being read.
struct Part {
    path: PathBuf,
    reader: Take<Box<dyn BufRead>>,
    available: Option<u64>,
    decoded: Option<Decoded>,
}

impl Part {
    /// Notes what is behind its samples.
    fn finish(self, stated: u64, surplus: &Surplus) -> io::Result<()> {
        let Self { path, reader, available, decoded } = self;
        if let Some(found) = available {
            surplus.samples(&path, Amount::Bytes(found), stated);
        }
        match decoded {
            Some(decoded) => decoded.finish(&path, &mut *reader.into_inner(), stated, true, surplus),
            None => Ok(()),
        }
    }
}

impl<F: FnMut(&Path) -> Result<Stream<'static>, ReadError>> Concatenated<F> {
    /// `open` returns the bytes of a file's samples.
    pub fn new(files: Vec<PathBuf>, bytes_each: u64, open: F) -> Self {
        Self { left: files.into(), bytes_each, open, current: None, surplus: Surplus::default() }
    }

    /// What will be found behind the samples of its files.
    pub fn surplus(&self) -> Surplus {
        self.surplus.clone()
    }
}

impl<F: FnMut(&Path) -> Result<Stream<'static>, ReadError>> Read for Concatenated<F> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(Part { path, reader, .. }) = &mut self.current {
                let n = reader.read(out)?;
                if n > 0 || out.is_empty() {
                    return Ok(n);
                }
                if reader.limit() > 0 {
                    let found = self.bytes_each - reader.limit();
                    let short = ReadError::Short { path: path.clone(), found, expected: self.bytes_each };
                    return Err(io::Error::other(short));
                }
            }
            if let Some(part) = self.current.take() {
                part.finish(self.bytes_each, &self.surplus)?;
            }
            let Some(path) = self.left.pop_front() else { return Ok(0) };
            let Stream { reader, available, decoded, .. } = (self.open)(&path).map_err(io::Error::other)?;
            let reader = reader.take(self.bytes_each);
            self.current = Some(Part { path, reader, available, decoded });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_third_pair_is_kept_whatever_the_buffer() {
        let input: Vec<u8> = (0..60).collect();
        let expected: Vec<u8> = input.iter().copied().filter(|v| v % 6 < 2).collect();
        for capacity in [1, 4, 5, 64] {
            let mut kept = Vec::new();
            let inner = BufReader::with_capacity(capacity, &input[..]);
            KeepEvery::new(inner, 2, 6).read_to_end(&mut kept).unwrap();
            assert_eq!(kept, expected, "buffer of {capacity}");
        }
    }
}
