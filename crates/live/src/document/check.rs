//! Checks a document against its JSON Schema, and converts it to the form from which the types are deserialized.
//!
//! Only the part of JSON Schema that the document's own schema uses is supported. The recursion follows the schema, not
//! the document, so that no nesting of the input can exhaust the stack.

use serde_json::{Map, Number, Value};

use super::advice::{unknown_key, unknown_word};
use super::describe::{describe, length};
use super::error::{DocumentError, Problem, Problems, describe_value, join};
use super::node::Node;
use super::schema::TAG;
use tyndall::math::cast;
use tyndall::message::quoted;

/// Checks `document` and converts it: a grey becomes a colour, 3.0 becomes 3 where a whole number is expected, and an
/// omitted type is filled in with its default.
///
/// # Errors
/// [`DocumentError::Content`] with every problem, up to a limit.
pub(super) fn check(document: &mut Value) -> Result<(), DocumentError> {
    let mut check = Check::default();
    check.value(document, Node::root(), "");
    check.problems.into_result()
}

#[derive(Default)]
struct Check {
    problems: Problems,
}

impl Check {
    fn report(&mut self, path: &str, found: impl Into<String>, expected: impl Into<String>) {
        self.problems.push(Problem::new(path, found, expected));
    }

    fn value(&mut self, value: &mut Value, node: Node, path: &str) {
        if self.problems.is_full() {
            return;
        }
        let choices = node.choices();
        let choice = choices.iter().copied().find(|choice| choice.accepts(value));
        match (&mut *value, choice) {
            (Value::Object(table), Some(_)) => self.table(table, node, path),
            (Value::Array(items), Some(choice)) => self.list(items, choice, path),
            (Value::Number(number), Some(choice)) => {
                self.number(number, choice, path);
                if choices.iter().any(|choice| choice.accepts(&Value::Array(Vec::new()))) {
                    *value = Value::Array(vec![value.clone(); 3]);
                }
            }
            (Value::String(text), Some(_)) => self.text(text, node, path),
            (_, Some(_)) => {}
            (value, None) => {
                let problem = Problem::new(path, describe_value(value), describe(node));
                self.problems.push(match value {
                    Value::Null => problem.with_fix("leave the key out to use its default"),
                    _ => problem,
                });
            }
        }
    }

    fn table(&mut self, table: &mut Map<String, Value>, union: Node, path: &str) {
        let Some(node) = union.table(table) else {
            return self.unknown_type(table, union, path);
        };
        if let Some(tag) = node.tag() {
            table.entry(TAG).or_insert_with(|| tag.into());
        }
        for (key, value) in table.iter_mut() {
            let path = join(path, key);
            match node.key(key) {
                Some(node) => self.value(value, node, &path),
                None => self.unknown_key(key, node, union, &path),
            }
        }
        for key in node.required().filter(|key| !table.contains_key(*key)) {
            let expected = node.key(key).map(describe).unwrap_or_default();
            self.report(&join(path, key), "nothing", expected);
        }
        self.alternatives(table, node, path);
    }

    fn unknown_key(&mut self, key: &str, node: Node, union: Node, path: &str) {
        let place =
            path.rsplit_once('.').map_or("the document".to_owned(), |(table, _)| format!("`{table}`"));
        let problem = Problem::new(path, "an unknown key", format!("a key of {place}"));
        self.problems.push(problem.with_fix(unknown_key(path, key, node, union)));
    }

    fn unknown_type(&mut self, table: &Map<String, Value>, union: Node, path: &str) {
        let tags: Vec<_> = union.variants().into_iter().filter_map(Node::tag).collect();
        let expected = tags.iter().map(|tag| format!("{tag:?}")).collect::<Vec<_>>().join(" or ");
        let found = table.get(TAG).map_or("nothing".to_owned(), describe_value);
        let problem = Problem::new(join(path, TAG), found, expected);
        let fix = table.get(TAG).and_then(Value::as_str).and_then(|tag| unknown_word(tag, &tags));
        self.problems.push(Problem { fix, ..problem });
    }

