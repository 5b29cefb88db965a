//! `tyndall replay`: edits against a live session, their reports, and invalid edits files.

use crate::fault::{Fault, SCENE};
use crate::support::{Ended, Folder};
use serde_json::{Value, json};

const CLOUD: &str = "\
    volume.procedural = { kind = 'cloud', size = [12, 12, 12] }\n\
    transfer_function.points = [{ value = 0.1, opacity = 0 }, { value = 1, opacity = 1 }]\n\
    medium.density = 0.5\n\
    film.size = [16, 16]\n\
    render.samples = 3\n";

fn with(edits: &Value) -> Folder {
    let folder = Folder::new();
    folder.put("scene.toml", CLOUD);
    folder.put("edits.json", edits.to_string());
    folder
}

/// The statistics of a replay with further options, whatever its status.
fn replay(folder: &Folder, options: &[&str]) -> (Value, Ended) {
    let arguments = ["replay", "../scene.toml", "../edits.json", "--stats", "s.json"];
    let ended = folder.run(&[&arguments, options].concat());
    let text = std::fs::read(folder.at("out/s.json")).unwrap_or_else(|e| panic!("{e}: {}", ended.stderr));
    (serde_json::from_slice(&text).expect("JSON"), ended)
}

fn edits() -> Value {
    json!([
        { "name": "thicker", "patch": { "medium": { "density": 0.8 } } },
        { "name": "brighter", "patch": { "film": { "exposure": 1 } } },
        { "patch": { "transfer_function": { "points": [{ "value": 0.3, "opacity": 0.5 }] } } },
        { "name": "wider", "patch": { "film": { "size": [20, 12] } } },
        { "name": "blocks", "patch": { "volume": { "interpolation": "nearest" } } },
        { "name": "another volume", "patch": { "volume": { "procedural": { "kind": "shells" } } } },
        { "name": "sky", "patch": { "lights": [{ "type": "environment", "radiance": 1 }] } },
        { "name": "more samples", "patch": { "render": { "samples": 5 } } },
        { "name": "another method", "patch": { "render": { "integrator": "raymarch" } } },
        { "name": "fewer samples", "patch": { "render": { "samples": 2 } } },
    ])
}

#[test]
fn every_edit_is_reported_and_equals_a_render_from_nothing() {
    for integrator in ["path", "raymarch"] {
        let folder = with(&edits());
        let (told, ended) = replay(&folder, &["--verify", "--integrator", integrator]);
        assert_eq!((ended.status, ended.stderr.as_str()), (Some(0), ""));
        let reports = told["edits"].as_array().expect("a list");
        let names: Vec<_> = reports.iter().map(|r| r["name"].as_str().expect("a name")).collect();
        assert_eq!(names[..4], ["thicker", "brighter", "edit 3", "wider"]);
        let redone: Vec<_> =
            reports.iter().map(|r| r["recomputed"]["pixels"].as_f64().expect("a share")).collect();
        // Samples that miss the cloud, half of all, are kept when its matter changes.
        let (matter, method) = if integrator == "path" { (redone[0], 1.0) } else { (1.0, 0.0) };
        assert!((0.4..0.6).contains(&matter) || integrator == "raymarch", "{told}");
        assert_eq!(redone, [matter, 0.0, matter, 1.0, 1.0, 1.0, 1.0, 0.0, method, 0.0], "{told}");
        for report in reports {
            assert_eq!(
                (&report["max_abs_diff"], &report["false_negatives"]),
                (&json!(0.0), &json!(0)),
                "{report}"
            );
            let [latency, scratch, speedup] =
                ["latency_s", "scratch_s", "speedup"].map(|key| report[key].as_f64().expect("a number"));
            assert!(latency > 0.0 && scratch > 0.0 && (speedup - scratch / latency).abs() < 1e-6 * speedup);
        }
        // Samples that the thicker cloud did not change were taken again; where sizes differ nothing can be compared.
        assert!(reports[0]["false_positives"].as_u64() > Some(0), "{told}");
        assert_eq!(reports[3]["false_positives"], Value::Null);
        let table = String::from_utf8(ended.stdout).expect("text");
        assert_eq!(table.lines().count(), 1 + reports.len(), "{table}");
        assert!(table.contains("another volume"), "{table}");
    }
}

