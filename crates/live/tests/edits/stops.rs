//! Edits that come at any moment: while kept light is still being asked about earlier ones, while light is prepared, while samples
//! are taken.

use super::{base, refined, scene};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tyndall::film::{Tone, Viewer};
use tyndall::integrator::{ItemChanges, METHODS, MethodEntry, Resources};
use tyndall::math::cast;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document::apply;
use tyndall_testing::SplitMix;

const ROUNDS: u64 = 25;
const EDITS: usize = 6;

fn start(value: &Value, threads: &Arc<rayon::ThreadPool>) -> Session {
    let resources = Resources { level: Level::best(), edit_memory: 1 << 20 };
    Session::with_resources(scene(value), threads.clone(), resources)
}

/// A document for the draft of a method, with many empty cells.
fn draft(method: &MethodEntry) -> Value {
    let mut value = base(method.name);
    value["transfer_function"]["points"][0]["value"] = 0.3.into();
    value["render"][method.table()] =
        method.write(&method.draft(&method.default_settings())).expect("settings");
    value
}

/// An edit of a kind that leaves some light valid, or none.
fn edit(random: &mut SplitMix, value: &Value) -> Value {
    let mut u = || cast::single(random.uniform());
    let mut points = value["transfer_function"]["points"].clone();
    let mut lights = value["lights"].as_array().cloned().expect("a list");
    let (which, point, light) =
        (cast::index(u() * 11.0), 1 + cast::index(u() * 2.0), cast::index(u() * lights.len() as f32));
    let of_points = |points: Value| json!({ "transfer_function": { "points": points } });
    match which {
        0 => {
            points[point]["opacity"] = (0.2 + 0.8 * u()).into();
            of_points(points)
        }
        1 => {
            points[point]["albedo"] = json!([u(), u(), 0.5]);
            of_points(points)
        }
        2 => {
            points[2]["emission"] = json!([if u() < 0.5 { 0.0 } else { u() }, 0, 0]);
            of_points(points)
        }
        3 | 4 => {
            let key = if lights[light]["type"] == "directional" { "irradiance" } else { "radiance" };
            lights[light][key] = json!([1.0 + u(), 1, 1]);
            json!({ "lights": lights })
        }
        5 => {
            let removed = lights.remove(light);
            if lights.is_empty() {
                lights.push(removed);
            }
            json!({ "lights": lights })
        }
        6 => {
            lights.push(json!({
                "type": "sphere", "position": [15.0 * u(), 20, 0], "radius": 1.0 + u(), "radiance": [9, 9, 5],
            }));
            lights.truncate(5);
            json!({ "lights": lights })
        }
        7 => {
            lights[light]["name"] = ["sun", "bulb", "lamp", "spot"][cast::index(u() * 4.0)].into();
            json!({ "lights": lights })
        }
        8 => json!({ "medium": { "density": 0.5 + u() } }),
        9 if u() < 0.5 => json!({ "camera": { "auto": { "azimuth": 90.0 * u() } } }),
        9 => json!({ "film": { "size": [16 + cast::index(u() * 9.0), 17] } }),
        _ => json!({ "render": { "max_scatter": cast::index(u() * 5.0) } }),
    }
}

/// What follows an edit: nothing, a refinement that a deadline, a cancellation or a number of samples ends at once or soon, or a whole
/// one; and perhaps a look.
fn follow(random: &mut SplitMix, session: &mut Session, view: &mut View) {
    refine_some(random, session);
    if random.bits().is_multiple_of(2) {
        view.look(session);
    }
}

/// What a viewer sees.
#[derive(Default)]
struct View {
    viewer: Viewer,
    picture: Vec<[u8; 3]>,
}

impl View {
    fn look(&mut self, session: &Session) {
        session.look(&mut self.viewer, Tone::default(), &mut self.picture);
    }
}

