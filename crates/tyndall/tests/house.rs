//! The crate's rooms import one way only; this reads their `use` lines and holds them to it.

use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up: a room may use its own floor and those before it.
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

/// Rooms of one floor that must not know each other.
const METHODS: [&str; 3] = ["path", "photon", "raymarch"];

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
        let own =
            floor(&room).unwrap_or_else(|| panic!("room `{room}` stands on no floor; give it one here"));
        for used in fs::read_to_string(&path).unwrap().split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            // Macros and items of the crate's root are no rooms.
            let Some(used_floor) = floor(&used) else { continue };
            let allowed = used_floor < own || used == room || (used_floor == own && own == 4);
            assert!(allowed, "{}: `{room}` must not know `{used}`", path.display());
            imports += 1;
        }
    }
    assert!(imports > 50, "only {imports} imports were seen: the test reads nothing");
}

#[test]
fn methods_do_not_know_each_other() {
    for method in METHODS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/integrator");
        let own =
            |path: &PathBuf| path.starts_with(folder.join(method)) || path.ends_with(format!("{method}.rs"));
        let files: Vec<_> = sources(&folder).into_iter().filter(own).collect();
        assert!(!files.is_empty(), "no file of `{method}`");
        for text in files.iter().map(|path| fs::read_to_string(path).unwrap()) {
            for other in METHODS.iter().filter(|m| **m != method) {
                let named = [format!("super::{other}::"), format!("integrator::{other}")];
                assert!(!named.iter().any(|name| text.contains(name)), "`{method}` imports `{other}`");
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

/// Who writes counters by hand may draw what others draw.
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
