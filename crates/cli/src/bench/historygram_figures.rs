//! The figures of \[Jonsson12, sec. 6.2\] as tables: edits against the number of photons and of segments; and what the default
//! settings come to.

use super::Row;
use super::edit::{Against, Cost, Edit};
use super::historygrams::{recoloured, settings, tissue};
use super::photon_scenes::{self, COLD, Tissue};
use super::scenes::Bench;
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use tyndall::simd::Level;

/// Seconds of patience for a point.
const PATIENCE: f64 = 2.0;

fn vessels() -> Value {
    tissue(&Tissue { vessels: COLD, ..Tissue::USUAL })
}

/// One point of a curve; the first of each is checked.
fn point(
    (bench, first): (&Bench, bool),
    (name, before, patch): (&str, Value, Value),
    effort: &Effort,
    level: Level,
) -> Result<Cost, Failure> {
    let against = if first { Against::Equal } else { Against::First };
    let edit = Edit { bench, before, patch, against, plain: false, patience: PATIENCE };
    edit.measure(effort, level).map_err(|e| e.within(name))
}

/// Speed-up of an edit by the number of light paths, for one scattering and two; `paper` says what it found where.
fn by_photons(
    (table, bench, patch, samples): (&'static str, &Bench, &Value, f64),
    paper: impl Fn(f64) -> Option<f64>,
    effort: &Effort,
    level: Level,
) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for scatterings in [1, 2] {
        for (i, &millions) in effort.pick(&[0.5, 1.0, 2.1, 4.2][..], &[2.1]).iter().enumerate() {
            let name = format!("{scatterings} scattering(s), {millions} M photons");
            let before = settings(effort, millions * 1e6, scatterings, 7, samples);
            let cost = point((bench, i == 0), (&name, before, patch.clone()), effort, level)?;
            rows.push(
                Row::new(table, name.clone(), "speed-up", "ratio", cost.speed_up()).beside(paper(millions)),
            );
            rows.push(Row::new(table, name.clone(), "photons recomputed", "share", cost.shares[0]));
            rows.push(Row::new(table, name.clone(), "segments recomputed", "share", cost.shares[1]));
            rows.push(Row::new(table, name, "edit", "s", cost.edit[2]));
        }
    }
    Ok(rows)
}

/// Figure 7: the Cornell box's sphere in another colour.
pub fn figure_7(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 7: Cornell box, sphere recoloured, 7 segments, 2 samples per voxel";
    let bench = photon_scenes::cornell_box(effort)?;
    by_photons((TABLE, &bench, &recoloured(), 2.0), |_| Some(15.0), effort, level)
}

/// Figure 8: the CT-like volume's vessels in another colour.
pub fn figure_8(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 8: CT-like, vessels recoloured, 7 segments, 4 samples per voxel";
    let bench = photon_scenes::ct(effort)?;
    // "When using more than 0.5 million photons."
    let paper = |millions: f64| (millions > 0.5).then_some(8.0);
    by_photons((TABLE, &bench, &vessels(), 4.0), paper, effort, level)
}

/// Figure 9: the same edits by the number of segments.
pub fn figure_9(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 9: time of an edit by segments per ray, 2.1 M photons, one scattering";
    let scenes = [
        ("Cornell box", photon_scenes::cornell_box(effort)?, recoloured(), 2.0),
        ("CT-like", photon_scenes::ct(effort)?, vessels(), 4.0),
    ];
    let mut rows = Vec::new();
    for (scene, bench, patch, samples) in &scenes {
        for (i, &segments) in effort.pick(&[1, 2, 4, 7, 10, 15, 20][..], &[1, 7]).iter().enumerate() {
            let name = format!("{scene}, {segments} segment(s)");
            let before = settings(effort, 2.1e6, 1, segments, *samples);
            let cost = point((bench, i == 0), (&name, before, patch.clone()), effort, level)?;
            rows.push(Row::new(TABLE, name.clone(), "edit: photons", "s", cost.edit[0]));
            rows.push(Row::new(TABLE, name.clone(), "edit: segments", "s", cost.edit[1]));
            rows.push(Row::new(TABLE, name.clone(), "edit: total", "s", cost.edit[2]));
            rows.push(Row::new(TABLE, name, "segments recomputed", "share", cost.shares[1]));
        }
    }
    Ok(rows)
}

/// The default settings on the CT-like volume: the first picture, a local edit, and what is kept in memory.
pub fn defaults(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "default settings, CT-like; two threads";
    /// Of a photon: place, direction and flux, as the paper's are.
    const BARE: f64 = 28.0;
    let bench = photon_scenes::ct(effort)?;
    let few = json!({ "render": { "photon": { "photons": 1 << 14 } } });
    let before = effort.pick(json!({}), few);
    let name = "vessels recoloured";
    let cost = point((&bench, true), (name, before, vessels()), effort, level)?;
    let mut rows = vec![
        Row::new(TABLE, "first picture", "from the document", "s", cost.scratch[2]).at_most(3.0),
        Row::new(TABLE, name, "photons recomputed", "share", cost.shares[0]),
        Row::new(TABLE, name, "segments recomputed", "share", cost.shares[1]),
        Row::new(TABLE, name, "edit", "s", cost.edit[2]).at_most(0.25),
    ];
    for items in cost.kept {
        let each = items.bytes as f64 / items.count.max(1) as f64;
        rows.push(match items.name {
            "photons" => {
                Row::new(TABLE, "memory", "a photon, beside its light", "bytes", each - BARE).at_most(16.0)
            }
            "paths" => Row::new(TABLE, "memory", "a light path, beside its photons", "bytes", each),
            "map" => Row::new(TABLE, "memory", "a photon, once more, sorted", "bytes", each),
            _ => Row::new(TABLE, "memory", "a segment", "bytes", each),
        });
    }
    Ok(rows)
}