fn refine_some(random: &mut SplitMix, session: &mut Session) {
    let mut budget = Budget::samples(2);
    match random.bits() % 10 {
        8 | 9 => budget.pixel_samples = Some(random.bits() % 700),
        0 | 1 => return,
        2..5 => budget.deadline = Some(Instant::now() + Duration::from_micros(random.bits() % 3000)),
        5 | 6 => {
            let (cancel, wait) = (budget.cancel.clone(), Duration::from_micros(random.bits() % 2000));
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    std::thread::sleep(wait);
                    cancel.store(true, std::sync::atomic::Ordering::Relaxed);
                });
                session.refine(&budget);
            });
            return;
        }
        _ => {}
    }
    session.refine(&budget);
}

/// However edits and stops interleave, the picture and what is kept are those of a new session.
#[test]
fn edits_at_any_moment_lose_nothing_and_leave_nothing() {
    let mut partial = 0;
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new);
        let pool = pool.expect("threads");
        for method in METHODS {
            let mut random = SplitMix::new(31 + threads as u64);
            let mut unsettled = 0;
            for round in 0..ROUNDS {
                let mut value = draft(method);
                let mut live = start(&value, &pool);
                let (mut edits, mut first, mut view) = (Vec::new(), true, View::default());
                while edits.len() < EDITS {
                    if !first || round % 2 == 0 {
                        follow(&mut random, &mut live, &mut view);
                    } else {
                        refined(&mut live, 2);
                    }
                    first = false;
                    let patch = edit(&mut random, &value);
                    value = apply(&value, &patch);
                    let before = live.progress();
                    unsettled += usize::from(before.settling);
                    partial += usize::from(before.coverage > 0.0 && before.samples < 2);
                    live.set_scene(scene(&value));
                    edits.push(patch);
                    let progress = live.progress();
                    assert!(!progress.settling || progress.coverage == 0.0, "{progress:?}");
                    assert!(progress.settling || progress == before, "{progress:?} after {before:?}");
                }
                follow(&mut random, &mut live, &mut view);
                let found = refined(&mut live, 2);
                assert!(!live.progress().settling);
                let mut fresh = start(&value, &pool);
                let at = || format!("{}, {threads} threads, round {round}, {edits:?}", method.name);
                assert!(found == refined(&mut fresh, 2), "{}", at());
                let mut seen = View::default();
                seen.look(&fresh);
                view.look(&live);
                assert!(view.picture == seen.picture, "{}: a look", at());
                if let (Some(kept), Some(from_nothing)) = (live.kept_items(), fresh.kept_items()) {
                    let ItemChanges { differing, .. } = kept.compare(&*from_nothing);
                    assert_eq!(differing, 0, "{}", at());
                }
            }
            assert!(unsettled > 10, "{}: {unsettled}", method.name);
        }
    }
    assert!(partial > 20, "{partial} edits of a picture half done");
}

/// Stops while photons of a light with another colour are being marked, chunk by chunk; the segments beside each must be computed
/// again, and others not.
#[test]
fn photons_whose_marking_is_interrupted() {
    let mut value = base("photon");
    value["film"]["size"] = json!([48, 40]);
    value["render"]["max_scatter"] = 1.into();
    value["render"]["photon"] = json!({ "photons": 120_000, "segments": 20, "radius": 0.3 });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().map(Arc::new).expect("threads");
    let mut live = start(&value, &pool);
    refined(&mut live, 1);
    value["lights"][2]["radiance"] = json!([5, 9, 9]);
    live.set_scene(scene(&value));
    let mut slices = 0;
    while live.progress().coverage == 0.0 {
        let deadline = Some(Instant::now() + Duration::from_micros(50));
        live.refine(&Budget { deadline, ..Budget::samples(1) });
        slices += 1;
        assert!(slices < 100_000, "no progress");
    }
    let found = refined(&mut live, 1);
    let [paths, segments] = [0, 1].map(|i| live.recomputed()[i].share);
    assert!(slices > 3 && paths == 0.0 && segments > 0.0 && segments < 0.9, "{slices}: {segments}");
    assert!(found == refined(&mut start(&value, &pool), 1));
}
