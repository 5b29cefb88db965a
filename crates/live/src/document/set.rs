//! Overrides of single keys, `PATH=VALUE`, as the command line gives them.

use serde_json::{Map, Value};

use super::error::{DocumentError, Problem, describe_value, join};
use super::moved::present_path;
use super::node::Node;
use super::patch::{make_way, merge};
use tyndall::message::{excerpt, quoted};

/// Sets one key of a document: `medium.density=0.3`, `lights.0.radiance=[1,2,3]`.
///
/// PATH is keys and list indices separated by dots; missing tables and lists on the way are created, and the index
/// after a list's last one appends an item. VALUE is JSON, or else text; it replaces the old value, and null removes
/// it. Types and alternatives are replaced as in [`apply`](super::apply).
///
/// # Errors
/// [`DocumentError::Content`] if the assignment has no `=`, or its path leads nowhere; the document is then unchanged.
/// The value itself is checked later, by [`Document::from_value`](super::Document::from_value).
pub fn set(document: &mut Value, assignment: &str) -> Result<(), DocumentError> {
    /// Every path in the schema is shorter; each part nests the document one level deeper.
    const LONGEST: usize = 16;

    let expected = "PATH=VALUE, such as medium.density=0.3";
    let malformed = |found: &str| DocumentError::one(Problem::new("", quoted(found), expected));
    let (path, text) = assignment.split_once('=').ok_or_else(|| malformed(assignment))?;
    let parts: Vec<_> = present_path(path.trim()).split('.').collect();
    if parts.len() > LONGEST || parts.contains(&"") {
        return Err(malformed(assignment));
    }
    let value = serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()));

    let mut changed = document.clone();
    assign(&mut changed, &parts, &value, Some(Node::root()), "")?;
    *document = changed;
    Ok(())
}

/// Sets the value at `parts` below `target`, which is at `path` and has the schema `node`.
fn assign(
    target: &mut Value,
    parts: &[&str],
    value: &Value,
    node: Option<Node>,
    path: &str,
) -> Result<(), DocumentError> {
    let Some((part, rest)) = parts.split_first() else {
        *target = Value::Null;
        merge(target, value, None);
        return Ok(());
    };
    if target.is_null() {
        *target = empty(node);
    }
    let below = join(path, part);
    let removes = rest.is_empty() && value.is_null();
    match target {
        Value::Object(table) => {
            let change = if removes { Value::Null } else { Value::Bool(true) };
            let change = if rest.is_empty() && value.is_string() { value.clone() } else { change };
            let node = make_way(table, &Map::from_iter([((*part).to_owned(), change)]), node);
            if removes {
                table.shift_remove(*part);
                return Ok(());
            }
            let node = node.and_then(|node| node.key(part));
            assign(table.entry(*part).or_insert(Value::Null), rest, value, node, &below)
        }
        Value::Array(items) => {
            let last = if removes { items.len().checked_sub(1) } else { Some(items.len()) };
            let index = part.parse().ok().filter(|index: &usize| last.is_some_and(|last| *index <= last));
            let Some(index) = index else {
                let problem =
                    Problem::new(below, quoted(part), format!("an index into {} items", items.len()));
                return Err(DocumentError::one(problem.with_fix("the index after the last one appends")));
            };
            if removes {
                items.remove(index);
                return Ok(());
            }
            if index == items.len() {
                items.push(Value::Null);
            }
            let node = node.and_then(Node::list).and_then(Node::items);
            assign(&mut items[index], rest, value, node, &below)
        }
        scalar => Err(DocumentError::one(Problem::new(
            path,
            describe_value(scalar),
            format!("a table or a list, to hold `{}`", excerpt(part)),
        ))),
    }
}

