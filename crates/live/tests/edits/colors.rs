//! Edits under `photon` that need no march: a segment whose matter did not change is summed anew after a change of colours, and
//! gathered anew after one of photons.

use super::{THREADS, base, refined, scene};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tyndall::integrator::Resources;
use tyndall::math::cast;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document::apply;
use tyndall_testing::SplitMix;

/// A session that keeps at most this many bytes for edits.
fn keeping(value: &Value, bytes: usize) -> Session {
    let resources = Resources { level: Level::best(), edit_memory: bytes };
    Session::with_resources(scene(value), THREADS.clone(), resources)
}

/// More than the gathers of these pictures need.
const PLENTY: usize = 1 << 22;

/// The points of a transfer function with another number somewhere.
fn with_point(value: &Value, point: usize, key: &str, number: impl Into<Value>) -> Value {
    let mut points = value["transfer_function"]["points"].clone();
    points[point][key] = number.into();
    json!({ "transfer_function": { "points": points } })
}

/// The share of the segments that the last edit computed.
fn computed(live: &Session) -> f64 {
    live.recomputed()[1].share
}

/// The number of segments that the last edit marched.
fn marched(live: &Session) -> usize {
    let counts = live.report().counts;
    counts.iter().find(|count| count.name == "marched").expect("a count").count
}

fn assert_as_from_nothing(live: &mut Session, value: &Value, name: &str) {
    let mut fresh = Session::new(scene(value), THREADS.clone());
    assert!(refined(live, 1) == refined(&mut fresh, 1), "{name}: {value}");
}

/// One scattering, so that no photon depends on a colour.
fn single(photon: Value) -> Value {
    let mut value = base("photon");
    value["film"]["size"] = json!([40, 33]);
    value["render"]["max_scatter"] = 1.into();
    value["render"]["photon"] = photon;
    value
}

/// Colours alone march nothing; whatever else an edit changes between them, they meet what is there then.
#[test]
fn recolouring_marches_nothing_and_other_edits_between_leave_nothing_old() {
    let mut random = SplitMix::new(23);
    for round in 0..24 {
        let mut value = single(json!({
            "photons": 6000, "segments": 1 + round, "nearest": 8,
            "estimate": (["point", "beam", "nearest"][round % 3]), "spatial": (["cells", "axes"][round / 3 % 2]),
        }));
        if round % 4 != 0 {
            value["transfer_function"]["points"][2]["emission"] = 0.into();
        }
        let mut live = keeping(&value, PLENTY);
        refined(&mut live, 1);
        let mut u = || random.uniform();
        // Where matter glows, not of that, and not darker than it: a change of the light would change photons.
        let mut recolor = |value: &Value| {
            let glows = value["transfer_function"]["points"][2]["emission"] != 0;
            let (point, least) = if glows { (0, 0.9) } else { (1, 0.0) };
            with_point(value, point, "albedo", json!([least + (1.0 - least) * u(), 0.6 + 0.4 * u(), 0.5]))
        };
        let others = [
            with_point(&value, 1, "opacity", 0.35),
            with_point(&value, 1, "surface", 0.9),
            with_point(&value, 2, "emission", json!([0.2, 0.3, 0.1])),
            json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": 0.4 } } }),
            json!({ "medium": { "gradient_factor": 2.5 } }),
            json!({ "medium": { "density": 1.7 } }),
            json!({ "camera": { "auto": { "azimuth": 61 } } }),
            json!({ "clip": [{ "type": "plane", "point": [0.2, 0, 0], "normal": [1, 0.3, 0] }] }),
            json!({ "film": { "size": [37, 35] } }),
            json!({ "lights": [{ "type": "directional", "name": "sun", "direction": [1, 1, -1], "irradiance": [3, 2, 3] }] }),
            json!({ "render": { "photon": { "radius": 1.1 } } }),
            json!({ "render": { "max_scatter": 2 } }),
        ];
        for (i, other) in others.iter().enumerate() {
            let before = value.clone();
            for step in ["recoloured", "and again", "undone"] {
                value = if step == "undone" { before.clone() } else { apply(&value, &recolor(&value)) };
                live.set_scene(scene(&value));
                let name = format!("round {round}, {step} before edit {i}");
                assert_as_from_nothing(&mut live, &value, &name);
                assert!(computed(&live) == 0.0, "{name}: {}", computed(&live));
            }
            // With what was recoloured, and without a picture in between.
            let both = apply(&recolor(&value), other);
            for (patch, name) in
                [(other, "edit"), (&recolor(&value), "recoloured after edit"), (&both, "both of edit")]
            {
                value = apply(&value, patch);
                live.set_scene(scene(&value));
                assert_as_from_nothing(&mut live, &value, &format!("round {round}, {name} {i}"));
            }
        }
    }
}

