//! Speed and error of gathering photons along view rays: the estimates against each other and against scalar code.

use super::photon_scenes;
use super::scenes::Bench;
use super::timing::{Effort, median};
use super::{Row, edit};
use crate::Failure;
use serde_json::{Value, json};
use tyndall::session::Session;
use tyndall::simd::Level;
use tyndall_live::document;

const TABLE: &str = "gathering, default settings, one scattering; two threads";

/// The least speed at equal error, over scalar gathers at every step.
const OVER_SCALAR: f64 = 2.5;

/// A thin medium between walls, and layers with empty space between.
pub fn estimates(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    let scenes =
        [("Cornell box", photon_scenes::cornell_box(effort)?), ("CT-like", photon_scenes::ct(effort)?)];
    let mut rows = Vec::new();
    for (name, bench) in &scenes {
        rows.extend(scene(name, bench, effort, level)?);
    }
    Ok(rows)
}

fn scene(name: &str, bench: &Bench, effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    let side = effort.pick(256, 64);
    let small = json!({ "film": { "size": [side, side] }, "render": { "max_scatter": 1 } });
    let with = |render: Value| bench.scene(&document::apply(&small, &json!({ "render": render })));
    let paths = with(json!({ "integrator": "path" }))?;
    effort.show(&format!("{name}, what is true"));
    let truth = picture(&bench.render(&paths, level, effort.pick(256, 16)));
    let photons = effort.pick(1 << 20, 1 << 14);
    let least = Level::available().first().copied().unwrap_or(level);
    // The first is the rival of the others: gathers at every step, without vector instructions.
    let ways = [
        ("point", least, 0.0),
        ("point", least, 1.5),
        ("point", level, 1.5),
        ("beam", level, 1.5),
        ("nearest", level, 1.5),
    ];
    let scene_of = |(estimate, _, spacing): &(&str, Level, f64)| {
        with(json!({ "photon": { "estimate": estimate, "gather_spacing": spacing, "photons": photons } }))
    };
    let scenes = ways.iter().map(scene_of).collect::<Result<Vec<_>, _>>()?;
    let mut times = ways.map(|_| Vec::new());
    let mut errors = ways.map(|_| 0.0);
    for round in 0..effort.rounds {
        if round > 0 && !effort.has_time() {
            break;
        }
        for (i, scene) in scenes.iter().enumerate() {
            effort.show(&format!("{name}, round {}", round + 1));
            let session = bench.render(scene, ways[i].1, 1);
            times[i].push(edit::seconds(&session, "segments"));
            errors[i] = error(&picture(&session), &truth);
        }
    }
    let seconds = times.map(median);
    let cost = |i: usize| seconds[i] * errors[i].powi(2);
    let mut rows = Vec::new();
    for (i, (estimate, level, spacing)) in ways.iter().enumerate() {
        let row = format!("{name}: {estimate}, spacing {spacing}, {}", level.name());
        rows.push(Row::new(TABLE, row.clone(), "segments", "s", seconds[i]));
        rows.push(Row::new(TABLE, row.clone(), "error against path", "of mean", errors[i]));
        if i > 0 {
            let ratio = Row::new(TABLE, row, "speed at equal error", "ratio", cost(0) / cost(i));
            rows.push(if i == 2 { ratio.at_least(OVER_SCALAR) } else { ratio });
        }
    }
    Ok(rows)
}

fn picture(session: &Session) -> Vec<f32> {
    session.image().rgba.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
}

/// Root of the mean squared difference, over the mean of the truth.
fn error(found: &[f32], truth: &[f32]) -> f64 {
    let squares = found.iter().zip(truth).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let mean = truth.iter().copied().map(f64::from).sum::<f64>() / truth.len() as f64;
    (squares / truth.len() as f64).sqrt() / mean
}
