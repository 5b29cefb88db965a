//! Parses the text of a document, TOML or JSON, to its value.

use serde_json::{Map, Number, Value};

use super::error::{DocumentError, Problem, join};
use tyndall::message::sentence;

/// Reads JSON.
///
/// # Errors
/// [`DocumentError::Syntax`] with line and column.
pub fn value_from_json(text: &str) -> Result<Value, DocumentError> {
    let text = text.trim_start_matches('\u{feff}');
    serde_json::from_str(text).map_err(|error| {
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
        DocumentError::Syntax {
            language: "JSON",
            line: error.line(),
            column: error.column(),
            message: sentence(message),
        }
    })
}

/// Reads TOML.
///
/// # Errors
/// [`DocumentError::Syntax`] with line and column; [`DocumentError::Content`] if a number is infinite or NaN, which
/// TOML allows.
pub fn value_from_toml(text: &str) -> Result<Value, DocumentError> {
    let table: toml::Table = toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        let before = text.get(..start).unwrap_or(text);
        let (line, column) = match before.rsplit_once('\n') {
            Some((lines, rest)) => (lines.matches('\n').count() + 2, rest.chars().count() + 1),
            None => (1, before.chars().count() + 1),
        };
        DocumentError::Syntax { language: "TOML", line, column, message: sentence(error.message()) }
    })?;
    table_to_json(table, "")
}

fn table_to_json(table: toml::Table, path: &str) -> Result<Value, DocumentError> {
    let entries = table.into_iter().map(|(key, value)| {
        let path = join(path, &key);
        Ok((key, to_json(value, &path)?))
    });
    entries.collect::<Result<Map<_, _>, _>>().map(Value::Object)
}

fn to_json(value: toml::Value, path: &str) -> Result<Value, DocumentError> {
    Ok(match value {
        toml::Value::String(text) => Value::String(text),
        toml::Value::Integer(number) => Value::from(number),
        toml::Value::Float(number) => {
            Value::Number(Number::from_f64(number).ok_or_else(|| {
                DocumentError::one(Problem::new(path, number.to_string(), "a finite number"))
            })?)
        }
        toml::Value::Boolean(flag) => Value::Bool(flag),
        toml::Value::Datetime(date) => Value::String(date.to_string()),
        toml::Value::Array(items) => {
            let items = items.into_iter().enumerate().map(|(i, item)| to_json(item, &join(path, i)));
            Value::Array(items.collect::<Result<_, _>>()?)
        }
        toml::Value::Table(table) => table_to_json(table, path)?,
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn both_languages_give_the_same_value() {
        let toml = value_from_toml("a = 1\nb = [1.5, true]\n[c]\nd = \"x\"\n[[e]]\nf = 2\n").unwrap();
        let json =
            value_from_json(r#"{ "a": 1, "b": [1.5, true], "c": { "d": "x" }, "e": [{ "f": 2 }] }"#).unwrap();
        assert_eq!(toml, json);
    }

    #[test]
    fn a_syntax_error_gives_line_and_column() {
        let error = value_from_toml("version = 1\n[volume]\npath = head.nrrd\n").unwrap_err();
        assert!(
            matches!(error, DocumentError::Syntax { language: "TOML", line: 3, column: 8, .. }),
            "{error:?}"
        );
        let error = value_from_json("{\n  \"version\": 1,\n}").unwrap_err();
        assert!(
            matches!(error, DocumentError::Syntax { language: "JSON", line: 3, column: 1, .. }),
            "{error:?}"
        );
        assert!(error.to_string().starts_with("line 3, column 1: trailing comma"), "{error}");
    }

    #[test]
    fn a_number_that_is_not_finite_is_named() {
        let error = value_from_toml("[medium]\ndensity = inf\n").unwrap_err();
        assert_eq!(error.path(), "medium.density");
        let error = value_from_toml("lights = [{ radiance = [1, nan, 1] }]").unwrap_err();
        assert_eq!(error.path(), "lights.0.radiance.1");
        assert!(value_from_json(r#"{ "density": 1e999 }"#).is_err());
    }

    #[test]
    fn deep_nesting_is_an_error() {
        for (open, close) in [("[", "]"), ("{a=", "}")] {
            let deep = format!("x = {}{}", open.repeat(100_000), close.repeat(100_000));
            assert!(value_from_toml(&deep).is_err());
        }
        assert!(value_from_toml(&format!("{}x = 1", "a.".repeat(100_000))).is_err());
        assert!(value_from_toml(&format!("[{}a]", "a.".repeat(100_000))).is_err());
        assert!(value_from_json(&"[".repeat(100_000)).is_err());
        assert!(value_from_json(&"{\"a\":".repeat(100_000)).is_err());
    }

    #[test]
    fn a_date_is_read_as_text() {
        assert_eq!(value_from_toml("a = 2026-01-01").unwrap(), json!({ "a": "2026-01-01" }));
    }

    #[test]
    fn a_byte_order_mark_is_accepted() {
        assert!(value_from_json("\u{feff}{}").is_ok());
        assert!(value_from_toml("\u{feff}a = 1").is_ok());
    }
}
