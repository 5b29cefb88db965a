//! Edits of a live session: after any sequence of them, the picture is that of a new session, bit for bit.

mod colors;
mod live;
mod photons;
mod samples;
mod shadows;
mod stops;

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};
use tyndall::film::Image;
use tyndall::integrator::{Resources, WorkShare};
use tyndall::math::cast;
use tyndall::scene::{Difference, LightOrigin, Scene};
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall::volume::procedural::{Field, Kind};
use tyndall::volume::{Interpolation, Volume};
use tyndall_live::document::{Document, apply};
use tyndall_live::{Assets, Built};
use tyndall_testing::SplitMix;

static VOLUME: LazyLock<Arc<Volume>> =
    LazyLock::new(|| Arc::new(Field::new(Kind::Cloud, [21, 18, 16], 3).volume().expect("a field")));

static THREADS: LazyLock<Arc<rayon::ThreadPool>> =
    LazyLock::new(|| Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads")));

fn scene(value: &Value) -> Scene {
    let document = Document::from_value(value.clone()).unwrap_or_else(|e| panic!("{value}: {e}"));
    let interpolation = match value.pointer("/volume/interpolation").and_then(Value::as_str) {
        Some("nearest") => Interpolation::Nearest,
        _ => Interpolation::Linear,
    };
    // As reloading does: the voxels are shared, and so is the volume unless the interpolation differs.
    let volume = match interpolation {
        Interpolation::Linear => VOLUME.clone(),
        Interpolation::Nearest => Arc::new((**VOLUME).clone().with_interpolation(interpolation)),
    };
    Built::new(document, Assets { volume, maps: BTreeMap::new(), studios: Vec::new() }, &THREADS)
        .expect("a scene")
        .scene
}

fn base(integrator: &str) -> Value {
    json!({
        "volume": { "procedural": { "kind": "cloud", "size": [21, 18, 16] } },
        "transfer_function": { "points": [
            { "value": 0.05, "opacity": 0.0, "albedo": [0.9, 0.6, 0.3] },
            { "value": 0.4, "opacity": 0.7, "albedo": [0.9, 0.6, 0.3], "surface": 0.3 },
            { "value": 0.8, "opacity": 1.0, "albedo": [0.2, 0.6, 0.9], "emission": [0.3, 0.1, 0.0] },
        ] },
        "medium": { "density": 1.0 },
        "lights": [
            { "type": "directional", "name": "sun", "direction": [1, -1, -1], "irradiance": [3, 3, 2] },
            { "type": "environment", "radiance": [0.3, 0.4, 0.5] },
            { "type": "sphere", "name": "bulb", "position": [20, 0, 0], "radius": 2, "radiance": [9, 5, 5] },
        ],
        "film": { "size": [19, 17] },
        "render": { "integrator": integrator, "max_scatter": 4, "samples": 2, "raymarch": { "light_samples": 2 } },
    })
}

/// A random edit of any kind that a document allows, with random numbers in it.
fn patch(random: &mut SplitMix, document: &Value) -> Value {
    let mut u = || cast::single(random.uniform());
    let which = cast::index(u() * 22.0);
    let mut points = document["transfer_function"]["points"].clone();
    let mut lights = document["lights"].clone();
    let count = points.as_array().map_or(0, Vec::len);
    let i = cast::index(u() * count as f32).min(count - 1);
    let edited = |points: Value| json!({ "transfer_function": { "points": points } });
    match which {
        0 | 1 => {
            points[i]["opacity"] = u().into();
            edited(points)
        }
        2 => {
            points[i]["albedo"] = json!([u(), 0.5, u()]);
            edited(points)
        }
        3 => {
            points[i]["emission"] = json!([if u() < 0.5 { 0.0 } else { 0.4 }, 0, 0]);
            edited(points)
        }
        4 => {
            points[i]["ior"] = (1.0 + u()).into();
            edited(points)
        }
        5 => {
            points[i]["value"] = (points[i]["value"].as_f64().unwrap_or(0.0) * 0.999).into();
            edited(points)
        }
        6 => {
            points[i]["surface"] = u().into();
            points[i]["roughness"] = u().into();
            edited(points)
        }
        // A point beyond all data values, which nothing reads.
        7 => {
            let mut all: Vec<Value> = points.as_array().cloned().unwrap_or_default();
            let last = all[count - 1].clone();
            all.push(last);
            all[count]["value"] = (2.0 + u()).into();
            all.truncate(4);
            edited(all.into())
        }
        8 => json!({ "medium": { "density": 0.5 + u() } }),
        9 => json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": u() - 0.5 } } }),
        10 if u() < 0.5 => json!({ "medium": { "brdf": { "type": "ashikhmin-shirley" } } }),
        10 => json!({ "medium": { "gradient_factor": 1.0 + u() } }),
        11 => json!({ "clip": [{ "type": "plane", "point": [u(), 0, 0], "normal": [1, u(), 0] }] }),
        12 => json!({ "clip": null }),
        13 => {
            let i =
                if lights.as_array().is_some_and(|all| all.len() > 1) { cast::index(u() * 2.0) } else { 0 };
            let key = match lights[i]["type"].as_str() {
                Some("directional") => "irradiance",
                Some("point") => "intensity",
                _ => "radiance",
            };
            lights[i][key] = json!([u(), 1, 1]);
            json!({ "lights": lights })
        }
        14 => {
            // The lights' indices change, and with them which light a random number selects; or one moves, or the last
            // one is removed for a while.
            let lights = lights.as_array_mut().expect("a list");
            match cast::index(u() * 4.0) {
                0 => lights.rotate_left(1),
                // The name determines the random numbers of the light's photons.
                1 => lights[0]["name"] = ["sun", "bulb", "lamp"][cast::index(u() * 3.0)].into(),
                2 => lights
                    .iter_mut()
                    .filter(|l| l["name"] == "bulb")
                    .for_each(|l| l["position"][1] = u().into()),
                _ if lights.len() > 2 => drop(lights.pop()),
                _ => lights
                    .push(json!({ "type": "point", "position": [9, 9, u()], "intensity": [60, 50, 40] })),
            }
            json!({ "lights": lights })
        }
        15 => json!({ "camera": { "auto": { "azimuth": 90.0 * u() } } }),
        16 => json!({ "film": { "size": [16 + cast::index(u() * 9.0), 17] } }),
        17 => json!({ "film": { "background": [u(), 0, 0] } }),
        18 => json!({ "film": { "exposure": u(), "tone": "linear" }, "render": { "samples": 3 } }),
        19 => {
            json!({ "render": { "seed": cast::index(u() * 3.0), "max_scatter": 1 + cast::index(u() * 4.0) } })
        }
        20 => json!({ "medium": { "majorant_cell": 4 + cast::index(u() * 2.0) } }),
        _ => json!({ "volume": { "interpolation": if u() < 0.5 { "nearest" } else { "linear" } } }),
    }
}

fn refined(session: &mut Session, samples: u32) -> Image {
    session.refine(&Budget::samples(samples));
    session.image()
}

/// Refines for so short a time that usually nothing is completed.
fn refined_a_little(session: &mut Session, random: &mut SplitMix) {
    let moment = Duration::from_micros(if random.uniform() < 0.5 { 0 } else { random.bits() % 3000 });
    session.refine(&Budget { deadline: Some(Instant::now() + moment), ..Budget::samples(2) });
}

#[test]
fn after_any_edits_the_picture_is_the_one_from_nothing() {
    let mut random = SplitMix::new(2012);
    let (mut kept, mut redone) = (0, 0);
    for round in 0..60 {
        let mut value = base(["raymarch", "path"][round % 2]);
        let mut live = Session::new(scene(&value), THREADS.clone());
        refined(&mut live, 2);
        let mut edits = Vec::new();
        for _ in 0..5 {
            let patch = patch(&mut random, &value);
            value = apply(&value, &patch);
            edits.push(patch);
            live.set_scene(scene(&value));
            let found = refined(&mut live, 2);
            let expected = refined(&mut Session::new(scene(&value), THREADS.clone()), 2);
            assert!(found == expected, "round {round}: a different picture after {edits:?}");
            let [WorkShare { name, share }] = live.recomputed()[..] else {
                panic!("{:?}", live.recomputed())
            };
            assert!(name == "pixels" && (share == 0.0 || share == 1.0), "{share} of the {name}");
            *(if share == 0.0 { &mut kept } else { &mut redone }) += 1;
        }
    }
    assert!(kept > 20 && redone > 150, "{kept} edits kept the picture, {redone} did not");
}

/// Tests photons and segments of the base map, which alone are kept through an edit, and a refinement pass after it.
/// Some edits come while the work for earlier ones is still under way.
#[test]
fn after_any_edits_photons_and_segments_are_those_from_nothing() {
    let mut random = SplitMix::new(4);
    // Numbers of edits that redid none, some, or all of the photons, and of the segments.
    let mut redone = [[0; 3]; 2];
    for round in 0..400 {
        let mut value = base("photon");
        if round % 2 == 0 {
            // With much empty space.
            value["transfer_function"]["points"][0]["value"] = 0.35.into();
        }
        value["render"]["photon"] = json!({
            "photons": 30 + random.bits() % (if round % 3 == 0 { 2000 } else { 100 }),
            "radius": 0.3 + 1.5 * random.uniform(),
            "segments": 1 + random.bits() % 9,
            "history_bits": ([32, 64, 128][round % 3]),
            "bins": (["quantile", "uniform"][round / 3 % 2]),
            "spatial": (["cells", "axes"][round / 6 % 2]),
            "estimate": (["point", "nearest", "beam"][round / 2 % 3]),
            "nearest": 5,
            "gather_spacing": ([0.0, 1.5, 4.0][round / 4 % 3]),
            "histories": (["interactions", "paths"][round / 5 % 2]),
        });
        let edit_memory = [1 << 22, 0, 1 << 14][round / 7 % 3];
        let resources = Resources { level: Level::best(), edit_memory };
        let mut live = Session::with_resources(scene(&value), THREADS.clone(), resources);
        refined(&mut live, 1);
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
            // A picture that the edit left unchanged may already have its refinement pass, or half of it.
            let found = refined(&mut live, 1);
            let samples = live.film().samples();
            let even = live.film().mean_samples() == f64::from(samples);
            assert!(
                !even || found == refined(&mut fresh, samples),
                "round {round}: {value}\nafter {edits:?}"
            );
            for (counts, WorkShare { name, share }) in redone.iter_mut().zip(live.recomputed()) {
                assert!((0.0..=1.0).contains(&share), "{share} of the {name}");
                counts[if share == 0.0 {
                    0
                } else if share < 1.0 {
                    1
                } else {
                    2
                }] += 1;
            }
            assert!(refined(&mut live, 2) == refined(&mut fresh, 2), "round {round}: a pass after {edits:?}");
        }
    }
    // Rays that miss the volume have segments too, which are never redone.
    let [photons, [none, some, _]] = redone;
    assert!(photons.iter().chain([&none, &some]).all(|&n| n > 20), "{redone:?}");
}

