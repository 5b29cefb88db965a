//! The text header of an NRRD file.

use super::super::error::ReadError;
use super::super::fields::{Fields, Line, Lines};
use std::io::BufRead;
use std::path::Path;

/// The fields that are read.
const KNOWN: [&str; 19] = [
    "type",
    "dimension",
    "sizes",
    "encoding",
    "endian",
    "data file",
    "line skip",
    "byte skip",
    "space",
    "space dimension",
    "space units",
    "space directions",
    "space origin",
    "kinds",
    "spacings",
    "axis mins",
    "axis maxs",
    "centerings",
    "centers",
];

/// The fields, and the data files if the header lists them.
pub(super) struct Header<'a> {
    pub fields: Fields<'a>,
    /// File names after `data file: LIST`.
    pub listed: Vec<String>,
}

/// Reads up to and including the blank line that ends the header; a header that names data files may also
/// end at the end of its file. Comments and key/value pairs (`key:=value`) are skipped.
pub(super) fn read<'a>(path: &'a Path, reader: &mut dyn BufRead) -> Result<Header<'a>, ReadError> {
    let mut lines = Lines::new(path, reader);
    let magic = lines.next_line()?.map(|line| line.text.into_owned()).unwrap_or_default();
    if !matches!(magic.trim_end(), "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005") {
        return Err(ReadError::header(path, "first line", &magic, "NRRD0001 to NRRD0005"));
    }
    let mut fields = Fields::new(path, &KNOWN);
    let mut listed = Vec::new();
    while let Some(line) = lines.next_line()? {
        let Line { text, .. } = &line;
        if text.is_empty() {
            return Ok(Header { fields, listed });
        }
        if text.starts_with('#') || is_pair(text) {
            continue;
        }
        let Some((key, value)) = text.split_once(':') else {
            return Err(ReadError::header(
                path,
                "header line",
                text,
                "`field: value`, `key:=value` or `# comment`",
            ));
        };
        fields.insert(key, value, &line)?;
        let value = value.trim();
        if Fields::same(key, "data file") && (value == "LIST" || value.starts_with("LIST ")) {
            listed = lines.names("data file")?;
        }
    }
    if fields.get(&["data file"]).is_none() {
        let expected = "a blank line after the header, or a `data file` field";
        return Err(ReadError::missing(path, "end of the header", expected));
    }
    Ok(Header { fields, listed })
}

/// Whether the first colon of the line is part of `:=`.
fn is_pair(line: &str) -> bool {
    line.split_once(':').is_some_and(|(_, rest)| rest.starts_with('='))
}
