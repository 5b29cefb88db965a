//! How a picture was made, stored in its file: a list of texts by key.

use serde_json::{Map, Value};

/// An ordered list of texts by key; every key begins with `tyndall:`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    entries: Vec<(String, String)>,
}

impl Metadata {
    /// Key of the scene document, as JSON.
    pub const SCENE: &str = "tyndall:scene";
    /// Key of the program's version.
    pub const VERSION: &str = "tyndall:version";
    /// Key of the seed.
    pub const SEED: &str = "tyndall:seed";
    /// Key of the samples per pixel.
    pub const SAMPLES: &str = "tyndall:samples";

    /// Sets the text of a key: replaces an existing entry, otherwise appends one.
    ///
    /// # Panics
    /// Unless the key is `tyndall:` followed by 1 to 23 printable ASCII characters, which every kind of file can hold.
    pub fn insert(&mut self, key: &str, text: impl Into<String>) {
        assert!(is_own(key), "metadata key `{key}`");
        match self.entries.iter_mut().find(|(known, _)| known == key) {
            Some((_, old)) => *old = text.into(),
            None => self.entries.push((key.to_owned(), text.into())),
        }
    }

    /// The text of a key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.iter().find(|(known, _)| *known == key).map(|(_, text)| text)
    }

    /// Keys and texts, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.entries.iter().map(|(key, text)| (key.as_str(), text.as_str()))
    }

    /// Whether there is no entry.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Adds an entry read from a file if its key is one of ours.
    pub(super) fn accept(&mut self, key: &str, text: impl Into<String>) {
        if is_own(key) {
            self.insert(key, text);
        }
    }

    /// One JSON object in pure ASCII, which no reader of a TIFF or JPEG comment can mistake for another encoding.
    pub(super) fn to_ascii_json(&self) -> String {
        let object: Map<String, Value> =
            self.iter().map(|(key, text)| (key.to_owned(), text.into())).collect();
        let mut ascii = String::new();
        for character in Value::Object(object).to_string().chars() {
            if character.is_ascii() {
                ascii.push(character);
            } else {
                for unit in character.encode_utf16(&mut [0; 2]) {
                    ascii.push_str(&format!("\\u{unit:04x}"));
                }
            }
        }
        ascii
    }

    /// Our entries of a JSON object; `None` if the text is not one.
    pub(super) fn from_json(text: &str) -> Option<Self> {
        let object: Map<String, Value> = serde_json::from_str(text).ok()?;
        let mut metadata = Self::default();
        for (key, value) in object {
            if let Value::String(text) = value {
                metadata.accept(&key, text);
            }
        }
        Some(metadata)
    }
}

/// Whether the key is ours. OpenEXR allows names of up to 31 bytes without a flag that old readers refuse; PNG, 79.
pub(super) fn is_own(key: &str) -> bool {
    key.len() <= 31
        && key
            .strip_prefix("tyndall:")
            .is_some_and(|name| !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_ascii_and_comes_back() {
        let mut metadata = Metadata::default();
        metadata.insert(Metadata::SCENE, "{\"path\": \"Schädel 𝛔\\\\ 頭.nrrd\"}\0\n");
        metadata.insert(Metadata::SEED, "0");
        metadata.insert(Metadata::SEED, "7");
        let json = metadata.to_ascii_json();
        assert!(json.is_ascii(), "{json}");
        assert_eq!(Metadata::from_json(&json).as_ref(), Some(&metadata));
        assert_eq!(metadata.get(Metadata::SEED), Some("7"));
    }

    #[test]
    fn other_programs_texts_are_left_alone() {
        let foreign = r#"{"Software": "x", "tyndall:": "no name", "tyndall:scene": 3}"#;
        assert_eq!(Metadata::from_json(foreign), Some(Metadata::default()));
        assert_eq!(Metadata::from_json("a comment"), None);
    }

    #[test]
    #[should_panic(expected = "metadata key `scene`")]
    fn keys_have_the_prefix() {
        Metadata::default().insert("scene", "");
    }
}
