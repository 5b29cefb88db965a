//! Successful runs: what is written, that pictures can be rendered again, and what the options change.

use crate::support::{Ended, Folder, decode, files_in_out, json, run, written};
use tyndall_formats::image::{Metadata, read_metadata};

const KINDS: [&str; 4] = ["png", "jpg", "tif", "exr"];

/// A cloud in a few pixels.
const SCENE: &str = "\
    volume.procedural = { kind = 'cloud', size = [12, 12, 12] }\n\
    medium.density = 0.5\n\
    film.size = [16, 16]\n\
    render.samples = 4\n";

fn with_scene(text: &str) -> Folder {
    let folder = Folder::new();
    folder.put("scene.toml", text);
    folder
}

/// The statistics of a run with further options.
fn statistics(folder: &Folder, options: &[&str]) -> serde_json::Value {
    json(&run(folder, &[&["render", "../scene.toml", "--stats", "-"], options].concat()))
}

/// The sum of the mean radiance's channels.
fn brightness(folder: &Folder, options: &[&str]) -> f64 {
    let mean = &statistics(folder, options)["mean_radiance"];
    (0..3).map(|channel| mean[channel].as_f64().expect("a number")).sum()
}

#[test]
fn a_scene_becomes_pictures_of_all_kinds_with_metadata() {
    let folder = with_scene(SCENE);
    let outputs = ["-o", "a.png", "-o", "a.jpg", "-o", "a.tif", "-o", "a.exr"];
    run(&folder, &[&["render", "../scene.toml", "--seed", "7"], &outputs[..]].concat());
    assert_eq!(files_in_out(&folder), ["a.exr", "a.jpg", "a.png", "a.tif"]);
    for kind in KINDS {
        let metadata = read_metadata(&folder.at(&format!("out/a.{kind}"))).expect(kind).expect(kind);
        assert_eq!(metadata.get(Metadata::SEED), Some("7"), "{kind}");
        assert_eq!(metadata.get(Metadata::SAMPLES), Some("4"), "{kind}");
        assert_eq!(metadata.get(Metadata::VERSION), Some(env!("CARGO_PKG_VERSION")), "{kind}");
        let scene = json(metadata.get(Metadata::SCENE).expect(kind).as_bytes());
        assert_eq!(scene["render"]["seed"], 7, "{kind}");
        assert_eq!(scene["volume"]["procedural"]["kind"], "cloud", "{kind}");
    }
    let (size, channels, pixels) = decode(&written(&folder, "a.png"));
    assert_eq!((size, channels), ([16, 16], 3));
    assert!(pixels.iter().any(|&x| x > 100) && pixels.iter().any(|&x| x != pixels[0]), "{pixels:?}");
}

#[test]
fn a_picture_is_rendered_again_to_the_byte_from_any_folder() {
    let folder = with_scene(
        "volume.path = 'data/v.nrrd'\nfilm.size = [16, 16]\nrender.samples = 2\nmedium.density = 0.7\n",
    );
    let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\n";
    folder.put("data/v.nrrd", [head.as_bytes(), &(0..64).map(|v| v * 4).collect::<Vec<u8>>()].concat());
    for kind in KINDS {
        let [first, here, elsewhere] = ["a", "b", "deep/c"].map(|name| format!("{name}.{kind}"));
        folder.put("out/deep/keep", "");
        run(&folder, &["render", "../scene.toml", "-o", &first, "--max-scatter", "3"]);
        run(&folder, &["render", &first, "-o", &here]);
        let bytes = |name: &str| written(&folder, name);
        assert!(bytes(&first) == bytes(&here), "{kind}: the file differs");
        // From another folder the volume's path differs, and so does the metadata, but not the pixels.
        run(&folder, &["render", &first, "-o", &elsewhere]);
        run(&folder, &["render", &elsewhere, "-o", &here]);
        assert!(bytes(&first) == bytes(&here), "{kind}: the file differs after a render to another folder");
    }
}

#[test]
fn the_bits_are_the_same_on_any_number_of_threads() {
    let folder = with_scene(SCENE);
    let on = |threads| {
        run(&folder, &["render", "../scene.toml", "--size", "40x24", "--threads", threads, "-o", "a.exr"]);
        written(&folder, "a.exr")
    };
    let one = on("1");
    assert!(one == on("2"), "2 threads");
    assert!(one == on("5"), "5 threads");
    run(&folder, &["render", "../scene.toml", "--size", "40x24", "--seed", "1", "-o", "a.exr"]);
    assert!(one != written(&folder, "a.exr"), "another seed, the same bits");
}

