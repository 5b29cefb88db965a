//! Why a volume file could not be read.

use std::io;
use std::path::{Path, PathBuf};
use tyndall::message::{excerpt, path_name, sentence};
use tyndall::volume::{GridError, VolumeError};

/// The kinds that [`super::read`] knows, for messages.
pub(super) const KINDS: &str =
    "NRRD (.nrrd, .nhdr), NIfTI (.nii, .nii.gz, .hdr + .img), MetaImage (.mha, .mhd) and NumPy (.npy)";

/// Why a volume file could not be read. Each message names the file, what was found, what was
/// expected and, where it helps, the fix.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system reported an error.
    #[error("{}: cannot be read: {source}", path_name(.path))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A folder, a pipe or a device.
    #[error("{}: {found}, expected a regular file", path_name(.path))]
    NotAFile {
        /// The path given.
        path: PathBuf,
        /// What is there instead.
        found: &'static str,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty, expected a volume", path_name(.path))]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Neither the first bytes nor the extension identify the kind.
    #[error("{}: not a known kind of volume; known are {KINDS}; for raw samples state their layout", path_name(.path))]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
    /// A header has a missing or invalid entry.
    #[error("{}: {key}: found {found}, expected {expected}", path_name(.path))]
    Header {
        /// The file.
        path: PathBuf,
        /// The header's key, or the place in it.
        key: String,
        /// What is there.
        found: String,
        /// What is allowed there.
        expected: String,
    },
    /// A valid file of a variant that is not supported.
    #[error("{}: {} is not supported; {fix}", path_name(.path), sentence(.what))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature.
        what: String,
        /// How to get around it.
        fix: String,
    },
    /// Fewer samples than the header states.
    #[error("{}: {found} bytes of samples, expected {expected} according to the header; the file is cut short or its header is wrong", path_name(.path))]
    Short {
        /// The file that holds the samples.
        path: PathBuf,
        /// Bytes after decompression (for text: samples).
        found: u64,
        /// Bytes that the header states (for text: samples).
        expected: u64,
    },
    /// The compressed stream or the text of the samples is damaged.
    #[error("{}: the samples are damaged: {}", path_name(.path), sentence(.message))]
    Damaged {
        /// The file that holds the samples.
        path: PathBuf,
        /// What the decoder said.
        message: String,
    },
    /// The samples would not fit in memory.
    #[error("{}: needs {needed} bytes of memory, but {available} are available; crop or downsample it", path_name(.path))]
    Memory {
        /// The file.
        path: PathBuf,
        /// Bytes that the samples need.
        needed: u64,
        /// Bytes that the machine has left.
        available: u64,
    },
    /// The file that a header names cannot be read.
    #[error("{}: its data file: {source}", path_name(.path))]
    DataFile {
        /// The header's file.
        path: PathBuf,
        /// What is wrong with the data file.
        source: Box<ReadError>,
    },
    /// The data values are too large to be rendered.
    #[error("{}: values from {:e} to {:e}, expected at most {:e} in magnitude; rescale them", path_name(.path), .range[0], .range[1], f32::MAX)]
    Values {
        /// The file.
        path: PathBuf,
        /// The smallest and the largest data value.
        range: [f64; 2],
    },
    /// The header's geometry is invalid.
    #[error("{}: {source}", path_name(.path))]
    Grid {
        /// The file.
        path: PathBuf,
        /// Why.
        source: GridError,
    },
    /// The samples and the grid do not make a valid volume.
    #[error("{}: {source}", path_name(.path))]
    Volume {
        /// The file.
        path: PathBuf,
        /// Why.
        source: VolumeError,
    },
}

impl ReadError {
    /// An invalid header entry; quotes what was found.
    pub(super) fn header(path: &Path, key: &str, found: &str, expected: &str) -> Self {
        Self::Header {
            path: path.into(),
            key: key.into(),
            found: format!("`{}`", excerpt(found)),
            expected: expected.into(),
        }
    }

    /// A missing header entry.
    pub(super) fn missing(path: &Path, key: &str, expected: &str) -> Self {
        Self::Header {
            path: path.into(),
            key: key.into(),
            found: "nothing".into(),
            expected: expected.into(),
        }
    }

    /// Something valid that is not supported.
    pub(super) fn unsupported(path: &Path, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Unsupported { path: path.into(), what: what.into(), fix: fix.into() }
    }

    /// An I/O error; if it wraps a [`ReadError`], that one is returned.
    pub(super) fn io(path: &Path, error: io::Error) -> Self {
        error.downcast::<Self>().unwrap_or_else(|source| Self::Io { path: path.into(), source })
    }

    /// The same error, in the data file that `header` names.
    pub(super) fn in_data_file(self, header: &Path) -> Self {
        Self::DataFile { path: header.into(), source: Box::new(self) }
    }
}
