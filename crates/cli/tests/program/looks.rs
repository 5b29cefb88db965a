//! Looks: listed, applied, saved, read again, and all on one page.

use crate::data::{Data, mean};
use crate::support::{Ended, Folder, decode, run, written};
use serde_json::json;
use tyndall::transfer::Preset;
use tyndall_live::{Budget, Input, LOOKS, LiveSession, Look, Options, read_look};

/// A ball in air: skin, fat, muscle, contrast agent and bone from outside inwards, as CT in HU, to which `change` is then done.
pub fn ball(change: fn(f64) -> f64) -> Data {
    Data::new(24, move |[x, y, z]| {
        let radius = (x * x + y * y + z * z).sqrt();
        let ripple = 8.0 * (40.0 * (x + 0.3 * y)).sin() * (30.0 * z).cos();
        change(
            match radius {
                r if r > 0.9 => -1000.0,
                r if r > 0.8 => 20.0,
                r if r > 0.7 => -100.0,
                r if r > 0.55 => 50.0,
                r if r > 0.4 => 260.0,
                _ => 900.0,
            } + ripple,
        )
    })
}

/// A file for each kind of data that a preset is chosen for.
fn files() -> [(&'static str, Data, &'static str); 5] {
    let label = |hu: f64| {
        if hu < -500.0 {
            0.0
        } else if hu < 150.0 {
            3.0
        } else {
            7.0
        }
    };
    [
        ("ct-bone", ball(|hu| hu).anatomical(), "short"),
        ("mri", ball(|hu| (hu + 1000.0) * 0.1).anatomical(), "short"),
        ("labels", ball(label), "uchar"),
        ("solid", ball(|hu| if hu < -500.0 { 0.0 } else { 254.0 + hu / 900.0 }), "float"),
        ("cloud", ball(|hu| (hu + 1000.0).abs() * 0.1), "float"),
    ]
}

pub fn options() -> Options {
    Options { edits: false, ..Options::new().expect("threads") }
}

#[test]
fn every_look_shows_the_data_that_it_is_made_for() {
    let folder = Folder::new();
    for (preset, data, kind) in files() {
        let name = format!("{preset}.nrrd");
        folder.put(&name, data.nrrd(kind));
        let looks: Vec<&Look> = LOOKS.iter().filter(|look| look.suits(preset)).collect();
        assert!(looks.len() >= 2, "{} looks for {preset}", looks.len());
        for look in looks {
            let mut input = Input::open(&folder.at(&name)).expect("a volume");
            let loaded = input.clone().load(&options()).expect("a volume");
            assert_eq!(Preset::for_volume(&loaded.assets.volume).name, preset);
            input.give_look(&look.patch()).expect("a patch");
            input
                .patch(&json!({ "film": { "size": [32, 32] }, "render": { "samples": 16 } }))
                .expect("a patch");
            let mut live = LiveSession::start(input, options()).expect("a scene");
            live.refine(&Budget::samples(16));
            let image = live.image();
            let matter: f64 = image.rgba.iter().map(|pixel| f64::from(pixel[3])).sum();
            let pixels = image.rgba.len() as f64;
            assert!(matter > 0.02 * pixels, "{}: {matter} of {pixels} pixels", look.name);
            // Without the background, which is seen but is not light.
            let back = live.document().film.shown(&image).backdrop.map_or([0.0; 3], |b| b.color.to_array());
            let light: f64 = mean(&image)
                .iter()
                .zip(back)
                .map(|(sum, b)| sum - f64::from(b) * (1.0 - matter / pixels))
                .sum();
            assert!(light / 3.0 > 0.05 * matter / pixels, "{} is dark: {light}", look.name);
        }
    }
}

#[test]
fn looks_are_listed_and_each_can_be_asked_for() {
    let folder = Folder::new();
    let listed = String::from_utf8(run(&folder, &["looks"])).expect("text");
    let names: Vec<&str> = listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, LOOKS.iter().map(|look| look.name).collect::<Vec<_>>());
    folder.put("a.toml", "volume.procedural = { kind = 'cloud', size = [8, 8, 8] }\nfilm.size = [8, 8]");
    for name in names {
        // Looks for CT show nothing of a cloud, which a note tells.
        run(&folder, &["render", "../a.toml", "--look", name, "--samples", "1", "-q"]);
    }
}

#[test]
fn a_saved_look_gives_the_same_picture() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(|hu| hu).anatomical().nrrd("short"));
    let bare = ["render", "../a.nrrd", "--size", "16x12", "--samples", "4"];
    let name = LOOKS[0].name;
    for file in ["my.toml", "my.json"] {
        let set = ["--set", "film.exposure=0.5", "--set", "camera.fov=20", "--set", "camera.auto.azimuth=30"];
        run(&folder, &[&bare[..], &["--look", name], &set, &["-o", "a.exr", "--save-look", file]].concat());
        let turned = ["--set", "camera.auto.azimuth=30"];
        run(&folder, &[&bare[..], &["--look", file], &turned, &["-o", "b.exr"]].concat());
        assert_eq!(written(&folder, "a.exr"), written(&folder, "b.exr"), "{file}");
        let look = read_look(&folder.at("out").join(file)).expect("a look");
        for (place, expected) in [
            ("/film/exposure", Some(json!(0.5))),
            ("/film/size", None),
            ("/camera/fov", Some(json!(20))),
            ("/camera/auto", None),
            ("/render/samples", None),
            ("/volume", None),
        ] {
            assert_eq!(look.pointer(place), expected.as_ref(), "{place} of {file}");
        }
    }
    // What is set, and other options, come after the look.
    run(
        &folder,
        &[&bare[..], &["--set", "film.exposure=2", "--look", "my.toml", "--save-look", "c.json"]].concat(),
    );
    let look = read_look(&folder.at("out").join("c.json")).expect("a look");
    assert_eq!(look["film"]["exposure"], 2);
}

