//! Keys that older versions had at other paths: they are still read, since pictures have them in their metadata.

use serde_json::{Map, Value};
use tyndall::integrator::{METHODS, MethodEntry, MovedKey};

use super::error::{DocumentError, Problem};

/// Moves the values at old paths in a document, or in a patch to one, to their current paths; returns a note for each.
///
/// # Errors
/// [`DocumentError::Content`] if there is a value at both paths; the document is then unchanged.
pub fn move_old_keys(document: &mut Value) -> Result<Vec<String>, DocumentError> {
    let mut changed = document.clone();
    let mut notes = Vec::new();
    for (method, moved) in all() {
        let Some(value) = take(&mut changed, &["render", &method.table(), moved.key]) else { continue };
        let (old, now) = (old_path(method, moved), moved.now);
        let parts: Vec<_> = now.split('.').collect();
        if put(&mut changed, &parts, value).is_err() {
            let problem = Problem::new(old, "a value", format!("nothing, since `{now}` is given too"));
            return Err(DocumentError::one(problem.with_fix("leave the old key out")));
        }
        notes.push(format!("`{old}` is now `{now}` and was read as such"));
    }
    if !notes.is_empty() {
        *document = changed;
    }
    Ok(notes)
}

/// The current path of a key that may be at another path in older documents.
pub(super) fn present_path(path: &str) -> &str {
    all().find(|(method, moved)| old_path(method, moved) == path).map_or(path, |(_, moved)| moved.now)
}

fn all() -> impl Iterator<Item = (&'static MethodEntry, &'static MovedKey)> {
    METHODS.iter().flat_map(|method| method.moved_keys.iter().map(move |moved| (method, moved)))
}

fn old_path(method: &MethodEntry, moved: &MovedKey) -> String {
    format!("render.{}.{}", method.table(), moved.key)
}

/// Removes and returns the value at a path of keys.
fn take(value: &mut Value, [outer, inner, key]: &[&str; 3]) -> Option<Value> {
    value.get_mut(outer)?.get_mut(inner)?.as_object_mut()?.shift_remove(*key)
}

/// Puts a value at a path of keys, and creates missing tables on the way.
///
/// # Errors
/// If there is a value already, or something on the way is not a table.
fn put(target: &mut Value, path: &[&str], value: Value) -> Result<(), ()> {
    let Some((key, rest)) = path.split_first() else { return Err(()) };
    if target.is_null() {
        *target = Value::Object(Map::new());
    }
    let table = target.as_object_mut().ok_or(())?;
    if !rest.is_empty() {
        return put(table.entry(*key).or_insert(Value::Null), rest, value);
    }
    if table.contains_key(*key) {
        return Err(());
    }
    table.insert((*key).to_owned(), value);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Document, set};
    use super::*;
    use serde_json::json;

    #[test]
    fn an_old_key_is_read_with_a_note() {
        for mut value in [
            json!({ "render": { "path": { "majorant_cell": 4, "history_memory": 1 } } }),
            json!({ "medium": { "density": 2 }, "render": { "path": { "majorant_cell": 4 } } }),
        ] {
            let notes = move_old_keys(&mut value).unwrap();
            assert_eq!(
                notes,
                ["`render.path.majorant_cell` is now `medium.majorant_cell` and was read as such"]
            );
            assert_eq!(value["medium"]["majorant_cell"], 4);
            assert_eq!(value.pointer("/render/path/majorant_cell"), None);
            let after = value.clone();
            assert_eq!(move_old_keys(&mut value).unwrap(), Vec::<String>::new());
            assert_eq!(value, after);
        }
        let document = json!({ "volume": { "path": "a" }, "render": { "path": { "majorant_cell": 4 } } });
        assert_eq!(Document::from_value(document).unwrap().medium.majorant_cell, 4);
    }

    #[test]
    fn both_places_at_once_are_an_error() {
        let both = json!({ "medium": { "majorant_cell": 4 }, "render": { "path": { "majorant_cell": 4 } } });
        let mut value = both.clone();
        let error = move_old_keys(&mut value).unwrap_err();
        assert_eq!(error.path(), "render.path.majorant_cell");
        assert!(error.to_string().contains("medium.majorant_cell"), "{error}");
        assert_eq!(value, both);
    }

    #[test]
    fn an_assignment_to_an_old_key_sets_the_new_one() {
        let mut value = json!({ "medium": { "majorant_cell": 4 } });
        set(&mut value, "render.path.majorant_cell=6").unwrap();
        assert_eq!(value, json!({ "medium": { "majorant_cell": 6 } }));
    }
}
