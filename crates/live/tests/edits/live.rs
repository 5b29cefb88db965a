//! The live session: random edits, undos and redos, compared with new sessions.

use super::{THREADS, base, patch};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use tyndall::film::Image;
use tyndall::integrator::METHODS;
use tyndall::math::cast;
use tyndall::simd::Level;
use tyndall_live::{Budget, EditSource, Input, LiveSession, Options};
use tyndall_testing::SplitMix;

fn options() -> Options {
    Options { threads: THREADS.clone(), level: Level::best(), edits: true }
}

fn opened(document: &Value) -> LiveSession {
    LiveSession::start(Input::of_document(document.clone(), Path::new("")), options()).expect("a scene")
}

fn refined(live: &mut LiveSession, samples: u32) -> Image {
    live.refine(&Budget::samples(samples));
    live.image()
}

/// The document without the camera, which undo leaves unchanged.
fn without_camera(live: &LiveSession) -> Value {
    let mut document = live.document().to_value();
    document.as_object_mut().expect("a table").remove("camera");
    document
}

/// Runs for every method in the list, so that a new one is tested too.
#[test]
fn after_edits_undos_and_redos_the_picture_is_the_one_from_nothing() {
    for method in METHODS {
        let mut random = SplitMix::new(13);
        let (mut undone, mut redone) = (0, 0);
        for round in 0..12 {
            let mut document = base(method.name);
            document["render"][method.table()] =
                method.write(&method.draft(&method.default_settings())).expect("settings");
            let mut live = opened(&document);
            refined(&mut live, 2);
            // Documents that undo and redo must lead to.
            let (mut past, mut future) = (Vec::new(), Vec::new());
            for _ in 0..10 {
                let before = without_camera(&live);
                match cast::index(4.0 * cast::single(random.uniform())) {
                    0 => {
                        let there = live.undo().expect("an undo").is_some();
                        assert_eq!(there, !past.is_empty());
                        if let Some(expected) = past.pop() {
                            assert_eq!(without_camera(&live), expected, "round {round}");
                            future.push(before);
                            undone += 1;
                        }
                    }
                    1 => {
                        let there = live.redo().expect("a redo").is_some();
                        assert_eq!(there, !future.is_empty());
                        if let Some(expected) = future.pop() {
                            assert_eq!(without_camera(&live), expected, "round {round}");
                            past.push(before);
                            redone += 1;
                        }
                    }
                    _ => {
                        let patch = patch(&mut random, &live.value());
                        live.edit(&patch).expect("an edit");
                        // What only moved the camera, or repeats what holds already, is not a step.
                        if without_camera(&live) != before {
                            past.push(before);
                            future.clear();
                        }
                    }
                }
                let samples = refined(&mut live, 1);
                let taken = live.film().samples();
                let mut fresh = live.fresh().expect("a session");
                let expected = refined(&mut fresh, taken);
                let even = live.film().mean_samples() == f64::from(taken);
                assert!(!even || samples == expected, "{}, round {round}: {}", method.name, live.value());
            }
        }
        assert!(undone > 8 && redone > 3, "{undone} undos, {redone} redos");
    }
}

#[test]
fn a_drag_is_one_step_and_what_changes_nothing_is_none() {
    let mut live = opened(&base("path"));
    let density = |live: &LiveSession| live.document().medium.density;
    live.edit(&json!({ "medium": { "density": 2.0 } })).expect("an edit");
    for step in 0..5 {
        let patch = json!({ "medium": { "density": 3.0 + f64::from(step) } });
        live.edit_from(&patch, EditSource { gesture: Some(1), ..EditSource::default() }).expect("an edit");
        // Written out, but the default that holds already.
        live.edit(&json!({ "medium": { "majorant_cell": 8 }, "camera": { "fov": 20 } })).expect("an edit");
    }
    assert_eq!(density(&live), 7.0);
    for expected in [2.0, 1.0] {
        live.undo().expect("an undo").expect("a step");
        assert_eq!(density(&live), expected);
    }
    assert!(live.undo().expect("no error").is_none());
}

#[test]
fn an_edit_that_fails_changes_nothing() {
    let mut live = opened(&base("path"));
    let picture = refined(&mut live, 1);
    let value = live.value().into_owned();
    for bad in [
        json!({ "medium": { "densty": 1 } }),
        json!({ "medium": { "density": 1e30 } }),
        json!({ "medium": { "majorant_cell": 4 }, "render": { "path": { "majorant_cell": 4 } } }),
        json!({ "transfer_function": { "preset": "no-such" } }),
        json!({ "volume": { "procedural": null, "path": "no-such-file.nrrd" } }),
        json!({ "camera": { "position": [0, 0, 9], "target": [0, 0, 9] } }),
        json!({ "film": { "size": [16384, 16384] }, "lights": [{ "type": "no-such" }] }),
    ] {
        let error = live.edit(&bad).err().unwrap_or_else(|| panic!("{bad} was accepted"));
        assert!(error.to_string().starts_with("edit: ") || error.to_string().contains("no-such"), "{error}");
        assert_eq!(*live.value(), value);
        assert!(live.undo().expect("nothing to undo").is_none());
        assert!(refined(&mut live, 1) == picture);
    }
}

#[test]
fn an_edit_with_a_key_at_its_old_place_is_read_with_a_note() {
    let mut live = opened(&base("path"));
    let report = live.edit(&json!({ "render": { "path": { "majorant_cell": 4 } } })).expect("an edit");
    assert_eq!(report.notes.len(), 1, "{:?}", report.notes);
    assert!(report.difference.majorants && live.document().medium.majorant_cell == 4);
}

