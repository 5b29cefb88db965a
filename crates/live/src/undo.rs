//! Undo and redo of a document's edits. The camera stays out of both: moving it is not a step to undo, and undoing an
//! edit does not move it.

use crate::document::CAMERA;
use serde_json::{Map, Value};

/// The most steps that are remembered.
const MOST_STEPS: usize = 1000;

/// The most memory that all steps may take, in bytes. A step that edits one point of a transfer function holds all its
/// points twice, since merge patches replace lists whole.
const MOST_BYTES: usize = 64 << 20;

/// The edits that can be undone and those that can be redone.
#[derive(Clone, Debug, Default)]
pub(crate) struct UndoList {
    past: Vec<Step>,
    future: Vec<Step>,
}

/// An edit as a pair of merge patches, which are applied without regard to the document's schema.
#[derive(Clone, Debug)]
struct Step {
    back: Value,
    forth: Value,
    /// Consecutive edits of the same gesture are one step.
    gesture: Option<u64>,
}

impl Step {
    /// The step between two documents.
    fn between(before: &Value, after: &Value, gesture: Option<u64>) -> Self {
        let back = without_camera(difference(after, before));
        Self { back, forth: without_camera(difference(before, after)), gesture }
    }

    fn is_empty(&self) -> bool {
        is_empty(&self.back) && is_empty(&self.forth)
    }

    fn bytes(&self) -> usize {
        bytes(&self.back) + bytes(&self.forth)
    }
}

impl UndoList {
    /// Remembers an edit, after which nothing can be redone. An edit that moved only the camera is not remembered.
    pub fn remember(&mut self, before: &Value, after: &Value, gesture: Option<u64>) {
        let step = Step::between(before, after, gesture);
        if step.is_empty() {
            return;
        }
        let continued = gesture.is_some() && self.future.is_empty();
        self.future.clear();
        match self.past.pop_if(|last| continued && last.gesture == gesture) {
            Some(begun) => {
                let whole = Step::between(&merged(before, &begun.back), after, gesture);
                // A drag that ends where it began is not a step.
                self.past.extend((!whole.is_empty()).then_some(whole));
            }
            None => self.past.push(step),
        }
        self.forget_oldest();
    }

    /// Adapts to an edit that changed how the document is written, for example by filling in a default, but not what it
    /// means: the steps before and after it now start from the new text, and no step is added.
    pub fn rewritten(&mut self, before: &Value, after: &Value) {
        if let Some(last) = self.past.last_mut() {
            *last = Step::between(&merged(before, &last.back), after, last.gesture);
        }
        if let Some(next) = self.future.last_mut() {
            *next = Step::between(after, &merged(before, &next.forth), next.gesture);
        }
    }

    fn forget_oldest(&mut self) {
        let mut bytes: usize = self.past.iter().map(Step::bytes).sum();
        let mut steps = self.past.len();
        let too_many = self.past.iter().take_while(|step| {
            // The newest step stays, however large.
            let much = steps > MOST_STEPS || (bytes > MOST_BYTES && steps > 1);
            (bytes, steps) = (bytes - step.bytes(), steps - 1);
            much
        });
        let too_many = too_many.count();
        self.past.drain(..too_many);
    }

    /// The document before the last step; `None` if there is no step to undo.
    pub fn before(&self, document: &Value) -> Option<Value> {
        self.past.last().map(|step| merged(document, &step.back))
    }

    /// The document after the step that was undone last; `None` if there is no step to redo.
    pub fn after(&self, document: &Value) -> Option<Value> {
        self.future.last().map(|step| merged(document, &step.forth))
    }

    /// The last step was undone: the document is now the one that [`Self::before`] returned.
    pub fn undone(&mut self) {
        self.future.extend(self.past.pop());
    }

    /// The step undone last was redone: the document is now the one that [`Self::after`] returned.
    pub fn redone(&mut self) {
        self.past.extend(self.future.pop());
    }
}