    fn alternatives(&mut self, table: &Map<String, Value>, node: Node, path: &str) {
        if let Some(alternatives) = node.alternatives() {
            let given: Vec<_> =
                alternatives.keys.iter().copied().filter(|key| table.contains_key(*key)).collect();
            if given.len() > 1 {
                let all = if given.len() == 2 { "both" } else { "all of" };
                let problem = Problem::new(path, format!("{all} `{}`", given.join("` and `")), "one of them");
                self.problems.push(problem.with_fix("keep only one"));
            } else if given.is_empty() && alternatives.needed {
                let none = format!("neither `{}`", alternatives.keys.join("` nor `"));
                self.report(path, none, "one of them");
            }
        }
        for (companion, leader) in node.companions() {
            if table.contains_key(companion) && !table.contains_key(leader) {
                let problem = Problem::new(
                    join(path, companion),
                    format!("no `{leader}` beside it"),
                    "both or neither",
                );
                self.problems
                    .push(problem.with_fix(format!("give `{leader}` too, or leave `{companion}` out")));
            }
        }
    }

    fn list(&mut self, items: &mut [Value], node: Node, path: &str) {
        let (shortest, longest) = length(node);
        let count = items.len() as u64;
        if count < shortest || longest.is_some_and(|longest| count > longest) {
            return self.report(path, format!("a list of length {count}"), describe(node));
        }
        let Some(node) = node.items() else { return };
        for (i, item) in items.iter_mut().enumerate() {
            self.value(item, node, &join(path, i));
        }
    }

    fn text(&mut self, text: &str, node: Node, path: &str) {
        let choices = node.choices();
        let words: Vec<_> = choices.iter().filter_map(|choice| choice.keyword("const")?.as_str()).collect();
        if words.is_empty() {
            let shortest = node.keyword("minLength").and_then(Value::as_u64).unwrap_or(0);
            if (text.len() as u64) < shortest {
                self.report(path, "empty text", describe(node));
            }
        } else if !words.contains(&text) {
            let problem = Problem::new(path, quoted(text), describe(node));
            self.problems.push(Problem { fix: unknown_word(text, &words), ..problem });
        }
    }

    fn number(&mut self, number: &mut Number, node: Node, path: &str) {
        let format = node.keyword("format").and_then(Value::as_str);
        // The range applies to the number that the renderer will use, rounded to its precision.
        let round = |x: f64| if format == Some("float") { f64::from(cast::single(x)) } else { x };
        let bound = |name: &str| node.keyword(name).and_then(Value::as_f64).map(round);
        let x = round(number.as_f64().unwrap_or(f64::NAN));
        let in_range = bound("minimum").is_none_or(|low| x >= low)
            && bound("maximum").is_none_or(|high| x <= high)
            && bound("exclusiveMinimum").is_none_or(|low| x > low)
            && bound("exclusiveMaximum").is_none_or(|high| x < high);
        // A range from 0 also lets in -0, which becomes 0 here: the renderer divides by densities.
        if x == 0.0 && x.is_sign_negative() {
            *number = Number::from_f64(0.0).unwrap_or_else(|| number.clone());
        }
        let is_whole = node.keyword("type").is_some_and(|kind| kind == "integer");
        if is_whole && let Some(whole) = whole(number) {
            *number = whole;
        }
        let fits = match format {
            Some("uint32") => number.as_u64().is_some_and(|x| u32::try_from(x).is_ok()),
            Some("uint64") => number.is_u64(),
            _ => x.is_finite(),
        };
        if !in_range {
            self.report(path, number.to_string(), describe(node));
        } else if !fits {
            self.report(path, number.to_string(), format!("{}, of smaller magnitude", describe(node)));
        }
    }
}

impl Node {
    /// Whether a value is of this schema's JSON type.
    fn accepts(self, value: &Value) -> bool {
        let Some(kind) = self.keyword("type").and_then(Value::as_str) else { return false };
        match value {
            Value::Null => false,
            Value::Bool(_) => kind == "boolean",
            Value::Number(number) => kind == "number" || (kind == "integer" && whole(number).is_some()),
            Value::String(_) => kind == "string",
            Value::Array(_) => kind == "array",
            Value::Object(_) => kind == "object",
        }
    }
}

/// A number without a fraction, as an integer: 64.0 means 64. Very large ones stay as they are.
fn whole(number: &Number) -> Option<Number> {
    if !number.is_f64() {
        return Some(number.clone());
    }
    let x = number.as_f64().filter(|x| x.fract() == 0.0)?;
    Some(format!("{x:.0}").parse::<i64>().map_or_else(|_| number.clone(), Number::from))
}
