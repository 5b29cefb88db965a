//! What can go wrong with a picture, each with its fix.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use tyndall::light::BRIGHTEST;
use tyndall::message::{excerpt, path_name, sentence};

/// A picture or map that could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file's extension is missing or unknown.
    #[error("{}: {found}; give it one of {known}", path_name(path))]
    Extension {
        /// The file.
        path: PathBuf,
        /// The extension found, in words.
        found: String,
        /// The extensions that are known.
        known: &'static str,
    },
    /// The file cannot be written.
    #[error("{}: cannot write the picture: {source}; {fix}", path_name(path))]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: Error,
        /// What to do.
        fix: String,
    },
    /// The file cannot be read.
    #[error("{}: cannot read the picture: {source}; {fix}", path_name(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: Error,
        /// What to do.
        fix: String,
    },
    /// The picture has more pixels than the kind of file, or this program, can hold.
    #[error("{}: {width} x {height} pixels, expected at most {limit}; {fix}", path_name(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Pixels in a row.
        width: u64,
        /// Rows.
        height: u64,
        /// The limit, in words.
        limit: String,
        /// What to do.
        fix: &'static str,
    },
    /// The encoding library refused the picture.
    #[error("{}: cannot encode the picture: {}; try another kind of file", path_name(path), sentence(reason))]
    Encode {
        /// The file.
        path: PathBuf,
        /// The library's reason.
        reason: String,
    },
    /// The file's content is damaged, or of an unsupported variant.
    #[error("{}: not a readable {kind} file: {}; copy or save it again", path_name(path), sentence(reason))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The kind, judged by its first bytes or its name.
        kind: &'static str,
        /// What was found and what was expected.
        reason: String,
    },
    /// The file is not one of the kinds that carry metadata.
    #[error(
        "{}: found no picture, expected PNG, JPEG, TIFF or OpenEXR content; name a picture that Tyndall wrote",
        path_name(path)
    )]
    NotAPicture {
        /// The file.
        path: PathBuf,
    },
    /// A texel of a map is not a valid radiance.
    #[error(
        "{}: texel ({x}, {y}) is {value:?}, expected values from 0 to {BRIGHTEST:e}; repair it in the map",
        path_name(path)
    )]
    Texel {
        /// The file.
        path: PathBuf,
        /// Column, from the left.
        x: usize,
        /// Row, from the top.
        y: usize,
        /// Its red, green and blue.
        value: [f32; 3],
    },
}

impl ImageError {
    pub(super) fn extension(path: &Path, known: &'static str) -> Self {
        let found = match path.extension() {
            Some(extension) => format!("unknown kind `.{}`", excerpt(&extension.to_string_lossy())),
            None => "no extension".to_owned(),
        };
        Self::Extension { path: path.to_owned(), found, known }
    }

    pub(super) fn unwritable(path: &Path, source: Error) -> Self {
        let folder = crate::atomic::folder_of(path);
        let fix = match source.kind() {
            ErrorKind::NotFound => format!("create the folder {} first", path_name(folder)),
            ErrorKind::NotADirectory => {
                format!("choose another place: {} is not a folder", path_name(folder))
            }
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                "choose a file and folder that you may write to".to_owned()
            }
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                "free some space or use another disk".to_owned()
            }
            ErrorKind::IsADirectory => "add a file name to it".to_owned(),
            ErrorKind::InvalidFilename => "give it a shorter name".to_owned(),
            _ => "choose another place".to_owned(),
        };
        Self::Unwritable { path: path.to_owned(), source, fix }
    }

    pub(super) fn unreadable(path: &Path, source: Error) -> Self {
        let fix = match source.kind() {
            ErrorKind::PermissionDenied => "ask for permission to read it",
            ErrorKind::IsADirectory => "name a file inside it",
            _ => "check the path",
        };
        Self::Unreadable { path: path.to_owned(), source, fix: fix.to_owned() }
    }

    pub(super) fn malformed(path: &Path, kind: &'static str, reason: String) -> Self {
        Self::Malformed { path: path.to_owned(), kind, reason }
    }
}

/// Why an encoder failed; the path is added later.
#[derive(Debug)]
pub(super) enum EncodeFailure {
    TooLarge { width: u32, height: u32, limit: String },
    Library(String),
}

impl EncodeFailure {
    pub(super) fn library(error: &dyn std::error::Error) -> Self {
        Self::Library(error.to_string())
    }

    pub(super) fn at(self, path: &Path) -> ImageError {
        let path = path.to_owned();
        match self {
            Self::TooLarge { width, height, limit } => ImageError::TooLarge {
                path,
                width: width.into(),
                height: height.into(),
                limit,
                fix: "write .png, .tif or .exr instead",
            },
            Self::Library(reason) => ImageError::Encode { path, reason },
        }
    }
}
