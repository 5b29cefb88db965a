//! Marching, flights, paths, threads and lateness.

use super::Row;
use super::scenes::{Bench, cloud, ct};
use super::timing::{Effort, median};
use crate::Failure;
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tyndall::integrator::{METHODS, Resources};
use tyndall::math::{Ray, Vec3};
use tyndall::medium::{MajorantGrid, Medium};
use tyndall::sampling::Stream;
use tyndall::scene::Scene;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document;

/// The number of march steps of all primary rays of a picture.
fn steps(scene: &Scene, step: f32) -> f64 {
    let [width, height] = scene.size;
    let step = step * scene.medium.volume().grid().voxel_size();
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            let ray = scene.camera.ray(scene.size, [x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
            sum += f64::from(scene.medium.track(&ray, f32::INFINITY).length() / step);
        }
    }
    sum
}

/// Primary rays of `raymarch`, one thread.
pub fn sampling(effort: &Effort, _: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "primary rays of raymarch: 256^3 u8, step half a voxel, one thread";
    let bench = Bench::new(ct(effort.pick(256, 64)), 1)?;
    let side = effort.pick(512, 128);
    let flat = |cell: u32, density: f64| {
        bench.scene(&json!({
            "film": { "size": [side, side] }, "medium": { "density": density, "majorant_cell": cell },
            "render": { "integrator": "raymarch", "max_scatter": 0 },
        }))
    };
    // The medium is so thin that no ray ends early; a single cell around the volume is never empty.
    let (all, skipping) = (flat(0, 1e-4)?, flat(8, 1e-4)?);
    let samples = steps(&all, 0.5);
    let cells = skipping.medium.majorants().opacities();
    let full = cells.iter().filter(|o| o[1] > 0.0).count() as f64 / cells.len() as f64;
    let levels = Level::available();
    let mut ways: Vec<Box<dyn FnMut() + '_>> = Vec::new();
    for &level in &levels {
        for scene in [&all, &skipping] {
            let bench = &bench;
            ways.push(Box::new(move || drop(bench.render(scene, level, 1))));
        }
    }
    let mut turns: Vec<&mut dyn FnMut()> =
        ways.iter_mut().map(|way| &mut **way as &mut dyn FnMut()).collect();
    let seconds = effort.by_turns(&mut turns);
    let mut rows = vec![Row::new(TABLE, "cells of 8^3", "with matter", "share", full)];
    for (i, level) in levels.iter().enumerate() {
        let (plain, skipped) = (seconds[2 * i], seconds[2 * i + 1]);
        let name = level.name();
        let per_sample = Row::new(TABLE, name, "no skipping, per sample", "ns", plain / samples * 1e9);
        rows.push(if i > 0 { per_sample.at_most(4.0) } else { per_sample });
        rows.push(Row::new(TABLE, name, "skipping, per frame", "ms", skipped * 1e3));
        rows.push(Row::new(TABLE, name, "skipping over not", "ratio", plain / skipped).at_least(3.0));
        if i > 0 {
            rows.push(
                Row::new(TABLE, name, "over scalar, no skipping", "ratio", seconds[0] / plain).at_least(4.0),
            );
            rows.push(
                Row::new(TABLE, name, "over scalar, skipping", "ratio", seconds[1] / skipped).at_least(2.5),
            );
        }
    }
    Ok(rows)
}

/// Sum of the transmittances of rays that start around the medium and pass near its centre.
fn transmittances(medium: &Medium, level: Level, rays: u32) -> f32 {
    let bounds = medium.volume().grid().world_bounds();
    let (middle, size) = (bounds.center(), bounds.size());
    let mut sum = 0.0;
    for i in 0..rays {
        let mut stream = Stream::new(1, [i, 0, 0]);
        let mut point = || Vec3::new(stream.uniform(), stream.uniform(), stream.uniform()) - 0.5;
        let (from, to) = (middle + point() * size * 2.0, middle + point() * size * 0.5);
        let track = medium.track(&Ray::new(from, (to - from).normalize()), f32::INFINITY);
        sum += medium.transmittance(level, &track, &mut stream);
    }
    sum
}

