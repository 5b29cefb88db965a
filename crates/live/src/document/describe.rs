//! Descriptions of what a place in the document may hold.

use serde_json::Value;

use super::node::Node;

/// What a place may hold, as described in messages.
pub(super) fn describe(node: Node) -> String {
    let choices = node.choices();
    let words: Vec<_> = choices.iter().filter_map(|choice| quoted(choice.keyword("const")?)).collect();
    let others = choices.iter().filter(|choice| choice.keyword("const").is_none() && choice.tag().is_none());
    let mut parts: Vec<_> = others.map(|choice| describe_choice(*choice)).collect();
    if choices.iter().any(|choice| choice.tag().is_some()) {
        parts.push("a table with a `type`".to_owned());
    }
    if !words.is_empty() {
        parts.insert(0, words.join(" or "));
    }
    parts.join(" or ")
}

fn quoted(word: &Value) -> Option<String> {
    word.as_str().map(|word| format!("{word:?}"))
}

fn describe_choice(node: Node) -> String {
    let kind = node.keyword("type").and_then(Value::as_str);
    match kind {
        Some("number") => format!("a number{}", describe_range(node)),
        Some("integer") => format!("a whole number{}", describe_range(node)),
        Some("string") => "text in quotes".to_owned(),
        Some("boolean") => "true or false".to_owned(),
        Some("array") => describe_list(node),
        _ => "a table".to_owned(),
    }
}

fn describe_list(node: Node) -> String {
    let items = node.items().map(|items| match items.keyword("type").and_then(Value::as_str) {
        Some("number") => format!("numbers{}", describe_range(items)),
        Some("integer") => format!("whole numbers{}", describe_range(items)),
        _ => "tables".to_owned(),
    });
    let items = items.unwrap_or_default();
    match length(node) {
        (shortest, Some(longest)) if shortest == longest => format!("a list of {longest} {items}"),
        (0, None) => format!("a list of {items}"),
        (0, Some(longest)) => format!("a list of at most {longest} {items}"),
        (shortest, Some(longest)) => format!("a list of {shortest} to {longest} {items}"),
        (shortest, None) => format!("a list of at least {shortest} {items}"),
    }
}

/// The least and the greatest length of a list.
pub(super) fn length(node: Node) -> (u64, Option<u64>) {
    let number = |name| node.keyword(name).and_then(Value::as_u64);
    (number("minItems").unwrap_or(0), number("maxItems"))
}

/// The range of a number, such as " from 0 to 1".
fn describe_range(node: Node) -> String {
    let bound = |inclusive, exclusive| {
        node.keyword(inclusive).map(|x| (x, true)).or_else(|| node.keyword(exclusive).map(|x| (x, false)))
    };
    match (bound("minimum", "exclusiveMinimum"), bound("maximum", "exclusiveMaximum")) {
        (None, None) => String::new(),
        (Some((low, true)), Some((high, true))) if low == high => format!(" that is {low}"),
        (Some((low, true)), Some((high, true))) => format!(" from {low} to {high}"),
        (Some((low, false)), Some((high, false))) => format!(" between {low} and {high}, ends excluded"),
        (low, high) => {
            let low = low.map(
                |(x, inclusive)| if inclusive { format!(" of at least {x}") } else { format!(" above {x}") },
            );
            let high = high.map(
                |(x, inclusive)| if inclusive { format!(" of at most {x}") } else { format!(" below {x}") },
            );
            low.into_iter().chain(high).collect::<Vec<_>>().join(" and")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn described(path: &str) -> String {
        let mut node = Node::root();
        for key in path.split('.') {
            node = match key {
                "[]" => node.items().unwrap(),
                key => node.choices().into_iter().find_map(|choice| choice.key(key)).unwrap(),
            };
        }
        describe(node)
    }

    #[test]
    fn each_kind_of_place_is_described() {
        for (path, words) in [
            ("version", "a whole number that is 1"),
            ("volume", "a table"),
            ("volume.path", "text in quotes"),
            ("volume.interpolation", "\"linear\" or \"nearest\""),
            ("volume.raw.spacing", "a list of 3 numbers above 0"),
            ("transfer_function.points", "a list of at least 1 tables"),
            ("transfer_function.points.[].albedo", "a number from 0 to 1 or a list of 3 numbers from 0 to 1"),
            ("medium.density", "a number of at least 0"),
            ("medium.phase", "a table with a `type`"),
            ("lights", "a list of at most 250000 tables"),
            ("camera.position", "a list of 3 numbers from -1e+38 to 1e+38"),
            ("camera.up", "a list of 3 numbers"),
            ("camera.fov", "a number between 0 and 180, ends excluded"),
            (
                "film.background",
                "\"environment\" or \"transparent\" or a number from 0 to 1e+18 or a list of 3 numbers from 0 to 1e+18",
            ),
            ("film.size", "a list of 2 whole numbers of at least 1"),
        ] {
            assert_eq!(described(path), words, "{path}");
        }
    }
}
