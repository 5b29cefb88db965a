//! Good runs: what is written, that it can be made again, and what the options change.

mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use support::{Ended, Folder};
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

/// Runs what must go well; returns what it printed.
fn run(folder: &Folder, arguments: &[&str]) -> Vec<u8> {
    let Ended { status, stdout, stderr, .. } = folder.run(arguments);
    assert_eq!((status, stderr.as_str()), (Some(0), ""), "{arguments:?}");
    stdout
}

fn json(bytes: &[u8]) -> serde_json::Value {
    serde_json::from_slice(bytes).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(bytes)))
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

/// Width, height, bytes per pixel and pixels of a PNG.
fn decode(png: &[u8]) -> ([u32; 2], usize, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    ([info.width, info.height], info.color_type.samples(), pixels)
}

/// A file that the program wrote.
fn written(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.at("out").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn files_in_out(folder: &Folder) -> Vec<String> {
    let entries = std::fs::read_dir(folder.at("out")).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_scene_becomes_pictures_of_all_kinds_that_tell_their_making() {
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
fn a_picture_is_made_again_to_the_byte_from_any_folder() {
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
        assert!(bytes(&first) == bytes(&here), "{kind}: another file");
        // From one folder up the volume's path is another, and so is the text in the picture: the pixels are not.
        run(&folder, &["render", &first, "-o", &elsewhere]);
        run(&folder, &["render", &elsewhere, "-o", &here]);
        assert!(bytes(&first) == bytes(&here), "{kind}: another file by way of another folder");
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
fn without_a_place_the_picture_goes_to_the_inputs_stem_here() {
    let folder = with_scene(SCENE);
    run(&folder, &["render", "../scene.toml", "-q"]);
    assert_eq!(files_in_out(&folder), ["scene.png"]);
}

#[test]
fn a_dash_is_standard_output() {
    let folder = with_scene(SCENE);
    let printed = run(&folder, &["render", "../scene.toml", "-o", "-"]);
    assert!(files_in_out(&folder).is_empty());
    run(&folder, &["render", "../scene.toml", "-o", "a.png"]);
    assert!(printed == written(&folder, "a.png"), "another picture than in a file");
}

#[test]
fn statistics_have_all_their_keys() {
    let folder = with_scene(SCENE);
    let told = statistics(&folder, &["--threads", "2"]);
    assert_eq!(told["integrator"], "path");
    assert_eq!(told["size"], serde_json::json!([16, 16]));
    assert_eq!(told["samples_per_pixel"], 4.0);
    assert_eq!(told["threads"], 2);
    assert_eq!(told["seed"], 0);
    let number = |key: &str| told[key].as_f64().unwrap_or_else(|| panic!("{key} in {told}"));
    assert!(number("wall_s") >= number("load_s") && number("load_s") > 0.0, "{told}");
    assert!(number("relative_error") > 0.0, "{told}");
    assert!(told["peak_memory_bytes"].as_u64().is_some_and(|bytes| bytes > 1 << 20), "{told}");
    assert!(
        told["stages"].as_object().is_some_and(|s| s.values().all(serde_json::Value::is_number)),
        "{told}"
    );
    assert_eq!(told["mean_radiance"].as_array().map(Vec::len), Some(3), "{told}");
    let told = statistics(&folder, &["--integrator", "raymarch"]);
    assert!(told["integrator"] == "raymarch" && told["relative_error"].is_null(), "{told}");
    run(&folder, &["render", "../scene.toml", "--stats", "a.json"]);
    assert_eq!(json(&written(&folder, "a.json"))["seed"], 0);
}

#[test]
fn options_win_over_assignments_and_these_over_the_scene() {
    let folder = with_scene(SCENE);
    let told = statistics(
        &folder,
        &["--set", "render.seed=9", "--set", "film.size=[8,8]", "--set", "render.samples=3", "--seed", "5"],
    );
    assert_eq!(told["seed"], 5);
    assert_eq!(told["size"], serde_json::json!([8, 8]));
    assert_eq!(told["samples_per_pixel"], 3.0);
    let told = statistics(&folder, &["--size", "4x6", "--set", "film.size.0=7", "--samples", "2"]);
    assert_eq!(told["size"], serde_json::json!([4, 6]));
    assert_eq!(told["samples_per_pixel"], 2.0);
    let told = statistics(&folder, &["--set", "render.integrator=path", "--integrator", "raymarch"]);
    assert_eq!(told["integrator"], "raymarch");
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
    // A light that becomes another one loses its place and strength.
    let switched = ["--set", lamp, "--set", "lights.0.type=environment", "--set", "lights.0.radiance=1"];
    assert!(brightness(&folder, &switched) > 0.0);
    // What is patched replaces its alternative, and an option of the command line replaces both.
    let clear = "transfer_function.points=[{\"value\":0,\"opacity\":0}]";
    assert_eq!(brightness(&folder, &["-q", "--set", lamp, "--set", clear]), 0.0);
    let solid = ["--set", lamp, "--set", clear, "--set", "transfer_function.preset=solid"];
    assert!(brightness(&folder, &solid) > 0.0);
    assert!(brightness(&folder, &["--set", lamp, "--set", clear, "--preset", "solid"]) > 0.0);
}

#[test]
fn the_order_of_scattering_adds_light() {
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
        run(&folder, &["render", "../a.nrrd", "--size", "8x8", "--samples", "2"]);
        let (_, _, pixels) = decode(&written(&folder, "a.png"));
        assert!(pixels.iter().any(|&x| x > 20), "{name}: {pixels:?}");
    }
}

/// What `info` tells of samples that are no numbers: how many, and that NaN and minus infinity count as the
/// smallest value, infinity as the largest.
#[test]
fn samples_that_are_no_numbers_are_counted_and_read_as_an_end_of_the_range() {
    let values = [f64::NAN, 2.0, f64::INFINITY, 3.0, f64::NEG_INFINITY, 4.0, 2.0, 3.5];
    #[expect(clippy::cast_possible_truncation, reason = "short numbers")]
    let single = values.map(|v| (v as f32).to_le_bytes()).concat();
    let double = values.map(f64::to_le_bytes).concat();
    for (kind, name, samples) in [("float", "f32", single), ("double", "f64", double)] {
        let folder = Folder::new();
        let head =
            format!("NRRD0004\ntype: {kind}\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: little\n\n");
        folder.put("a.nrrd", [head.as_bytes(), &samples].concat());
        let told = json(&run(&folder, &["info", "../a.nrrd", "--json"]));
        assert_eq!(told["type"], name, "{told}");
        assert_eq!(told["non_finite"], 3, "{told}");
        assert_eq!(told["value_range"], serde_json::json!([2.0, 4.0]), "{told}");
        let counts: Vec<u64> = serde_json::from_value(told["histogram"]["counts"].clone()).expect("numbers");
        assert_eq!((counts[0], counts[255], counts.iter().sum::<u64>()), (4, 2, 8), "{told}");
        let text = String::from_utf8(run(&folder, &["info", "../a.nrrd"])).expect("UTF-8");
        assert!(text.contains("not finite 3 samples; NaN is read as the smallest value"), "{text}");
        assert!(text.contains("values     2 to 4;"), "{text}");
    }
}

#[test]
fn the_brightest_light_still_has_a_mean_and_an_error() {
    let folder = with_scene(&format!("{SCENE}lights = [{{ type = 'environment', radiance = 1e18 }}]\n"));
    let told = statistics(&folder, &[]);
    let mean = told["mean_radiance"][0].as_f64().unwrap_or_else(|| panic!("a mean in {told}"));
    assert!((1e17..=1.1e18).contains(&mean), "{told}");
    assert!(told["relative_error"].as_f64().is_some_and(f64::is_finite), "{told}");
}

#[test]
fn marks_and_line_ends_of_other_systems_are_no_fault() {
    let folder = with_scene(&format!("\u{feff}{}", SCENE.replace('\n', "\r\n")));
    run(&folder, &["render", "../scene.toml"]);
    folder.put("scene.json", "\u{feff}{\r\n\"volume\": {\"procedural\": {\"size\": [4, 4, 4]}},\r\n\"film\": {\"size\": [4, 4]}}\r\n");
    run(&folder, &["render", "../scene.json", "--samples", "1"]);
}

/// As many lights as a program may write: they cost memory in proportion, and no time to speak of.
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
fn a_part_that_is_not_shown_is_noted() {
    let folder = Folder::new();
    let head = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 2 2 3\nencoding: raw\n\n";
    folder.put("a.nrrd", [head.as_bytes(), &[9; 24]].concat());
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

#[test]
fn every_stop_is_met() {
    let folder = with_scene(SCENE);
    for most in ["1e300", "1.8e19", "1e18"] {
        assert_eq!(statistics(&folder, &["--samples", "2", "--time", most])["samples_per_pixel"], 2.0);
    }
    let told = statistics(&folder, &["--time", "0.01"]);
    assert!(told["samples_per_pixel"].as_f64().is_some_and(|n| n >= 1.0), "{told}");
    let told = statistics(&folder, &["--target-error", "0.1"]);
    assert!(told["relative_error"].as_f64().is_some_and(|e| e <= 0.1), "{told}");
    // Where there is no error to be told the scene's samples are the end.
    let told = statistics(&folder, &["--target-error", "0.1", "--integrator", "raymarch"]);
    assert_eq!(told["samples_per_pixel"], 4.0);
    let dark = ["--target-error", "0.1", "--set", "lights=[]", "--set", "film.background=0"];
    assert!(statistics(&folder, &dark)["relative_error"].is_null());
}

#[test]
fn what_the_loader_understood_is_told() {
    let folder = Folder::new();
    let head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 1\nspace: LPS\n\
                space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (5,6,7)\nencoding: raw\nendian: little\n\n";
    let samples = [-1000_i16, 0, 1, 2, 3, 500].map(i16::to_le_bytes).concat();
    folder.put("a.nrrd", [head.as_bytes(), &samples].concat());
    folder.put("scene.json", "{ \"volume\": { \"path\": \"a.nrrd\" }, \"film\": { \"size\": [8, 8] } }");
    let told = json(&run(&folder, &["info", "../a.nrrd", "--json"]));
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
        assert_eq!(told[key], value, "{key}");
    }
    assert_eq!(told["robust_range"].as_array().map(Vec::len), Some(2), "{told}");
    assert_eq!(told["histogram"]["range"], told["value_range"]);
    let counts = told["histogram"]["counts"].as_array().expect("counts");
    assert_eq!(counts.iter().filter_map(serde_json::Value::as_u64).sum::<u64>(), 6);
    assert_eq!(json(&run(&folder, &["info", "../scene.json", "--json"])), told);
    run(&folder, &["render", "../scene.json", "-o", "a.exr", "--samples", "1"]);
    assert_eq!(json(&run(&folder, &["info", "a.exr", "--json"])), told);
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

/// Ctrl-C in the middle of a render: what is there is written, and the status says so.
#[cfg(unix)]
#[test]
fn an_interrupted_render_leaves_a_readable_picture() {
    let folder = with_scene(SCENE);
    let arguments = ["render", "../scene.toml", "--samples", "2000000000", "-v", "-o", "a.png"];
    let mut child = folder.tyndall(&arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    stderr.read_line(&mut line).expect("a line");
    assert!(line.starts_with("tyndall: loaded in "), "{line}");
    // Long enough for a pass over all of 256 pixels.
    std::thread::sleep(std::time::Duration::from_millis(500));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success());
    let status = child.wait().expect("a status");
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("text");
    assert_eq!(status.code(), Some(130), "{rest}");
    assert!(!rest.contains("panicked"), "{rest}");
    assert_eq!(files_in_out(&folder), ["a.png"]);
    let (size, _, pixels) = decode(&written(&folder, "a.png"));
    assert!(size == [16, 16] && pixels.iter().any(|&x| x > 100), "{size:?}");
    let metadata = read_metadata(&folder.at("out/a.png")).expect("a picture").expect("metadata");
    let samples: u32 = metadata.get(Metadata::SAMPLES).expect("samples").parse().expect("a number");
    assert!((1..2_000_000_000).contains(&samples), "{samples}");
}