#[test]
fn light_paths_that_were_not_traced_do_not_count_as_wrong() {
    let folder = with(&json!([
        { "patch": { "transfer_function": { "points": [{ "value": 0.3, "opacity": 0.5 }] } } },
        { "patch": { "render": { "max_scatter": 1 } } },
        { "patch": { "render": { "max_scatter": 0 } } },
    ]));
    let options = ["--verify", "--integrator", "photon", "--set", "render.max_scatter=0"];
    let (told, _) = replay(&folder, &options);
    for (report, traced) in told["edits"].as_array().expect("a list").iter().zip([0.0, 1.0, 0.0]) {
        let counts = ["max_abs_diff", "false_negatives"].map(|key| report[key].as_f64());
        assert_eq!(counts, [Some(0.0); 2], "{report}");
        assert_eq!(report["recomputed"]["photons"], traced, "{report}");
    }
}

#[test]
fn without_verify_nothing_is_rendered_twice() {
    let (told, ended) = replay(&with(&edits()), &["-q"]);
    assert_eq!((ended.status, ended.stderr.as_str(), ended.stdout.as_slice()), (Some(0), "", &b""[..]));
    let report = &told["edits"][0];
    assert!(report["latency_s"].is_f64() && report.get("scratch_s").is_none(), "{report}");
    assert_eq!((&told["integrator"], &told["size"]), (&json!("raymarch"), &json!([20, 12])));
}

#[test]
fn the_last_picture_is_that_of_the_edited_scene() {
    let folder = with(&json!([{ "patch": { "medium": { "density": 2 } } }]));
    for arguments in [
        &["replay", "../scene.toml", "../edits.json", "-o", "a.png"][..],
        &["render", "../scene.toml", "--set", "medium.density=2", "-o", "b.png"],
        &["render", "../scene.toml", "-o", "c.png"],
    ] {
        assert_eq!(folder.run(arguments).status, Some(0));
    }
    let [a, b, c] =
        ["a.png", "b.png", "c.png"].map(|name| std::fs::read(folder.at("out").join(name)).expect("a file"));
    assert!(a == b && a != c);
}

#[test]
fn a_bad_edit_keeps_the_reports_before_it() {
    for (bad, says) in [
        (json!({ "name": "x", "patch": { "medium": { "densty": 1 } } }), "medium.densty"),
        (json!({ "name": "x", "patch": { "volume": { "path": "no-such.nrrd" } } }), "no-such.nrrd"),
        (json!({ "name": "x", "patch": { "medium": { "density": 1e30 } } }), "medium.density"),
        (json!({ "name": "x", "patch": 3 }), "`patch`: found a number"),
        (json!({ "name": "x" }), "no `patch`"),
        (json!({ "name": 3, "patch": {} }), "`name`: found a number"),
        (json!({ "name": "x", "patch": {}, "patsch": {} }), "unknown key \"patsch\""),
        (json!([]), "found a list"),
    ] {
        let folder = with(&json!([{ "patch": {} }, bad, { "patch": {} }]));
        let (told, ended) = replay(&folder, &[]);
        assert_eq!(ended.status, Some(1), "{}", ended.stderr);
        assert_eq!(told["edits"].as_array().map(Vec::len), Some(1), "{told}");
        let message = &ended.stderr;
        assert!(message.lines().count() == 1 && message.contains("edits.json: edit 2"), "{message}");
        assert!(message.contains(says), "`{says}` is not in {message}");
    }
}

