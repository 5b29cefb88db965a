//! Text files, read only if they are of a reasonable size.

use crate::error::LiveError;
use std::fmt::Display;
use std::path::Path;
use tyndall::message::path_name;

/// The largest text document that is read, in bytes.
const LARGEST_DOCUMENT: u64 = 256 << 20;

/// Bytes of memory that a byte of text may take: a million lights took 33 times the size of their text.
const MEMORY_PER_BYTE: u64 = 40;

/// The text of a file that should be `what`, such as "a scene document".
///
/// # Errors
/// [`LiveError::File`] if it cannot be read, is not UTF-8, or is too large.
pub fn read_text(path: &Path, what: &str) -> Result<String, LiveError> {
    let unreadable = |e: std::io::Error| file(path, format!("cannot be read: {e}; check the path"));
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(file(path, format!("not a file; expected {what}")));
    }
    if about.len() > LARGEST_DOCUMENT {
        return Err(file(path, format!("{} bytes; {what} has at most {LARGEST_DOCUMENT}", about.len())));
    }
    let needed = about.len().saturating_mul(MEMORY_PER_BYTE);
    if let Some(available) = tyndall_formats::memory::available().filter(|&available| needed > available) {
        let problem = format!(
            "{what} of {} MiB takes up to {} MiB of memory, but {} MiB are free; expected a smaller one",
            about.len() >> 20,
            needed >> 20,
            available >> 20
        );
        return Err(file(path, problem));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|e| {
        file(path, format!("byte {} is not UTF-8; expected {what} in UTF-8", e.utf8_error().valid_up_to()))
    })
}

fn file(path: &Path, problem: impl Display) -> LiveError {
    LiveError::File { at: path_name(path), problem: problem.to_string() }
}
