//! Text headers of keys and values, as in NRRD and MetaImage.

use super::error::ReadError;
use std::borrow::Cow;
use std::io::{BufRead, Read};
use std::path::Path;
use std::str::FromStr;

/// Bytes of a line that are kept. No entry that a reader needs is longer; comments, and what other programs store, may be.
const KEPT: usize = 1 << 16;

/// Reads lines. However long a header is, no more than a line of it is kept.
pub(super) struct Lines<'a> {
    path: &'a Path,
    reader: &'a mut dyn BufRead,
    /// The last line.
    bytes: Vec<u8>,
}

/// A line of a header.
#[derive(Debug)]
pub(super) struct Line<'a> {
    /// Without its ending; the first [`KEPT`] bytes.
    pub text: Cow<'a, str>,
    /// Whether it is longer.
    pub is_cut: bool,
}

impl<'a> Lines<'a> {
    pub fn new(path: &'a Path, reader: &'a mut dyn BufRead) -> Self {
        Self { path, reader, bytes: Vec::new() }
    }

    /// The next line; `None` at the end of the file.
    pub fn next_line(&mut self) -> Result<Option<Line<'_>>, ReadError> {
        let trouble = |source| ReadError::io(self.path, source);
        let line = &mut self.bytes;
        line.clear();
        let read = (&mut *self.reader).take(KEPT as u64).read_until(b'\n', line).map_err(trouble)?;
        if read == 0 {
            return Ok(None);
        }
        let is_cut = line.len() == KEPT && line.last() != Some(&b'\n');
        if is_cut {
            self.reader.skip_until(b'\n').map_err(trouble)?;
        }
        while line.pop_if(|byte| matches!(byte, b'\n' | b'\r')).is_some() {}
        Ok(Some(Line { text: String::from_utf8_lossy(line), is_cut }))
    }

    /// The names of files, one a line, to the end of the file; `key` names the list.
    ///
    /// # Errors
    /// [`ReadError::Header`] for more than [`MOST_FILES`].
    pub fn names(&mut self, key: &str) -> Result<Vec<String>, ReadError> {
        let (mut names, path) = (Vec::new(), self.path);
        while let Some(Line { text, is_cut }) = self.next_line()? {
            let name = text.trim();
            if is_cut {
                return Err(ReadError::header(path, key, name, "one file name a line, each under 64 KiB"));
            }
            if names.len() == MOST_FILES {
                let expected = format!("at most {MOST_FILES} names of files, of which this is one more");
                return Err(ReadError::header(path, key, name, &expected));
            }
            if !name.is_empty() {
                names.push(name.to_string());
            }
        }
        Ok(names)
    }
}

/// The entries of a header that its reader knows; keys are compared ignoring case and whitespace.
#[derive(Debug)]
pub(super) struct Fields<'a> {
    pub path: &'a Path,
    known: &'static [&'static str],
    /// By position in `known`; of repeated entries, the last.
    values: Vec<Option<String>>,
}

impl<'a> Fields<'a> {
    /// Without entries; those of keys that are not `known` are not kept, however many there are.
    pub fn new(path: &'a Path, known: &'static [&'static str]) -> Self {
        Self { path, known, values: vec![None; known.len()] }
    }

    /// Whether two keys are the same.
    pub fn same(key: &str, other: &str) -> bool {
        let first =
            |key: &str| key.bytes().find(|b| !b.is_ascii_whitespace()).map(|b| b.to_ascii_lowercase());
        // Nearly all keys differ there, and there may be millions.
        let differ = |a: Option<u8>, b: Option<u8>| {
            a != b && a.is_some_and(|a| a.is_ascii()) && b.is_some_and(|b| b.is_ascii())
        };
        !differ(first(key), first(other)) && plain(key).eq(plain(other))
    }

    /// Keeps the entry of a line, whose value ends with the line, if its key is known.
    ///
    /// # Errors
    /// [`ReadError::Header`] if the line was cut.
    pub fn insert(&mut self, key: &str, value: &str, line: &Line<'_>) -> Result<(), ReadError> {
        let Some(place) = self.known.iter().position(|known| Self::same(known, key)) else { return Ok(()) };
        if line.is_cut {
            let expected = format!("an entry of less than {} KiB", KEPT >> 10);
            return Err(ReadError::header(self.path, key.trim(), value.trim(), &expected));
        }
        self.values[place] = Some(value.trim().to_string());
        Ok(())
    }

    /// The value of the first of these keys that is present; all must be known.
    pub fn get(&self, keys: &[&str]) -> Option<&str> {
        keys.iter().find_map(|key| {
            let place = self.known.iter().position(|known| Self::same(known, key));
            debug_assert!(place.is_some(), "`{key}` is read, but not kept");
            self.values[place?].as_deref()
        })
    }

    /// A required value.
    pub fn need(&self, keys: &[&str], expected: &str) -> Result<&str, ReadError> {
        self.get(keys).ok_or_else(|| ReadError::missing(self.path, keys[0], expected))
    }

    /// The value parsed as a single word or number.
    pub fn one<T: FromStr>(&self, keys: &[&str], expected: &str) -> Result<Option<T>, ReadError> {
        self.get(keys)
            .map(|text| text.parse().map_err(|_| ReadError::header(self.path, keys[0], text, expected)))
            .transpose()
    }

    /// Exactly `count` words, each parsed into a value.
    pub fn list<T>(
        &self,
        keys: &[&str],
        count: usize,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<Vec<T>>, ReadError> {
        let Some(text) = self.get(keys) else { return Ok(None) };
        let wrong = || ReadError::header(self.path, keys[0], text, &format!("{count} {expected}"));
        let values: Vec<T> = text.split_whitespace().map(parse).collect::<Option<_>>().ok_or_else(wrong)?;
        if values.len() == count { Ok(Some(values)) } else { Err(wrong()) }
    }

    /// Exactly `count` finite numbers.
    pub fn numbers(&self, keys: &[&str], count: usize) -> Result<Option<Vec<f64>>, ReadError> {
        self.list(keys, count, "finite numbers", finite)
    }
}

/// A finite number.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|v: &f64| v.is_finite())
}

fn plain(key: &str) -> impl Iterator<Item = char> {
    key.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_lowercase)
}

