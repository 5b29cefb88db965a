//! Tables that `tyndall bench` is asked for, reduced to what shows that they work.

mod support;

use serde_json::Value;
use support::{Ended, Folder};

/// A volume of 12^3 values from -400 to 1500, as NRRD.
fn tiny_scan() -> Vec<u8> {
    let head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 12 12 12\nencoding: raw\nendian: little\n\n";
    let values = (0..12_i16 * 12 * 12).flat_map(|i| (i * 11 % 1900 - 400).to_le_bytes());
    head.bytes().chain(values).collect()
}

fn run(arguments: &[&str], files: &[&str]) -> Ended {
    let folder = Folder::new();
    files.iter().for_each(|name| folder.put(name, tiny_scan()));
    let ended = folder.run(arguments);
    assert_eq!(ended.status, Some(0), "{arguments:?}: {}", ended.stderr);
    ended
}

/// The different values of a key of JSON rows, in their order.
fn values(ended: &Ended, key: &str) -> Vec<String> {
    let rows: Vec<Value> = serde_json::from_slice(&ended.stdout).expect("JSON rows");
    let mut found: Vec<String> = rows.iter().map(|row| row[key].as_str().expect("text").to_owned()).collect();
    found.dedup();
    found
}

#[test]
fn only_the_chosen_tables_are_measured_and_nothing_else_is_said() {
    let chosen = ["bench", "historygrams", "--quick", "--json", "--table", "path", "--table", "defaults"];
    let ended = run(&chosen, &[]);
    let titles = values(&ended, "table");
    assert_eq!(titles.len(), 2, "{titles:?}");
    // In the order of the whole set, whatever that of the options.
    assert!(titles[0].starts_with("default settings") && titles[1].starts_with("path with"), "{titles:?}");
    assert_eq!(ended.stderr, "");
}

#[test]
fn progress_names_the_table() {
    let arguments = ["bench", "historygrams", "--quick", "--json", "--table", "scans", "--progress"];
    let ended = run(&arguments, &[]);
    assert!(ended.stderr.starts_with("  0 %  0 s, scans"), "{}", ended.stderr);
    let rows = values(&ended, "row");
    assert!(rows.iter().all(|row| row.starts_with("MRI, ")) && rows.len() == 8, "{rows:?}");
}

#[test]
fn scans_of_a_folder_come_before_the_mri() {
    let arguments = ["bench", "historygrams", "--quick", "--json", "--table", "scans", "--data", "..", "-q"];
    for (file, name) in [("ct_chest_aorta_i16.nrrd", "chest CT, "), ("ct_head_promed_i16.nrrd", "head CT, ")]
    {
        let rows = values(&run(&arguments, &[file]), "row");
        let [of_folder, mri] =
            [name, "MRI, "].map(|name| rows.iter().filter(|r| r.starts_with(name)).count());
        assert!([of_folder, mri] == [8, 8] && rows[0].starts_with(name), "{rows:?}");
    }
}