fn difference(before: &Value, patch: &Value) -> Difference {
    Difference::between(&scene(before), &scene(&apply(before, patch)))
}

#[test]
fn a_difference_names_what_changed_and_nothing_else() {
    let before = base("path");
    assert!(difference(&before, &json!({})).is_empty());
    assert!(
        difference(&before, &json!({ "film": { "exposure": 2 }, "render": { "samples": 9 } })).is_empty()
    );

    let density = difference(&before, &json!({ "medium": { "density": 0.25 } }));
    assert_eq!(density.density, Some(0.25));
    assert!(density.light() && !density.view() && density.transfer.is_empty());

    let mut points = before["transfer_function"]["points"].clone();
    points[1]["ior"] = 1.5.into();
    let ior = difference(&before, &json!({ "transfer_function": { "points": points } }));
    assert!(!ior.is_empty() && !ior.light() && !ior.view());

    let glossy = json!({ "medium": { "brdf": { "type": "ashikhmin-shirley" } } });
    assert!(difference(&before, &glossy).surfaces);
    let mut dull = before.clone();
    dull["transfer_function"]["points"][1]["surface"] = 0.into();
    assert!(difference(&dull, &glossy).is_empty(), "no matter has a surface");

    let camera = difference(&before, &json!({ "camera": { "fov": 20 } }));
    assert!(camera.camera && camera.view() && !camera.light());

    // Another picture size changes an automatic camera and lights only where it must.
    let size = difference(&before, &json!({ "film": { "size": [38, 34] } }));
    assert!(size.size && !size.light());
}