#[test]
fn only_new_notes_are_reported() {
    let mut live = opened(&base("path"));
    assert!(live.notes().is_empty(), "{:?}", live.notes());
    let clear = json!({ "transfer_function": { "points": [{ "value": 0, "opacity": 0 }] } });
    assert_eq!(live.edit(&clear).expect("an edit").notes.len(), 1);
    assert!(live.edit(&json!({ "camera": { "fov": 20 } })).expect("an edit").notes.is_empty(), "said once");
}

/// What an edit leaves unchanged is shared with the scene before it, and two sessions share their voxels.
#[test]
fn an_edit_rebuilds_only_what_it_touches() {
    let mut live = opened(&base("path"));
    let parts = |live: &LiveSession| {
        let scene = live.scene();
        let medium = &scene.medium;
        let (volume, transfer) = (medium.shared_volume().clone(), medium.shared_transfer().clone());
        (volume, transfer, scene.medium.clone(), scene.lights.clone())
    };
    for (patch, keeps) in [
        (json!({ "camera": { "fov": 20 } }), [true, true, true]),
        (json!({ "film": { "size": [20, 20], "background": [1, 0, 0] } }), [true, true, true]),
        (
            json!({ "lights": [{ "type": "point", "position": [9, 9, 9], "intensity": 9 }] }),
            [true, true, false],
        ),
        (json!({ "medium": { "phase": { "type": "schlick", "k": 0.1 } } }), [true, false, true]),
        (
            json!({ "clip": [{ "type": "plane", "point": [0, 0, 0], "normal": [1, 0, 0] }] }),
            [true, false, true],
        ),
        (json!({ "medium": { "density": 0.5 } }), [true, false, false]),
        (json!({ "transfer_function": { "points": [{ "value": 0, "opacity": 1 }] } }), [false, false, false]),
    ] {
        let (volume, transfer, medium, lights) = parts(&live);
        live.edit(&patch).expect("an edit");
        let (volume_after, transfer_after, medium_after, lights_after) = parts(&live);
        assert!(Arc::ptr_eq(&volume, &volume_after), "{patch}");
        let kept = [
            Arc::ptr_eq(&transfer, &transfer_after),
            Arc::ptr_eq(&medium, &medium_after),
            Arc::ptr_eq(&lights, &lights_after),
        ];
        assert_eq!(kept, keeps, "function, medium and lights after {patch}");
        let opacities = |medium: &tyndall::medium::Medium| medium.majorants().opacities().as_ptr();
        assert_eq!(opacities(&medium) == opacities(&medium_after), keeps[0], "majorants after {patch}");
    }
    let fresh = live.fresh().expect("a session");
    assert!(Arc::ptr_eq(&parts(&fresh).0, &parts(&live).0), "two sessions share voxels");
}

/// A light of every type in the camera's axes.
fn lights_of_the_camera() -> Value {
    json!([
        { "type": "directional", "axes": "camera", "direction": [1, -2, -3], "irradiance": [3, 2, 1], "angle": 5 },
        { "type": "point", "axes": "camera", "position": [-14, 20, 11], "intensity": [90, 300, 200] },
        { "type": "rect", "axes": "camera", "position": [20, 9, 14], "target": [1, 2, 3], "up": [1, 1, 0], "size": [9, 5], "radiance": 4 },
        { "type": "disk", "axes": "camera", "position": [0, -25, 5], "target": [0, 1, 0], "radius": 6, "radiance": [3, 1, 4] },
        { "type": "sphere", "axes": "camera", "position": [-4, 3, -22], "radius": 3, "radiance": [9, 5, 5] },
        { "type": "environment", "axes": "camera", "studio": {
            "horizon": 0.1, "zenith": [0.2, 0.3, 0.4],
            "softboxes": [{ "azimuth": -40, "elevation": 30, "size": [40, 20], "radiance": [3, 2, 2] }],
        } },
    ])
}

#[test]
fn lights_follow_the_camera() {
    for method in METHODS {
        let mut document = base(method.name);
        document["lights"] = lights_of_the_camera();
        let mut live = opened(&document);
        refined(&mut live, 2);
        for patch in [
            json!({ "camera": { "auto": { "azimuth": 100, "elevation": -30 } } }),
            json!({ "film": { "exposure": 1 } }),
            json!({ "camera": { "position": [30, 20, 10], "up": [1, 0, 0] } }),
        ] {
            live.edit(&patch).expect("an edit");
            let fresh = refined(&mut opened(&live.value()), 2);
            assert_eq!(refined(&mut live, 2), fresh, "{patch}, {}", method.name);
        }
    }
}

/// From the right, the camera's x is the world's -z, and its z, to the viewer, the world's x.
#[test]
fn axes_of_the_camera_are_as_documented() {
    let mut document = base("raymarch");
    document["camera"] = json!({ "auto": { "azimuth": 90, "elevation": 0 } });
    document["render"]["raymarch"] = json!({ "shadows": "exact" });
    let mut world = lights_of_the_camera();
    for light in world.as_array_mut().expect("lights") {
        light.as_object_mut().expect("a light").remove("axes");
        for key in ["direction", "position", "target", "up"] {
            if let Some([x, y, z]) = light.get(key).and_then(Value::as_array).map(Vec::as_slice) {
                let turned = json!([z, y, -x.as_f64().expect("a number")]);
                light[key] = turned;
            }
        }
        if light["type"] == "environment" {
            light["rotation"] = 90.into();
        }
    }
    let [followed, placed] = [lights_of_the_camera(), world].map(|lights| {
        document["lights"] = lights;
        refined(&mut opened(&document), 1)
    });
    for (a, b) in followed.rgba.iter().zip(&placed.rgba) {
        for (x, y) in a.iter().zip(b) {
            assert!((x - y).abs() < 1e-4 * y.max(0.1), "{a:?} for {b:?}");
        }
    }
}
