//! Edits: a JSON Merge Patch (RFC 7396) that knows which keys of a document exclude each other.

use serde_json::{Map, Value};

use super::node::Node;
use super::schema::TAG;

/// The document after an edit.
///
/// The patch is merged as RFC 7396 says: tables are merged, everything else, arrays included, is replaced whole, and
/// null deletes a key and so restores its default. In addition,
/// - a patch that changes a `type` drops the keys that the new type lacks;
/// - of two alternatives, such as `preset` and `points`, the one in the patch replaces the other;
/// - a key that is only allowed with another one, such as `raw` with `path`, is removed with that one.
///
/// Keys that the patch itself sets always stay, so that [`Document::from_value`](super::Document::from_value) can
/// report what is wrong with them.
#[must_use]
pub fn apply(document: &Value, patch: &Value) -> Value {
    let mut patched = document.clone();
    merge(&mut patched, patch, Some(Node::root()));
    patched
}

/// Merges `patch` into `target`, whose schema is `node` if it has one.
pub(super) fn merge(target: &mut Value, patch: &Value, node: Option<Node>) {
    let Value::Object(changes) = patch else {
        *target = patch.clone();
        return;
    };
    let table = as_table(target);
    let node = make_way(table, changes, node);
    for (key, change) in changes {
        if change.is_null() {
            table.shift_remove(key);
        } else {
            let below = node.and_then(|node| node.key(key));
            merge(table.entry(key).or_insert(Value::Null), change, below);
        }
    }
}

/// The table in `value`; anything else is first replaced by an empty table.
fn as_table(value: &mut Value) -> &mut Map<String, Value> {
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
    match value {
        Value::Object(table) => table,
        _ => unreachable!("made a table above"),
    }
}

