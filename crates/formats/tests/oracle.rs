//! Every file written by a format's reference library is read as that library reads it.
//!
//! `tests/oracle/make_and_dump.py FOLDER [DATA]` writes the files, and what nibabel, pynrrd, SimpleITK and
//! NumPy read from them. Set `TYNDALL_ORACLE_DIR` to that folder, and `TYNDALL_DATA_DIR` to the folder of real
//! files, if they were dumped too.

use serde::Deserialize;
use std::path::{Path, PathBuf};
use tyndall_formats::volume::read;

/// Relative difference in positions and directions due to single-precision headers.
const PLACE_TOLERANCE: f64 = 1e-5;
/// After slope and intercept, a value may round differently by one unit of single precision.
const VALUE_TOLERANCE: f64 = f32::EPSILON as f64;

#[derive(Deserialize)]
struct Expected {
    file: String,
    dump: String,
    dims: [usize; 3],
    spacing: [f64; 3],
    direction: [[f64; 3]; 3],
    origin: [f64; 3],
    channels: usize,
    times: usize,
    data: bool,
}

fn folder(variable: &str) -> Option<PathBuf> {
    let folder = std::env::var_os(variable).map(PathBuf::from);
    if folder.is_none() {
        println!("SKIPPED: {variable} is not set");
    }
    folder
}

/// What differs, in words.
fn difference(root: &Path, path: &Path, expected: &Expected) -> Result<(), String> {
    let loaded = read(path).map_err(|error| error.to_string())?;
    let (volume, grid) = (&loaded.volume, loaded.volume.grid());
    if grid.dims() != expected.dims {
        return Err(format!("dims {:?}, expected {:?}", grid.dims(), expected.dims));
    }
    if (loaded.channels, loaded.times) != (expected.channels, expected.times) {
        let (c, t) = (expected.channels, expected.times);
        return Err(format!("{} channels, {} times, expected {c}, {t}", loaded.channels, loaded.times));
    }
    let extent = (0..3).map(|i| expected.spacing[i] * expected.dims[i] as f64).fold(0.0, f64::max);
    let far = expected.origin.iter().fold(extent, |far, o| far.max(o.abs()));
    let close = |what: &str, found: &[f64], expected: &[f64], scale: f64| {
        let wrong = found.iter().zip(expected).any(|(a, b)| (a - b).abs() > PLACE_TOLERANCE * scale);
        if wrong { Err(format!("{what} {found:?}, expected {expected:?}")) } else { Ok(()) }
    };
    let smallest = expected.spacing.iter().copied().fold(f64::INFINITY, f64::min);
    close("spacing", &grid.spacing(), &expected.spacing, smallest)?;
    close("direction", grid.direction().as_flattened(), expected.direction.as_flattened(), 1.0)?;
    close("origin", &grid.origin(), &expected.origin, far)?;
    let dump = std::fs::read(root.join(&expected.dump)).map_err(|error| error.to_string())?;
    let values = dump.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
    if values.len() != grid.len() {
        return Err(format!("{} values dumped, expected {}", values.len(), grid.len()));
    }
    let voxels = volume.voxels();
    for (index, expected) in values.enumerate() {
        let found = volume.value_map().apply(voxels.get(index));
        if (found - expected).abs() > VALUE_TOLERANCE * expected.abs() {
            return Err(format!("value {index} is {found}, expected {expected}"));
        }
        let exact = volume.value_map() == tyndall::volume::ValueMap::IDENTITY;
        if exact && found.to_bits() != expected.to_bits() {
            return Err(format!("value {index} is {found}, expected exactly {expected}"));
        }
    }
    Ok(())
}

#[test]
fn files_of_the_reference_libraries_are_read_as_they_read_them() {
    let Some(root) = folder("TYNDALL_ORACLE_DIR") else { return };
    let data = folder("TYNDALL_DATA_DIR");
    let list = std::fs::read_to_string(root.join("expected.jsonl")).unwrap();
    let mut compared = 0;
    let mut failures = Vec::new();
    for line in list.lines() {
        let expected: Expected = serde_json::from_str(line).unwrap();
        let Some(folder) = (if expected.data { data.as_ref() } else { Some(&root) }) else { continue };
        compared += 1;
        if let Err(what) = difference(&root, &folder.join(&expected.file), &expected) {
            failures.push(format!("{}: {what}", expected.file));
        }
    }
    println!("{compared} files compared");
    assert!(compared >= 250, "only {compared} files were listed");
    assert!(failures.is_empty(), "{} of {compared} differ:\n{}", failures.len(), failures.join("\n"));
}
