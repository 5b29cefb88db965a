//! How user-supplied text is quoted in messages: shortened, and without characters that would move a terminal's cursor.

use std::path::Path;

/// A key or a word: its first 60 characters, with control characters escaped.
#[must_use]
pub fn excerpt(text: &str) -> String {
    shown(text, 60, 0)
}

/// The same between double quotes, with quotes escaped too.
#[must_use]
pub fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let short: String = text.chars().take(LONGEST).collect();
    let more = if text.chars().nth(LONGEST).is_some() { "..." } else { "" };
    format!("{:?}", short + more)
}

/// Another library's message, which may quote a file at length: its first 300 characters.
#[must_use]
pub fn sentence(text: &str) -> String {
    shown(&text.split_whitespace().collect::<Vec<_>>().join(" "), 300, 0)
}

/// A path: whole up to 240 characters, otherwise its beginning and end, which identify it best.
#[must_use]
pub fn path_name(path: &Path) -> String {
    shown(&path.to_string_lossy(), 80, 160)
}

/// The given numbers of first and last characters, with dots between them if any are left out.
fn shown(text: &str, head: usize, tail: usize) -> String {
    let characters = text.chars().count();
    if characters <= head + tail {
        return text.chars().map(visible).collect();
    }
    let first = text.chars().take(head).map(visible);
    let last = text.chars().skip(characters - tail).map(visible);
    first.chain(["...".to_owned()]).chain(last).collect()
}

/// A character, escaped if it is a control character or one that changes the direction of text.
fn visible(character: char) -> String {
    let acts = character.is_control()
        || matches!(character, '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if acts { character.escape_default().to_string() } else { character.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_words_stay_as_they_are() {
        for text in ["", "medium.density", "C:\\data\\Schädel 頭.nrrd", "it's \"so\""] {
            assert_eq!(excerpt(text), text);
            assert_eq!(path_name(Path::new(text)), text);
        }
        assert_eq!(quoted("it's \"so\""), "\"it's \\\"so\\\"\"");
    }

    #[test]
    fn what_acts_on_a_terminal_is_escaped() {
        assert_eq!(excerpt("a\u{1b}[31m\nb\0\u{202e}"), "a\\u{1b}[31m\\nb\\u{0}\\u{202e}");
        assert_eq!(quoted("\u{1b}"), "\"\\u{1b}\"");
        assert_eq!(sentence("two\n  lines\u{7}"), "two lines\\u{7}");
        assert_eq!(path_name(Path::new("a\nb.nrrd")), "a\\nb.nrrd");
    }

    #[test]
    fn long_words_are_cut_between_characters() {
        let long = "\u{e9}".repeat(1000);
        assert_eq!(excerpt(&long), format!("{}...", "\u{e9}".repeat(60)));
        assert_eq!(quoted(&long), format!("\"{}...\"", "\u{e9}".repeat(60)));
        assert_eq!(sentence(&long).chars().count(), 303);
        let long = format!("/begin/{}/end.nrrd", "x".repeat(500));
        let shown = path_name(Path::new(&long));
        assert!(shown.starts_with("/begin/xx") && shown.ends_with("xx/end.nrrd"), "{shown}");
        assert_eq!(shown.chars().count(), 243);
        assert_eq!(path_name(Path::new(&long[..240])), long[..240]);
    }
}