/// Removes the keys of `table` that `changes` exclude, and returns the schema of the table after the changes.
pub(super) fn make_way(
    table: &mut Map<String, Value>,
    changes: &Map<String, Value>,
    node: Option<Node>,
) -> Option<Node> {
    let union = node?;
    let before = union.table(table).and_then(Node::tag);
    let mut typed = Map::new();
    let tag = changes.get(TAG).or_else(|| table.get(TAG)).filter(|tag| !tag.is_null());
    typed.extend(tag.map(|tag| (TAG.to_owned(), tag.clone())));
    let node = union.table(&typed)?;
    if node.tag() != before {
        table.retain(|key, _| node.key(key).is_some());
    }

    let alternatives = node.alternatives();
    let mut gone: Vec<&str> = Vec::new();
    for (key, change) in changes {
        if change.is_null() {
            gone.push(key);
        } else {
            gone.extend(alternatives.iter().flat_map(|alternatives| alternatives.rivals(key)));
        }
    }
    for (companion, leader) in node.companions() {
        if gone.contains(&leader) && table.contains_key(leader) {
            table.shift_remove(companion);
        }
    }
    for key in gone {
        table.shift_remove(key);
    }
    Some(node)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_examples_of_rfc_7396_hold() {
        for (original, patch, result) in [
            (json!({"a": "b"}), json!({"a": "c"}), json!({"a": "c"})),
            (json!({"a": "b"}), json!({"b": "c"}), json!({"a": "b", "b": "c"})),
            (json!({"a": "b"}), json!({"a": null}), json!({})),
            (json!({"a": "b", "b": "c"}), json!({"a": null}), json!({"b": "c"})),
            (json!({"a": ["b"]}), json!({"a": "c"}), json!({"a": "c"})),
            (json!({"a": "c"}), json!({"a": ["b"]}), json!({"a": ["b"]})),
            (json!({"a": {"b": "c"}}), json!({"a": {"b": "d", "c": null}}), json!({"a": {"b": "d"}})),
            (json!({"a": [{"b": "c"}]}), json!({"a": [1]}), json!({"a": [1]})),
            (json!(["a", "b"]), json!(["c", "d"]), json!(["c", "d"])),
            (json!({"a": "b"}), json!(["c"]), json!(["c"])),
            (json!({"a": "foo"}), json!(null), json!(null)),
            (json!({"a": "foo"}), json!("bar"), json!("bar")),
            (json!({"e": null}), json!({"a": 1}), json!({"e": null, "a": 1})),
            (json!([1, 2]), json!({"a": "b", "c": null}), json!({"a": "b"})),
            (json!({}), json!({"a": {"bb": {"ccc": null}}}), json!({"a": {"bb": {}}})),
        ] {
            assert_eq!(apply(&original, &patch), result, "{original} patched by {patch}");
        }
    }

    #[test]
    fn a_changed_type_drops_the_keys_that_it_lacks() {
        let document = json!({
            "camera": { "type": "perspective", "position": [0, 0, 9], "target": [0, 0, 0], "fov": 20, "aperture": 1 },
            "medium": { "phase": { "type": "henyey-greenstein", "g": 0.5 }, "density": 2 }
        });
        let patch = json!({
            "camera": { "type": "orthographic", "height": 3 },
            "medium": { "phase": { "type": "schlick", "k": 0.4 } }
        });
        let patched = json!({
            "camera": { "type": "orthographic", "position": [0, 0, 9], "target": [0, 0, 0], "height": 3 },
            "medium": { "phase": { "type": "schlick", "k": 0.4 }, "density": 2 }
        });
        assert_eq!(apply(&document, &patch), patched);
        let isotropic = apply(&document, &json!({ "medium": { "phase": { "type": null } } }));
        assert_eq!(isotropic["medium"]["phase"], json!({}), "the default type has no g");
    }

    #[test]
    fn a_type_left_to_its_default_counts_as_named() {
        let same =
            apply(&json!({ "camera": { "fov": 20 } }), &json!({ "camera": { "type": "perspective" } }));
        assert_eq!(same, json!({ "camera": { "fov": 20, "type": "perspective" } }));
        let other =
            apply(&json!({ "camera": { "fov": 20 } }), &json!({ "camera": { "type": "orthographic" } }));
        assert_eq!(other, json!({ "camera": { "type": "orthographic" } }));
    }

    #[test]
    fn keys_of_the_patch_stay_even_if_they_are_wrong() {
        let patch = json!({ "medium": { "phase": { "type": "isotropic", "g": 0.5 } } });
        assert_eq!(apply(&json!({}), &patch), patch);
        let both = json!({ "transfer_function": { "preset": "a", "points": [] } });
        assert_eq!(apply(&json!({ "transfer_function": { "preset": "b" } }), &both), both);
    }

    #[test]
    fn the_alternative_that_is_patched_replaces_the_other() {
        let point = json!({ "value": 0, "opacity": 1 });
        let view = json!({ "position": [0, 0, 9], "target": [0, 0, 0], "fov": 20 });
        for (key, before, patch, after) in [
            (
                "transfer_function",
                json!({ "preset": "ct-bone" }),
                json!({ "points": [point] }),
                json!({ "points": [point] }),
            ),
            (
                "transfer_function",
                json!({ "points": [point] }),
                json!({ "preset": "ct-bone" }),
                json!({ "preset": "ct-bone" }),
            ),
            (
                "camera",
                view.clone(),
                json!({ "auto": { "zoom": 2 } }),
                json!({ "fov": 20, "auto": { "zoom": 2 } }),
            ),
            (
                "camera",
                json!({ "auto": { "zoom": 2 } }),
                json!({ "position": [1, 1, 1] }),
                json!({ "position": [1, 1, 1] }),
            ),
            (
                "volume",
                json!({ "path": "a", "raw": { "dims": [1, 1, 1] } }),
                json!({ "procedural": {} }),
                json!({ "procedural": {} }),
            ),
            (
                "volume",
                json!({ "procedural": {}, "interpolation": "nearest" }),
                json!({ "path": "a" }),
                json!({ "interpolation": "nearest", "path": "a" }),
            ),
            (
                "volume",
                json!({ "path": "a", "raw": {} }),
                json!({ "path": "b" }),
                json!({ "path": "b", "raw": {} }),
            ),
            ("camera", view, json!({ "position": null }), json!({ "fov": 20 })),
        ] {
            assert_eq!(
                apply(&json!({ key: before }), &json!({ key: patch })),
                json!({ key: after }),
                "{key}: {patch}"
            );
        }
    }

    #[test]
    fn a_deleted_alternative_leaves_the_other() {
        let document = json!({ "transfer_function": { "preset": "ct-bone" } });
        assert_eq!(apply(&document, &json!({ "transfer_function": { "points": null } })), document);
    }
}
