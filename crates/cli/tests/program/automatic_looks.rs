//! What is chosen to suit a volume and its picture: the look of a bare file, exposure, and looks over the next volume of the same kind.

use crate::data::Data;
use crate::gradients::scene_of;
use crate::looks::{ball, options};
use crate::support::{Folder, decode, run, written};
use serde_json::{Value, json};
use tyndall_live::{Budget, Input, LOOKS, LiveSession, Look};

/// A look over a file, as mean code values of the pixels that matter covers.
fn colors(folder: &Folder, file: &str, look: &Look) -> [f64; 3] {
    let mut input = Input::open(&folder.at(file)).expect("a volume");
    input.give_look(&look.patch()).expect("a look");
    let small = json!({ "film": { "size": [40, 40] }, "render": { "samples": 32 } });
    input.patch(&small).expect("a patch");
    let mut live = LiveSession::start(input, options()).expect("a scene");
    live.refine(&Budget::samples(32));
    let image = live.image();
    let mut codes = vec![[0; 3]; image.rgba.len()];
    live.document().film.shown(&image).encode(options().level, &image.rgba, &mut codes);
    let covered: Vec<[u8; 3]> =
        image.rgba.iter().zip(codes).filter(|(pixel, _)| pixel[3] > 0.3).map(|(_, code)| code).collect();
    assert!(covered.len() > 50, "{} of {file} covers {} pixels", look.name, covered.len());
    [0, 1, 2].map(|c| covered.iter().map(|code| f64::from(code[c])).sum::<f64>() / covered.len() as f64)
}

/// Code values by which means may differ: noise of 32 samples made it 4.7 at most, and a function that does not adapt made it 42.
const APART: f64 = 8.0;

/// The same matter in another range of values, at another spacing, and stored along other axes.
#[test]
fn a_look_is_the_same_over_the_next_volume_of_its_kind() {
    let folder = Folder::new();
    let axes = |s: f64| [[0.0, s, 0.0], [0.0, 0.0, -s], [s, 0.0, 0.0]];
    let signal = |hu: f64| (hu + 1000.0) * 0.1;
    let other_signal = |hu: f64| (hu + 1000.0) * 17.0;
    let files: [(&str, Data, Data); 3] = [
        ("ct-bone", ball(|hu| hu).anatomical(), ball(|hu| hu).anatomical()),
        ("mri", ball(signal).anatomical(), ball(other_signal).anatomical()),
        ("cloud", ball(signal), ball(other_signal)),
    ];
    for (preset, data, other) in files {
        folder.put("a.nrrd", data.nrrd("float"));
        folder.put("b.nrrd", other.nrrd_along("float", axes(0.03)));
        for look in LOOKS.iter().filter(|look| look.suits(preset)) {
            let [a, b] = ["a.nrrd", "b.nrrd"].map(|file| colors(&folder, file, look));
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() < APART, "{} over {preset}: {a:.0?} and {b:.0?}", look.name);
            }
        }
    }
}

#[test]
fn a_bare_volume_takes_the_automatic_look_unless_another_is_given() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(|hu| hu).anatomical().nrrd("short"));
    let bare = ["render", "../a.nrrd", "--size", "16x12", "--samples", "2"];
    run(&folder, &[&bare[..], &["-o", "a.exr"]].concat());
    run(&folder, &[&bare[..], &["--look", Look::automatic().name, "-o", "b.exr"]].concat());
    assert_eq!(written(&folder, "a.exr"), written(&folder, "b.exr"));
    // `dye` says nothing of reflectance, and takes no lights.
    run(&folder, &[&bare[..], &["--look", "dye", "-o", "c.exr"]].concat());
    let scene = scene_of(&folder, "c.exr");
    assert_eq!(scene["medium"]["brdf"], json!({ "type": "lambert" }));
    assert_eq!(scene["lights"], json!([]));
    // Options come after it.
    run(&folder, &[&bare[..], &["--set", "film.tone=linear", "-o", "d.exr"]].concat());
    let scene = scene_of(&folder, "d.exr");
    assert_eq!(
        (&scene["film"]["tone"], scene["lights"][0]["axes"].as_str()),
        (&json!("linear"), Some("camera"))
    );
}

/// Eight times the light is three stops less exposure and the same picture; the metadata have the number, and a picture that is
/// rendered from them has the same.
#[test]
fn automatic_exposure_suits_the_light_and_is_written_as_a_number() {
    let folder = Folder::new();
    let scene = |radiance: f64| {
        format!(
            "film = {{ size = [24, 24], exposure = 'auto', background = [1, 1, 1] }}\nrender.samples = 4\n\
             volume.procedural = {{ kind = 'cloud', size = [12, 12, 12] }}\n\
             lights = [{{ type = 'environment', radiance = {radiance}, visible = false }}]\n"
        )
    };
    let stops = |file: &str| -> f64 {
        let scene: Value = scene_of(&folder, file);
        scene["film"]["exposure"].as_f64().unwrap_or_else(|| panic!("{file}: {}", scene["film"]))
    };
    for (file, radiance) in [("a", 0.5), ("b", 4.0)] {
        folder.put(&format!("{file}.toml"), scene(radiance));
        let [input, png, exr] = [format!("../{file}.toml"), format!("{file}.png"), format!("{file}.exr")];
        run(&folder, &["render", &input, "-o", &png, "-o", &exr]);
        assert_eq!(stops(&png), stops(&exr));
    }
    assert!(
        (stops("a.png") - stops("b.png") - 3.0).abs() < 0.011,
        "{} and {}",
        stops("a.png"),
        stops("b.png")
    );
    let [a, b] = ["a.png", "b.png"].map(|file| decode(&written(&folder, file)).2);
    let apart = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(apart <= Some(1), "{apart:?}");
    run(&folder, &["render", "a.png", "-o", "again.png"]);
    assert_eq!(written(&folder, "a.png"), written(&folder, "again.png"));
    // Parts keep what the whole is to have.
    run(&folder, &["render", "../a.toml", "--samples", "32", "--part", "1/2", "-o", "part.exr"]);
    assert_eq!(scene_of(&folder, "part.exr")["film"]["exposure"], "auto");
    let status = folder.run(&["render", "../a.toml", "--set", "film.exposure=bright"]).status;
    assert_eq!(status, Some(1));
}
