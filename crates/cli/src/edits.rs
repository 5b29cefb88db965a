//! Edits files: a JSON list of named merge patches.

use crate::Failure;
use serde_json::Value;
use std::path::Path;
use tyndall::message::{excerpt, path_name, quoted};
use tyndall_live::document::{self, DocumentError};
use tyndall_live::read_text;

/// One edit.
pub struct Edit {
    /// Its name in reports; `edit 3` where the file gives none.
    pub name: String,
    /// Which one it is, for messages: by number, and by name if it has one.
    pub at: String,
    /// A JSON Merge Patch on the scene document, a table.
    pub patch: Value,
}

/// The edits of a file, not yet checked one by one, so that those before a bad one are still played.
pub fn read(path: &Path) -> Result<Vec<Value>, Failure> {
    let what = "a list of edits";
    let value =
        document::value_from_json(&read_text(path, what).map_err(Failure::input)?).map_err(|e| match e {
            DocumentError::Syntax { line, column, message, .. } => Failure::input(format!(
                "{}: line {line}, column {column}: {message}; expected {what} in JSON",
                path_name(path)
            )),
            other => Failure::input(format!("{}: {other}", path_name(path))),
        })?;
    match value {
        Value::Array(edits) => Ok(edits),
        other => Err(Failure::input(format!(
            "{}: found {}, expected a list of edits: [{{\"name\": ..., \"patch\": {{...}}}}, ...]",
            path_name(path),
            kind(&other)
        ))),
    }
}

impl Edit {
    /// Reads the `number`-th edit, counted from 0; the error says what is wrong with it.
    pub fn read(value: &Value, number: usize) -> Result<Self, String> {
        let at = format!("edit {}", number + 1);
        let expected = "expected {\"name\": ..., \"patch\": {...}}";
        let table = value.as_object().ok_or_else(|| format!("{at}: found {}, {expected}", kind(value)))?;
        if let Some(unknown) = table.keys().find(|key| !["name", "patch"].contains(&key.as_str())) {
            return Err(format!("{at}: unknown key {}, {expected}", quoted(unknown)));
        }
        let (name, at) = match table.get("name") {
            None => (at.clone(), at),
            Some(Value::String(name)) => (name.clone(), format!("{at} (`{}`)", excerpt(name))),
            Some(other) => return Err(format!("{at}: `name`: found {}, expected a string", kind(other))),
        };
        match table.get("patch") {
            Some(patch @ Value::Object(_)) => Ok(Self { name, at, patch: patch.clone() }),
            Some(other) => Err(format!("{at}: `patch`: found {}, expected a table of changes", kind(other))),
            None => Err(format!("{at}: no `patch`, {expected}")),
        }
    }
}

/// A JSON value in a word or two.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "a list",
        Value::Object(_) => "a table",
    }
}
