//! The cost of an edit before light is computed: from the patch to the scene, and to the first sample.

use super::Row;
use super::scenes::ct;
use super::timing::{Effort, median};
use crate::Failure;
use crate::machine::pool;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;
use tyndall::simd::Level;
use tyndall_live::{Budget, Input, LiveSession, Options};

/// Target in milliseconds from the scene to the first sample: discarding what the method kept, and clearing the film.
const TO_SAMPLE: f64 = 5.0;

/// An edit that alternates between two patches.
struct Case {
    name: &'static str,
    patches: [Value; 2],
    /// Target in milliseconds, from the patch to the scene.
    target: Option<f64>,
}

fn cases(voxels: u32) -> Vec<Case> {
    let case = |name, patches, target| Case { name, patches, target: Some(target) };
    let rebuilt = |name, patches| Case { name, patches, target: None };
    let points = |opacity: f64, emission: f64| {
        let mut points = ct(voxels)["transfer_function"]["points"].clone();
        points[1]["opacity"] = opacity.into();
        points[1]["emission"] = json!([emission, 0, 0]);
        json!({ "transfer_function": { "points": points } })
    };
    let lights = |irradiance: f64| {
        let mut lights = ct(voxels)["lights"].clone();
        lights[0]["irradiance"] = json!([irradiance, 3, 3]);
        json!({ "lights": lights })
    };
    let preset = |name: &str| json!({ "transfer_function": { "preset": name } });
    let medium = |key: &str, values: [Value; 2]| values.map(|value| json!({ "medium": { (key): value } }));
    let clip = |x: f64| json!({ "clip": [{ "type": "plane", "point": [x, 0, 0], "normal": [1, 0, 0] }] });
    vec![
        case("camera", [20, 30].map(|a| json!({ "camera": { "auto": { "azimuth": a } } })), 0.2),
        case("background", [0.1, 0.2].map(|c| json!({ "film": { "background": [c, c, c] } })), 0.2),
        case("light", [2.0, 3.0].map(lights), 0.5),
        case("transfer function, points", [0.8, 0.9].map(|opacity| points(opacity, 0.0)), 5.0),
        case("transfer function, preset", ["cloud", "solid"].map(preset), 5.0),
        case("transfer function that emits", [0.8, 0.9].map(|opacity| points(opacity, 2.0)), 30.0),
        rebuilt("density", medium("density", [json!(0.2), json!(0.25)])),
        rebuilt("density of what emits", medium("density", [json!(0.2), json!(0.25)])),
        rebuilt("phase function", medium("phase", [0.1, 0.2].map(|k| json!({ "type": "schlick", "k": k })))),
        rebuilt("BRDF", medium("brdf", ["lambert", "ashikhmin-shirley"].map(|t| json!({ "type": t })))),
        rebuilt("clip", [1.0, 2.0].map(clip)),
    ]
}

/// Edits of a live session of the default method, each made while every pixel has a sample.
pub fn costs(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "an edit before light is computed, 256^3 voxels, 512 x 512 pixels, two threads";
    let voxels = effort.pick(256, 64);
    let side = effort.pick(512, 64);
    let on = Options { threads: pool(Some(2))?, level, edits: true };
    let mut document = ct(voxels);
    document["film"] = json!({ "size": [side, side] });
    document["render"] = json!({ "max_scatter": 1 });
    let mut rows = Vec::new();
    for Case { name, patches, target } in cases(voxels) {
        if name.ends_with("emits") && name.starts_with("density") {
            document["transfer_function"]["points"][1]["emission"] = json!([2, 0, 0]);
        }
        let input = Input::of_document(document.clone(), Path::new(""));
        let mut live = LiveSession::start(input, on.clone()).map_err(Failure::input)?;
        let (mut to_scene, mut to_sample) = (Vec::new(), Vec::new());
        for edit in 0..effort.pick(21, 3) {
            live.refine(&Budget::samples(1));
            let begun = Instant::now();
            let report = live.edit(&patches[edit % 2]).map_err(Failure::input)?;
            let whole = begun.elapsed();
            to_scene.push(report.to_scene.as_secs_f64() * 1e3);
            to_sample.push(whole.saturating_sub(report.to_scene).as_secs_f64() * 1e3);
        }
        let row = Row::new(TABLE, name, "from patch to scene", "ms", median(to_scene));
        rows.push(match target {
            Some(target) => row.at_most(target),
            None => row,
        });
        let row = Row::new(TABLE, name, "from scene to first sample", "ms", median(to_sample));
        rows.push(row.at_most(TO_SAMPLE));
    }
    Ok(rows)
}
