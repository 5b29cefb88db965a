//! The cost of edits of path-traced pictures when samples survive them \[Jonsson12, sec. 7\].

use super::Row;
use super::edit::{bits, check};
use super::historygrams::{recoloured, tissue};
use super::photon_scenes::{self, COLD, Layer, Tissue};
use super::scenes::Bench;
use super::timing::{Effort, median};
use crate::Failure;
use serde_json::{Value, json};
use std::time::Instant;
use tyndall::integrator::Resources;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document;

/// Samples of each pixel.
const SAMPLES: u32 = 16;

/// What an edit cost; times are medians, in seconds.
struct Cost {
    /// A render of the edited scene from nothing that keeps no samples.
    without_histories: f64,
    /// One that keeps them.
    with_histories: f64,
    /// The edit, to one sample in each pixel.
    edit_to_one: f64,
    /// The edit, to all samples.
    edit_to_all: f64,
    /// The share of the samples that were taken again.
    share: f64,
    /// Bytes of a kept sample.
    bytes: f64,
}

/// Renders a scene from nothing and keeps its samples in at most so many bytes.
fn render(bench: &Bench, patch: &Value, level: Level, bytes: usize) -> Result<Session, Failure> {
    let resources = Resources { level, edit_memory: bytes };
    let mut session = Session::with_resources(bench.scene(patch)?, bench.threads().clone(), resources);
    session.refine(&Budget::samples(SAMPLES));
    Ok(session)
}

fn cost(
    effort: &Effort,
    level: Level,
    bench: &Bench,
    before: &Value,
    patch: &Value,
) -> Result<Cost, Failure> {
    /// Enough for all samples.
    const BYTES: usize = 1 << 30;
    let after = document::apply(before, patch);
    let mut live = render(bench, before, level, BYTES)?;
    let (mut without, mut with, mut to_one, mut to_all) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut share = 0.0;
    for round in 0..effort.rounds.min(3) {
        if round > 0 {
            if !effort.has_time() {
                break;
            }
            live.set_scene(bench.scene(before)?);
            live.refine(&Budget::samples(SAMPLES));
        }
        let begun = Instant::now();
        let fresh = render(bench, &after, level, 0)?;
        without.push(begun.elapsed().as_secs_f64());
        let begun = Instant::now();
        drop(render(bench, &after, level, BYTES)?);
        with.push(begun.elapsed().as_secs_f64());
        let begun = Instant::now();
        live.set_scene(bench.scene(&after)?);
        for (samples, times) in [(1, &mut to_one), (SAMPLES, &mut to_all)] {
            live.refine(&Budget::samples(samples));
            times.push(begun.elapsed().as_secs_f64());
        }
        share = live.recomputed()[0].share;
        check(&bits(&live), &bits(&fresh))?;
    }
    let [samples] = live.report().kept[..] else { return Err(Failure::input("nothing is kept")) };
    let bytes = samples.bytes as f64 / samples.count as f64;
    Ok(Cost {
        without_histories: median(without),
        with_histories: median(with),
        edit_to_one: median(to_one),
        edit_to_all: median(to_all),
        share,
        bytes,
    })
}

/// Edits of colour, of opacity, and of all that scatters.
pub fn edits(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "path with histories, 16 samples a pixel; two threads";
    let (room, ct) = (photon_scenes::cornell_box(effort)?, photon_scenes::ct(effort)?);
    let usual = Tissue::USUAL;
    let vessels = tissue(&Tissue { vessels: COLD, ..usual });
    let bone = tissue(&Tissue { bone: Layer { albedo: COLD, ..usual.bone }, ..usual });
    let clear = tissue(&Tissue { bone: Layer { opacity: 0.0, ..usual.bone }, ..usual });
    let all = json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": 0.3 } } });
    let cases = [
        ("Cornell box, sphere recoloured, 1", &room, recoloured(), 1),
        ("Cornell box, sphere recoloured, 8", &room, recoloured(), 8),
        ("CT-like, vessels recoloured, 8", &ct, vessels, 8),
        ("CT-like, bone recoloured, 8", &ct, bone, 8),
        ("CT-like, bone made clear, 8", &ct, clear, 8),
        ("CT-like, phase function, 8", &ct, all, 8),
    ];
    let mut rows = Vec::new();
    for (name, bench, patch, scatterings) in cases {
        effort.show(name);
        let before = json!({ "render": { "integrator": "path", "max_scatter": scatterings } });
        let cost = cost(effort, level, bench, &before, &patch).map_err(|e| e.within(name))?;
        let Cost { without_histories: without, share, .. } = cost;
        let row = |quantity, unit, ours| Row::new(TABLE, name, quantity, unit, ours);
        rows.extend([
            row("from nothing, without histories", "s", without),
            row("set-up", "share", cost.with_histories / without - 1.0).at_most(0.26),
            row("bytes of a sample", "bytes", cost.bytes),
            row("samples taken again", "share", share),
            row("edit, to the first sample", "s", cost.edit_to_one),
            row("edit, to all samples", "s", cost.edit_to_all),
            row("speed-up", "ratio", without / cost.edit_to_all),
            row("speed-up that the share allows", "ratio", 1.0 / share),
        ]);
    }
    Ok(rows)
}