#[test]
fn lights_are_matched_by_name_then_by_number() {
    let before = base("path");
    let lights = before["lights"].as_array().unwrap();
    let origins = |lights: Vec<Value>| {
        let difference = difference(&before, &json!({ "lights": lights })).lights;
        assert_eq!(difference.is_empty(), lights == *before["lights"].as_array().unwrap());
        assert_eq!(difference.names, !difference.is_empty());
        (difference.origins, difference.removed)
    };
    use LightOrigin::{Changed, New, Same};
    assert_eq!(origins(lights.clone()), (vec![Same(0), Same(1), Same(2)], vec![]));
    let [sun, sky, bulb] = [0, 1, 2].map(|i| lights[i].clone());
    assert_eq!(
        origins(vec![bulb.clone(), sky.clone(), sun.clone()]),
        (vec![Same(2), Same(1), Same(0)], vec![])
    );
    let mut dim = sun.clone();
    dim["irradiance"] = json!([1, 1, 1]);
    assert_eq!(origins(vec![dim.clone(), bulb.clone()]), (vec![Changed(0), Same(2)], vec![1]));
    // The third light now has no name, and the old third light is still there under its own name.
    dim["name"] = Value::Null;
    dim.as_object_mut().unwrap().remove("name");
    assert_eq!(origins(vec![sun, bulb, dim]), (vec![Same(0), Same(2), New], vec![1]));
}
