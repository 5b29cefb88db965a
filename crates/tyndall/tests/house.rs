//! The crate's top-level modules, its "rooms", import in one direction only; this checks their `use` lines.

use std::fs;
use std::path::{Path, PathBuf};
use tyndall::integrator::{METHODS, MethodEntry};

/// From the bottom up: a room may import rooms of lower floors; `transfer` and `scattering` also each other.
const FLOORS: [&[&str]; 10] = [
    &["math", "message"],
    &["simd"],
    &["sampling"],
    &["volume"],
    &["transfer", "scattering"],
    &["medium"],
    &["light", "camera", "film"],
    &["scene"],
    &["integrator"],
    &["session"],
];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the source folder is there") {
        let path = entry.expect("it can be listed").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

fn floor(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn imports_run_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut imports = 0;
    for path in sources(&root) {
        let place = path.strip_prefix(&root).unwrap().with_extension("");
        let room = place.components().next().unwrap().as_os_str().to_str().unwrap().to_owned();
        if room == "lib" {
            continue;
        }
        let own = floor(&room).unwrap_or_else(|| panic!("room `{room}` is on no floor; add it to FLOORS"));
        for used in fs::read_to_string(&path).unwrap().split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            // Macros and items of the crate's root are not rooms.
            let Some(used_floor) = floor(&used) else { continue };
            let allowed = used_floor < own || used == room || (used_floor == own && own == 4);
            assert!(allowed, "{}: `{room}` must not import `{used}`", path.display());
            imports += 1;
        }
    }
    assert!(imports > 50, "only {imports} imports were found: the test checks nothing");
}

/// The folder names of the methods, from the list of methods.
fn methods() -> Vec<String> {
    METHODS.iter().map(MethodEntry::table).collect()
}

/// The code of a file before its unit tests, without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source file");
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Whether code names a method: as a module, as a quoted word, or as a table of the scene document.
fn names(code: &str, method: &str) -> bool {
    let hyphens = method.replace('_', "-");
    let mut spelt = vec![
        format!("integrator::{method}"),
        format!("super::{method}::"),
        format!("render.{method}"),
        format!("`{hyphens}`"),
    ];
    // "path" is also the key of a file in the document.
    if method != "path" {
        spelt.extend([format!("\"{hyphens}\""), format!("\"{method}\"")]);
    }
    spelt.iter().any(|name| code.contains(name))
}

#[test]
fn a_method_is_named_in_its_folder_and_in_one_list() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let list = crates.join("tyndall/src/integrator/mod.rs").canonicalize().unwrap();
    let (mut files, mut named_at_home) = (0, 0);
    for room in ["tyndall", "formats", "live", "cli"] {
        let root = crates.join(room).join("src").canonicalize().unwrap();
        for path in sources(&root) {
            // Benchmarks name the methods that they measure, and unit tests may name methods.
            if path == list || path.components().any(|c| c.as_os_str() == "bench" || c.as_os_str() == "tests")
            {
                continue;
            }
            files += 1;
            let code = code(&path);
            for method in methods() {
                let home = crates.join("tyndall/src/integrator").join(&method).canonicalize().unwrap();
                let found = names(&code, &method);
                named_at_home += usize::from(found && path.starts_with(&home));
                assert!(!found || path.starts_with(&home), "{} names the method `{method}`", path.display());
            }
        }
    }
    assert!(files > 100 && named_at_home > 0, "{files} files, {named_at_home} names");
}

#[test]
fn methods_do_not_know_each_other() {
    for method in methods() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/integrator").join(&method);
        let files = sources(&folder);
        assert!(!files.is_empty(), "no file of `{method}`");
        for code in files.iter().map(|path| code(path)) {
            for other in methods().iter().filter(|other| **other != method) {
                let known = [format!("super::{other}::"), format!("integrator::{other}")];
                assert!(!known.iter().any(|name| code.contains(name)), "`{method}` imports `{other}`");
            }
        }
    }
}

#[test]
fn the_renderer_knows_no_file_and_no_window() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for word in ["std::fs", "std::net", "std::io", "std::process", "tyndall_formats"] {
            assert!(!code.contains(word), "{}: {word}", path.display());
        }
    }
}

/// Code that makes its own counters might reuse random numbers that other code draws.
#[test]
fn addresses_of_random_numbers_come_from_one_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let drawn_in = ["address.rs", "philox.rs", "stream.rs"].map(|file| root.join("sampling").join(file));
    for path in sources(&root).iter().filter(|path| !drawn_in.contains(path) && !path.ends_with("tests.rs")) {
        let text = fs::read_to_string(path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for word in ["Stream::new(", "Stream::at(", "philox("] {
            assert!(!code.contains(word), "{}: {word}", path.display());
        }
    }
    assert!(drawn_in.iter().all(|path| path.exists()));
}