/// What to create at a missing place before something below it is set: a list with its default items, if it has any, or
/// else an empty list or table.
fn empty(node: Option<Node>) -> Value {
    match node.and_then(Node::list) {
        Some(list) => list.keyword("default").cloned().unwrap_or_else(|| Value::Array(Vec::new())),
        None => Value::Object(Map::new()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn after(document: &Value, assignment: &str) -> Value {
        let mut document = document.clone();
        set(&mut document, assignment).unwrap();
        document
    }

    #[test]
    fn values_are_json_else_text() {
        for (assignment, document) in [
            ("medium.density=0.3", json!({ "medium": { "density": 0.3 } })),
            ("render.integrator=raymarch", json!({ "render": { "integrator": "raymarch" } })),
            ("volume.path=a=b.nrrd", json!({ "volume": { "path": "a=b.nrrd" } })),
            ("volume.path=\"1\"", json!({ "volume": { "path": "1" } })),
            ("camera={\"fov\": 20}", json!({ "camera": { "fov": 20 } })),
            ("camera.auto.zoom=2", json!({ "camera": { "auto": { "zoom": 2 } } })),
            ("lights=[]", json!({ "lights": [] })),
            ("medium.density=", json!({ "medium": { "density": "" } })),
        ] {
            assert_eq!(after(&json!({}), assignment), document, "{assignment}");
        }
    }

    #[test]
    fn indices_reach_into_lists_and_append() {
        let document = json!({ "lights": [{ "type": "point", "intensity": [1, 1, 1] }] });
        assert_eq!(
            after(&document, "lights.0.intensity=[1,2,3]")["lights"][0]["intensity"],
            json!([1, 2, 3])
        );
        assert_eq!(after(&document, "lights.0.intensity.1=5")["lights"][0]["intensity"], json!([1, 5, 1]));
        let appended = after(&document, "lights.1.type=sphere");
        assert_eq!(appended["lights"][1], json!({ "type": "sphere" }));
        assert_eq!(after(&json!({}), "lights.0.type=point"), json!({ "lights": [{ "type": "point" }] }));
        assert_eq!(after(&document, "lights.0=null"), json!({ "lights": [] }));
    }

    #[test]
    fn a_part_of_a_default_changes_the_default() {
        assert_eq!(after(&json!({}), "film.size.1=100"), json!({ "film": { "size": [512, 100] } }));
    }

    #[test]
    fn types_and_alternatives_give_way() {
        let document = json!({
            "volume": { "path": "a", "raw": {} },
            "transfer_function": { "points": [] },
            "camera": { "position": [0, 0, 1], "target": [0, 0, 0] },
            "medium": { "phase": { "type": "schlick", "k": 0.5 } },
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        });
        assert_eq!(
            after(&document, "volume.procedural.kind=cloud")["volume"],
            json!({ "procedural": { "kind": "cloud" } })
        );
        assert_eq!(
            after(&document, "transfer_function.preset=x")["transfer_function"],
            json!({ "preset": "x" })
        );
        assert_eq!(after(&document, "camera.auto.zoom=2")["camera"], json!({ "auto": { "zoom": 2 } }));
        assert_eq!(
            after(&document, "medium.phase.type=isotropic")["medium"]["phase"],
            json!({ "type": "isotropic" })
        );
        assert_eq!(
            after(&document, "lights.0.map=a.exr")["lights"][0],
            json!({ "type": "environment", "map": "a.exr" })
        );
        assert_eq!(after(&document, "lights.0.type=point")["lights"][0], json!({ "type": "point" }));
    }

    #[test]
    fn null_removes_a_key() {
        let document = json!({ "medium": { "density": 2, "gradient_factor": 1 } });
        assert_eq!(after(&document, "medium.density=null"), json!({ "medium": { "gradient_factor": 1 } }));
        assert_eq!(after(&document, "camera=null"), document);
    }

    #[test]
    fn a_path_that_leads_nowhere_is_an_error_and_changes_nothing() {
        let document = json!({ "lights": [{}], "medium": { "density": 1 } });
        for (assignment, path) in [
            ("medium.density", ""),
            ("=1", ""),
            ("medium..density=1", ""),
            ("lights.2.radiance=1", "lights.2"),
            ("lights.first.radiance=1", "lights.first"),
            ("lights.-1.radiance=1", "lights.-1"),
            ("lights.1=null", "lights.1"),
            ("medium.density.x=1", "medium.density"),
        ] {
            let mut changed = document.clone();
            let error = set(&mut changed, assignment).unwrap_err();
            assert_eq!(error.path(), path, "{assignment}: {error}");
            assert_eq!(changed, document);
        }
        assert!(set(&mut json!({}), &format!("{}a=1", "a.".repeat(100_000))).is_err());
    }
}
