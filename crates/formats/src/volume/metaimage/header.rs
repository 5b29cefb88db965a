//! The text header of a MetaImage: lines of `key = value` or, as MetaIO reads too, `key: value`, the last of which is `ElementDataFile`.

use super::super::error::ReadError;
use super::super::fields::{Fields, Line, Lines};
use std::io::BufRead;
use std::path::Path;

/// Keys that headers begin with in practice.
const FIRST_KEYS: [&str; 5] = ["ObjectType", "ObjectSubType", "NDims", "Comment", "TransformType"];

/// The first of these in a line ends its key.
const SEPARATORS: [char; 2] = ['=', ':'];

/// The entries that are read.
const KNOWN: [&str; 21] = [
    "NDims",
    "DimSize",
    "ElementNumberOfChannels",
    "ElementType",
    "ElementSpacing",
    "ElementSize",
    "Offset",
    "Position",
    "Origin",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "AnatomicalOrientation",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "ElementByteOrderMSB",
    "CompressedData",
    "HeaderSize",
    "ElementDataFile",
    "ElementToIntensityFunctionSlope",
    "ElementToIntensityFunctionOffset",
];

/// Whether a file that begins with `head` is a MetaImage.
pub(in super::super) fn recognises(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let first = text.trim_start().lines().next().and_then(|line| line.split_once(SEPARATORS));
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
    let mut fields = Fields::new(path, &KNOWN);
    let mut listed = Vec::new();
    while let Some(line) = lines.next_line()? {
        let Line { text, .. } = &line;
        if text.trim().is_empty() || text.starts_with('#') {
            continue;
        }
        let Some((key, value)) = text.split_once(SEPARATORS) else {
            return Err(ReadError::header(path, "header line", text, "`key = value` or `key: value`"));
        };
        fields.insert(key, value, &line)?;
        if key.trim().eq_ignore_ascii_case("ElementDataFile") {
            if value.split_whitespace().next() == Some("LIST") {
                listed = lines.names("ElementDataFile")?;
            }
            break;
        }
    }
    Ok(Header { fields, listed })
}
