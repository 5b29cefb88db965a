//! Samples in files apart from their header: one file, or several, each holding a slab of the slowest axis.

use super::error::ReadError;
use super::fields::numbered_files;
use super::layout::Layout;
use super::stream::{Concatenated, Stream};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use tyndall::volume::Voxels;

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
        // A fourth number states the axes of a slab; it is not needed, as the number of files implies them.
        [pattern, ref range @ ..] if pattern.contains('%') && (2..=4).contains(&range.len()) => {
            let mut numbers = [0, 0, 1];
            for (number, word) in numbers.iter_mut().zip(range) {
                *number = word
                    .parse()
                    .map_err(|_| ReadError::header(header, key, value, "PATTERN FIRST LAST STEP"))?;
            }
            numbered_files(header, key, pattern, numbers, slowest)?
        }
        _ => vec![value.to_string()],
    };
    if names.is_empty() || !slowest.is_multiple_of(names.len()) {
        let expected = format!("a number of files that divides the slowest axis, {slowest}");
        return Err(ReadError::header(header, key, &format!("{} files", names.len()), &expected));
    }
    Ok(names)
}

/// Reads the named files, whose paths are relative to the header's folder; `open(path, n)` opens one from which
/// `n` bytes of samples are needed.
pub(super) fn read(
    header: &Path,
    names: &[String],
    layout: &Layout,
    open: impl Fn(&Path, u64) -> Result<Stream<'static>, ReadError>,
) -> Result<Voxels, ReadError> {
    let folder = header.parent().unwrap_or(Path::new(""));
    let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    let total = layout.bytes();
    let voxels = match &paths[..] {
        [path] => open(path, total).and_then(|stream| layout.read(path, stream)),
        _ if layout.text => {
            let fix = "use one data file, or binary samples";
            return Err(ReadError::unsupported(header, "text in several data files", fix));
        }
        _ => {
            let each = total / paths.len() as u64;
            let parts = Concatenated::new(paths, each, |path: &Path| open(path, each));
            let reader = Box::new(BufReader::with_capacity(1 << 16, parts));
            layout.read(header, Stream { reader, available: None })
        }
    };
    voxels.map_err(|error| error.in_data_file(header))
}
