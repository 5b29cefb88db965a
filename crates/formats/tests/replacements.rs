//! Files that are written piece by piece. Apart from the unit tests, one of which removes every unfinished file of its process.

use std::fs;
use tyndall_formats::atomic::Replacement;

#[test]
fn a_replacement_appears_when_it_is_finished_and_leaves_nothing_otherwise() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.apng");
    fs::write(&path, "before").expect("a file");
    let holds = |text: &str| {
        let names = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!((names, fs::read_to_string(&path).expect("a file").as_str()), (1, text));
    };
    let replacement = Replacement::begin(&path).expect("a place");
    fs::write(replacement.unfinished_path(), "half").expect("a file");
    assert_eq!(fs::read_to_string(&path).expect("a file"), "before");
    drop(replacement);
    holds("before");
    let replacement = Replacement::begin(&path).expect("a place");
    fs::write(replacement.unfinished_path(), "whole").expect("a file");
    replacement.finish().expect("a file");
    holds("whole");
    assert!(Replacement::begin(folder.path()).is_err());
}
