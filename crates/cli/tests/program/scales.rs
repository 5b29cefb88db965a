//! A body of any scale of values and of voxels gives the same picture.

use crate::data::{Data, Way, apart, mean, picture, ways};
use crate::support::Folder;
use serde_json::{Value, json};
use tyndall::film::Image;
use tyndall_live::document::apply;

/// A body of rising values in nothing.
fn body([x, y, z]: [f64; 3]) -> f64 {
    let r = (x * x + y * y + z * z).sqrt();
    if r < 0.8 { 1.0 + 0.5 * x - 0.25 * y } else { 0.0 }
}

/// Its look, with values times `scale` and voxels of an edge.
fn look(scale: f64, spacing: f64) -> Value {
    let point = |value: f64, opacity: f64| json!({ "value": value * scale, "opacity": opacity, "albedo": [0.9, 0.7, 0.5], "surface": 0.9 });
    let mut points = vec![point(0.25, 0.0), point(0.75, 0.5), point(1.75, 1.0)];
    points[2]["emission"] = json!([0.5, 0.3, 0.1]);
    json!({
        "transfer_function": { "points": points },
        "medium": { "density": 0.5 / spacing },
        "lights": [
            { "type": "directional", "direction": [1, -1, -1], "irradiance": [3, 3, 3], "angle": 5 },
            { "type": "environment", "radiance": 0.3 },
            { "type": "sphere", "position": [-20.0 * spacing, 8.0 * spacing, 8.0 * spacing],
              "radius": 2.0 * spacing, "radiance": 9 },
        ],
    })
}

fn scaled(folder: &Folder, scale: f64, spacing: f64, kind: &str, way: Way) -> Image {
    scaled_with(folder, scale, spacing, kind, &Value::Null, way)
}

fn scaled_with(folder: &Folder, scale: f64, spacing: f64, kind: &str, patch: &Value, way: Way) -> Image {
    let samples = Data::new(16, |p| scale * body(p));
    folder.put("a.nrrd", Data { spacing, ..samples }.nrrd(kind));
    let look = look(scale, spacing);
    let patched = if patch.is_null() { look } else { apply(&look, patch) };
    picture(folder, "a.nrrd", &patched, way)
}

#[test]
fn powers_of_two_give_the_same_bits() {
    let folder = Folder::new();
    let two = |power: i32| 2.0_f64.powi(power);
    for way in ways() {
        let plain = scaled(&folder, 1.0, 1.0, "float", way);
        assert!(mean(&plain)[0] > 0.02, "{:?} with {way:?}", mean(&plain));
        for (scale, spacing) in [
            (two(99), 1.0),
            (two(-99), 1.0),
            (two(66), two(-6)),
            (two(80), two(-30)),
            (1.0, two(-40)),
            (1.0, two(40)),
            (two(-60), two(-40)),
            (two(60), two(40)),
        ] {
            let found = scaled(&folder, scale, spacing, "float", way);
            let apart = apart(&found, &plain);
            assert!(
                found.rgba == plain.rgba,
                "values times {scale:e}, voxels of {spacing:e}: {apart}, {way:?}"
            );
        }
    }
}

#[test]
fn any_other_scale_gives_nearly_the_same() {
    let folder = Folder::new();
    // The photon mapper rotates the points at which it looks for matter by the bits of a position: more pixels and samples, and the lights of
    // a scene without any, which are larger than those of the automatic look.
    let many = json!({ "lights": null, "film": { "size": [48, 48] }, "render": { "samples": 40 } });
    let scaled = |scale: f64, spacing: f64, way: Way| {
        let patch = if way.method == "photon" { &many } else { &Value::Null };
        scaled_with(&folder, scale, spacing, "double", patch, way)
    };
    for way in ways() {
        let plain = scaled(1.0, 1.0, way);
        let scales =
            [(1e30, 1.0), (1e24, 1e-9), (1e20, 0.02), (1e18, 1e-8), (1e-30, 1.0), (1e-24, 1.0), (7.0, 3e9)];
        let taken = if way.method == "photon" { 3 } else { scales.len() };
        for (scale, spacing) in scales.into_iter().take(taken) {
            let found = mean(&scaled(scale, spacing, way));
            let expected = mean(&plain);
            for (found, expected) in found.iter().zip(expected) {
                let off = (found - expected).abs() / expected;
                assert!(
                    off < 1e-3,
                    "values times {scale:e}, voxels of {spacing:e}: {found}, {expected}, {way:?}"
                );
            }
        }
    }
}

/// Programs fill what is outside with a number that cannot be data; how far outside it is does not matter.
#[test]
fn a_fill_value_however_far_away_changes_nothing() {
    let folder = Folder::new();
    let filled = |fill: f64, way: Way, function: &Value| {
        let data = Data::new(16, |p| if body(p) > 0.0 { body(p) } else { fill });
        folder.put("a.nrrd", data.nrrd("float"));
        // The points that `photon` looks at follow the bits of positions, which values at the border of data change.
        let samples = if way.method == "photon" { 128 } else { 16 };
        picture(
            &folder,
            "a.nrrd",
            &json!({ "transfer_function": function, "medium": { "density": 0.5 }, "render": { "samples": samples } }),
            way,
        )
    };
    let points = json!({ "points": [{ "value": 0.2, "opacity": 0, "surface": 0.9 }, { "value": 0.3, "opacity": 1, "surface": 0.9 }] });
    for function in [points, json!({ "preset": "solid" })] {
        for way in ways() {
            let near = filled(-1e6, way, &function);
            assert!(mean(&near)[0] > 0.02, "{:?} with {way:?}", mean(&near));
            for fill in [-1e10, -1e20, -1e30] {
                let off = (mean(&filled(fill, way, &function))[0] / mean(&near)[0] - 1.0).abs();
                assert!(off < 2e-3, "{fill:e} outside: {off} off with {way:?} and {function}");
            }
        }
    }
}