/// Approximate memory of a value: each entry of a list or table, with its key and text.
fn bytes(value: &Value) -> usize {
    /// For each key, a table also holds a hash and a slot in its index.
    const KEY: usize = size_of::<String>() + 2 * size_of::<usize>();
    let inner = match value {
        Value::String(text) => text.len(),
        Value::Array(list) => list.iter().map(bytes).sum(),
        Value::Object(table) => table.iter().map(|(key, value)| KEY + key.len() + bytes(value)).sum(),
        _ => 0,
    };
    size_of::<Value>() + inner
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

/// The merge patch (RFC 7396) that turns `from` into `to`, two tables without nulls.
fn difference(from: &Value, to: &Value) -> Value {
    let (Value::Object(old), Value::Object(new)) = (from, to) else { return to.clone() };
    let gone = old.keys().filter(|key| !new.contains_key(*key)).map(|key| (key.clone(), Value::Null));
    let changed = new.iter().filter(|(key, value)| old.get(*key) != Some(value)).map(|(key, value)| {
        let change = match old.get(key) {
            Some(before @ Value::Object(_)) if value.is_object() => difference(before, value),
            // A new table is written out whole, since none of it is there yet.
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
            undo.remember(&document, &after, None);
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
        undo.remember(&document, &json!({ "medium": { "density": 7 }, "camera": {} }), None);
        assert_eq!(undo.after(&document), None, "after an edit, nothing can be redone");
    }

    fn densities(undo: &mut UndoList, mut density: f64, edits: &[(f64, Option<u64>)]) -> Value {
        let of = |density: f64| json!({ "medium": { "density": density } });
        for &(next, gesture) in edits {
            undo.remember(&of(density), &of(next), gesture);
            density = next;
        }
        of(density)
    }

    #[test]
    fn a_gesture_is_one_step_and_a_gesture_that_ends_where_it_began_is_no_step() {
        let mut undo = UndoList::default();
        let mut document =
            densities(&mut undo, 1.0, &[(2.0, None), (3.0, Some(7)), (4.0, Some(7)), (5.0, Some(7))]);
        for expected in [2.0, 1.0] {
            document = undo.before(&document).unwrap();
            undo.undone();
            assert_eq!(document["medium"]["density"], expected);
        }
        assert_eq!(undo.before(&document), None);
        document = undo.after(&document).unwrap();
        undo.redone();
        document = undo.after(&document).unwrap();
        assert_eq!(document["medium"]["density"], 5.0);

        let mut undo = UndoList::default();
        densities(&mut undo, 1.0, &[(2.0, Some(1)), (3.0, Some(2)), (4.0, Some(2)), (2.0, Some(2))]);
        assert_eq!(undo.past.len(), 1);
        undo.undone();
        densities(&mut undo, 1.0, &[(6.0, Some(1))]);
        assert_eq!((undo.past.len(), undo.future.len()), (1, 0), "an undone gesture is not continued");
    }

    #[test]
    fn undo_and_redo_work_after_the_document_was_written_differently() {
        let lobe = |g: f64| json!({ "phase": { "type": "henyey-greenstein", "g": g } });
        let (first, short) = (lobe(0.3), json!({ "phase": { "type": "schlick" } }));
        let (long, last) = (json!({ "phase": { "type": "schlick", "k": 0.0 } }), lobe(0.5));
        let mut undo = UndoList::default();
        undo.remember(&first, &short, None);
        undo.remember(&short, &last, None);
        undo.undone();
        undo.rewritten(&short, &long);
        assert_eq!(undo.after(&long), Some(last));
        assert_eq!(undo.before(&long), Some(first));
    }

    #[test]
    fn the_oldest_steps_are_forgotten_when_they_are_too_many_or_too_large() {
        let mut undo = UndoList::default();
        let many: Vec<_> = (0..MOST_STEPS + 7).map(|i| (i as f64, None)).collect();
        densities(&mut undo, -1.0, &many);
        assert_eq!(undo.past.len(), MOST_STEPS);

        let lists = |i: usize| json!({ "points": vec![i; 200_000] });
        let mut undo = UndoList::default();
        for i in 0..12 {
            undo.remember(&lists(i), &lists(i + 1), None);
        }
        let held: usize = undo.past.iter().map(Step::bytes).sum();
        assert!(held <= MOST_BYTES && undo.past.len() > 1, "{held} bytes in {} steps", undo.past.len());
        assert_eq!(undo.before(&lists(12)), Some(lists(11)));
    }
}
