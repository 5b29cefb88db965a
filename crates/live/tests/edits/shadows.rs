//! Cached shadows of `raymarch` through edits: kept where no ray meets other matter, and otherwise computed anew.

use super::{THREADS, base, refined, scene};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tyndall::session::{Budget, Session};
use tyndall_live::document::apply;

fn start(value: &Value) -> Session {
    Session::new(scene(value), THREADS.clone())
}

/// Enough light points for sweeps that can be stopped on their way.
fn with_shadows() -> Value {
    let mut value = base("raymarch");
    value["lights"]
        .as_array_mut()
        .expect("a list")
        .push(json!({ "type": "point", "name": "spot", "position": [2, 1, 0], "intensity": 40 }));
    let clip = json!([{ "type": "plane", "point": [4, 0, 0], "normal": [1, 0.2, 0] }]);
    apply(&value, &json!({ "clip": clip, "render": { "raymarch": { "light_samples": 6 } } }))
}

/// Edits of each kind, and whether they keep the shadows.
fn edits(value: &Value) -> Vec<(&'static str, bool, Value)> {
    let point = |i: usize, key: &str, x: Value| {
        let mut points = value["transfer_function"]["points"].clone();
        points[i][key] = x;
        json!({ "transfer_function": { "points": points } })
    };
    let lights = |change: &dyn Fn(&mut Vec<Value>)| {
        let mut lights = value["lights"].as_array().cloned().expect("a list");
        change(&mut lights);
        json!({ "lights": lights })
    };
    let light = |i: usize, key: &str, x: Value| lights(&|lights| lights[i][key] = x.clone());
    vec![
        ("opacity", false, point(1, "opacity", 0.4.into())),
        ("matter in empty space", false, point(0, "opacity", 0.1.into())),
        ("less matter", false, point(0, "value", 0.3.into())),
        ("colour", true, point(1, "albedo", json!([0.2, 0.9, 0.4]))),
        ("emission", true, point(2, "emission", json!([0.0, 0.5, 0.1]))),
        ("surface", true, point(2, "surface", 0.9.into())),
        ("phase", true, json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": 0.4 } } })),
        ("glossy surfaces", true, json!({ "medium": { "brdf": { "type": "ashikhmin-shirley" } } })),
        ("density", false, json!({ "medium": { "density": 0.6 } })),
        ("sun turned", false, light(0, "direction", json!([-1, -1, -1]))),
        ("sun widened", false, light(0, "angle", 20.into())),
        ("sphere moved", false, light(2, "position", json!([0, 20, 4]))),
        ("sphere larger", false, light(2, "radius", 3.into())),
        ("point moved", false, light(3, "position", json!([-3, 2, 1]))),
        ("intensity", true, light(3, "intensity", json!([90, 10, 40]))),
        ("radiance", true, light(1, "radiance", json!([0.5, 0.1, 0.2]))),
        ("light renamed", true, light(2, "name", "lamp".into())),
        (
            "light added",
            false,
            lights(&|l| l.push(json!({ "type": "point", "position": [9, 9, 9], "intensity": 70 }))),
        ),
        ("light removed", false, lights(&|l| drop(l.remove(0)))),
        ("lights exchanged", false, lights(&|l| l.swap(2, 3))),
        (
            "clip moved",
            false,
            json!({ "clip": [{ "type": "plane", "point": [2, 0, 0], "normal": [1, 0.2, 0] }] }),
        ),
        ("clip removed", false, json!({ "clip": null })),
        ("camera", true, json!({ "camera": { "auto": { "azimuth": 70 } } })),
        ("size", true, json!({ "film": { "size": [23, 16] } })),
        ("background", true, json!({ "film": { "background": [0.2, 0, 0] } })),
        ("interpolation", false, json!({ "volume": { "interpolation": "nearest" } })),
        ("cells", true, json!({ "medium": { "majorant_cell": 5 } })),
        ("light points", false, json!({ "render": { "raymarch": { "light_samples": 9 } } })),
        ("exact shadows", true, json!({ "render": { "raymarch": { "shadows": "exact" } } })),
        ("no scattering", true, json!({ "render": { "max_scatter": 0 } })),
    ]
}

/// Refines until the shadows are complete; returns how long that took.
fn settled(session: &mut Session) -> Duration {
    let begun = Instant::now();
    while session.progress().settling {
        session.refine(&Budget {
            deadline: Some(Instant::now() + Duration::from_micros(200)),
            ..Budget::samples(1)
        });
    }
    begun.elapsed()
}

/// Stops in the middle of the sweeps; false if it came too late.
fn swept_in_part(session: &mut Session, part: Duration) -> bool {
    session.refine(&Budget { deadline: Some(Instant::now() + part), ..Budget::samples(1) });
    session.progress().settling
}

#[test]
fn after_each_edit_the_picture_is_the_one_from_nothing() {
    let before = with_shadows();
    let whole = settled(&mut start(&before));
    let mut in_part = 0;
    for (i, (name, keeps, patch)) in edits(&before).into_iter().enumerate() {
        let after = apply(&before, &patch);
        let expected = refined(&mut start(&after), 2);

        let mut live = start(&before);
        refined(&mut live, 2);
        live.set_scene(scene(&after));
        live.refine(&Budget { pixel_samples: Some(0), ..Budget::samples(2) });
        assert_eq!(live.progress().settling, !keeps, "{name}: shadows are kept, or not");
        assert!(refined(&mut live, 2) == expected, "{name}: another picture");

        // Stopped in the sweeps before the edit, and after it.
        let part = whole * (1 + u32::try_from(i % 3).expect("small")) / 4;
        let mut live = start(&before);
        in_part += usize::from(swept_in_part(&mut live, part));
        live.set_scene(scene(&after));
        in_part += usize::from(swept_in_part(&mut live, part));
        assert!(refined(&mut live, 2) == expected, "{name}: another picture after stops");
    }
    assert!(in_part > 5, "{in_part} stops in the middle");
}

/// The second edit comes while the shadows of the first are under way, or takes it back.
#[test]
fn edits_in_the_middle_of_the_sweeps_lose_nothing() {
    let before = with_shadows();
    let whole = settled(&mut start(&before));
    let (edits, mut in_part) = (edits(&before), 0);
    for (i, (first, _, patch)) in edits.iter().enumerate().filter(|(_, (_, keeps, _))| !keeps) {
        let between = apply(&before, patch);
        let some = edits.iter().skip(i % 7).step_by(7);
        let seconds = some.map(|(second, _, patch)| (*second, apply(&between, patch)));
        for (j, (second, after)) in seconds.chain([("back", before.clone())]).enumerate() {
            let mut live = start(&before);
            if j % 2 == 0 {
                refined(&mut live, 1);
            }
            live.set_scene(scene(&between));
            in_part +=
                usize::from(swept_in_part(&mut live, whole * u32::try_from(j % 4).expect("small") / 5));
            live.set_scene(scene(&after));
            assert!(refined(&mut live, 1) == refined(&mut start(&after), 1), "{first}, then {second}");
        }
    }
    assert!(in_part > 10, "{in_part} stops in the middle");
}
