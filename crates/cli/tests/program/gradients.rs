//! What gradients are measured against: what is nowhere in the picture does not change how surfaces look.

use crate::data::{Data, apart, mean, open, picture, ways};
use crate::support::{Folder, json as parse, run, written};
use serde_json::{Value, json};
use tyndall::simd::Level;
use tyndall_formats::image::{Metadata, read_metadata};

/// A head: air, skin and bone, with a corner of other values, in which nothing else is.
fn head(corner: Option<f64>) -> Data {
    let value = move |[x, y, z]: [f64; 3]| {
        let r = (x * x + y * y + z * z).sqrt();
        match corner {
            Some(value) if x < -0.7 && y > 0.7 && z > 0.7 => value,
            _ if r < 0.55 => 900.0,
            _ if r < 0.7 => 40.0,
            _ => -1000.0,
        }
    };
    Data::new(24, value).anatomical()
}

fn cut() -> Value {
    json!({
        "medium": { "density": 1.0 },
        "transfer_function": { "preset": "ct-bone" },
        "clip": [{ "type": "box", "min": [7, -1, -1], "max": [24, 24, 24] }],
    })
}

#[test]
fn metal_and_padding_that_are_not_seen_change_nothing() {
    let folder = Folder::new();
    folder.put("plain.nrrd", head(None).nrrd("float"));
    for way in ways() {
        let plain = picture(&folder, "plain.nrrd", &cut(), way);
        assert!(mean(&plain)[0] > 0.02, "{:?}", mean(&plain));
        for value in [30_000.0, 3071.0, -3024.0, -32_768.0] {
            folder.put("other.nrrd", head(Some(value)).nrrd("float"));
            let other = apart(&picture(&folder, "other.nrrd", &cut(), way), &plain);
            assert!(other < 0.01, "a corner of {value}: {other} apart with {way:?}");
        }
    }
}

#[test]
fn the_range_can_be_set_and_is_stated() {
    let folder = Folder::new();
    folder.put("ct.nrrd", head(None).nrrd("short"));
    let other = Data { anatomical: false, ..head(None) };
    folder.put("other.nrrd", other.nrrd("short"));
    for (name, patch, expected) in [
        ("ct.nrrd", json!({}), 2600.0),
        ("other.nrrd", json!({}), 1900.0),
        ("other.nrrd", json!({ "medium": { "gradient_range": 500 } }), 500.0),
        ("ct.nrrd", json!({ "medium": { "gradient_range": 500.5 } }), 500.5),
    ] {
        let mut live = open(&folder, name, &patch, Level::best());
        assert_eq!(live.scene().medium.gradient_range(), expected, "{name} {patch}");
        assert_eq!(live.document().medium.gradient_range, Some(expected), "{name} {patch}");
        // An edit of something else keeps it, and null restores the default.
        let report = live.edit(&json!({ "medium": { "gradient_factor": 3 } })).expect("an edit");
        assert!(report.difference.surfaces);
        assert_eq!(live.scene().medium.gradient_range(), expected, "{name} {patch}");
        let report = live.edit(&json!({ "medium": { "gradient_range": 77 } })).expect("an edit");
        assert!(report.difference.surfaces);
        live.edit(&json!({ "medium": { "gradient_range": null } })).expect("an edit");
        let default = if name == "ct.nrrd" { 2600.0 } else { 1900.0 };
        assert_eq!(live.scene().medium.gradient_range(), default, "{name} {patch}");
    }
    let report = parse(&run(&folder, &["info", "../ct.nrrd", "--json"]));
    assert_eq!(report["gradient_range"], 2600.0, "{report}");
    let text = String::from_utf8(run(&folder, &["info", "../other.nrrd"])).expect("UTF-8");
    assert!(text.contains("gradients  divided by a range of 1900"), "{text}");
    run(&folder, &["render", "../ct.nrrd", "--size", "8x8", "--samples", "1", "-o", "a.png"]);
    assert_eq!(scene_of(&folder, "a.png")["medium"]["gradient_range"], 2600.0);
}

/// Pictures that do not state the range are of versions that measured against the robust range.
#[test]
fn pictures_of_earlier_versions_keep_the_robust_range() {
    let folder = Folder::new();
    folder.put("ct.nrrd", head(None).nrrd("short"));
    let arguments = ["--size", "8x8", "--samples", "1", "--set", "medium.gradient_range=2600"];
    run(&folder, &[&["render", "../ct.nrrd", "-o", "new.png"], &arguments[..]].concat());
    // As an earlier version would have stored it.
    let mut scene = scene_of(&folder, "new.png");
    scene["medium"].as_object_mut().expect("a table").remove("gradient_range");
    folder.put("out/old.png", with_scene(&written(&folder, "new.png"), &scene));
    for (name, range) in [("out/new.png", 2600.0), ("out/old.png", 1900.0)] {
        let mut live = open(&folder, name, &json!({}), Level::best());
        assert_eq!(live.scene().medium.gradient_range(), range, "{name}");
        live.edit(&json!({ "medium": { "density": 0.1 } })).expect("an edit");
        assert_eq!(live.scene().medium.gradient_range(), range, "{name} after an edit");
        let set = open(&folder, name, &json!({ "medium": { "gradient_range": 5 } }), Level::best());
        assert_eq!(set.scene().medium.gradient_range(), 5.0, "{name}");
    }
    run(&folder, &["render", "old.png", "-o", "again.png"]);
    assert_eq!(scene_of(&folder, "again.png")["medium"]["gradient_range"], 1900.0);
}

/// The scene in the metadata of a picture that the program wrote.
pub fn scene_of(folder: &Folder, name: &str) -> Value {
    let metadata = read_metadata(&folder.at("out").join(name)).expect(name).expect(name);
    parse(metadata.get(Metadata::SCENE).expect(name).as_bytes())
}

/// A PNG's pixels with another scene in the metadata.
fn with_scene(png: &[u8], scene: &Value) -> Vec<u8> {
    let (size, _, pixels) = crate::support::decode(png);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.add_itxt_chunk(Metadata::SCENE.to_owned(), scene.to_string()).expect("a chunk");
    encoder.write_header().expect("a header").write_image_data(&pixels).expect("pixels");
    bytes
}
