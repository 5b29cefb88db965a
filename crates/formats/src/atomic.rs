//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// Puts `bytes` at `path`: written to a file beside it first, then moved over what was there.
///
/// # Errors
/// What the system says; nothing half-written is left behind.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let path = destination(path)?;
    let (beside, mut file) = create_beside(&path)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    let moved = written.and_then(|()| fs::rename(&beside, &path));
    if moved.is_err() {
        // The first failure is the one to tell; a file that cannot be removed either is at least not the picture.
        drop(fs::remove_file(&beside));
    }
    moved
}

/// Whether [`replace`] could put a file at `path`; leaves nothing behind.
///
/// # Errors
/// What the system or a look at the place says against it.
pub fn check(path: &Path) -> Result<()> {
    let (beside, file) = create_beside(&destination(path)?)?;
    drop(file);
    fs::remove_file(beside)
}

/// Where the bytes go: through links, and never over a folder, a device or a protected file.
fn destination(path: &Path) -> Result<PathBuf> {
    let existing = match path.canonicalize() {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(path.to_owned()),
        found => found?,
    };
    let about = existing.metadata()?;
    if about.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if !about.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    if about.permissions().readonly() {
        return Err(Error::new(ErrorKind::PermissionDenied, "the file there is write-protected"));
    }
    Ok(existing)
}

fn create_beside(path: &Path) -> Result<(PathBuf, File)> {
    let folder = folder_of(path);
    for attempt in 0_u32.. {
        let beside = folder.join(format!(".tyndall-{}-{attempt}.part", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&beside) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
            Ok(file) => return Ok((beside, file)),
        }
    }
    Err(Error::new(ErrorKind::AlreadyExists, "the folder is full of unfinished pictures"))
}

/// The folder that a file lies in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
