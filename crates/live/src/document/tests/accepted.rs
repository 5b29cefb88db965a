//! What is accepted, what it means, and what a round trip keeps.

use serde_json::{Value, json};

use super::super::*;
use super::{nested, point, scene};

/// A complete example, with every kind of light and clip that this version has.
const EXAMPLE: &str = r#"
version = 1

[volume]
path = "head.raw"
interpolation = "linear"
raw = { dims = [256, 256, 256], dtype = "u8", endian = "little", offset = 0, spacing = [1, 1, 1] }

[transfer_function]
points = [
  { value = 0.0, opacity = 0.0, albedo = [0.9, 0.9, 0.9] },
  { value = 1.0, opacity = 1.0, albedo = [0.9, 0.8, 0.7], emission = [0, 0, 0], surface = 0.0, specular = [0.04, 0.04, 0.04], roughness = 0.3, ior = 1.0 },
]

[medium]
density = 1.0
phase = { type = "isotropic" }
brdf = { type = "lambert" }
gradient_factor = 10.0
gradient_range = 2500.0

[[lights]]
type = "directional"
direction = [0, -1, 0]
irradiance = [3, 3, 3]

[[lights]]
type = "rect"
position = [0, 300, 0]
target = [0, 0, 0]
size = [100, 100]
radiance = [10, 10, 10]

[[lights]]
type = "point"
name = "lamp"
position = [0, 300, 0]
intensity = 5

[[lights]]
type = "disk"
position = [0, 300, 0]
target = [0, 0, 0]
radius = 10
radiance = [1, 1, 1]

[[lights]]
type = "sphere"
position = [0, 300, 0]
radius = 10
radiance = [1, 1, 1]

[[lights]]
type = "environment"
map = "studio.exr"
rotation = 90
visible = true

[camera]
type = "perspective"
position = [0, 0, 600]
target = [0, 0, 0]
up = [0, 1, 0]
fov = 35.0

[film]
size = [512, 512]
exposure = 0.0
tone = "agx"
background = "environment"

[render]
integrator = "path"
max_scatter = 64
samples = 64
seed = 0

[render.raymarch]
step = 0.5
light_samples = 16

[[clip]]
type = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]

[[clip]]
type = "box"
min = [-1, -1, -1]
max = [1, 1, 1]
"#;

#[test]
fn the_complete_example_is_read() {
    let document = Document::from_toml(EXAMPLE).unwrap();
    assert_eq!(document.volume.raw.as_ref().unwrap().dims, [256; 3]);
    let points = document.transfer_function.as_ref().unwrap().points.as_ref().unwrap();
    assert_eq!(points[0], TransferPoint { albedo: [0.9; 3], ..TransferPoint::new(0.0, 0.0) });
    assert_eq!(points[1].albedo, [0.9, 0.8, 0.7]);
    let lights = document.lights.as_ref().unwrap();
    assert_eq!(lights.len(), 6);
    assert_eq!(lights[2].name(), Some("lamp"));
    assert!(matches!(lights[2], Light::Point { intensity: [5.0, 5.0, 5.0], .. }), "one number is grey");
    assert_eq!(document.camera.as_ref().unwrap().position(), Some([0.0, 0.0, 600.0]));
    assert_eq!(document.render.method().name(), "path");
    assert_eq!(document.clip.len(), 2);
}

#[test]
fn a_scene_as_other_programs_write_it_is_read() {
    let text = r#"{
        "version": 1,
        "volume": { "path": "volume.nrrd" },
        "transfer_function": { "points": [
            { "value": 0.0, "opacity": 0.0, "albedo": [0.99, 0.99, 0.99] },
            { "value": 255.0, "opacity": 1.0, "albedo": [0.99, 0.99, 0.99] }
        ] },
        "medium": { "density": 22.0, "phase": { "type": "henyey-greenstein", "g": 0.6 } },
        "lights": [
            { "type": "directional", "direction": [-0.55, -0.75, 0.2], "irradiance": [5, 4.7, 4.2] },
            { "type": "environment", "radiance": [0.2, 0.28, 0.42], "visible": true }
        ],
        "camera": { "type": "perspective", "position": [2.6, 0.7, 3.6], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 32.0 },
        "film": { "size": [160, 160], "background": "environment" },
        "render": { "integrator": "path", "max_scatter": 64, "samples": 256, "seed": 1 }
    }"#;
    let document = Document::from_json(text).unwrap();
    assert_eq!(document.medium.phase, Phase::HenyeyGreenstein { g: 0.6 });
    assert_eq!(document.render.samples(), 256);
}

