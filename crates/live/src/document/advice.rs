//! Advice on an unknown word: the nearest known one, or that it comes with a later version.

use super::node::Node;
use super::schema::TAG;
use tyndall::integrator::DEFAULT_METHOD;

/// Tables of the document that this version does not have yet, by their path.
const LATER_KEYS: [&str; 5] =
    ["objects", "surfaces", "render.many_light", "render.irradiance_cache", "render.refractive"];

/// Integrators that this version does not have yet.
const LATER_INTEGRATORS: [&str; 3] = ["many-light", "irradiance-cache", "refractive"];

/// How to fix a key that `node` does not have.
pub(super) fn unknown_key(path: &str, key: &str, node: Node, union: Node) -> String {
    if LATER_KEYS.contains(&path) {
        return format!("this version of Tyndall does not have `{path}` yet: leave it out");
    }
    if let Some(near) = nearest(key, node.keys()) {
        return format!("did you mean `{near}`?");
    }
    let owner = union.variants().into_iter().find(|variant| variant.key(key).is_some()).and_then(Node::tag);
    if let Some(owner) = owner {
        return format!("it belongs to type = \"{owner}\"");
    }
    format!("known here: {}", listed(node.keys().filter(|key| *key != TAG || node.tag().is_some())))
}

/// How to fix a word that is not one of `known`.
pub(super) fn unknown_word(word: &str, known: &[&'static str]) -> Option<String> {
    if known.contains(&DEFAULT_METHOD.name) && LATER_INTEGRATORS.contains(&word) {
        return Some(format!("this version of Tyndall does not have the integrator `{word}` yet"));
    }
    nearest(word, known.iter().copied()).map(|near| format!("did you mean \"{near}\"?"))
}

/// The words in backquotes, separated by commas.
fn listed<'a>(words: impl Iterator<Item = &'a str>) -> String {
    words.map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

/// The known word that a mistyped one most likely meant.
fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    /// Longer words are not typing errors, and the time to compare grows with the product of the lengths.
    const LONGEST: usize = 64;
    if word.len() > LONGEST {
        return None;
    }
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let distance = |known: &str| strsim::damerau_levenshtein(&word, &known.replace('-', "_"));
    let (distance, near) =
        known.map(|known| (distance(known), known)).min_by_key(|(distance, _)| *distance)?;
    (distance <= (word.chars().count() / 3).max(1)).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_word_finds_the_nearest_known_one_and_an_unrelated_word_none() {
        let known = || ["density", "phase", "brdf", "gradient_factor"].into_iter();
        assert_eq!(nearest("densty", known()), Some("density"));
        assert_eq!(nearest("Density", known()), Some("density"));
        assert_eq!(nearest("gradient-factor", known()), Some("gradient_factor"));
        assert_eq!(nearest("barf", known()), None);
        assert_eq!(nearest(&"density".repeat(1000), known()), None);
    }

    #[test]
    fn what_comes_with_later_versions_is_reported_as_such() {
        let root = Node::root();
        let fix = unknown_key("objects", "objects", root, root);
        assert!(fix.contains("does not have `objects` yet"), "{fix}");
        let fix = unknown_word("many-light", &["raymarch", "path"]).unwrap();
        assert!(fix.contains("does not have the integrator `many-light` yet"), "{fix}");
    }

    #[test]
    fn nothing_that_is_here_is_said_to_come_later() {
        for path in LATER_KEYS {
            let node = path.split('.').try_fold(Node::root(), Node::key);
            assert!(node.is_none(), "`{path}` is in the schema");
        }
    }
}
