//! Samples in files apart from their header: one file, or several, each holding a slab of the slowest axis.

use super::error::ReadError;
use super::fields::numbered_files;
use super::layout::{Layout, Samples};
use super::stream::{Concatenated, Stream};
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The files that the value of `key` names: the list below it, a numbered pattern, or one file.
pub(super) fn names(
    header: &Path,
    key: &str,
    value: &str,
    listed: Vec<String>,
    slowest: usize,
) -> Result<Vec<String>, ReadError> {
    let words: Vec<&str> = value.split_whitespace().collect();
    let names = match words[..] {
        ["LIST"] | ["LIST", _] => listed,
        // Names may have percent signs and numbers in them, such as `75% 0.75 B26f.raw`.
        _ if folder_of(header).join(value).is_file() => vec![value.to_string()],
        _ => match Pattern::parse(&words) {
            Some(Pattern { name, numbers }) => numbered_files(header, key, name, numbers, slowest)?,
            None => vec![value.to_string()],
        },
    };
    if names.is_empty() || !slowest.is_multiple_of(names.len()) {
        let expected = format!("a number of files that divides the slowest axis, {slowest}");
        return Err(ReadError::header(header, key, &format!("{} files", names.len()), &expected));
    }
    Ok(names)
}

/// A name with a place for a number, such as `slice%03d.raw`, and which numbers it stands for.
struct Pattern<'a> {
    name: &'a str,
    /// The first, the last and their step.
    numbers: [i64; 3],
}

impl<'a> Pattern<'a> {
    /// From `PATTERN FIRST LAST`, with a step or without. A fourth number states the axes of a slab; it is not needed, as the number of
    /// files implies them.
    fn parse(words: &[&'a str]) -> Option<Self> {
        let (&name, range) = words.split_first()?;
        let mut numbers = [0, 0, 1];
        let given: Vec<i64> = range.iter().map(|word| word.parse().ok()).collect::<Option<_>>()?;
        if !name.contains('%') || !(2..=4).contains(&given.len()) {
            return None;
        }
        numbers.iter_mut().zip(given).for_each(|(number, given)| *number = given);
        Some(Self { name, numbers })
    }
}

fn folder_of(header: &Path) -> &Path {
    header.parent().unwrap_or(Path::new(""))
}

/// Reads the named files, whose paths are relative to the header's folder; `open(path, n)` opens one from which
/// `n` bytes of samples are needed.
pub(super) fn read(
    header: &Path,
    names: &[String],
    layout: &Layout,
    open: impl Fn(&Path, u64) -> Result<Stream<'static>, ReadError>,
) -> Result<Samples, ReadError> {
    let folder = folder_of(header);
    let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    let total = layout.bytes();
    let samples = match &paths[..] {
        [path] => open(path, total).and_then(|stream| layout.read(path, stream)),
        _ if layout.text => {
            let fix = "use one data file, or binary samples";
            return Err(ReadError::unsupported(header, "text in several data files", fix));
        }
        _ => {
            let each = total / paths.len() as u64;
            let parts = Concatenated::new(paths, each, |path: &Path| open(path, each));
            let surplus = parts.surplus();
            let reader = Box::new(BufReader::with_capacity(1 << 16, parts));
            layout.read(header, Stream { surplus, ..Stream::of(reader) })
        }
    };
    samples.map_err(|error| error.in_data_file(header))
}