#[test]
fn what_is_left_out_has_its_default() {
    let document = scene(&json!({})).unwrap();
    assert_eq!(document.version, 1);
    assert_eq!(document.transfer_function, None);
    assert_eq!(document.lights, None);
    assert_eq!(document.camera, None);
    assert_eq!(document.medium, Medium::default());
    assert_eq!(document.render, Render::default());

    let written = scene(&json!({
        "volume": { "procedural": {} },
        "transfer_function": { "points": [point(0.0)] },
        "medium": {}, "lights": [], "camera": {}, "film": {}, "render": { "raymarch": {}, "path": {}, "photon": {} }, "clip": []
    }));
    let document = written.unwrap();
    assert_eq!(document.volume.procedural, Some(Procedural::default()));
    assert_eq!(document.lights, Some(Vec::new()), "no lights are not the default lights");
    assert_eq!(document.camera, Some(Camera::default()));
    let value = document.to_value();
    for (path, default) in [
        (
            "/transfer_function/points/0",
            json!({
                "value": 0.0, "opacity": 0.5, "albedo": [0.8, 0.8, 0.8], "emission": [0.0, 0.0, 0.0], "surface": 0.0,
                "specular": [0.04, 0.04, 0.04], "roughness": 0.3, "ior": 1.0
            }),
        ),
        (
            "/medium",
            json!({
                "density": 1.0, "phase": { "type": "isotropic" }, "brdf": { "type": "lambert" }, "gradient_factor": 10.0,
                "majorant_cell": 8
            }),
        ),
        ("/camera", json!({ "type": "perspective", "fov": 35.0, "aperture": 0.0 })),
        ("/film", json!({ "size": [512, 512], "exposure": 0.0, "tone": "agx", "background": "environment" })),
        (
            "/render",
            json!({
                "integrator": "path", "max_scatter": 64, "seed": 0,
                "raymarch": { "step": 0.5, "light_samples": 16, "shadows": "cached" }, "path": { "history_memory": 512 },
                "photon": {
                    "photons": 1_048_576, "radius": 1.5, "segments": 7, "steps_per_voxel": 2.0, "gather_spacing": 1.5,
                    "estimate": "point", "nearest": 32, "histories": "interactions", "history_bits": 64, "bins": "quantile", "spatial": "cells"
                }
            }),
        ),
    ] {
        assert_eq!(value.pointer(path), Some(&default), "{path}");
    }
}

#[test]
fn an_omitted_number_of_samples_follows_the_method() {
    let samples = |render: Value| scene(&json!({ "render": render })).unwrap().render.samples();
    for method in tyndall::integrator::METHODS {
        let usual = if method.has_noise { 64 } else { 4 };
        assert_eq!(samples(json!({ "integrator": method.name })), usual, "{}", method.name);
        assert_eq!(samples(json!({ "integrator": method.name, "samples": 9 })), 9, "{}", method.name);
    }
}

#[test]
fn a_round_trip_keeps_everything() {
    let awkward = json!({
        "volume": { "path": "a.raw", "raw": {
            "dims": [3, 4, 5], "dtype": "f64", "endian": "big", "offset": u64::MAX,
            "spacing": [f64::from(0.1_f32), 0.1, 1e-300], "origin": [1.0 / 3.0, -0.7, 0.0]
        } },
        "medium": { "density": f64::from(7.038_531e-26_f32), "brdf": { "type": "abc", "b": 12.3, "c": 0.1 } },
        "camera": { "type": "orthographic", "auto": { "azimuth": 30.3 } },
        "film": { "background": [0.1, 0.2, 0.3] },
        "render": { "seed": u64::MAX, "integrator": "raymarch" }
    });
    let example = Document::from_toml(EXAMPLE).unwrap();
    for document in [scene(&json!({})).unwrap(), scene(&awkward).unwrap(), example] {
        let value = document.to_value();
        assert_eq!(Document::from_value(value.clone()).unwrap(), document);
        let text = serde_json::to_string(&value).unwrap();
        assert_eq!(Document::from_json(&text).unwrap(), document, "through text");
        assert_eq!(Document::from_value(value.clone()).unwrap().to_value(), value);
    }
    let spacing = scene(&awkward).unwrap().volume.raw.unwrap().spacing;
    assert_eq!(spacing, [f64::from(0.1_f32), 0.1, 1e-300]);
}

