//! Pictures of the examples keep their bits: whoever changes them on purpose renders them again with `TYNDALL_FIX_PICTURES=1`, says so in
//! CHANGELOG.md, and shows with tools/z_test.py that the light is the same.

use crate::support::{Folder, decode, written};
use std::fs;
use std::path::{Path, PathBuf};
use tyndall::integrator::METHODS;

/// Fraction of a picture's bytes that may differ: another mathematical library rounds otherwise now and then.
const ROUNDING: f64 = 0.01;

fn examples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let entries = fs::read_dir(folder).expect("the examples").map(|entry| entry.expect("an entry").path());
    let mut scenes: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    scenes
}

#[test]
fn pictures_keep_their_bits() {
    let fixed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixed");
    let folder = Folder::new();
    let mut differing = Vec::new();
    for scene in examples() {
        for method in METHODS {
            let name =
                format!("{}-{}.png", scene.file_stem().expect("a name").to_string_lossy(), method.name);
            let path = scene.to_string_lossy();
            let options =
                ["--integrator", method.name, "--size", "24x24", "--samples", "3", "-q", "-o", "a.png"];
            let less = ["--set", "render.photon.photons=5000", "--set", "render.raymarch.light_samples=2"];
            // One level on every machine.
            let mut command = folder.tyndall(&[&["render", &path], &options[..], &less].concat());
            let status = command.env("TYNDALL_SIMD", "scalar").status().expect("the program runs");
            assert!(status.success(), "{name}");
            let picture = written(&folder, "a.png");
            let kept = fixed.join(&name);
            if std::env::var_os("TYNDALL_FIX_PICTURES").is_some() {
                fs::create_dir_all(&fixed).expect("a folder");
                fs::write(&kept, &picture).expect("a picture");
            }
            let expected = fs::read(&kept).unwrap_or_else(|e| panic!("{}: {e}", kept.display()));
            let ((size, channels, found), (its_size, its_channels, expected)) =
                (decode(&picture), decode(&expected));
            assert_eq!((size, channels), (its_size, its_channels), "{name}");
            let others = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            if others as f64 > ROUNDING * found.len() as f64 {
                differing.push(format!("{name}: {others} of {} bytes", found.len()));
            }
        }
    }
    assert!(differing.is_empty(), "other bits than before: {differing:?}");
}
