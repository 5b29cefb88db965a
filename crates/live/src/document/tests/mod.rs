//! Tests of the document as users write it.

mod accepted;
mod refused;

use serde_json::{Value, json};

use super::{Document, DocumentError, apply};

/// A small valid document, changed by a merge patch.
fn scene(patch: &Value) -> Result<Document, DocumentError> {
    Document::from_value(apply(&json!({ "volume": { "path": "head.nrrd" } }), patch))
}

fn nested(path: &str, value: Value) -> Value {
    path.rsplit('.').fold(value, |inner, key| json!({ key: inner }))
}

fn point(value: f64) -> Value {
    json!({ "value": value, "opacity": 0.5 })
}
