//! What is refused, at which path, and with which advice.

use std::ops::RangeInclusive;

use serde_json::{Value, json};

use super::super::{Document, apply};
use super::{nested, point, scene};
use tyndall::sampling::{BOUNCES, PATHS, PIXELS};

/// Asserts that a patch makes the document wrong at `path` and nowhere else, and returns the message.
fn refused(patch: &Value, path: &str) -> String {
    let error = scene(patch).expect_err(&patch.to_string());
    assert_eq!(error.path(), path, "{error}");
    assert_eq!(error.problems().len(), 1, "{error}");
    error.to_string()
}

/// Asserts that each of `values` is refused at the dotted `path`.
fn refused_values(path: &str, values: impl IntoIterator<Item = Value>) {
    for value in values {
        refused(&nested(path, value), path);
    }
}

fn points(values: &[f64]) -> Value {
    json!({ "transfer_function": { "points": values.iter().copied().map(point).collect::<Vec<_>>() } })
}

#[test]
fn an_unknown_key_suggests_the_nearest() {
    let message = refused(&json!({ "medium": { "densty": 1.0 } }), "medium.densty");
    assert!(message.contains("did you mean `density`?"), "{message}");
    let message = refused(&json!({ "camra": {} }), "camra");
    assert!(message.contains("did you mean `camera`?"), "{message}");
    let message =
        refused(&json!({ "medium": { "phase": { "type": "isotropic", "g": 0.5 } } }), "medium.phase.g");
    assert!(message.contains("belongs to type = \"henyey-greenstein\""), "{message}");
    let message = refused(&json!({ "film": { "gamma": 2.2 } }), "film.gamma");
    assert!(message.contains("known here: `size`, `exposure`, `tone`, `background`"), "{message}");
}

#[test]
fn an_unknown_word_suggests_the_nearest() {
    let message = refused(&nested("film.tone", "acess".into()), "film.tone");
    assert!(message.contains("did you mean \"aces\"?"), "{message}");
    let light = json!({ "lights": [{ "type": "rectangle", "radiance": 1 }] });
    let message = refused(&light, "lights.0.type");
    assert!(message.contains("\"directional\" or \"point\" or \"rect\""), "{message}");
    let message = refused(&json!({ "lights": [{ "type": "spere" }] }), "lights.0.type");
    assert!(message.contains("did you mean \"sphere\"?"), "{message}");
    refused_values("volume.interpolation", [json!("cubic"), json!(1)]);
}

#[test]
fn what_comes_with_later_versions_is_reported_as_such() {
    for path in ["objects", "surfaces", "render.many_light", "render.irradiance_cache", "render.refractive"] {
        let message = refused(&nested(path, json!({})), path);
        assert!(message.contains(&format!("does not have `{path}` yet")), "{message}");
    }
    for name in ["many-light", "irradiance-cache", "refractive"] {
        let message = refused(&nested("render.integrator", name.into()), "render.integrator");
        assert!(message.contains(&format!("does not have the integrator `{name}` yet")), "{message}");
    }
}

#[test]
fn a_missing_required_key_is_an_error() {
    let missing = |value: Value, path: &str| {
        let error = Document::from_value(value).unwrap_err();
        assert_eq!(error.path(), path, "{error}");
        assert!(error.problems()[0].found.starts_with('n'), "nothing or neither: {error}");
    };
    missing(json!({}), "volume");
    missing(json!({ "volume": {} }), "volume");
    missing(json!({ "volume": { "path": "a", "raw": { "dtype": "u8" } } }), "volume.raw.dims");
    missing(json!({ "volume": { "path": "a", "raw": { "dims": [1, 1, 1] } } }), "volume.raw.dtype");
    for (light, path) in [
        (json!({}), "type"),
        (json!({ "type": "directional", "irradiance": 1 }), "direction"),
        (json!({ "type": "directional", "direction": [0, 0, 1] }), "irradiance"),
        (json!({ "type": "point", "intensity": 1 }), "position"),
        (json!({ "type": "rect", "position": [0, 0, 1], "target": [0, 0, 0], "radiance": 1 }), "size"),
        (json!({ "type": "disk", "position": [0, 0, 1], "radius": 1, "radiance": 1 }), "target"),
        (json!({ "type": "sphere", "position": [0, 0, 1], "radius": 1 }), "radiance"),
    ] {
        refused(&json!({ "lights": [light] }), &format!("lights.0.{path}"));
    }
    refused(&json!({ "lights": [{ "type": "environment" }] }), "lights.0");
    refused(&json!({ "clip": [{ "type": "plane", "point": [0, 0, 0] }] }), "clip.0.normal");
    refused(&json!({ "clip": [{ "min": [0, 0, 0], "max": [1, 1, 1] }] }), "clip.0.type");
    refused(
        &json!({ "transfer_function": { "points": [{ "value": 1 }] } }),
        "transfer_function.points.0.opacity",
    );
}

