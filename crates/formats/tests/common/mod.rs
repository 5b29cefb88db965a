//! Helpers shared by the tests of files.

use std::fs;
use std::path::{Path, PathBuf};

/// An empty folder for one test.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("the last run's folder can go");
    }
    fs::create_dir(&folder).expect("a new folder");
    folder
}

/// Deletes and rewrites a file; overwriting it in place can make the file system wait for the disk each time.
pub fn rewrite(path: &Path, bytes: &[u8]) {
    if path.exists() {
        fs::remove_file(path).expect("the last file can go");
    }
    fs::write(path, bytes).expect("a new file");
}

/// Calls `try_file` on 3000 copies of a file with three bytes changed, by a fixed sequence (Knuth's MMIX generator).
pub fn for_damaged_copies(bytes: &[u8], path: &Path, try_file: impl Fn(&Path)) {
    let mut state = 1_u64;
    for _ in 0..3000 {
        let mut changed = bytes.to_vec();
        for _ in 0..3 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let place = usize::try_from(state >> 33).expect("31 bits") % changed.len();
            changed[place] = state.to_be_bytes()[0];
        }
        rewrite(path, &changed);
        try_file(path);
    }
}