/// Errors of a bad edit refer to the edits file, not to the scene; and the picture before it is not lost.
#[test]
fn a_bad_edit_leaves_the_picture_before_it() {
    let edit = json!({ "patch": { "medium": { "density": 2 } } });
    for bad in [
        json!({ "patch": { "transfer_function": { "preset": "ct-bon" } } }),
        json!({ "patch": { "volume": { "path": "none.nrrd" } } }),
        json!({ "patch": { "lights": [{ "type": "environment", "map": "none.exr" }] } }),
    ] {
        let folder = with(&json!([edit, bad]));
        let (told, ended) = replay(&folder, &["-o", "before.png"]);
        assert_eq!((ended.status, &told["edits"][0]["size"]), (Some(1), &json!([16, 16])));
        let message = &ended.stderr;
        assert!(message.contains("edits.json: edit 2: "), "{message}");
        assert!(!message.contains("scene.toml") && !message.contains("`edit 2`"), "{message}");
        let whole = folder.run(&["render", "../scene.toml", "--set", "medium.density=2", "-o", "whole.png"]);
        assert_eq!(whole.status, Some(0));
        let [before, whole] = ["before.png", "whole.png"]
            .map(|name| std::fs::read(folder.at("out").join(name)).expect("a file"));
        assert!(before == whole);
    }
}

/// With `spatial = "off"` segments are not redone for photons that changed near them, as in the paper.
#[test]
fn a_picture_that_is_not_the_one_from_nothing_gives_a_warning() {
    let lights = json!([{ "type": "point", "position": [0, 20, 0], "intensity": [900, 900, 900] }]);
    let folder = with(&json!([{ "patch": { "lights": lights } }, { "patch": {} }]));
    let photon = ["--verify", "--integrator", "photon", "--set", "render.photon.photons=5000"];
    for (spatial, warned) in [("render.photon.spatial=off", true), ("render.photon.spatial=cells", false)] {
        let (told, ended) = replay(&folder, &[&photon[..], &["--set", spatial]].concat());
        assert_eq!(ended.status, Some(0));
        let wrong = told["edits"][0]["max_abs_diff"].as_f64() > Some(0.0);
        let warning = "warning: edit `edit 1`: the picture differs";
        assert_eq!((wrong, ended.stderr.contains(warning)), (warned, warned), "{}", ended.stderr);
    }
}

#[test]
fn an_invalid_edits_file_is_refused_before_the_work() {
    let mut deep = "[".repeat(100_000);
    deep.push_str(&"]".repeat(100_000));
    for (edits, says) in [
        (&b""[..], "expected a list of edits in JSON"),
        (b"{}", "expected a list of edits"),
        (b"3", "expected a list of edits"),
        (b"[{]", "line 1"),
        (b"[{\"patch\": {}}", "expected a list of edits in JSON"),
        (b"\xff\xfe", "not UTF-8; expected a list of edits"),
        (deep.as_bytes(), "edits.json: "),
    ] {
        let files = vec![("scene.toml", SCENE.into()), ("edits.json", edits.to_vec())];
        let arguments = vec!["replay", "../scene.toml", "../edits.json"];
        Fault { files, arguments, status: 1, says: vec![says] }.check();
    }
    let files = || vec![("scene.toml", SCENE.into())];
    for (arguments, status, says) in [
        (vec!["replay", "../scene.toml", "../none.json"], 1, "none.json"),
        (vec!["replay", "../scene.toml", ".."], 1, "not a file; expected a list of edits"),
        (vec!["replay", "../scene.toml", "../e.json", "--max-scatter", "-1"], 2, "-1 is not in"),
        (vec!["replay", "../scene.toml"], 2, "<EDITS>"),
        (vec!["replay", "../scene.toml", "../e.json", "-o", "a.gif"], 2, "a.gif"),
    ] {
        Fault { files: files(), arguments, status, says: vec![says] }.check();
    }
}