/// More slices than any scanner produces; names of more files would need too much memory.
pub(super) const MOST_FILES: usize = 1 << 16;

/// The files that a header names by a pattern such as `slice%03d.raw`, numbered `first`, `first + step` ... `last`.
///
/// # Errors
/// [`ReadError::Header`] if the pattern has no place for a number, or the numbers give no file or more than `most`.
pub(super) fn numbered_files(
    path: &Path,
    key: &str,
    pattern: &str,
    [first, last, step]: [i64; 3],
    most: usize,
) -> Result<Vec<String>, ReadError> {
    let found = format!("{pattern} {first} {last} {step}");
    let wrong = |expected: &str| ReadError::header(path, key, &found, expected);
    let (before, rest) = pattern.split_once('%').ok_or_else(|| wrong("a pattern with %d in it"))?;
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (digits, rest) = rest.split_at(end);
    let after = rest.strip_prefix(['d', 'i', 'u']).ok_or_else(|| wrong("a number such as %d or %03d"))?;
    let width: usize = if digits.is_empty() { 0 } else { digits.parse().unwrap_or(usize::MAX) };
    let span = last.checked_sub(first).filter(|span| step != 0 && span.signum() * step.signum() >= 0);
    let most = most.min(MOST_FILES);
    let count = span.and_then(|span| usize::try_from(span.checked_div(step)?).ok());
    let count = count.filter(|&n| n < most && width <= 20);
    let count = count.ok_or_else(|| wrong(&format!("numbers that give 1 to {most} files")))?;
    let name = |n: usize| {
        let number = first + step * i64::try_from(n).unwrap_or(0);
        if digits.starts_with('0') {
            format!("{before}{number:0width$}{after}")
        } else {
            format!("{before}{number:width$}{after}")
        }
    };
    Ok((0..=count).map(name).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_name_their_files() {
        let path = Path::new("test");
        let names = |pattern, range| numbered_files(path, "data file", pattern, range, 9);
        assert_eq!(names("a%03d.raw", [8, 12, 2]).unwrap(), ["a008.raw", "a010.raw", "a012.raw"]);
        assert_eq!(names("%d", [2, 1, -1]).unwrap(), ["2", "1"]);
        for (pattern, range) in [
            ("a.raw", [1, 2, 1]),
            ("%s", [1, 2, 1]),
            ("%d", [1, 2, 0]),
            ("%d", [i64::MIN, i64::MAX, 1]),
            ("%d", [0, i64::MIN, -1]),
            ("%99999999999999999999d", [1, 2, 1]),
            ("%d", [1, 2, -1]),
            ("%d", [1, 10, 1]),
        ] {
            assert!(names(pattern, range).is_err(), "{pattern} {range:?}");
        }
    }

    #[test]
    fn the_number_of_files_is_limited() {
        let names = numbered_files(Path::new("test"), "data file", "%d", [1, 1 << 40, 1], usize::MAX);
        assert!(names.unwrap_err().to_string().contains("65536 files"));
    }

    #[test]
    fn of_a_long_line_the_beginning_is_kept() {
        let text =
            [vec![b'x'; KEPT - 1], b"\n".to_vec(), vec![b'y'; 3 * KEPT], b"\r\nlast".to_vec()].concat();
        let mut reader = std::io::BufReader::with_capacity(7, &text[..]);
        let mut lines = Lines::new(Path::new("test"), &mut reader);
        let mut next = || lines.next_line().unwrap().map(|line| (line.text.len(), line.is_cut));
        assert_eq!(
            [next(), next(), next(), next()],
            [Some((KEPT - 1, false)), Some((KEPT, true)), Some((4, false)), None]
        );
    }

    #[test]
    fn a_needed_entry_that_was_cut_is_refused_and_others_are_not_kept() {
        let mut fields = Fields::new(Path::new("test"), &["sizes"]);
        let line = |is_cut| Line { text: Cow::Borrowed(""), is_cut };
        assert!(fields.insert("comment", "x", &line(true)).is_ok());
        assert!(fields.insert("Sizes", "1 2", &line(false)).is_ok());
        assert_eq!(fields.get(&["sizes"]), Some("1 2"));
        assert!(fields.insert("sizes", "1 2", &line(true)).unwrap_err().to_string().contains("sizes"));
    }
}