#[test]
fn without_an_output_the_picture_goes_to_the_inputs_stem_in_the_current_folder() {
    let folder = with_scene(SCENE);
    run(&folder, &["render", "../scene.toml", "-q"]);
    assert_eq!(files_in_out(&folder), ["scene.png"]);
}

/// Without -o only an earlier picture is replaced: neither the input nor what another program made.
#[test]
fn what_tyndall_did_not_make_is_replaced_only_when_asked_for() {
    let folder = with_scene(SCENE);
    let render = ["render", "../scene.toml", "-q"];
    run(&folder, &render);
    let first = written(&folder, "scene.png");
    run(&folder, &[&render[..], &["--seed", "3"]].concat());
    let own = written(&folder, "scene.png");
    assert!(first != own, "an earlier picture is replaced");

    let refused = |arguments: &[&str], kept: &[u8]| {
        let Ended { status, stderr, .. } = folder.run(arguments);
        assert_eq!(status, Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains("`scene.png`") && stderr.contains("with -o"), "{stderr}");
        assert!(written(&folder, "scene.png") == kept, "{arguments:?}: it was replaced");
    };
    refused(&["render", "scene.png", "-q"], &own);
    refused(&["render", &folder.at("out/scene.png").to_string_lossy(), "-q"], &own);
    // From another folder it is not the input.
    folder.put("deep/scene.png", &own);
    run(&folder, &["render", "../deep/scene.png", "-q"]);

    let mut foreign = Vec::new();
    let mut encoder = png::Encoder::new(&mut foreign, 1, 1);
    encoder.add_itxt_chunk("Software".to_owned(), "another".to_owned()).expect("a text");
    encoder.write_header().expect("a header").write_image_data(&[0]).expect("a pixel");
    for others in [&foreign[..], b"notes", b"", &own[..own.len().min(40)]] {
        folder.put("out/scene.png", others);
        refused(&render, others);
    }
    folder.put("data/scene.nrrd", "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\n\nab");
    folder.put("out/scene.png", &foreign);
    refused(&["render", "../data/scene.nrrd", "-q"], &foreign);
    run(&folder, &[&render[..], &["-o", "scene.png"]].concat());
    assert!(written(&folder, "scene.png") != foreign, "it was asked for");

    #[cfg(unix)]
    {
        let place = folder.at("out/scene.png");
        std::fs::remove_file(&place).expect("the picture");
        std::os::unix::fs::symlink(folder.at("deep/scene.png"), &place).expect("a link");
        refused(&["render", "../deep/scene.png", "-q"], &own);
        std::fs::remove_file(&place).expect("the link");
        std::os::unix::fs::symlink(folder.at("nowhere"), &place).expect("a link");
        assert_eq!(folder.run(&render).status, Some(2));
    }
}

#[test]
fn a_dash_is_standard_output() {
    let folder = with_scene(SCENE);
    let printed = run(&folder, &["render", "../scene.toml", "-o", "-"]);
    assert!(files_in_out(&folder).is_empty());
    run(&folder, &["render", "../scene.toml", "-o", "a.png"]);
    assert!(printed == written(&folder, "a.png"), "the picture differs from the one in a file");
}

#[test]
fn statistics_have_all_their_keys() {
    let folder = with_scene(SCENE);
    let report = statistics(&folder, &["--threads", "2"]);
    assert_eq!(report["integrator"], "path");
    assert_eq!(report["size"], serde_json::json!([16, 16]));
    assert_eq!(report["samples_per_pixel"], 4.0);
    assert_eq!(report["threads"], 2);
    assert_eq!(report["seed"], 0);
    let number = |key: &str| report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"));
    assert!(number("wall_s") >= number("load_s") && number("load_s") > 0.0, "{report}");
    assert!(number("relative_error") > 0.0, "{report}");
    assert!(report["peak_memory_bytes"].as_u64().is_some_and(|bytes| bytes > 1 << 20), "{report}");
    assert!(
        report["stages"].as_object().is_some_and(|s| s.values().all(serde_json::Value::is_number)),
        "{report}"
    );
    assert_eq!(report["mean_radiance"].as_array().map(Vec::len), Some(3), "{report}");
    let report = statistics(&folder, &["--integrator", "raymarch"]);
    assert!(report["integrator"] == "raymarch" && report["relative_error"].is_null(), "{report}");
    run(&folder, &["render", "../scene.toml", "--stats", "a.json"]);
    assert_eq!(json(&written(&folder, "a.json"))["seed"], 0);
}