/// Ratio tracking with one majorant and with local ones.
pub fn flight(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "transmittance by ratio tracking, one thread";
    let mut rows = Vec::new();
    for (name, value, floor) in [("CT-like", ct(256), 5.0), ("cloud", cloud(128), 1.6)] {
        let bench = Bench::new(value, 1)?;
        let scene = |cell: u32| bench.scene(&json!({ "medium": { "majorant_cell": cell } }));
        let (global, local) = (scene(0)?, scene(8)?);
        let rays = effort.pick(100_000, 5_000);
        let run = |scene: &Scene| {
            std::hint::black_box(transmittances(&scene.medium, level, rays));
        };
        let seconds = effort.by_turns(&mut [&mut || run(&global), &mut || run(&local)]);
        rows.push(Row::new(TABLE, name, "local majorants", "M rays/s", f64::from(rays) / seconds[1] * 1e-6));
        rows.push(
            Row::new(TABLE, name, "local over global", "ratio", seconds[0] / seconds[1]).at_least(floor),
        );
    }
    Ok(rows)
}

/// Path tracing with one majorant and with local ones, two scatterings.
pub fn paths(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "path with two scatterings, one thread";
    let mut rows = Vec::new();
    for (name, value, floor) in [("CT-like", ct(256), 2.2), ("cloud", cloud(128), 1.2)] {
        let bench = Bench::new(value, 1)?;
        let side = effort.pick(256, 64);
        let scene = |cell: u32| {
            let render = json!({ "integrator": "path", "max_scatter": 2 });
            let medium = json!({ "majorant_cell": cell });
            bench.scene(&json!({ "film": { "size": [side, side] }, "medium": medium, "render": render }))
        };
        let (global, local) = (scene(0)?, scene(8)?);
        let run = |scene: &Scene| drop(bench.render(scene, level, 2));
        let seconds = effort.by_turns(&mut [&mut || run(&global), &mut || run(&local)]);
        let paths = 2.0 * f64::from(side).powi(2);
        rows.push(Row::new(TABLE, name, "local majorants", "M paths/s", paths / seconds[1] * 1e-6));
        rows.push(
            Row::new(TABLE, name, "local over global", "ratio", seconds[0] / seconds[1]).at_least(floor),
        );
    }
    Ok(rows)
}

/// Two threads against one.
pub fn threads(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "two threads over one";
    let mut rows = Vec::new();
    for integrator in ["raymarch", "path"] {
        let benches = [Bench::new(ct(256), 1)?, Bench::new(ct(256), 2)?];
        let side = effort.pick(256, 64);
        let patch = json!({
            "film": { "size": [side, side] }, "lights": [ct(256)["lights"][0]],
            "render": { "integrator": integrator, "max_scatter": effort.pick(8, 1) },
        });
        let scenes = [benches[0].scene(&patch)?, benches[1].scene(&patch)?];
        let run = |i: usize| drop(benches[i].render(&scenes[i], level, 4));
        let seconds = effort.by_turns(&mut [&mut || run(0), &mut || run(1)]);
        rows.push(Row::new(TABLE, integrator, "speed-up", "ratio", seconds[0] / seconds[1]).at_least(1.6));
    }
    Ok(rows)
}

/// How late a session reacts, in milliseconds.
#[derive(Default)]
struct Lateness {
    /// By how much each slice of work overran its deadline.
    stops: Vec<f64>,
    /// Time to accept each edited scene.
    edits: Vec<f64>,
}

impl Lateness {
    /// Refines in slices of up to 20 ms, so that deadlines fall in all stages of the work.
    fn refine(&mut self, session: &mut Session, samples: u32, slices: u32, random: &mut Stream) {
        for _ in 0..slices {
            if session.film().samples() >= samples {
                return;
            }
            let deadline = Instant::now() + Duration::from_secs_f32(0.02 * random.uniform());
            session.refine(&Budget { deadline: Some(deadline), ..Budget::samples(samples) });
            if session.film().samples() < samples {
                self.stops.push(deadline.elapsed().as_secs_f64() * 1e3);
            }
        }
    }

