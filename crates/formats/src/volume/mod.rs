//! Volume files: NRRD, NIfTI, MetaImage, NumPy arrays and raw samples.
//!
//! Every reader returns the grid in Tyndall's world (anatomical files in LPS millimetres), the samples in
//! the file's type, and the map from samples to data values. Of several channels or time steps only the
//! first is read. A file that is damaged, cut short or states a wrong size gives a [`ReadError`];
//! memory use grows with what the file actually holds.

mod detached;
mod error;
mod fields;
mod layout;
mod members;
mod metaimage;
mod nifti;
mod nrrd;
mod numpy;
mod placement;
mod raw;
mod sample_type;
mod stream;
mod surplus;

pub use error::ReadError;
pub use raw::{RawLayout, read_raw};
pub use sample_type::{Endian, SampleType, UnknownName};

use std::path::Path;
use tyndall::volume::{Grid, ValueMap, Volume, Voxels};

/// A volume, and what else its file contained.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The first channel at the first time.
    pub volume: Volume,
    /// Components per voxel in the file.
    pub channels: usize,
    /// Time steps in the file.
    pub times: usize,
    /// What the user should know: skipped parts of the file, assumptions, inconsistencies.
    pub notes: Vec<String>,
}

/// Reads a volume of any known kind, recognised by the first bytes, otherwise by the file's name.
///
/// # Errors
/// [`ReadError`] if the file is missing, of no known kind, damaged, or too large for memory.
pub fn read(path: &Path) -> Result<Loaded, ReadError> {
    match kind(path)? {
        Some(Kind::Nrrd) => nrrd::read(path),
        Some(Kind::Nifti) => nifti::read(path),
        Some(Kind::MetaImage) => metaimage::read(path),
        Some(Kind::Numpy) => numpy::read(path),
        None => Err(ReadError::UnknownKind { path: path.into() }),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Nrrd,
    Nifti,
    MetaImage,
    Numpy,
}

/// The kind by the first bytes; by the name for files that have no signature there: the samples of a NIfTI
/// pair, and MetaImage headers that begin unusually.
fn kind(path: &Path) -> Result<Option<Kind>, ReadError> {
    let head = stream::first_bytes(path)?;
    if head.starts_with(b"NRRD00") {
        return Ok(Some(Kind::Nrrd));
    }
    if head.starts_with(b"\x93NUMPY") {
        return Ok(Some(Kind::Numpy));
    }
    if nifti::recognises(&head) {
        return Ok(Some(Kind::Nifti));
    }
    if metaimage::recognises(&head) {
        return Ok(Some(Kind::MetaImage));
    }
    let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    Ok(match name.rsplit_once('.').map(|(_, extension)| extension) {
        Some("nrrd" | "nhdr") => Some(Kind::Nrrd),
        Some("nii" | "hdr" | "img") => Some(Kind::Nifti),
        Some("mha" | "mhd") => Some(Kind::MetaImage),
        Some("npy") => Some(Kind::Numpy),
        _ => None,
    })
}

/// What a reader found, before the [`Volume`] is built and its ranges computed.
struct Parsed {
    grid: Grid,
    voxels: Voxels,
    values: ValueMap,
    channels: usize,
    times: usize,
    notes: Vec<String>,
}

impl Parsed {
    fn load(self, path: &Path) -> Result<Loaded, ReadError> {
        let Self { grid, voxels, values, channels, times, mut notes } = self;
        if channels > 1 {
            notes.push(format!("{channels} channels: the first was read"));
        }
        if times > 1 {
            notes.push(format!("{times} time steps: the first was read"));
        }
        let volume = Volume::new(grid, voxels, values)
            .map_err(|source| ReadError::Volume { path: path.into(), source })?;
        let range = volume.value_range();
        // False for NaN, which slope and intercept can produce from two infinities.
        let fits = |value: &f64| value.abs() <= f64::from(f32::MAX);
        if !range.iter().all(fits) {
            return Err(ReadError::Values { path: path.into(), range });
        }
        Ok(Loaded { volume, channels, times, notes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use tempfile::TempDir;

    /// A file in a folder of its own, which exists until the first value is dropped.
    pub(super) fn folder_with(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    #[test]
    fn the_first_bytes_win_over_the_name() {
        let nrrd = b"NRRD0004\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\n\n\x01\x02";
        for name in ["a.nii.gz", "a.mha", "a", "a.npy", "a.raw"] {
            let (_folder, path) = folder_with(name, nrrd);
            assert_eq!(read(&path).unwrap().volume.voxels(), Voxels::U8(vec![1, 2]), "{name}");
        }
    }

    #[test]
    fn values_that_single_precision_cannot_hold_are_refused() {
        for (largest, fits) in [(3.4e38, true), (3.5e38, false), (-1e300, false)] {
            let head = b"NRRD0004\ntype: double\ndimension: 1\nsizes: 2\nencoding: raw\nendian: little\n\n";
            let bytes = [&head[..], &[0; 8], &f64::to_le_bytes(largest)].concat();
            let (_folder, path) = folder_with("a.nrrd", &bytes);
            match read(&path) {
                Ok(_) => assert!(fits, "{largest}"),
                Err(error) => assert!(!fits && matches!(error, ReadError::Values { .. }), "{error}"),
            }
        }
    }

    #[test]
    fn a_file_that_is_not_a_volume_is_reported() {
        let (folder, path) = folder_with("a.txt", b"hello");
        let message = read(&path).unwrap_err().to_string();
        assert!(
            ["a.txt", "NRRD", "NIfTI", "MetaImage", "NumPy"].iter().all(|w| message.contains(w)),
            "{message}"
        );
        assert!(matches!(read(folder.path()), Err(ReadError::NotAFile { found: "a folder", .. })));
        assert!(matches!(read(&folder.path().join("none.nrrd")), Err(ReadError::Io { .. })));
        let (_folder, path) = folder_with("a.nrrd", b"");
        assert!(matches!(read(&path), Err(ReadError::Empty { .. })));
        for name in ["a.nrrd", "a.nii", "a.nii.gz", "a.hdr", "a.mha", "a.mhd", "a.npy"] {
            let (_folder, path) = folder_with(name, b"hello");
            let error = read(&path).unwrap_err();
            assert!(!matches!(error, ReadError::UnknownKind { .. }), "{name}: {error}");
        }
    }
}