#[test]
fn options_win_over_assignments_and_these_over_the_scene() {
    let folder = with_scene(SCENE);
    let report = statistics(
        &folder,
        &["--set", "render.seed=9", "--set", "film.size=[8,8]", "--set", "render.samples=3", "--seed", "5"],
    );
    assert_eq!(report["seed"], 5);
    assert_eq!(report["size"], serde_json::json!([8, 8]));
    assert_eq!(report["samples_per_pixel"], 3.0);
    let report = statistics(&folder, &["--size", "4x6", "--set", "film.size.0=7", "--samples", "2"]);
    assert_eq!(report["size"], serde_json::json!([4, 6]));
    assert_eq!(report["samples_per_pixel"], 2.0);
    let report = statistics(&folder, &["--set", "render.integrator=path", "--integrator", "raymarch"]);
    assert_eq!(report["integrator"], "raymarch");
}

#[test]
fn assignments_reach_every_part_of_a_scene() {
    let folder = with_scene(&format!("{SCENE}film.background = 0\nlights = []\n"));
    assert_eq!(brightness(&folder, &[]), 0.0);
    let lamp = "lights.0={\"type\":\"point\",\"position\":[0,0,30],\"intensity\":[900,900,900]}";
    let one = brightness(&folder, &["--set", lamp]);
    assert!(one > 0.0, "{one}");
    let red = brightness(&folder, &["--set", lamp, "--set", "lights.0.intensity=[900,0,0]"]);
    assert!(0.0 < red && red < 0.6 * one, "{red} of {one}");
    let second = lamp.replace("lights.0", "lights.1");
    let two = brightness(&folder, &["--set", lamp, "--set", &second, "--samples", "64"]);
    assert!(1.5 * one < two && two < 2.5 * one, "{two} of {one}");
    // A light whose type changes loses its position and intensity.
    let switched = ["--set", lamp, "--set", "lights.0.type=environment", "--set", "lights.0.radiance=1"];
    assert!(brightness(&folder, &switched) > 0.0);
    // A patched key replaces its alternative, and a command-line option replaces both.
    let clear = "transfer_function.points=[{\"value\":0,\"opacity\":0}]";
    assert_eq!(brightness(&folder, &["-q", "--set", lamp, "--set", clear]), 0.0);
    let solid = ["--set", lamp, "--set", clear, "--set", "transfer_function.preset=solid"];
    assert!(brightness(&folder, &solid) > 0.0);
    assert!(brightness(&folder, &["--set", lamp, "--set", clear, "--preset", "solid"]) > 0.0);
}

#[test]
fn more_orders_of_scattering_add_light() {
    let folder = with_scene(
        &format!("{SCENE}film.background = 0\nrender.samples = 64\n")
            .replace("render.samples = 4\n", "lights = [{ type = 'environment', radiance = 1 }]\n"),
    );
    let upto = |order| brightness(&folder, &["--max-scatter", order]);
    assert_eq!(upto("0"), 0.0);
    let [one, many] = ["1", "64"].map(upto);
    assert!(one > 0.1 && many > 1.1 * one, "{one}, then {many}");
}

#[test]
fn a_transparent_background_leaves_straight_opacity() {
    let folder = with_scene(&format!("{SCENE}film.background = 'transparent'\n"));
    run(&folder, &["render", "../scene.toml", "-o", "a.png"]);
    let (size, channels, pixels) = decode(&written(&folder, "a.png"));
    assert_eq!((size, channels), ([16, 16], 4));
    let opacity = |x: usize, y: usize| pixels[4 * (16 * y + x) + 3];
    assert_eq!(opacity(0, 0), 0);
    assert!(opacity(8, 8) > 100, "{}", opacity(8, 8));
}

