//! Label maps without options: every part is seen, in a colour of its own that it has in every file.

use crate::data::{Data, mean, open, picture, ways};
use crate::support::{Folder, json as parse, run};
use serde_json::{Value, json};
use tyndall::simd::Level;
use tyndall::volume::Interpolation;
use tyndall_formats::image::{Metadata, read_metadata};

/// Two blocks side by side in nothing.
fn blocks(left: f64, right: f64) -> Data {
    Data::new(16, move |[x, y, z]| match [x, y, z].map(f64::abs) {
        [a, b, c] if a.max(b).max(c) > 0.8 => 0.0,
        _ if x < 0.0 => left,
        _ => right,
    })
}

const PAIRS: [[f64; 2]; 5] = [[1.0, 3.0], [1.0, 8.0], [5.0, 117.0], [1.0, 2.0], [200.0, 7.0]];

fn front() -> Value {
    json!({ "camera": { "type": "orthographic", "auto": { "azimuth": 0, "elevation": 0 } },
            "lights": [{ "type": "environment", "radiance": 1 }] })
}

/// The mean colours of the left and of the right half of a picture, without its outermost parts.
fn halves(image: &tyndall::film::Image) -> [[f64; 3]; 2] {
    let [width, height] = image.size.map(|n| n as usize);
    let mean = |from: usize, to: usize| {
        let rows = height / 3..2 * height / 3;
        let n = ((to - from) * rows.len()) as f64;
        let pixels = rows.flat_map(|y| (from..to).map(move |x| x + width * y));
        let sum = pixels
            .fold([0.0; 3], |sum: [f64; 3], i| std::array::from_fn(|c| sum[c] + f64::from(image.rgba[i][c])));
        sum.map(|s| s / n)
    };
    [mean(width / 4, width / 2 - 1), mean(width / 2 + 1, 3 * width / 4)]
}

fn hue(color: [f64; 3]) -> [f64; 3] {
    let most = color.into_iter().fold(1e-9, f64::max);
    color.map(|c| c / most)
}

#[test]
fn every_label_is_seen_in_a_color_of_its_own() {
    let folder = Folder::new();
    for way in ways() {
        let mut of_one = None;
        for pair in &PAIRS[..3] {
            folder.put("a.nrrd", blocks(pair[0], pair[1]).nrrd("uchar"));
            let [left, right] = halves(&picture(&folder, "a.nrrd", &front(), way));
            for (label, color) in pair.iter().zip([left, right]) {
                assert!(color.iter().any(|&c| c > 0.02), "{label} of {pair:?} is {color:?} with {way:?}");
            }
            let apart = (0..3).map(|c| (hue(left)[c] - hue(right)[c]).abs()).fold(0.0, f64::max);
            assert!(apart > 0.1, "{pair:?}: {left:?} and {right:?} with {way:?}");
            // Label 1 looks the same whatever the other one is.
            if pair[0] == 1.0 {
                let before = *of_one.get_or_insert(left);
                let moved = (0..3).map(|c| (hue(left)[c] - hue(before)[c]).abs()).fold(0.0, f64::max);
                assert!(moved < 0.06, "1 beside {}: {left:?}, before {before:?} with {way:?}", pair[1]);
            }
        }
    }
}

#[test]
fn presets_for_any_data_drop_no_label() {
    let folder = Folder::new();
    for way in ways().into_iter().step_by(2) {
        for preset in ["layers", "solid", "cloud", "labels"] {
            for pair in [PAIRS[1], PAIRS[2]] {
                folder.put("a.nrrd", blocks(pair[0], pair[1]).nrrd("ushort"));
                let patch = json!({ "transfer_function": { "preset": preset }, "film": { "background": "transparent" } });
                let patch = tyndall_live::document::apply(&front(), &patch);
                let image = picture(&folder, "a.nrrd", &patch, way);
                for (label, color) in pair.iter().zip(halves(&image)) {
                    assert!(
                        color.iter().any(|&c| c > 0.003),
                        "{preset}: {label} of {pair:?} is {color:?}, {way:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_choice_is_made_only_where_nothing_was_given_and_is_stated() {
    let folder = Folder::new();
    folder.put("a.nrrd", blocks(1.0, 3.0).nrrd("uchar"));
    for (patch, preset, interpolation) in [
        (json!({}), Some("labels"), Interpolation::Nearest),
        (json!({ "volume": { "interpolation": "linear" } }), Some("cloud"), Interpolation::Linear),
        (json!({ "volume": { "interpolation": "nearest" } }), Some("cloud"), Interpolation::Nearest),
        (json!({ "transfer_function": { "preset": "cloud" } }), Some("cloud"), Interpolation::Linear),
        (json!({ "transfer_function": { "preset": "labels" } }), Some("labels"), Interpolation::Nearest),
        (
            json!({ "transfer_function": { "points": [{ "value": 1, "opacity": 1 }] } }),
            None,
            Interpolation::Linear,
        ),
    ] {
        let mut live = open(&folder, "a.nrrd", &patch, Level::best());
        let chosen = |live: &tyndall_live::LiveSession| {
            let function = live.document().transfer_function.clone().expect("a function");
            (function.preset, live.scene().medium.volume().interpolation())
        };
        assert_eq!(chosen(&live), (preset.map(str::to_owned), interpolation), "{patch}");
        // What an edit gives replaces the choice, and what it takes away restores it.
        live.edit(&json!({ "transfer_function": { "preset": "mri" } })).expect("an edit");
        assert_eq!(chosen(&live).0.as_deref(), Some("mri"));
        let restored = json!({ "transfer_function": null, "volume": { "interpolation": null } });
        live.edit(&restored).expect("an edit");
        assert_eq!(chosen(&live), (Some("labels".to_owned()), Interpolation::Nearest));
    }
    assert_eq!(parse(&run(&folder, &["info", "../a.nrrd", "--json"]))["preset"], "labels");
    let small = ["--size", "8x8", "--samples", "1"];
    run(&folder, &[&["render", "../a.nrrd", "-o", "a.png"], &small[..]].concat());
    let metadata = read_metadata(&folder.at("out/a.png")).expect("a picture").expect("metadata");
    let scene = parse(metadata.get(Metadata::SCENE).expect("a scene").as_bytes());
    assert_eq!(scene["transfer_function"]["preset"], "labels");
    assert_eq!(scene["volume"]["interpolation"], "nearest");
}

#[test]
fn data_without_labels_refuse_the_preset_by_name() {
    let folder = Folder::new();
    let smooth = Data::new(8, |[x, y, z]| 0.3 + x + 2.0 * y + 3.0 * z);
    folder.put("a.nrrd", smooth.nrrd("float"));
    let ended = folder.run(&["render", "../a.nrrd", "--preset", "labels", "--size", "8x8"]);
    assert_eq!(ended.status, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("`labels` needs 1 to 200 different whole numbers"), "{}", ended.stderr);
    // A mask of a single part has no automatic labels, but one can ask for them.
    let mask = Data::new(8, |[x, ..]| f64::from(u8::from(x > 0.0)));
    folder.put("a.nrrd", mask.nrrd("uchar"));
    let way = ways()[2];
    let asked = json!({ "transfer_function": { "preset": "labels" } });
    assert!(mean(&picture(&folder, "a.nrrd", &asked, way))[0] > 0.01);
    assert_ne!(parse(&run(&folder, &["info", "../a.nrrd", "--json"]))["preset"], "labels");
}
