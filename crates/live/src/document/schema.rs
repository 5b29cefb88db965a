//! The document's JSON Schema (draft 2020-12), derived from its types: what `tyndall schema` prints, and what
//! documents are checked against.

use std::sync::LazyLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::{Map, Value};

use super::Document;
use super::number::shorten;

/// The key that tells the variants of a tagged union apart.
pub(super) const TAG: &str = "type";

/// The JSON Schema of the scene document.
#[must_use]
pub fn schema() -> Value {
    shared().clone()
}

/// The one copy that documents are checked against.
pub(super) fn shared() -> &'static Value {
    static SCHEMA: LazyLock<Value> = LazyLock::new(|| {
        let settings = SchemaSettings::draft2020_12().with_transform(RecursiveTransform(tidy));
        settings.into_generator().into_root_schema_for::<Document>().to_value()
    });
    &SCHEMA
}

/// Changes what is derived from the types to what holds for the document.
fn tidy(schema: &mut Schema) {
    let Some(keywords) = schema.as_object_mut() else { return };
    drop_null(keywords);
    name_default_type(keywords);
    if let Some(Value::String(description)) = keywords.get_mut("description") {
        *description = description.replace('\n', " ");
    }
    if let Some(default) = keywords.get_mut("default") {
        shorten(default);
    }
}

/// Removes null from the allowed types: a key without a value is left out, never null.
fn drop_null(keywords: &mut Map<String, Value>) {
    if let Some(Value::Array(types)) = keywords.get_mut("type") {
        types.retain(|name| name != "null");
        if let [name] = types.as_slice() {
            let name = name.clone();
            keywords.insert("type".into(), name);
        }
    }
    let is_null = |choice: &Value| choice.get("type").is_some_and(|name| name == "null");
    if let Some(Value::Array(choices)) = keywords.get("anyOf")
        && let [choice, null] = choices.as_slice()
        && is_null(null)
        && let Value::Object(mut choice) = choice.clone()
    {
        keywords.shift_remove("anyOf");
        choice.append(keywords);
        *keywords = choice;
    }
}

/// In a union with a default, makes the type optional for that default.
fn name_default_type(keywords: &mut Map<String, Value>) {
    let Some(tag) = keywords.get("default").and_then(|default| default.get(TAG)).cloned() else { return };
    let Some(Value::Array(variants)) = keywords.get_mut("oneOf") else { return };
    for variant in variants.iter_mut().filter(|variant| variant["properties"][TAG]["const"] == tag) {
        variant["properties"][TAG]["default"] = tag.clone();
        if let Some(Value::Array(required)) = variant.get_mut("required") {
            required.retain(|key| key != TAG);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Calls `visit` with every schema, from the root down.
    fn walk(schema: &Value, visit: &mut impl FnMut(&Map<String, Value>)) {
        let Value::Object(keywords) = schema else { return };
        visit(keywords);
        for (keyword, value) in keywords {
            match (keyword.as_str(), value) {
                ("properties" | "$defs", Value::Object(schemas)) => {
                    schemas.values().for_each(|schema| walk(schema, visit));
                }
                ("oneOf" | "anyOf", Value::Array(schemas)) => {
                    schemas.iter().for_each(|schema| walk(schema, visit));
                }
                ("items" | "not", schema) => walk(schema, visit),
                _ => {}
            }
        }
    }

    #[test]
    fn every_keyword_is_one_that_the_check_obeys() {
        let obeyed = [
            "$defs",
            "$ref",
            "$schema",
            "additionalProperties",
            "anyOf",
            "const",
            "default",
            "dependentRequired",
            "description",
            "exclusiveMaximum",
            "exclusiveMinimum",
            "format",
            "items",
            "maxItems",
            "maximum",
            "minItems",
            "minLength",
            "minimum",
            "not",
            "oneOf",
            "properties",
            "required",
            "title",
            "type",
        ];
        let mut used = BTreeSet::new();
        walk(shared(), &mut |keywords| used.extend(keywords.keys().cloned()));
        let obeyed: BTreeSet<_> = obeyed.iter().map(ToString::to_string).collect();
        assert_eq!(used.difference(&obeyed).collect::<Vec<_>>(), Vec::<&String>::new());
    }

    #[test]
    fn references_lead_somewhere_and_null_appears_nowhere() {
        walk(shared(), &mut |keywords| {
            if let Some(Value::String(reference)) = keywords.get("$ref") {
                assert!(shared().pointer(reference.trim_start_matches('#')).is_some(), "{reference}");
            }
            assert_ne!(keywords.get("type"), Some(&"null".into()), "{keywords:?}");
            assert_ne!(keywords.get("default"), Some(&Value::Null), "{keywords:?}");
        });
    }

    #[test]
    fn every_key_is_explained() {
        walk(shared(), &mut |keywords| {
            for (key, schema) in keywords.get("properties").and_then(Value::as_object).into_iter().flatten() {
                let explained = key == TAG || schema.get("description").is_some();
                assert!(explained, "`{key}` has no description");
            }
        });
    }

    #[test]
    fn defaults_are_short_decimals() {
        let point = &shared()["$defs"]["TransferPoint"]["properties"];
        assert_eq!(point["specular"]["default"].to_string(), "[0.04,0.04,0.04]");
        assert_eq!(point["roughness"]["default"].to_string(), "0.3");
    }

    #[test]
    fn a_default_type_may_be_left_out() {
        let variants = shared()["$defs"]["Camera"]["oneOf"].as_array().unwrap();
        let needs_type = |i: usize| variants[i]["required"].as_array().unwrap().contains(&TAG.into());
        assert!(!needs_type(0), "perspective");
        assert!(needs_type(1), "orthographic");
    }
}