#[test]
fn bare_volumes_of_odd_kinds_are_never_black() {
    let floats = |values: [f32; 8]| values.map(f32::to_le_bytes).concat();
    for (name, fields, samples) in [
        ("one voxel", "type: uchar\ndimension: 3\nsizes: 1 1 1", vec![5]),
        ("constant", "type: uchar\ndimension: 3\nsizes: 2 2 2", vec![5; 8]),
        ("zeros", "type: uchar\ndimension: 3\nsizes: 2 2 2", vec![0; 8]),
        ("a plane", "type: uchar\ndimension: 2\nsizes: 4 2", (0..8).collect()),
        ("a row", "type: uchar\ndimension: 1\nsizes: 8", (0..8).collect()),
        ("undefined", "type: float\ndimension: 3\nsizes: 2 2 2", floats([f32::NAN; 8])),
        (
            "in part",
            "type: float\ndimension: 3\nsizes: 2 2 2",
            floats([0., 1., f32::NAN, 2., 3., f32::INFINITY, 4., 5.]),
        ),
        (
            "vast",
            "type: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1000000 1000000 1000000",
            (0..8).collect(),
        ),
        (
            "vaster",
            "type: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 10000000000 10000000000 10000000000",
            (0..8).collect(),
        ),
        ("tiny", "type: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1e-9 1e-9 1e-9", (0..8).collect()),
        ("flat", "type: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1000 1 0.001", (0..8).collect()),
    ] {
        let folder = Folder::new();
        let head = format!("NRRD0004\n{fields}\nencoding: raw\nendian: little\n\n");
        folder.put("a.nrrd", [head.as_bytes(), &samples].concat());
        // Quietly, since volumes of a single value and without data are noted.
        run(&folder, &["render", "../a.nrrd", "--size", "8x8", "--samples", "2", "-q"]);
        let (_, _, pixels) = decode(&written(&folder, "a.png"));
        assert!(pixels.iter().any(|&x| x > 20), "{name}: {pixels:?}");
    }
}

#[test]
fn the_brightest_light_still_has_a_mean_and_an_error() {
    let folder = with_scene(&format!("{SCENE}lights = [{{ type = 'environment', radiance = 1e18 }}]\n"));
    let report = statistics(&folder, &[]);
    let mean = report["mean_radiance"][0].as_f64().unwrap_or_else(|| panic!("a mean in {report}"));
    assert!((1e17..=1.1e18).contains(&mean), "{report}");
    assert!(report["relative_error"].as_f64().is_some_and(f64::is_finite), "{report}");
}

#[test]
fn byte_order_marks_and_crlf_are_accepted() {
    let folder = with_scene(&format!("\u{feff}{}", SCENE.replace('\n', "\r\n")));
    run(&folder, &["render", "../scene.toml"]);
    folder.put("scene.json", "\u{feff}{\r\n\"volume\": {\"procedural\": {\"size\": [4, 4, 4]}},\r\n\"film\": {\"size\": [4, 4]}}\r\n");
    run(&folder, &["render", "../scene.json", "--samples", "1"]);
}

/// As many lights as a script might write: they cost memory in proportion, and hardly any time.
#[test]
fn a_hundred_thousand_lights_are_rendered() {
    let light =
        "{\"type\": \"sphere\", \"position\": [-9.123456, 0.5, 1e1], \"radius\": 1, \"radiance\": [1, 2, 3]}";
    let lights = vec![light; 100_000].join(",\n");
    let folder = Folder::new();
    folder.put(
        "scene.json",
        format!("{{\"volume\": {{\"procedural\": {{\"size\": [4, 4, 4]}}}}, \"lights\": [{lights}]}}"),
    );
    let arguments = ["render", "../scene.json", "--size", "4x4", "--samples", "1"];
    let Ended { status, stderr, took, memory, .. } = folder.run(&arguments);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(took < std::time::Duration::from_secs(30) && memory < 1 << 30, "{took:?}, {} MiB", memory >> 20);
}

#[test]
fn every_stop_condition_works() {
    let folder = with_scene(SCENE);
    for most in ["1e300", "1.8e19", "1e18"] {
        assert_eq!(statistics(&folder, &["--samples", "2", "--time", most])["samples_per_pixel"], 2.0);
    }
    let report = statistics(&folder, &["--time", "0.01"]);
    assert!(report["samples_per_pixel"].as_f64().is_some_and(|n| n >= 1.0), "{report}");
    let report = statistics(&folder, &["--target-error", "0.1"]);
    assert!(report["relative_error"].as_f64().is_some_and(|e| e <= 0.1), "{report}");
    // Without an error estimate rendering stops at the scene's samples.
    let report = statistics(&folder, &["--target-error", "0.1", "--integrator", "raymarch"]);
    assert_eq!(report["samples_per_pixel"], 4.0);
    let dark = ["--target-error", "0.1", "--set", "lights=[]", "--set", "film.background=0"];
    assert!(statistics(&folder, &dark)["relative_error"].is_null());
}
