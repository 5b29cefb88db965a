//! Text headers of keys and values, as in NRRD and MetaImage.

use super::error::ReadError;
use std::io::{BufRead, Read};
use std::path::Path;
use std::str::FromStr;

/// Longer text, in bytes, is refused as a header.
const LONGEST_HEADER: usize = 1 << 20;

/// Reads lines, at most [`LONGEST_HEADER`] bytes of them.
pub(super) struct Lines<'a> {
    path: &'a Path,
    reader: &'a mut dyn BufRead,
    left: usize,
}

impl<'a> Lines<'a> {
    pub fn new(path: &'a Path, reader: &'a mut dyn BufRead) -> Self {
        Self { path, reader, left: LONGEST_HEADER }
    }

    /// The next line without its line ending; `None` at the end of the file.
    pub fn next_line(&mut self) -> Result<Option<String>, ReadError> {
        let mut line = Vec::new();
        let mut limited = (&mut *self.reader).take(self.left as u64);
        let read = limited.read_until(b'\n', &mut line).map_err(|source| ReadError::io(self.path, source))?;
        self.left -= read;
        if self.left == 0 {
            let expected = "a text header of at most 1 MiB";
            return Err(ReadError::header(self.path, "header", "more than 1 MiB of text", expected));
        }
        if read == 0 {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&line);
        Ok(Some(text.trim_end_matches(['\n', '\r']).to_string()))
    }
}

/// The entries of a header; keys are compared ignoring case and whitespace.
#[derive(Debug)]
pub(super) struct Fields<'a> {
    pub path: &'a Path,
    entries: Vec<(String, String)>,
}

impl<'a> Fields<'a> {
    pub fn new(path: &'a Path) -> Self {
        Self { path, entries: Vec::new() }
    }

    /// Whether two keys are the same.
    pub fn same(key: &str, other: &str) -> bool {
        plain(key) == plain(other)
    }

    pub fn insert(&mut self, key: &str, value: &str) {
        self.entries.push((plain(key), value.trim().to_string()));
    }

    /// The value of the first of these keys that is present; of repeated entries, the last.
    pub fn get(&self, keys: &[&str]) -> Option<&str> {
        keys.iter().find_map(|key| {
            let key = plain(key);
            self.entries.iter().rev().find(|(k, _)| *k == key).map(|(_, value)| value.as_str())
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

fn plain(key: &str) -> String {
    key.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_lowercase).collect()
}

/// More slices than any scanner produces; names of more files would need too much memory.
const MOST_FILES: usize = 1 << 16;

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
    fn an_endless_header_is_refused() {
        let text = vec![b'x'; LONGEST_HEADER + 1];
        let mut reader = &text[..];
        assert!(Lines::new(Path::new("test"), &mut reader).next_line().is_err());
    }
}
