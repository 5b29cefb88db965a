//! The files of a folder form no import cycle: code that two of them need belongs in a file below both.
//! Checks the `use` lines of all crates; a folder's `mod.rs` and its files naturally import each other and are exempt.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// From each file to the files of the same folder that it imports, by module name.
type Graph = BTreeMap<String, BTreeSet<String>>;

fn folders(folder: &Path) -> Vec<PathBuf> {
    let inner = fs::read_dir(folder).expect("a folder").filter_map(|entry| {
        let path = entry.expect("an entry").path();
        path.is_dir().then_some(path)
    });
    let mut found = vec![folder.to_owned()];
    inner.for_each(|path| found.extend(folders(&path)));
    found
}

/// The modules in a folder, files and folders alike, except its own module.
fn modules(folder: &Path) -> Vec<(String, PathBuf)> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let module = |path: PathBuf| {
        let name = path.file_stem()?.to_str()?.to_owned();
        let counts = !["mod", "lib", "main", "tests"].contains(&name.as_str());
        counts.then_some((name, path))
    };
    entries.filter_map(module).collect()
}

/// The code of a module before its tests: that of one file, or of all files of a folder.
fn code(path: &Path) -> String {
    if path.is_dir() {
        let inside = fs::read_dir(path).expect("a folder").map(|entry| entry.expect("an entry").path());
        return inside.map(|path| code(&path)).collect();
    }
    if path.extension().is_none_or(|extension| extension != "rs") || path.ends_with("tests.rs") {
        return String::new();
    }
    let text = fs::read_to_string(path).expect("a source");
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .fold(String::new(), |all, line| all + line + "\n")
}

/// Names that follow `prefix` in code, each name in braces separately: `super::a`, `super::{b, c::D}`.
fn named(code: &str, prefix: &str) -> BTreeSet<String> {
    let word =
        |text: &str| -> String { text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect() };
    let mut names = BTreeSet::new();
    for after in code.split(prefix).skip(1) {
        let Some(inside) = after.strip_prefix('{') else {
            names.insert(word(after));
            continue;
        };
        let (mut depth, mut item) = (0, String::new());
        for c in inside.chars() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    names.insert(word(item.trim()));
                    item.clear();
                    continue;
                }
                _ => {}
            }
            item.push(c);
        }
        names.insert(word(item.trim()));
    }
    names
}

fn graph(src: &Path, folder: &Path) -> Graph {
    let modules = modules(folder);
    let from_root: String = folder
        .strip_prefix(src)
        .expect("a folder of the crate")
        .components()
        .map(|part| format!("{}::", part.as_os_str().to_string_lossy()))
        .collect();
    let imports = |(name, path): &(String, PathBuf)| {
        let code = code(path);
        let mut used = named(&code, &format!("crate::{from_root}"));
        // Inside a folder `super` is the folder itself.
        if path.is_file() {
            used.extend(named(&code, "super::"));
        }
        used.retain(|used| used != name && modules.iter().any(|(module, _)| module == used));
        (name.clone(), used)
    };
    let mut graph = Graph::new();
    // A file and the folder of the same name are one module.
    for (name, used) in modules.iter().map(imports) {
        graph.entry(name).or_default().extend(used);
    }
    graph
}

/// A cycle of imports, if there is one.
fn cycle(graph: &Graph) -> Option<Vec<String>> {
    fn visit(
        graph: &Graph,
        at: &str,
        way: &mut Vec<String>,
        done: &mut BTreeSet<String>,
    ) -> Option<Vec<String>> {
        if let Some(start) = way.iter().position(|before| before == at) {
            return Some(way[start..].to_vec());
        }
        if !done.insert(at.to_owned()) {
            return None;
        }
        way.push(at.to_owned());
        let found = graph[at].iter().find_map(|next| visit(graph, next, way, done));
        way.pop();
        found
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|at| visit(graph, at, &mut Vec::new(), &mut done))
}

#[test]
fn imports_between_files_of_a_folder_run_one_way() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut imports, mut cycles) = (0, Vec::new());
    for entry in fs::read_dir(&crates).expect("the crates") {
        let src = entry.expect("an entry").path().join("src");
        for folder in folders(&src) {
            let graph = graph(&src, &folder);
            imports += graph.values().map(BTreeSet::len).sum::<usize>();
            cycles.extend(cycle(&graph).map(|cycle| format!("{}: {}", folder.display(), cycle.join(" -> "))));
        }
    }
    assert!(cycles.is_empty(), "{cycles:#?}");
    assert!(imports > 200, "only {imports} imports were found: the test checks nothing");
}

#[test]
fn cycles_are_found_and_names_in_braces_are_read() {
    let of = |pairs: &[(&str, &[&str])]| -> Graph {
        let set = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        pairs.iter().map(|(name, used)| (name.to_string(), set(used))).collect()
    };
    assert_eq!(cycle(&of(&[("a", &["b"]), ("b", &["c"]), ("c", &[])])), None);
    let found = cycle(&of(&[("a", &["b"]), ("b", &["c"]), ("c", &["b"])])).expect("a cycle");
    assert_eq!(found, ["b", "c"]);
    let names = named("use super::{a, b::{C, D}, e::F};\nuse super::g::H;", "super::");
    assert_eq!(names.into_iter().collect::<Vec<_>>(), ["a", "b", "e", "g"]);
}