#[test]
fn the_short_forms_mean_the_long_ones() {
    let short = scene(&json!({
        "medium": { "phase": {}, "brdf": {} }, "camera": { "fov": 20.0 }, "film": { "background": 0.5, "size": [64.0, 32.0] },
        "render": { "samples": 16.0 }
    }));
    let long = scene(&json!({
        "medium": { "phase": { "type": "isotropic" }, "brdf": { "type": "lambert" } },
        "camera": { "type": "perspective", "fov": 20.0 }, "film": { "background": [0.5, 0.5, 0.5], "size": [64, 32] },
        "render": { "samples": 16 }
    }));
    assert_eq!(short.unwrap(), long.unwrap());
}

#[test]
fn the_ends_of_the_ranges_are_accepted() {
    for (path, value) in [
        ("medium.density", json!(0)),
        ("render.max_scatter", json!(0)),
        ("render.max_scatter", json!(1_000_000)),
        ("render.samples", json!(2_147_483_648_u64)),
        ("render.seed", json!(u64::MAX)),
        ("render.raymarch.step", json!(0.01)),
        ("render.raymarch.light_samples", json!(4096)),
        ("medium.majorant_cell", json!(0)),
        ("render.path.history_memory", json!(0)),
        ("film.size", json!([1, 1])),
        ("film.size", json!([16384, 16384])),
        ("camera.fov", json!(179.9)),
        ("medium.phase", json!({ "type": "schlick", "k": -0.999 })),
    ] {
        let outcome = scene(&nested(path, value.clone()));
        assert!(outcome.is_ok(), "{path} = {value}: {}", outcome.unwrap_err());
    }
}

/// A density of -0 once stopped rays from advancing.
#[test]
fn a_zero_has_no_sign() {
    for density in ["-0.0", "-0", "-1e-300", "-1e-46"] {
        for text in [
            format!("volume.procedural = {{}}\nmedium.density = {density}"),
            format!("{{\"volume\": {{\"procedural\": {{}}}}, \"medium\": {{\"density\": {density}}}}}"),
        ] {
            let document =
                if text.starts_with('{') { Document::from_json(&text) } else { Document::from_toml(&text) };
            let density = document.unwrap().medium.density;
            assert!(density == 0.0 && density.is_sign_positive(), "{text}: {density}");
        }
    }
}

#[test]
fn the_check_and_the_types_agree() {
    // Every value that passes the check must deserialize into the types: serde's message means that the two disagree.
    let text = EXAMPLE.replace("\"isotropic\"", "\"schlick\"").replace("\"lambert\"", "\"abc\"");
    let value = Document::from_toml(&text).unwrap().to_value();
    let mut leaves = Vec::new();
    collect_leaves(&value, &mut Vec::new(), &mut leaves);
    let strange = [
        json!(0),
        json!(-1),
        json!(1e39),
        json!(0.5),
        json!(1e20),
        json!(""),
        json!(true),
        json!([]),
        json!({}),
        json!(null),
    ];
    for path in leaves {
        for strange in &strange {
            let mut changed = value.clone();
            *changed.pointer_mut(&path).unwrap() = strange.clone();
            if let Err(error) = Document::from_value(changed) {
                let told = error.to_string();
                assert!(!told.contains("as the schema describes it"), "{path} = {strange}: {told}");
            }
        }
    }
}

fn collect_leaves(value: &Value, path: &mut Vec<String>, leaves: &mut Vec<String>) {
    leaves.push(path.iter().fold(String::new(), |pointer, key| format!("{pointer}/{key}")));
    let below: Vec<(String, &Value)> = match value {
        Value::Object(table) => table.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(items) => items.iter().enumerate().map(|(i, item)| (i.to_string(), item)).collect(),
        _ => Vec::new(),
    };
    for (key, value) in below {
        path.push(key);
        collect_leaves(value, path, leaves);
        path.pop();
    }
}

#[test]
fn the_manual_names_every_key_and_every_word() {
    let manual = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene.md"));
    let mut words = Vec::new();
    collect_words(&schema(), &mut words);
    assert!(words.len() > 60, "{words:?}");
    for word in words {
        assert!(manual.contains(&format!("`{word}`")), "docs/scene.md does not mention `{word}`");
    }
}

/// The names of all properties, and all constants.
fn collect_words(schema: &Value, words: &mut Vec<String>) {
    match schema {
        Value::Object(keywords) => {
            if let Some(Value::Object(properties)) = keywords.get("properties") {
                words.extend(properties.keys().cloned());
            }
            words.extend(keywords.get("const").and_then(Value::as_str).map(str::to_owned));
            keywords.values().for_each(|value| collect_words(value, words));
        }
        Value::Array(items) => items.iter().for_each(|item| collect_words(item, words)),
        _ => {}
    }
}
