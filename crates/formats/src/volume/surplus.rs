//! What a file holds behind its samples. It is left out, with a note: it may be the sign of a wrong size or type.

use std::cell::{Cell, RefCell};
use std::io::{self, BufRead, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use tyndall::message::path_name;

/// Compressed bytes behind the samples are decompressed to count them, up to this many.
pub(super) const LOOK_AHEAD: u64 = 64 << 20;

/// What the files of a volume held behind their samples; clones share it.
#[derive(Clone, Debug, Default)]
pub(super) struct Surplus(Rc<RefCell<Vec<Found>>>);

/// How much a file holds from the first sample on.
#[derive(Clone, Copy, Debug)]
pub(super) enum Amount {
    Bytes(u64),
    /// And more that were not counted.
    AtLeastBytes(u64),
    /// Of text.
    Numbers(u64),
}

/// What one file held.
#[derive(Debug)]
struct Found {
    file: PathBuf,
    what: String,
}

impl Surplus {
    /// Notes that a file has more than the `stated` samples, if so.
    pub fn samples(&self, file: &Path, found: Amount, stated: u64) {
        let found = match found {
            Amount::Bytes(found) if found > stated => format!("{found} bytes"),
            Amount::AtLeastBytes(found) if found > stated => format!("more than {found} bytes"),
            Amount::Numbers(found) if found > stated => format!("{found} numbers"),
            _ => return,
        };
        let what = format!(
            "found {found} of sample data where {stated} are stated: the rest was ignored; check the dimensions and the type of the samples"
        );
        self.0.borrow_mut().push(Found { file: file.into(), what });
    }

    /// Notes that bytes follow the compressed data, if there are some.
    pub fn behind(&self, file: &Path, bytes: u64) {
        if bytes > 0 {
            let what = format!("{bytes} bytes after the end of the compressed data were ignored");
            self.0.borrow_mut().push(Found { file: file.into(), what });
        }
    }

    /// The notes; of files with the same thing, the first speaks for all.
    pub fn notes(&self) -> Vec<String> {
        let all = self.0.borrow();
        let mut notes = Vec::new();
        for (index, Found { file, what }) in all.iter().enumerate() {
            if all[..index].iter().any(|earlier| earlier.what == *what) {
                continue;
            }
            let others = all.iter().filter(|other| other.what == *what).count() - 1;
            let others = match others {
                0 => String::new(),
                1 => " and 1 other file".to_owned(),
                n => format!(" and {n} other files"),
            };
            notes.push(format!("{}{others}: {what}", path_name(file)));
        }
        notes
    }
}

/// The bytes of a decoder, counted.
pub(super) struct Counted<R> {
    pub inner: R,
    pub count: Rc<Cell<u64>>,
}

impl<R: BufRead> Read for Counted<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(out)?;
        self.count.set(self.count.get() + read as u64);
        Ok(read)
    }
}

impl<R: BufRead> BufRead for Counted<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, bytes: usize) {
        self.inner.consume(bytes);
        self.count.set(self.count.get() + bytes as u64);
    }
}

/// A decoder's progress.
#[derive(Clone, Debug)]
pub(super) struct Decoded {
    /// Bytes decompressed so far, from the first sample on.
    pub count: Rc<Cell<u64>>,
    /// Bytes of the file behind the compressed data, once the decoder has come to its end.
    pub behind: Rc<Cell<u64>>,
}

impl Decoded {
    /// Reads on behind the samples, of which `stated` bytes are needed, and notes what is there. Whether the whole array was read:
    /// then the decoder must come to its end, where it verifies the checksum.
    pub fn finish(
        &self,
        file: &Path,
        reader: &mut dyn BufRead,
        stated: u64,
        whole: bool,
        surplus: &Surplus,
    ) -> io::Result<()> {
        if whole {
            reader.fill_buf()?;
        } else if stated.saturating_sub(self.count.get()) > LOOK_AHEAD {
            // Of a long series only the beginning was decompressed.
            return Ok(());
        }
        let limit = stated.saturating_add(LOOK_AHEAD);
        while self.count.get() <= limit {
            // Damage behind the samples is no damage to them.
            let read = match reader.fill_buf() {
                Ok(bytes) => bytes.len(),
                Err(_) => break,
            };
            if read == 0 {
                break;
            }
            reader.consume(read);
        }
        let count = self.count.get();
        let amount = if count > limit { Amount::AtLeastBytes(count) } else { Amount::Bytes(count) };
        surplus.samples(file, amount, stated);
        surplus.behind(file, self.behind.get());
        Ok(())
    }
}
