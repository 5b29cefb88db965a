//! Nodes of the document's JSON Schema, and how to get from a node to those below it.

use serde_json::{Map, Value};

use super::schema::{self, TAG};

/// The schema of one place in the document.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node(&'static Value);

impl Node {
    /// The schema of the whole document.
    pub(super) fn root() -> Self {
        Self(schema::shared())
    }

    fn new(schema: &'static Value) -> Self {
        let target = schema["$ref"].as_str().and_then(|reference| reference.strip_prefix('#'));
        match target.and_then(|pointer| schema::shared().pointer(pointer)) {
            Some(definition) => Self(definition),
            None => Self(schema),
        }
    }

    /// The value of a keyword, such as `minimum`.
    pub(super) fn keyword(self, name: &str) -> Option<&'static Value> {
        self.0.get(name)
    }

    /// The value of a keyword that is a list of strings, such as `required`.
    fn strings(self, name: &str) -> impl Iterator<Item = &'static str> {
        self.keyword(name).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str)
    }

    /// The schemas of which a value must match one, with nested choices expanded.
    pub(super) fn choices(self) -> Vec<Self> {
        let choices = ["oneOf", "anyOf"].iter().find_map(|name| self.keyword(name)?.as_array());
        match choices {
            Some(choices) if !self.is_table() => {
                choices.iter().flat_map(|choice| Self::new(choice).choices()).collect()
            }
            _ => vec![self],
        }
    }

    /// Whether this is a table; a table's own `oneOf` is a choice between keys.
    pub(super) fn is_table(self) -> bool {
        self.keyword("properties").is_some()
    }

    /// The schema of a list's items.
    pub(super) fn items(self) -> Option<Self> {
        self.keyword("items").map(Self::new)
    }

    /// The name of this variant of a tagged union.
    pub(super) fn tag(self) -> Option<&'static str> {
        self.keyword("properties")?.get(TAG)?.get("const")?.as_str()
    }

    /// The variants of a tagged union; empty for everything else.
    pub(super) fn variants(self) -> Vec<Self> {
        let choices = self.choices();
        if choices.iter().all(|choice| choice.tag().is_some()) { choices } else { Vec::new() }
    }

    /// The type that a tagged union has by default.
    pub(super) fn default_tag(self) -> Option<&'static str> {
        self.keyword("default")?.get(TAG)?.as_str()
    }

    /// The schema of `table`: in a tagged union, the variant of the type that `table` gives, or of the default type.
    pub(super) fn table(self, table: &Map<String, Value>) -> Option<Self> {
        let variants = self.variants();
        if variants.is_empty() {
            return self.choices().into_iter().find(|choice| choice.is_table());
        }
        let tag = match table.get(TAG) {
            Some(Value::String(tag)) => tag,
            Some(_) => return None,
            None => self.default_tag()?,
        };
        variants.into_iter().find(|variant| variant.tag() == Some(tag))
    }

    /// The schema of a list.
    pub(super) fn list(self) -> Option<Self> {
        self.choices().into_iter().find(|choice| choice.items().is_some())
    }

    /// The keys that this table may have.
    pub(super) fn keys(self) -> impl Iterator<Item = &'static str> {
        let properties = self.keyword("properties").and_then(Value::as_object);
        properties.into_iter().flat_map(|properties| properties.keys().map(String::as_str))
    }

    /// The schema of a key's value.
    pub(super) fn key(self, key: &str) -> Option<Self> {
        self.keyword("properties")?.get(key).map(Self::new)
    }

    /// The keys that this table must have.
    pub(super) fn required(self) -> impl Iterator<Item = &'static str> {
        self.strings("required")
    }

    /// The keys of which this table has at most one or, if `needed`, exactly one.
    pub(super) fn alternatives(self) -> Option<Alternatives> {
        if let Some(not) = self.keyword("not") {
            return Some(Alternatives { keys: Self(not).required().collect(), needed: false });
        }
        let choices = self.keyword("oneOf").filter(|_| self.is_table())?.as_array()?;
        let keys = choices.iter().flat_map(|choice| Self(choice).required().next()).collect();
        Some(Alternatives { keys, needed: true })
    }

    /// The keys that are only allowed with another one, each with that one, such as `raw` with `path`.
    pub(super) fn companions(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let pairs = self.keyword("dependentRequired").and_then(Value::as_object).into_iter().flatten();
        pairs.filter_map(|(companion, leader)| Some((companion.as_str(), leader.get(0)?.as_str()?)))
    }
}

/// Keys of a table that exclude each other.
pub(super) struct Alternatives {
    pub(super) keys: Vec<&'static str>,
    /// Whether one of them must be there.
    pub(super) needed: bool,
}

impl Alternatives {
    /// The keys that `key` excludes.
    pub(super) fn rivals(&self, key: &str) -> Vec<&'static str> {
        let others = self.keys.iter().copied().filter(|other| *other != key);
        if self.keys.contains(&key) { others.collect() } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn table(node: Node, value: &Value) -> Option<Node> {
        node.table(value.as_object().unwrap())
    }

    #[test]
    fn a_union_finds_the_variant_of_a_type_or_of_its_default() {
        let camera = Node::root().key("camera").unwrap();
        let tag = |value| table(camera, &value).and_then(Node::tag);
        assert_eq!(tag(json!({ "type": "orthographic" })), Some("orthographic"));
        assert_eq!(tag(json!({})), Some("perspective"));
        assert_eq!(tag(json!({ "type": "fish-eye" })), None);
        assert_eq!(tag(json!({ "type": 1 })), None);

        let light = Node::root().key("lights").and_then(Node::items).unwrap();
        assert_eq!(light.variants().len(), 6);
        assert!(table(light, &json!({})).is_none(), "a light has no type by default");
    }

    #[test]
    fn alternatives_and_companions_come_from_the_schema() {
        let volume = Node::root().key("volume").unwrap();
        let source = volume.alternatives().unwrap();
        assert_eq!((source.keys, source.needed), (vec!["path", "procedural"], true));
        assert_eq!(volume.companions().collect::<Vec<_>>(), [("raw", "path")]);

        let function = Node::root().key("transfer_function").unwrap().alternatives().unwrap();
        assert_eq!((&function.keys, function.needed), (&vec!["preset", "points"], false));
        assert_eq!(function.rivals("points"), ["preset"]);
        assert!(function.rivals("interpolation").is_empty());
        assert!(Node::root().alternatives().is_none());
    }

    #[test]
    fn a_colour_is_a_number_or_a_list() {
        let albedo = Node::root().key("transfer_function").and_then(|node| node.key("points"));
        let albedo = albedo.and_then(Node::items).and_then(|node| node.key("albedo")).unwrap();
        assert_eq!(albedo.choices().len(), 2);
        assert!(albedo.list().is_some());
    }
}
