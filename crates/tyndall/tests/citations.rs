//! Every citation is listed in `references.bib`, and every entry there is cited.
//!
//! A citation is a key in square brackets: the first author's name and two digits of the year, and, after a
//! comma, the place in the work or another key. In doc comments the brackets are escaped, or rustdoc would
//! read the key as a link to an item.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder of the repository");
    entries.map(|entry| entry.expect("an entry that can be read").path()).collect()
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e == extension)
}

/// The files at any depth below a folder.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let (folders, mut found): (Vec<_>, Vec<_>) = entries(folder).into_iter().partition(|path| path.is_dir());
    found.retain(|path| has_extension(path, extension));
    found.extend(folders.iter().flat_map(|folder| files(folder, extension)));
    found
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("a text of the repository")
}

/// At least two letters, two digits, and a letter if the author has more than one work of that year.
/// One letter and two digits would be a Rust number type, such as `f64`.
fn is_key(text: &str) -> bool {
    let text = text.strip_suffix(|c: char| c.is_ascii_lowercase()).unwrap_or(text);
    let name = text.trim_end_matches(|c: char| c.is_ascii_digit());
    text.len() == name.len() + 2 && name.len() >= 2 && name.chars().all(|c| c.is_ascii_alphabetic())
}

/// The keys between square brackets, escaped or not, unless a parenthesis follows: then they are the text of a link.
fn keys(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (opening, _) in text.match_indices('[') {
        let Some((inside, after)) = text[opening + 1..].split_once(']') else { break };
        if !after.starts_with('(') {
            let inside = inside.strip_suffix('\\').unwrap_or(inside);
            found.extend(inside.split(',').map(str::trim).filter(|part| is_key(part)));
        }
    }
    found
}

/// The text after the first `//` that begins the line or follows white space, which the `//` of a URL does not.
fn comment(line: &str) -> Option<&str> {
    let begins = |start: usize| line[..start].chars().next_back().is_none_or(char::is_whitespace);
    let (start, _) = line.match_indices("//").find(|(start, _)| begins(*start))?;
    Some(line[start..].trim_start_matches(['/', '!']))
}

/// The comments of a Rust source, line by line.
fn comments(source: &str) -> String {
    source.lines().map(|line| comment(line).unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Each cited key, with the files that cite it.
fn cited() -> BTreeMap<String, BTreeSet<PathBuf>> {
    let root = repository();
    let mut documents = files(&root.join("docs"), "md");
    documents.extend(entries(&root).into_iter().filter(|path| has_extension(path, "md")));
    let documents = documents.into_iter().map(|path| (read(&path), path));
    let sources = files(&root.join("crates"), "rs").into_iter().map(|path| (comments(&read(&path)), path));

    let mut found = BTreeMap::<_, BTreeSet<_>>::new();
    for (text, path) in documents.chain(sources) {
        let path = path.strip_prefix(&root).unwrap_or(&path);
        for key in keys(&text) {
            found.entry(key.to_owned()).or_default().insert(path.to_owned());
        }
    }
    assert!(found.len() > 20, "only {} keys were found: the test checks nothing", found.len());
    found
}

/// The keys of the entries of `references.bib`.
fn listed() -> Vec<String> {
    let text = read(&repository().join("references.bib"));
    let key = |line: &str| Some(line.strip_prefix('@')?.split_once('{')?.1.trim_end_matches(',').to_owned());
    text.lines().filter_map(key).collect()
}

#[test]
fn each_citation_has_its_entry() {
    let listed = listed();
    let missing: Vec<_> = cited().into_iter().filter(|(key, _)| !listed.contains(key)).collect();
    assert!(missing.is_empty(), "references.bib lacks keys that these files cite: {missing:#?}");
}

#[test]
fn each_entry_is_cited_and_listed_once() {
    let cited = cited();
    let listed = listed();
    let idle: Vec<_> = listed.iter().filter(|key| !cited.contains_key(*key)).collect();
    assert!(idle.is_empty(), "no file cites these entries of references.bib: {idle:?}");
    let once: BTreeSet<_> = listed.iter().collect();
    assert_eq!(once.len(), listed.len(), "a key has two entries in references.bib: {listed:?}");
}

#[test]
fn keys_are_distinguished_from_links_and_code() {
    let cases: [(&str, &[&str]); 14] = [
        ("a lobe [HG41]: wide", &["HG41"]),
        (r"a lobe \[HG41\].", &["HG41"]),
        ("[Low12, eq. 15]", &["Low12"]),
        (r"\[Low12, eq. 15\]", &["Low12"]),
        ("[Low12,\n eq. 15]", &["Low12"]),
        ("[Low12a, vandeHulst80]", &["Low12a", "vandeHulst80"]),
        ("[`Fit` of [HG41]]", &["HG41"]),
        ("[HG41](https://example.org)", &[]),
        ("HG41", &[]),
        ("[HG41", &[]),
        ("[f64], [u16, i32]", &[]),
        ("[Low2012] [Low1] [HG4a] [41]", &[]),
        ("[Low-12] [`HG41`] [SplitMix64::new]", &[]),
        (r"\[1/sr\]", &[]),
    ];
    for (text, expected) in cases {
        assert_eq!(keys(text), expected, "{text}");
    }
}

#[test]
fn only_comments_of_sources_are_read() {
    // Tabs, not spaces, before `//`: this file is checked too, and a space would make these its own comments.
    let source = "//! [Aa01]\n\t/// \\[Bb02,\n\t/// fig. 1\\]\ny[cc03];\t// [Dd04]\n\"https://[Ee05]\"";
    assert_eq!(keys(&comments(source)), ["Aa01", "Bb02", "Dd04"]);
}