    fn edit(&mut self, session: &mut Session, scene: Scene) {
        let begun = Instant::now();
        session.set_scene(scene);
        self.edits.push(begun.elapsed().as_secs_f64() * 1e3);
    }
}

/// Edits of every kind, each of a document that earlier ones have changed.
fn edits_of_every_kind(voxels: u32) -> [Value; 9] {
    let mut points = ct(voxels)["transfer_function"]["points"].clone();
    points[1]["opacity"] = 0.8.into();
    let opacity = json!({ "transfer_function": { "points": points } });
    points[1]["albedo"] = json!([0.9, 0.5, 0.5]);
    let sun =
        |irradiance: f64| json!({ "type": "directional", "direction": [1, -1, 0], "irradiance": irradiance });
    let lamp = json!({ "type": "environment", "radiance": [0.3, 0.3, 0.35] });
    [
        opacity,
        json!({ "transfer_function": { "points": points } }),
        json!({ "medium": { "density": 30.0 / f64::from(voxels) } }),
        json!({ "lights": [sun(3.0), lamp] }),
        json!({ "lights": [sun(2.0), lamp] }),
        json!({ "lights": [sun(2.0)] }),
        json!({ "camera": { "auto": { "azimuth": 70 } } }),
        json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": 0.3 } } }),
        json!({ "render": { "max_scatter": 7 } }),
    ]
}

/// How late each method stops, through all stages of its work, and how long it takes to accept an edit; and how long majorants
/// take after an edit of the transfer function.
pub fn latency(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "latency, 256^3 voxels, 512 x 512 pixels, 8 scatterings, two threads";
    const MOST_MS: f64 = 5.0;
    let voxels = effort.pick(256, 64);
    let bench = Bench::new(ct(voxels), 2)?;
    let (samples, slices) = effort.pick((3, 200), (100_000, 2));
    let mut rows = Vec::new();
    for integrator in METHODS.iter().map(|method| method.name) {
        effort.show(integrator);
        let mut random = Stream::new(1, [0; 3]);
        let side = effort.pick(512, 32);
        let mut document = json!({ "film": { "size": [side, side] }, "render": { "integrator": integrator, "max_scatter": 8 } });
        let resources = Resources { level, edit_memory: 1 << 29 };
        let mut session =
            Session::with_resources(bench.scene(&document)?, bench.threads().clone(), resources);
        let mut late = Lateness::default();
        late.refine(&mut session, samples, slices, &mut random);
        for edit in edits_of_every_kind(voxels) {
            // Each edit comes twice: the first is undone and made again while the work for it is under way.
            let after = document::apply(&document, &edit);
            for (scene, slices) in [(&after, 4), (&document, 4), (&after, slices)] {
                late.edit(&mut session, bench.scene(scene)?);
                late.refine(&mut session, samples, slices, &mut random);
            }
            document = after;
        }
        for (what, times) in [("past the deadline", late.stops), ("to accept an edit", late.edits)] {
            let name = format!("{integrator}: {what}");
            let worst = times.iter().copied().fold(0.0, f64::max);
            rows.push(Row::new(TABLE, name.clone(), "median", "ms", median(times)).at_most(MOST_MS));
            rows.push(Row::new(TABLE, name, "worst", "ms", worst).at_most(MOST_MS));
        }
    }
    let scene = bench.scene(&json!({}))?;
    let (volume, transfer) = (scene.medium.volume(), scene.medium.transfer());
    let rebuild = || drop(bench.threads().install(|| MajorantGrid::new(volume, transfer, 8)));
    let seconds = effort.seconds(&mut { rebuild });
    rows.push(
        Row::new(TABLE, "majorants after a transfer-function edit", "256^3", "ms", seconds * 1e3)
            .at_most(33.0),
    );
    Ok(rows)
}
