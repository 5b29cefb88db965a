//! Compressed data as gzip and bzip2 define it: one or several members, one after another.
//!
//! Tools append bytes to finished files: zeros up to a whole block, a newline, a signature. What follows the last member and does not begin
//! like another one is no data.

use bzip2::bufread::BzDecoder;
use flate2::bufread::{GzDecoder, ZlibDecoder};
use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, Read, Result, Seek, SeekFrom};
use std::rc::Rc;

/// The first bytes of every gzip stream.
pub(super) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The compressed file.
type Source = BufReader<File>;

/// Decodes one member.
pub(super) trait Member: Read {
    /// The first bytes of a further member; empty if there can be none.
    const SIGNATURE: &'static [u8];

    fn begin(source: Source) -> Self;

    /// The file; behind the member, if that was read to its end.
    fn end(self) -> Source;
}

macro_rules! member {
    ($decoder:ident, $signature:expr) => {
        impl Member for $decoder<Source> {
            const SIGNATURE: &'static [u8] = $signature;

            fn begin(source: Source) -> Self {
                Self::new(source)
            }

            fn end(self) -> Source {
                self.into_inner()
            }
        }
    };
}
member!(GzDecoder, &GZIP);
member!(BzDecoder, b"BZh");
member!(ZlibDecoder, b"");

/// Decodes all members.
pub(super) struct Members<M> {
    current: Option<M>,
    /// Bytes behind the last member, once that was read to its end.
    behind: Rc<Cell<u64>>,
}

impl<M: Member> Members<M> {
    /// From the file's position on; sets `behind` when it comes to the end.
    pub fn new(source: Source, behind: &Rc<Cell<u64>>) -> Self {
        Self { current: Some(M::begin(source)), behind: Rc::clone(behind) }
    }
}

impl<M: Member> Read for Members<M> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        while let Some(member) = &mut self.current {
            let read = member.read(out)?;
            if read > 0 || out.is_empty() {
                return Ok(read);
            }
            let Some(mut source) = self.current.take().map(M::end) else { break };
            let here = source.stream_position()?;
            let mut next = Vec::new();
            source.by_ref().take(M::SIGNATURE.len() as u64).read_to_end(&mut next)?;
            if next.is_empty() || next != M::SIGNATURE {
                let length = source.get_ref().metadata()?.len();
                self.behind.set(length.saturating_sub(here));
            } else {
                source.seek(SeekFrom::Start(here))?;
                self.current = Some(M::begin(source));
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::folder_with;
    use super::*;
    use flate2::Compression;
    use flate2::write::{GzEncoder, ZlibEncoder};
    use std::io::Write;

    fn gzip(data: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(data).unwrap();
        encoder.finish().unwrap()
    }

    fn zlib(data: &[u8]) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(data).unwrap();
        encoder.finish().unwrap()
    }

    fn bzip2(data: &[u8]) -> Vec<u8> {
        let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
        encoder.write_all(data).unwrap();
        encoder.finish().unwrap()
    }

    /// What is decoded, and the bytes behind it; whatever the size of the file's buffer.
    fn decoded<M: Member>(file: &[u8]) -> Result<(Vec<u8>, u64)> {
        let (_folder, path) = folder_with("a", file);
        let mut found = None;
        for capacity in [1, 7, 1 << 16] {
            let behind = Rc::default();
            let source = BufReader::with_capacity(capacity, File::open(&path)?);
            let mut data = Vec::new();
            Members::<M>::new(source, &behind).read_to_end(&mut data)?;
            let now = (data, behind.get());
            assert_eq!(found.get_or_insert_with(|| now.clone()), &now, "buffer of {capacity}");
        }
        Ok(found.unwrap())
    }

    #[test]
    fn members_are_read_to_the_last_and_what_follows_is_counted() {
        let text = b"a few bytes that are compressed".repeat(9);
        let twice = text.repeat(2);
        for tail in [
            &b""[..],
            b"\0",
            b"\n",
            &[0; 512],
            b"signature",
            b"B",
            b"BZ",
            &[0x1f],
            &[0x1f, 0],
            &[0xff; 70_000],
        ] {
            let with_tail = |members: &[u8]| [members, tail].concat();
            let behind = tail.len() as u64;
            let one = decoded::<GzDecoder<Source>>(&with_tail(&gzip(&text))).unwrap();
            assert_eq!(one, (text.clone(), behind), "gzip and {tail:?}");
            let two = decoded::<GzDecoder<Source>>(&with_tail(&gzip(&text).repeat(2))).unwrap();
            assert_eq!(two, (twice.clone(), behind), "gzip, gzip and {tail:?}");
            let two = decoded::<BzDecoder<Source>>(&with_tail(&bzip2(&text).repeat(2))).unwrap();
            assert_eq!(two, (twice.clone(), behind), "bzip2, bzip2 and {tail:?}");
            let one = decoded::<ZlibDecoder<Source>>(&with_tail(&zlib(&text))).unwrap();
            assert_eq!(one, (text.clone(), behind), "zlib and {tail:?}");
        }
        assert_eq!(
            decoded::<GzDecoder<Source>>(&[gzip(b""), gzip(b"x")].concat()).unwrap(),
            (b"x".to_vec(), 0)
        );
    }

    #[test]
    fn damage_is_no_tail() {
        let mut wrong_sum = gzip(b"data");
        let sum = wrong_sum.len() - 8;
        wrong_sum[sum] ^= 1;
        assert!(decoded::<GzDecoder<Source>>(&wrong_sum).is_err());
        assert!(decoded::<GzDecoder<Source>>(&[gzip(b"data"), wrong_sum].concat()).is_err());
        assert!(decoded::<GzDecoder<Source>>(&gzip(b"data")[..12]).is_err());
        assert!(decoded::<GzDecoder<Source>>(&[gzip(b"data"), vec![0x1f, 0x8b, 9]].concat()).is_err());
    }
}
