//! Undo and redo of a document's edits. The camera is apart: looking around is no edit to be undone, and undoing an edit does not
//! move the viewer.

use crate::document::CAMERA;
use serde_json::{Map, Value};

/// Steps that are remembered.
const MOST: usize = 1000;

/// The edits that can be undone and those that can be redone.
#[derive(Clone, Debug, Default)]
pub(crate) struct UndoList {
    past: Vec<Step>,
    future: Vec<Step>,
}

/// An edit of the document, both ways, as merge patches that know nothing of its schema.
#[derive(Clone, Debug)]
struct Step {
    back: Value,
    forth: Value,
}

impl UndoList {
    /// Remembers an edit, after which nothing can be redone; one that moved the camera alone is none.
    pub fn remember(&mut self, before: &Value, after: &Value) {
        let step = Step {
            back: without_camera(difference(after, before)),
            forth: without_camera(difference(before, after)),
        };
        if is_empty(&step.back) && is_empty(&step.forth) {
            return;
        }
        self.future.clear();
        if self.past.len() == MOST {
            self.past.remove(0);
        }
        self.past.push(step);
    }

    /// The document before the last edit that was not undone; `None` where there is none.
    pub fn before(&self, document: &Value) -> Option<Value> {
        self.past.last().map(|step| merged(document, &step.back))
    }

    /// The document after the edit that was undone last; `None` where there is none.
    pub fn after(&self, document: &Value) -> Option<Value> {
        self.future.last().map(|step| merged(document, &step.forth))
    }

    /// The document is the one [`Self::before`] the last edit now.
    pub fn undone(&mut self) {
        self.future.extend(self.past.pop());
    }

    /// The document is the one [`Self::after`] the edit undone last now.
    pub fn redone(&mut self) {
        self.past.extend(self.future.pop());
    }
}

fn is_empty(patch: &Value) -> bool {
    patch.as_object().is_some_and(Map::is_empty)
}

fn without_camera(mut patch: Value) -> Value {
    if let Value::Object(changes) = &mut patch {
        changes.shift_remove(CAMERA);
    }
    patch
}

/// The merge patch (RFC 7396) that makes `to` of `from`, two tables without nulls.
fn difference(from: &Value, to: &Value) -> Value {
    let (Value::Object(old), Value::Object(new)) = (from, to) else { return to.clone() };
    let gone = old.keys().filter(|key| !new.contains_key(*key)).map(|key| (key.clone(), Value::Null));
    let changed = new.iter().filter(|(key, value)| old.get(*key) != Some(value)).map(|(key, value)| {
        let change = match old.get(key) {
            Some(before @ Value::Object(_)) if value.is_object() => difference(before, value),
            // A table that was not there is no patch: nothing of it stands already.
            _ => value.clone(),
        };
        (key.clone(), change)
    });
    Value::Object(gone.chain(changed).collect())
}

fn merged(document: &Value, patch: &Value) -> Value {
    let mut merged = document.clone();
    merge(&mut merged, patch);
    merged
}

/// RFC 7396.
fn merge(target: &mut Value, patch: &Value) {
    let Value::Object(changes) = patch else {
        *target = patch.clone();
        return;
    };
    if !target.is_object() {
        *target = Value::Object(Map::new());
    }
    let Value::Object(table) = target else { return };
    for (key, change) in changes {
        if change.is_null() {
            table.shift_remove(key);
        } else {
            merge(table.entry(key).or_insert(Value::Null), change);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn steps_lead_back_and_forth_and_leave_the_camera() {
        let mut document = json!({ "medium": { "density": 1 }, "lights": [1, 2], "camera": { "fov": 20 } });
        let mut undo = UndoList::default();
        let edits = [
            json!({ "medium": { "density": 2, "phase": { "type": "schlick" } }, "lights": [1, 2], "camera": { "fov": 20 } }),
            json!({ "medium": { "density": 2 }, "camera": { "fov": 20 } }),
            json!({ "medium": { "density": 2 }, "camera": { "fov": 90 } }),
            json!({ "film": { "size": [1, 1] }, "camera": { "fov": 90 } }),
        ];
        let mut documents = vec![document.clone()];
        for after in edits {
            undo.remember(&document, &after);
            if difference(&document, &after).as_object().unwrap().keys().any(|key| key != "camera") {
                documents.push(after.clone());
            }
            document = after;
        }
        let rest = |document: &Value| without_camera(document.clone());
        for expected in documents.iter().rev().skip(1) {
            document = undo.before(&document).unwrap();
            undo.undone();
            assert_eq!(rest(&document), rest(expected));
            assert_eq!(document["camera"]["fov"], 90);
        }
        assert_eq!(undo.before(&document), None);
        for expected in documents.iter().skip(1) {
            document = undo.after(&document).unwrap();
            undo.redone();
            assert_eq!(rest(&document), rest(expected));
        }
        assert_eq!(undo.after(&document), None);
        document = undo.before(&document).unwrap();
        undo.undone();
        undo.remember(&document, &json!({ "medium": { "density": 7 }, "camera": {} }));
        assert_eq!(undo.after(&document), None, "an edit ends what can be redone");
    }
}