#[test]
fn a_bad_look_is_refused_by_name() {
    let folder = Folder::new();
    folder.put("a.toml", "volume.procedural = { kind = 'cloud', size = [8, 8, 8] }\nfilm.size = [8, 8]");
    for (file, text, told) in [
        ("v.toml", "volume.path = 'a'", "`volume`"),
        ("c.json", "{ \"clip\": [] }", "`clip`"),
        ("k.toml", "film.exposre = 1", "film.exposre"),
        ("t.json", "[1, 2]", "not a table"),
        ("s.toml", "film = ", "line 1"),
    ] {
        folder.put(&format!("out/{file}"), text);
        let Ended { status, stderr, .. } = folder.run(&["render", "../a.toml", "--look", file]);
        assert_eq!(status, Some(1), "{stderr}");
        assert!(stderr.contains(file) && stderr.contains(told), "{stderr}");
    }
    let Ended { status, stderr, .. } = folder.run(&["render", "../a.toml", "--look", "none-such"]);
    assert_eq!(status, Some(2), "{stderr}");
    assert!(stderr.contains("none-such") && stderr.contains(LOOKS[0].name), "{stderr}");
    let Ended { status, stderr, .. } = folder.run(&["render", "../a.toml", "--look", "none.toml"]);
    assert_eq!(status, Some(1), "{stderr}");
    assert!(stderr.contains("none.toml"), "{stderr}");
}

/// Maps are found beside the look, and a saved look finds them from anywhere.
#[test]
fn maps_of_a_look_are_beside_it() {
    let folder = Folder::new();
    folder.put(
        "a.toml",
        "volume.procedural = { kind = 'cloud', size = [8, 8, 8] }\nfilm.size = [8, 8]\nrender.samples = 1",
    );
    run(&folder, &["render", "../a.toml", "-o", "sky.exr", "--size", "16x8"]);
    folder.put("looks/x.toml", "lights = [{ type = 'environment', map = 'sky.exr' }]");
    std::fs::rename(folder.at("out/sky.exr"), folder.at("looks/sky.exr")).expect("a move");
    run(
        &folder,
        &["render", "../a.toml", "--look", "../looks/x.toml", "-o", "a.exr", "--save-look", "y.json"],
    );
    run(&folder, &["render", "../a.toml", "--look", "y.json", "-o", "b.exr"]);
    assert_eq!(written(&folder, "a.exr"), written(&folder, "b.exr"));
}

#[test]
fn a_look_does_not_replace_the_scene_that_it_is_saved_from() {
    let folder = Folder::new();
    let scene = "volume.procedural = { kind = 'cloud', size = [8, 8, 8] }\nfilm.size = [8, 8]";
    folder.put("a.toml", scene);
    let Ended { status, stderr, .. } =
        folder.run(&["render", "../a.toml", "--save-look", "../out/../a.toml"]);
    assert_eq!(status, Some(2), "{stderr}");
    assert!(stderr.contains("a.toml") && stderr.contains("is the input"), "{stderr}");
    assert_eq!(std::fs::read_to_string(folder.at("a.toml")).expect("a file"), scene);
}

#[test]
fn a_sheet_that_cannot_be_is_refused() {
    let folder = Folder::new();
    folder.put("a.toml", "volume.procedural = { kind = 'cloud', size = [8, 8, 8] }");
    for size in ["4294967295x1", "1x4294967295", "4294967290x4294967290", "8000x10"] {
        let Ended { status, stderr, .. } =
            folder.run(&["sheet", "../a.toml", "-o", "s.png", "--size", size, "--samples", "1"]);
        assert_eq!(status, Some(2), "{size}: {stderr}");
        assert!(stderr.contains(size), "{stderr}");
    }
    for name in ["s.jpg", "s", "-"] {
        let Ended { status, stderr, .. } = folder.run(&["sheet", "../a.toml", "-o", name]);
        assert_eq!(status, Some(2), "{stderr}");
        assert!(stderr.contains(".png"), "{stderr}");
    }
}

#[test]
fn a_sheet_shows_every_look_of_the_data() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(|hu| hu).anatomical().nrrd("short"));
    let sheet = ["sheet", "../a.nrrd", "-o", "sheet.png", "--size", "40x30", "--samples", "4", "-q"];
    run(&folder, &sheet);
    let ([width, height], channels, pixels) = decode(&written(&folder, "sheet.png"));
    let count = LOOKS.iter().filter(|look| look.suits("ct-bone")).count();
    let columns = (1..).find(|n| n * n >= count).expect("a square");
    let rows = count.div_ceil(columns);
    assert_eq!(channels, 3);
    assert_eq!([width as usize, height as usize], [columns * 52 + 12, rows * 72 + 12]);
    // Each picture shows something, and no two are the same.
    let picture = |i: usize| -> Vec<u8> {
        let [left, top] = [12 + i % columns * 52, 12 + i / columns * 72];
        let rows = (top..top + 30).map(|y| 3 * (y * width as usize + left));
        rows.flat_map(|first| pixels[first..first + 120].to_vec()).collect()
    };
    let pictures: Vec<_> = (0..count).map(picture).collect();
    for (i, picture) in pictures.iter().enumerate() {
        let [least, most] = [picture.iter().min(), picture.iter().max()].map(|code| *code.expect("pixels"));
        assert!(most - least > 40, "picture {i} is from {least} to {most}");
        assert!(!pictures[..i].contains(picture), "picture {i} is one before it");
    }
}
