//! What is printed besides pictures: what the loader understood, notes, lists.

use crate::support::{Ended, Folder, json, run};
use tyndall_formats::image::{Metadata, read_metadata};

/// A cloud in a few pixels.
const SCENE: &str = "\
    volume.procedural = { kind = 'cloud', size = [12, 12, 12] }\n\
    medium.density = 0.5\n\
    film.size = [16, 16]\n\
    render.samples = 4\n";

#[test]
fn a_part_that_is_not_shown_is_noted() {
    let folder = Folder::new();
    let head = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 2 2 3\nencoding: raw\n\n";
    folder.put("a.nrrd", [head.as_bytes(), &(0..24).collect::<Vec<u8>>()].concat());
    let arguments = ["render", "../a.nrrd", "--size", "8x8", "--samples", "1"];
    let Ended { status, stderr, .. } = folder.run(&arguments);
    assert_eq!(status, Some(0), "{stderr}");
    assert_eq!(stderr, "tyndall: note: 3 time steps: the first was read\n");
    run(&folder, &[&arguments[..], &["-q"]].concat());
}

#[test]
fn a_picture_without_matter_is_noted() {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE);
    let clip =
        |normal: &str| format!("clip=[{{\"type\":\"plane\",\"point\":[0,99,0],\"normal\":[0,{normal},0]}}]");
    for (assignment, note) in [
        (
            "transfer_function.points=[{\"value\":1.5,\"opacity\":0},{\"value\":2,\"opacity\":1}]",
            "no value of the data has any opacity",
        ),
        (&clip("-1"), "a clip cuts the whole volume away"),
        (&clip("1"), ""),
    ] {
        let Ended { status, stderr, .. } = folder.run(&["render", "../scene.toml", "--set", assignment]);
        assert_eq!(status, Some(0), "{stderr}");
        assert!(stderr.contains(note) && stderr.is_empty() == note.is_empty(), "{assignment}: {stderr}");
    }
}

/// No picture has holes: the first sample of every pixel is taken however long it takes (here, some seconds).
#[test]
fn a_first_sample_past_the_time_is_noted() {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE);
    let arguments = ["render", "../scene.toml", "--time", "0.01"];
    run(&folder, &arguments);
    let dense = ["--threads", "1", "--set", "medium.density=50", "--set", "render.photon.photons=300000"];
    let photon = [&arguments[..], &["--integrator", "photon"], &dense].concat();
    let Ended { status, stderr, .. } = folder.run(&photon);
    assert_eq!(status, Some(0), "{stderr}");
    let note = "note: the first sample of every pixel";
    assert!(stderr.contains(note) && stderr.lines().count() == 1, "{stderr}");
}

/// What `info` reports about samples that are not finite: how many, that NaN counts nowhere, and infinities as the ends of the range.
#[test]
fn nan_is_no_data_and_infinities_are_the_ends_of_the_range() {
    let values = [f64::NAN, 2.0, f64::INFINITY, 3.0, f64::NEG_INFINITY, 4.0, 2.0, 3.5];
    #[expect(clippy::cast_possible_truncation, reason = "short numbers")]
    let single = values.map(|v| (v as f32).to_le_bytes()).concat();
    let double = values.map(f64::to_le_bytes).concat();
    for (kind, name, samples) in [("float", "f32", single), ("double", "f64", double)] {
        let folder = Folder::new();
        let head =
            format!("NRRD0004\ntype: {kind}\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: little\n\n");
        folder.put("a.nrrd", [head.as_bytes(), &samples].concat());
        let report = json(&run(&folder, &["info", "../a.nrrd", "--json"]));
        assert_eq!(report["type"], name, "{report}");
        assert_eq!(report["non_finite"], 3, "{report}");
        assert_eq!(report["no_data"], 1, "{report}");
        assert_eq!(report["value_range"], serde_json::json!([2.0, 4.0]), "{report}");
        let counts: Vec<u64> =
            serde_json::from_value(report["histogram"]["counts"].clone()).expect("numbers");
        assert_eq!((counts[0], counts[255], counts.iter().sum::<u64>()), (3, 2, 7), "{report}");
        let text = String::from_utf8(run(&folder, &["info", "../a.nrrd"])).expect("UTF-8");
        assert!(text.contains("not finite 3 samples; NaN is no data"), "{text}");
        assert!(text.contains("values     2 to 4;"), "{text}");
    }
}