#[test]
fn alternatives_exclude_each_other() {
    for (patch, path) in [
        (json!({ "volume": { "path": "a", "procedural": {} } }), "volume"),
        (json!({ "transfer_function": { "preset": "a", "points": [point(0.0)] } }), "transfer_function"),
        (json!({ "camera": { "position": [0, 0, 1], "auto": {} } }), "camera"),
        (json!({ "lights": [{ "type": "environment", "radiance": 1, "map": "a.exr" }] }), "lights.0"),
        (json!({ "lights": [{ "type": "environment", "map": "a.exr", "studio": {} }] }), "lights.0"),
        (
            json!({ "lights": [{ "type": "environment", "radiance": 1, "map": "a", "studio": {} }] }),
            "lights.0",
        ),
        (json!({ "camera": { "target": [0, 0, 1] } }), "camera.target"),
        (json!({ "camera": { "target": [0, 0, 1], "auto": {} } }), "camera.target"),
    ] {
        refused(&patch, path);
    }
    let raw = json!({ "volume": { "procedural": {}, "raw": { "dims": [1, 1, 1], "dtype": "u8" } } });
    assert_eq!(Document::from_value(raw).unwrap_err().path(), "volume.raw");
}

#[test]
fn wrong_types_are_refused() {
    refused_values("version", [json!("1"), json!(2), json!(0), json!(1.5)]);
    refused_values("volume.path", [json!(""), json!(1), json!([])]);
    refused_values("medium", [json!(1), json!([]), json!("thin")]);
    refused_values("medium.density", [json!("1"), json!([1, 1, 1]), json!(true)]);
    refused_values("lights", [json!({ "type": "point" }), json!(1)]);
    refused_values("camera.position", [json!([0, 0]), json!([0, 0, 0, 0]), json!(1), json!({})]);
    refused_values("film.size", [json!([1]), json!(512), json!("512x512")]);
    refused_values("film.background", [json!("black"), json!([1, 1]), json!(true)]);
    refused_values("transfer_function.points", [json!([]), json!({})]);
    let error = Document::from_json("[]").unwrap_err();
    assert_eq!(error.to_string(), "the document: found a list of length 0, expected a table");
    let error = Document::from_value(json!({ "volume": { "path": "a" }, "camera": null })).unwrap_err();
    assert!(error.to_string().contains("leave the key out"), "{error}");
}

#[test]
fn more_than_the_random_numbers_can_address_is_refused() {
    let too_many = |numbers: RangeInclusive<u32>| numbers.end() + 2;
    refused_values("film.size", [json!([too_many(PIXELS), 1])]);
    refused_values("render.photon.photons", [json!(too_many(PATHS))]);
    refused_values("render.max_scatter", [json!(too_many(BOUNCES))]);
}

#[test]
fn numbers_outside_their_range_are_refused() {
    refused_values("medium.density", [json!(-0.1), json!(1e39)]);
    refused_values("medium.gradient_factor", [json!(-1)]);
    refused_values(
        "medium.gradient_range",
        [json!(0), json!(-1), json!(1e-60), json!(1e39), json!("robust")],
    );
    refused_values("camera.fov", [json!(0), json!(180), json!(1e-60)]);
    refused_values("camera.aperture", [json!(-1)]);
    refused_values("camera.focus", [json!(0), json!(-1)]);
    refused_values("camera.auto.zoom", [json!(0), json!(-1)]);
    refused_values("camera.auto.elevation", [json!(91)]);
    refused_values("film.exposure", [json!(200)]);
    refused_values("render.max_scatter", [json!(-1), json!(1_000_001), json!(1.5)]);
    refused_values("render.samples", [json!(0), json!(2_147_483_649_u64)]);
    // `photon` can number four times as many, but goes through all of them in each time slice.
    assert_eq!(crate::document::schema()["properties"]["lights"]["maxItems"], 250_000);
    refused_values("render.seed", [json!(-1), json!(1e20)]);
    refused_values("render.raymarch.step", [json!(0), json!(0.005), json!(11)]);
    refused_values("render.raymarch.light_samples", [json!(0), json!(4097)]);
    refused_values("medium.majorant_cell", [json!(-1), json!(4097)]);
    refused_values("render.path.history_memory", [json!(-1), json!(1_048_577)]);
    for (phase, key) in [("henyey-greenstein", "g"), ("schlick", "k")] {
        for g in [-1.0, 1.0, 0.999_999_999, 2.0] {
            refused(
                &json!({ "medium": { "phase": { "type": phase, key: g } } }),
                &format!("medium.phase.{key}"),
            );
        }
    }
    for key in ["opacity", "surface", "roughness", "albedo", "specular"] {
        for x in [-0.1, 1.1] {
            let point = json!({ "value": 0, "opacity": 1, key: x });
            refused(
                &json!({ "transfer_function": { "points": [point] } }),
                &format!("transfer_function.points.0.{key}"),
            );
        }
    }
    let point = json!({ "value": 0, "opacity": 1, "emission": [0, -1, 0] });
    refused(&json!({ "transfer_function": { "points": [point] } }), "transfer_function.points.0.emission.1");
    let light = json!({ "type": "point", "position": [0, 0, 0], "intensity": [1, 1, -1] });
    refused(&json!({ "lights": [light] }), "lights.0.intensity.2");
    let light = json!({ "type": "sphere", "position": [0, 0, 0], "radius": 0, "radiance": 1 });
    refused(&json!({ "lights": [light] }), "lights.0.radius");
}

