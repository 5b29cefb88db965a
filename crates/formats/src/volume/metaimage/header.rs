//! The text header of a MetaImage: lines of `key = value`, the last of which is `ElementDataFile`.

use super::super::error::ReadError;
use super::super::fields::{Fields, Lines};
use std::io::BufRead;
use std::path::Path;

/// Keys that headers begin with in practice.
const FIRST_KEYS: [&str; 5] = ["ObjectType", "ObjectSubType", "NDims", "Comment", "TransformType"];

/// Whether a file that begins with `head` is a MetaImage.
pub(in super::super) fn recognises(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let first = text.trim_start().lines().next().and_then(|line| line.split_once('='));
    first.is_some_and(|(key, _)| FIRST_KEYS.contains(&key.trim()))
}

/// The fields, and the data files if the header lists them.
pub(super) struct Header<'a> {
    pub fields: Fields<'a>,
    /// File names after `ElementDataFile = LIST`.
    pub listed: Vec<String>,
}

/// Reads up to and including the line of `ElementDataFile`, and any list after it.
pub(super) fn read<'a>(path: &'a Path, reader: &mut dyn BufRead) -> Result<Header<'a>, ReadError> {
    let mut lines = Lines::new(path, reader);
    let mut fields = Fields::new(path);
    let mut listed = Vec::new();
    while let Some(line) = lines.next_line()? {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            return Err(ReadError::header(path, "header line", &line, "`key = value`"));
        };
        fields.insert(key, value);
        if key.trim().eq_ignore_ascii_case("ElementDataFile") {
            if value.split_whitespace().next() == Some("LIST") {
                while let Some(name) = lines.next_line()? {
                    if !name.trim().is_empty() {
                        listed.push(name.trim().to_string());
                    }
                }
            }
            break;
        }
    }
    Ok(Header { fields, listed })
}