/// Where a surface is glossy, or memory does not suffice, segments are marched as before.
#[test]
fn what_cannot_be_summed_is_marched() {
    let mut value = single(json!({ "photons": 6000, "segments": 9 }));
    value["transfer_function"]["points"][2]["emission"] = 0.into();
    let mut glossy = value.clone();
    glossy["medium"]["brdf"] = json!({ "type": "ashikhmin-shirley" });
    for (mut value, bytes, name) in [
        (glossy, PLENTY, "glossy"),
        (value.clone(), 0, "no memory"),
        (value.clone(), 4000, "little memory"),
        (value, 60_000, "not enough memory"),
    ] {
        let mut live = keeping(&value, bytes);
        refined(&mut live, 1);
        for red in [0.1, 0.7, 0.4] {
            for key in ["albedo", "opacity"] {
                let number = if key == "albedo" { json!([red, 0.5, 0.2]) } else { red.into() };
                value = apply(&value, &with_point(&value, 1, key, number));
                live.set_scene(scene(&value));
                assert_as_from_nothing(&mut live, &value, name);
                assert!(marched(&live) > 0, "{name}");
                let kept = live.report().kept.into_iter().find(|kept| kept.name == "gathers");
                let tables = 17 * 9 * 40 * 33;
                assert!(kept.is_some_and(|kept| kept.bytes <= bytes + tables), "{name}: {kept:?}");
            }
        }
    }
}

/// With several scatterings, few photons may change with a colour; only what is near them is gathered again.
#[test]
fn photons_that_change_with_the_colour_are_gathered_again() {
    let mut value = base("photon");
    value["film"]["size"] = json!([48, 40]);
    value["render"]["max_scatter"] = 2.into();
    value["transfer_function"]["points"][0]["value"] = 0.3.into();
    value["transfer_function"]["points"][2]["emission"] = 0.into();
    value["render"]["photon"] = json!({ "photons": 2000, "radius": 0.3, "segments": 20 });
    let [mut keeps, mut forgets] = [PLENTY, 0].map(|bytes| keeping(&value, bytes));
    for live in [&mut keeps, &mut forgets] {
        refined(live, 1);
    }
    for albedo in [0.9, 0.899, 0.9, 0.895] {
        value = apply(&value, &with_point(&value, 2, "albedo", albedo));
        for live in [&mut keeps, &mut forgets] {
            live.set_scene(scene(&value));
        }
        assert_as_from_nothing(&mut keeps, &value, "keeps");
        assert_as_from_nothing(&mut forgets, &value, "forgets");
        let [some, more] = [&keeps, &forgets].map(computed);
        assert!(0.0 < some && some < more, "{some} and {more} of the segments");
    }
}