#[test]
fn transfer_points_ascend_and_jump_at_most_once() {
    assert!(scene(&points(&[0.0, 1.0, 1.0, 2.0])).is_ok(), "a jump");
    refused(&points(&[0.0, 2.0, 1.0]), "transfer_function.points.2.value");
    refused(&points(&[0.0, 1.0, 1.0, 1.0]), "transfer_function.points.3.value");
    refused(&points(&[0.0, 1.0, 1.0 + 1e-12, 1.0 + 2e-12]), "transfer_function.points.3.value");
}

#[test]
fn positions_and_directions_must_make_sense() {
    let view = |position: [f64; 3], target: [f64; 3], up: [f64; 3]| json!({ "camera": { "position": position, "target": target, "up": up } });
    let (up, origin) = ([0.0, 1.0, 0.0], [0.0; 3]);
    assert!(scene(&view([0.0, 0.0, 1.0], origin, up)).is_ok());
    refused(&view([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], up), "camera.target");
    refused(&view([0.0, 5.0, 0.0], origin, up), "camera.up");
    refused(&view([0.0, -5.0, 1e-6], origin, up), "camera.up");
    refused(&view([0.0, 0.0, 1.0], origin, origin), "camera.up");
    refused(&view([0.0, 0.0, 9e37], [0.0, 0.0, -9e37], up), "camera.target");
    refused(&view([0.0, 0.0, 2e38], origin, up), "camera.position.2");
    refused(&json!({ "camera": { "auto": {}, "up": [0, 0, 0] } }), "camera.up");

    let light = |light: Value| json!({ "lights": [light] });
    refused(
        &light(json!({ "type": "directional", "direction": [0, 0, 0], "irradiance": 1 })),
        "lights.0.direction",
    );
    let rect =
        json!({ "type": "rect", "position": [0, 1, 0], "target": [0, 0, 0], "size": [1, 1], "radiance": 1 });
    assert!(scene(&light(rect.clone())).is_ok());
    refused(&light(apply(&rect, &json!({ "target": [0, 1, 0] }))), "lights.0.target");
    refused(&light(apply(&rect, &json!({ "up": [0, -2, 0] }))), "lights.0.up");
    let disk =
        json!({ "type": "disk", "position": [0, 1, 0], "target": [0, 1, 0], "radius": 1, "radiance": 1 });
    refused(&light(disk), "lights.0.target");

    let clip = |clip: Value| json!({ "clip": [clip] });
    refused(&clip(json!({ "type": "plane", "point": [0, 0, 0], "normal": [0, 0, 0] })), "clip.0.normal");
    refused(&clip(json!({ "type": "box", "min": [0, 1, 0], "max": [1, 1, 1] })), "clip.0.min");
    refused(&json!({ "film": { "size": [16384, 16385] } }), "film.size");
    refused(&json!({ "film": { "size": [0, 1] } }), "film.size.0");
}

#[test]
fn several_problems_are_reported_at_once() {
    let error =
        scene(&json!({ "medium": { "density": -1 }, "film": { "tone": "x" }, "colour": 1 })).unwrap_err();
    let paths: Vec<_> = error.problems().iter().map(|problem| problem.path.as_str()).collect();
    assert_eq!(paths, ["medium.density", "film.tone", "colour"]);
    assert_eq!(error.to_string().lines().count(), 3);
}
