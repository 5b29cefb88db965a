//! Samples of `path` that are kept through edits, together with what they depend on.

use super::{THREADS, base, patch, refined, refined_a_little, scene};
use serde_json::{Value, json};
use tyndall::integrator::{Resources, WorkShare};
use tyndall::session::Session;
use tyndall::simd::Level;
use tyndall_live::document::apply;
use tyndall_testing::SplitMix;

/// Bytes of a kept sample.
const SAMPLE: usize = 32;

fn keeping(value: &Value, bytes: usize) -> Session {
    let resources = Resources { level: Level::best(), edit_memory: bytes };
    Session::with_resources(scene(value), THREADS.clone(), resources)
}

/// The fraction of samples that are taken again after an edit.
fn share_after(live: &mut Session, value: &Value) -> f64 {
    live.set_scene(scene(value));
    refined(live, 2);
    live.recomputed()[0].share
}

/// Some edits come while the work for earlier ones is still under way; some sessions can keep only part of the samples.
#[test]
fn after_any_edits_samples_are_those_from_nothing() {
    let mut random = SplitMix::new(7);
    // Numbers of edits that redid none, some, or all of the samples.
    let mut redone = [0; 3];
    for round in 0..400 {
        let mut value = base("path");
        if round % 2 == 0 {
            // With much empty space.
            value["transfer_function"]["points"][0]["value"] = 0.35.into();
        }
        if round % 3 == 0 {
            // A single light, which is always the one selected, and no emission.
            value["lights"] = json!([value["lights"][round / 3 % 3]]);
            value["transfer_function"]["points"][2]["emission"] = json!([0, 0, 0]);
        }
        value["render"]["max_scatter"] = ([0, 1, 2, 5][round / 5 % 4]).into();
        let mut live = keeping(&value, 19 * 17 * SAMPLE * [1, 2, 100][round % 3]);
        refined(&mut live, 2);
        let mut edits = Vec::new();
        for _ in 0..5 {
            let patch = patch(&mut random, &value);
            value = apply(&value, &patch);
            edits.push(patch);
            live.set_scene(scene(&value));
            if random.bits().is_multiple_of(4) {
                refined_a_little(&mut live, &mut random);
                continue;
            }
            let mut fresh = Session::new(scene(&value), THREADS.clone());
            let found = refined(&mut live, 2);
            let samples = live.film().samples();
            assert!(found == refined(&mut fresh, samples), "round {round}: {value}\nafter {edits:?}");
            let [WorkShare { share, .. }] = live.recomputed()[..] else { panic!("{:?}", live.recomputed()) };
            assert!((0.0..=1.0).contains(&share), "{share}");
            redone[if share == 0.0 {
                0
            } else if share < 1.0 {
                1
            } else {
                2
            }] += 1;
        }
    }
    assert!(redone.iter().all(|&n| n > 100), "{redone:?}");
}

#[test]
fn edits_take_again_what_they_touched() {
    let mut value = base("path");
    let points = |albedo: f64, opacity: f64| {
        json!([
            { "value": 0.05, "opacity": 0.0 },
            { "value": 0.3, "opacity": 0.7, "albedo": [0.9, 0.6, 0.3] },
            { "value": 0.6, "opacity": 0.7, "albedo": [0.9, 0.6, 0.3] },
            { "value": 0.7, "opacity": opacity, "albedo": [albedo, 0.6, 0.9] },
            { "value": 0.75, "opacity": 0.7, "albedo": [0.9, 0.6, 0.3] },
        ])
    };
    value["transfer_function"] = json!({ "points": points(0.2, 0.5) });
    let mut live = keeping(&value, 1 << 20);
    let met = refined(&mut live, 2).rgba.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>() / (19.0 * 17.0);
    assert!(met > 0.15 && met < 0.8, "{met}");
    let [samples] = live.report().kept[..] else { panic!("{:?}", live.report()) };
    assert_eq!([samples.count, samples.bytes], [2 * 19 * 17, 2 * 19 * 17 * SAMPLE]);

    let mut share = |key: &str, edited: Value| {
        value[key] = edited;
        share_after(&mut live, &value)
    };
    let film = |background: f64| json!({ "size": [19, 17], "background": [background, 0, 0] });
    let recoloured = share("transfer_function", json!({ "points": points(0.5, 0.5) }));
    assert!(recoloured > 0.0 && recoloured < 0.4 * met, "{recoloured}");
    let thinner = share("transfer_function", json!({ "points": points(0.5, 0.4) }));
    assert!(thinner > recoloured && thinner < 0.8, "{thinner}");
    let forward = share("medium", json!({ "density": 1.0, "phase": { "type": "schlick", "k": 0.5 } }));
    assert!((forward - met).abs() < 0.05, "{forward} of {met}");
    let behind = share("film", film(0.5));
    assert!((behind - (1.0 - met)).abs() < 0.05, "{behind} of {met}");
    // By now the background colour hides the sky.
    let light =
        share("lights", json!([{ "type": "point", "position": [30, 0, 0], "intensity": [900, 900, 900] }]));
    assert!((light - met).abs() < 0.05, "{light} of {met}");
    assert_eq!(share("film", film(0.5)), 0.0);
    assert_eq!(share("clip", json!([{ "type": "plane", "point": [0, 0, 0], "normal": [1, 0, 0] }])), 1.0);
}

/// Without empty space: a narrow band of values becomes the smallest or the largest opacity of some cells, and not of
/// others.
#[test]
fn limits_that_few_values_move() {
    let mut value = base("path");
    value["render"]["max_scatter"] = 1.into();
    value["medium"]["majorant_cell"] = 4.into();
    value["medium"]["density"] = 0.05.into();
    let points = |band: f64| {
        let step = |opacity: f64, values: [f64; 2]| {
            values.map(|value| json!({ "value": value, "opacity": opacity }))
        };
        let bands = [
            step(0.6, [0.0, 0.27]),
            step(0.3, [0.28, 0.29]),
            step(0.6, [0.30, 0.32]),
            step(band, [0.33, 0.34]),
            step(0.6, [0.35, 0.37]),
            step(0.8, [0.38, 0.39]),
            step(0.6, [0.40, 1.0]),
        ];
        json!({ "points": bands.concat() })
    };
    value["transfer_function"] = points(0.6);
    let mut live = keeping(&value, 1 << 20);
    refined(&mut live, 2);
    for band in [0.2, 0.1, 0.5, 0.7, 0.9, 1.0, 0.7, 0.6] {
        value["transfer_function"] = points(band);
        let share = share_after(&mut live, &value);
        assert!(share > 0.0 && share < 0.95, "{band}: {share}");
        assert!(live.image() == refined(&mut Session::new(scene(&value), THREADS.clone()), 2), "{band}");
    }
}

/// A single light is selected with probability 1, whatever it emits.
#[test]
fn a_lone_light_that_turns() {
    let mut value = base("path");
    let sun = |x: f64| json!([{ "type": "directional", "direction": [x, -1, -1], "irradiance": [3, 3, 2] }]);
    value["transfer_function"]["points"][2]["emission"] = json!([0, 0, 0]);
    value["lights"] = sun(1.0);
    let mut live = keeping(&value, 1 << 20);
    refined(&mut live, 2);
    value["lights"] = sun(-1.0);
    let share = share_after(&mut live, &value);
    assert!(share > 0.0 && share < 1.0, "{share}");
    assert!(live.image() == refined(&mut Session::new(scene(&value), THREADS.clone()), 2));
}
