//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Unfinished files, which must not outlive the process. Locked while one is created, moved or removed.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes `bytes` to `path`: first to a file beside it, which then replaces what was there. A device or a pipe is
/// written to directly.
///
/// # Errors
/// The system's error; no half-written file is left behind.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let path = match destination(path)? {
        Destination::File(path) => path,
        // Appended, because existing content must not be truncated: it may be a log.
        Destination::Stream => return OpenOptions::new().append(true).open(path)?.write_all(bytes),
    };
    let mut replacement = Replacement::beside(path)?;
    replacement.file.write_all(bytes)?;
    replacement.finish()
}

/// A file that is written piece by piece and appears at its path, replacing what was there, once it is finished. Dropped before, it leaves
/// nothing behind.
#[derive(Debug)]
pub struct Replacement {
    path: PathBuf,
    unfinished_path: PathBuf,
    file: File,
}

impl Replacement {
    /// Begins a file that is to be at `path`.
    ///
    /// # Errors
    /// The system's error; devices and pipes are refused.
    pub fn begin(path: &Path) -> Result<Self> {
        match destination(path)? {
            Destination::File(path) => Self::beside(path),
            Destination::Stream => Err(Error::new(ErrorKind::InvalidInput, "it is a device or a pipe")),
        }
    }

    /// Where the unfinished file is, for a program that writes it.
    #[must_use]
    pub fn unfinished_path(&self) -> &Path {
        &self.unfinished_path
    }

    /// Another handle of the file, for a writer that keeps what it writes to.
    pub(crate) fn handle(&self) -> Result<File> {
        self.file.try_clone()
    }

    fn beside(path: PathBuf) -> Result<Self> {
        let (unfinished_path, file) = create_beside(&path)?;
        Ok(Self { path, unfinished_path, file })
    }

    /// Puts the file at its path.
    ///
    /// # Errors
    /// The system's error; no half-written file is left behind.
    pub fn finish(self) -> Result<()> {
        self.file.sync_all()?;
        // Held while the file moves, so that an early end finds it either unfinished or at its path.
        let mut unfinished = unfinished();
        fs::rename(&self.unfinished_path, &self.path)?;
        unfinished.retain(|other| *other != self.unfinished_path);
        Ok(())
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        if unfinished.contains(&self.unfinished_path) {
            unfinished.retain(|other| *other != self.unfinished_path);
            // A leftover that cannot be removed is at least not at `path`.
            drop(fs::remove_file(&self.unfinished_path));
        }
    }
}

/// Whether [`replace`] could put a file at `path`; leaves nothing behind.
///
/// # Errors
/// Why not: the system's error, or what is already at `path`.
pub fn check(path: &Path) -> Result<()> {
    // A stream is not opened as a test: opening a pipe can block until it has a reader.
    let Destination::File(path) = destination(path)? else { return Ok(()) };
    let (unfinished_path, file) = create_beside(&path)?;
    drop(file);
    let mut unfinished = unfinished();
    unfinished.retain(|other| *other != unfinished_path);
    fs::remove_file(unfinished_path)
}

/// Removes every unfinished file. While the returned value is held, no file is created or finished, so that the
/// process can end without leaving one behind.
#[must_use = "files can be created again once it is dropped"]
pub fn abandon() -> impl Drop {
    let mut unfinished = unfinished();
    for unfinished_path in unfinished.drain(..) {
        // The process is about to end; there is nobody to report an error to.
        drop(fs::remove_file(unfinished_path));
    }
    unfinished
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths stays valid even if another thread panics.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is at the path to write to.
enum Destination {
    /// A file, or nothing yet.
    File(PathBuf),
    /// A device or a pipe, or whatever `/dev/stdout` refers to.
    Stream,
}

/// Where the bytes go. Follows links; refuses folders, disks and write-protected files.
fn destination(path: &Path) -> Result<Destination> {
    let about = match path.metadata() {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Destination::File(path.to_owned())),
        found => found?,
    };
    if about.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if is_stream(about.file_type()) || (about.is_file() && path.starts_with("/dev")) {
        return Ok(Destination::Stream);
    }
    if !about.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    if about.permissions().readonly() {
        return Err(Error::new(ErrorKind::PermissionDenied, "the file there is write-protected"));
    }
    path.canonicalize().map(Destination::File)
}

#[cfg(unix)]
fn is_stream(kind: fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_char_device() || kind.is_fifo()
}

#[cfg(not(unix))]
fn is_stream(_kind: fs::FileType) -> bool {
    false
}

fn create_beside(path: &Path) -> Result<(PathBuf, File)> {
    let folder = folder_of(path);
    for attempt in 0_u32.. {
        let unfinished_path = folder.join(format!(".tyndall-{}-{attempt}.part", std::process::id()));
        let mut unfinished = unfinished();
        match OpenOptions::new().write(true).create_new(true).open(&unfinished_path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
            Ok(file) => {
                unfinished.push(unfinished_path.clone());
                return Ok((unfinished_path, file));
            }
        }
    }
    Err(Error::new(ErrorKind::AlreadyExists, "the folder is full of unfinished pictures"))
}

/// The folder that contains a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn nothing_unfinished_outlives_an_early_end() {
        let folder = tempfile::tempdir().unwrap();
        let (_, mut file) = create_beside(&folder.path().join("a.png")).unwrap();
        file.write_all(b"half").unwrap();
        assert_eq!(names(folder.path()).len(), 1);
        let ending = abandon();
        assert!(names(folder.path()).is_empty());

        // A writer has to wait meanwhile.
        let place = folder.path().join("b.png");
        let writer = std::thread::spawn(move || replace(&place, b"whole"));
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(names(folder.path()).is_empty());
        drop(ending);
        writer.join().unwrap().unwrap();
        assert_eq!(names(folder.path()), ["b.png"]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_device_is_written_to_directly() {
        assert!(check(Path::new("/dev/null")).is_ok() && replace(Path::new("/dev/null"), b"text").is_ok());
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        let error = replace(Path::new("/dev/full"), b"text").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::StorageFull);
    }
}