/// What only moves photons, or changes their flux, marches nothing where estimates are of points.
#[test]
fn lights_are_gathered_again_without_a_march() {
    let mut random = SplitMix::new(71);
    for round in 0..18 {
        let estimate = ["point", "point", "beam", "nearest"][round % 4];
        let mut value = single(json!({
            "photons": 4000, "segments": 1 + round, "nearest": 8, "estimate": estimate,
            "spatial": (["cells", "axes"][round / 4 % 2]),
        }));
        value["render"]["max_scatter"] = (1 + round / 2 % 3).into();
        if round % 3 == 0 {
            value["transfer_function"]["points"][2]["emission"] = 0.into();
        }
        if round % 2 == 0 {
            value["medium"]["phase"] = json!({ "type": "henyey-greenstein", "g": 0.4 });
        }
        let mut live = keeping(&value, PLENTY);
        refined(&mut live, 1);
        let mut u = || random.uniform();
        for i in 0..14 {
            let mut lights = value["lights"].clone();
            match i % 7 {
                0 => lights[0]["direction"] = json!([1.0, u() - 1.0, -u()]),
                1 => lights[2]["radiance"] = json!([u(), 5, 5]),
                2 => lights[0]["name"] = ["lamp", "sun"][i / 7].into(),
                3 => lights.as_array_mut().expect("a list").push(json!({
                    "type": "point", "position": [9, 9, u()], "intensity": [60, 50, 40],
                })),
                4 => drop(lights.as_array_mut().expect("a list").pop()),
                // Later edits gather photons where there were none.
                5 => lights[0]["irradiance"] = json!([0, 0, 0]),
                _ => lights[0]["irradiance"] = json!([1, 2, 3]),
            }
            value["lights"] = lights;
            live.set_scene(scene(&value));
            assert_as_from_nothing(&mut live, &value, &format!("round {round}, lights {i}"));
            assert!(computed(&live) > 0.0, "round {round}, lights {i}");
            assert_eq!(marched(&live) == 0, estimate == "point", "round {round}, lights {i}");
            // Colours, opacities and the camera in between.
            let patch = match (i + round) % 5 {
                0 => with_point(&value, 1, "albedo", json!([u(), u(), 0.5])),
                1 => with_point(&value, 2, "albedo", json!([u(), u(), 0.5])),
                2 => with_point(&value, 1, "opacity", u()),
                3 => json!({ "camera": { "auto": { "azimuth": 90.0 * u() } } }),
                _ => json!({ "film": { "size": [36 + i, 31] } }),
            };
            value = apply(&value, &patch);
            live.set_scene(scene(&value));
            if i % 3 > 0 {
                assert_as_from_nothing(&mut live, &value, &format!("round {round}, after lights {i}"));
            } else {
                // Its light is gathered with that of the next.
                live.refine(&Budget { pixel_samples: Some(100), ..Budget::samples(1) });
                refined(&mut live, 1);
            }
        }
    }
}

/// Stopped again and again, and with other edits in between.
#[test]
fn colours_that_are_stopped_in_the_midst() {
    let mut random = SplitMix::new(5);
    let mut stopped = 0;
    for round in 0..60 {
        let mut value = single(json!({ "photons": 3000, "segments": 12 }));
        value["render"]["max_scatter"] = (1 + round % 2).into();
        let mut live = keeping(&value, [PLENTY, 30_000][round % 3 / 2]);
        refined(&mut live, 1);
        for _ in 0..8 {
            let mut u = || random.uniform();
            let which = cast::index(3.0 * cast::single(u()));
            let patch = match cast::index(8.0 * cast::single(u())) {
                0 => with_point(&value, which, "opacity", u()),
                1 => with_point(&value, which, "surface", u()),
                3 => {
                    let mut lights = value["lights"].clone();
                    lights[2]["position"][1] = u().into();
                    json!({ "lights": lights })
                }
                2 => json!({ "camera": { "auto": { "azimuth": 90.0 * u() } } }),
                _ => with_point(&value, which, "albedo", json!([u(), u(), u()])),
            };
            value = apply(&value, &patch);
            live.set_scene(scene(&value));
            for _ in 0..cast::index(4.0 * cast::single(u())) {
                let deadline = Some(Instant::now() + Duration::from_secs_f64(4e-4 * u()));
                live.refine(&Budget { deadline, ..Budget::samples(1) });
            }
            stopped += usize::from((0.0..1.0).contains(&live.progress().coverage));
            if u() < 0.3 {
                assert_as_from_nothing(&mut live, &value, &format!("round {round}"));
            }
        }
        assert_as_from_nothing(&mut live, &value, &format!("round {round}, at the end"));
    }
    assert!(stopped > 100, "{stopped}");
}
