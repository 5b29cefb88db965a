//! What edits of path-traced pictures cost when samples survive them \[Jonsson12, sec. 7\].

use super::Row;
use super::edit::{bits, check};
use super::historygrams::{recoloured, tissue};
use super::photon_scenes::{self, COLD, Tissue};
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

/// What an edit took, in seconds.
struct Cost {
    /// From nothing, without histories and with them.
    scratch: [f64; 2],
    /// To one sample of each pixel, and to all.
    edit: [f64; 2],
    /// Of the samples the share that was taken again.
    share: f64,
    /// Bytes of a sample.
    bytes: f64,
}

/// Renders a scene from nothing, keeping its samples in so many bytes.
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
    let (mut scratch, mut edit) = ([(); 2].map(|()| Vec::new()), [(); 2].map(|()| Vec::new()));
    let mut share = 0.0;
    for round in 0..effort.rounds.min(3) {
        if round > 0 {
            live.set_scene(bench.scene(before)?);
            live.refine(&Budget::samples(SAMPLES));
        }
        let begun = Instant::now();
        let fresh = render(bench, &after, level, 0)?;
        scratch[0].push(begun.elapsed().as_secs_f64());
        let begun = Instant::now();
        drop(render(bench, &after, level, BYTES)?);
        scratch[1].push(begun.elapsed().as_secs_f64());
        let begun = Instant::now();
        live.set_scene(bench.scene(&after)?);
        for (samples, times) in [1, SAMPLES].into_iter().zip(&mut edit) {
            live.refine(&Budget::samples(samples));
            times.push(begun.elapsed().as_secs_f64());
        }
        share = live.recomputed()[0].share;
        check(&bits(&live), &bits(&fresh))?;
    }
    let [samples] = live.report().kept[..] else { return Err(Failure::input("nothing is kept")) };
    let bytes = samples.bytes as f64 / samples.count as f64;
    Ok(Cost { scratch: scratch.map(median), edit: edit.map(median), share, bytes })
}

/// Edits of colour, of opacity, and of all that scatters.
pub fn edits(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "path with histories, 16 samples a pixel; two threads";
    let (room, ct) = (photon_scenes::cornell_box(effort)?, photon_scenes::ct(effort)?);
    let usual = Tissue::USUAL;
    let vessels = tissue(&Tissue { vessels: COLD, ..usual });
    let bone = tissue(&Tissue { bone: (COLD, usual.bone.1), ..usual });
    let clear = tissue(&Tissue { bone: (usual.bone.0, 0.0), ..usual });
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
        let before = json!({ "render": { "integrator": "path", "max_scatter": scatterings } });
        let Cost { scratch: [without, with], edit: [first, whole], share, bytes } =
            cost(effort, level, bench, &before, &patch).map_err(|e| e.within(name))?;
        let row = |quantity, unit, ours| Row::new(TABLE, name, quantity, unit, ours);
        rows.extend([
            row("from nothing, without histories", "s", without),
            row("set-up", "share", with / without - 1.0).at_most(0.26),
            row("bytes of a sample", "bytes", bytes),
            row("samples taken again", "share", share),
            row("edit, to the first sample", "s", first),
            row("edit, to all samples", "s", whole),
            row("speed-up", "ratio", without / whole),
            row("speed-up that the share allows", "ratio", 1.0 / share),
        ]);
    }
    Ok(rows)
}