/// Pictures of older versions have a key at its old place.
#[test]
fn a_key_at_its_old_place_is_read_with_a_note() {
    let folder = Folder::new();
    folder.put("old.toml", format!("{SCENE}render.path.majorant_cell = 4\n"));
    folder.put("both.toml", format!("{SCENE}render.path.majorant_cell = 4\nmedium.majorant_cell = 8\n"));
    let Ended { status, stderr, .. } = folder.run(&["render", "../old.toml"]);
    assert_eq!(status, Some(0), "{stderr}");
    let note = "`render.path.majorant_cell` is now `medium.majorant_cell` and was read as such";
    assert_eq!(stderr, format!("tyndall: note: {note}\n"));
    let Ended { status, stderr, .. } = folder.run(&["render", "../both.toml"]);
    assert_eq!(status, Some(1), "{stderr}");
    assert!(
        stderr.contains("render.path.majorant_cell") && stderr.contains("medium.majorant_cell"),
        "{stderr}"
    );
    // An option takes precedence over the file.
    let Ended { status, stderr, .. } =
        folder.run(&["render", "../old.toml", "--set", "medium.majorant_cell=2", "-o", "b.png"]);
    assert_eq!((status, stderr.contains("note")), (Some(0), true), "{stderr}");
    let metadata = read_metadata(&folder.at("out/b.png")).expect("a picture").expect("metadata");
    let scene: serde_json::Value =
        serde_json::from_str(metadata.get(Metadata::SCENE).expect("a scene")).expect("JSON");
    assert_eq!(scene["medium"]["majorant_cell"], 2);
    assert_eq!(scene.pointer("/render/path/majorant_cell"), None);
}

#[test]
fn what_the_loader_understood_is_printed() {
    let folder = Folder::new();
    let head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 1\nspace: LPS\n\
                space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (5,6,7)\nencoding: raw\nendian: little\n\n";
    let samples = [-1000_i16, 0, 1, 2, 3, 500].map(i16::to_le_bytes).concat();
    folder.put("a.nrrd", [head.as_bytes(), &samples].concat());
    folder.put("scene.json", "{ \"volume\": { \"path\": \"a.nrrd\" }, \"film\": { \"size\": [8, 8] } }");
    let report = json(&run(&folder, &["info", "../a.nrrd", "--json"]));
    for (key, value) in [
        ("dims", serde_json::json!([3, 2, 1])),
        ("type", serde_json::json!("i16")),
        ("spacing", serde_json::json!([2.0, 3.0, 4.0])),
        ("direction", serde_json::json!([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
        ("origin", serde_json::json!([5.0, 6.0, 7.0])),
        ("bounds", serde_json::json!([[4.0, 4.5, 5.0], [10.0, 10.5, 9.0]])),
        ("value_range", serde_json::json!([-1000.0, 500.0])),
        ("channels", serde_json::json!(1)),
        ("times", serde_json::json!(1)),
    ] {
        assert_eq!(report[key], value, "{key}");
    }
    assert_eq!(report["robust_range"].as_array().map(Vec::len), Some(2), "{report}");
    assert_eq!(report["histogram"]["range"], report["value_range"]);
    let counts = report["histogram"]["counts"].as_array().expect("counts");
    assert_eq!(counts.iter().filter_map(serde_json::Value::as_u64).sum::<u64>(), 6);
    assert_eq!(json(&run(&folder, &["info", "../scene.json", "--json"])), report);
    run(&folder, &["render", "../scene.json", "-o", "a.exr", "--samples", "1"]);
    assert_eq!(json(&run(&folder, &["info", "a.exr", "--json"])), report);
    let text = String::from_utf8(run(&folder, &["info", "../a.nrrd"])).expect("UTF-8");
    assert!(text.contains("3 x 2 x 1 of i16") && text.contains("-1000 to 500"), "{text}");
}

#[test]
fn lists_are_printed() {
    let folder = Folder::new();
    let presets = String::from_utf8(run(&folder, &["presets"])).expect("UTF-8");
    assert!(presets.lines().any(|line| line.starts_with("ct-bone ")), "{presets}");
    let schema = json(&run(&folder, &["schema"]));
    assert!(schema["properties"]["volume"].is_object(), "{schema}");
    let script = String::from_utf8(run(&folder, &["completions", "bash"])).expect("UTF-8");
    assert!(script.contains("_tyndall()") && script.contains("--max-scatter"), "{script}");
}
