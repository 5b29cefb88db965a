//! The figures of \[Jonsson12, sec. 6.2\] as tables: the cost of edits over the number of photons and of segments; and that of
//! the default settings.

use super::Row;
use super::edit::{Against, Cost, Edit};
use super::historygrams::{recoloured, settings, tissue};
use super::photon_scenes::{self, COLD, Tissue};
use super::scenes::Bench;
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use tyndall::simd::Level;

/// See [`Edit::patience`].
const PATIENCE: f64 = 2.0;

/// The edit of a curve or table, and the scene that it edits.
struct Case {
    bench: Bench,
    patch: Value,
    steps_per_voxel: f64,
}

impl Case {
    /// The Cornell box, its sphere recoloured.
    fn cornell_box(effort: &Effort) -> Result<Self, Failure> {
        Ok(Self { bench: photon_scenes::cornell_box(effort)?, patch: recoloured(), steps_per_voxel: 2.0 })
    }

    /// The CT-like volume, its vessels recoloured.
    fn ct(effort: &Effort) -> Result<Self, Failure> {
        let patch = tissue(&Tissue { vessels: COLD, ..Tissue::USUAL });
        Ok(Self { bench: photon_scenes::ct(effort)?, patch, steps_per_voxel: 4.0 })
    }

    /// What the edit costs of the scene that `before` patches; `against` as of [`Edit`].
    fn cost(&self, before: Value, against: Against, effort: &Effort, level: Level) -> Result<Cost, Failure> {
        let (bench, patch) = (&self.bench, self.patch.clone());
        Edit { bench, before, patch, against, plain: false, patience: PATIENCE }.measure(effort, level)
    }
}

/// What point `i` of a curve is compared with: the first picture is checked.
fn against(i: usize) -> Against {
    if i == 0 { Against::Equal } else { Against::First }
}

/// Speed-up of an edit over the number of light paths, for one scattering and two; `paper` gives the paper's speed-up at so many
/// million photons.
fn by_photons(
    table: &'static str,
    case: &Case,
    paper: impl Fn(f64) -> Option<f64>,
    effort: &Effort,
    level: Level,
) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for scatterings in [1, 2] {
        for (i, &millions) in effort.pick(&[0.5, 1.0, 2.1, 4.2][..], &[2.1]).iter().enumerate() {
            let name = format!("{scatterings} scattering(s), {millions} M photons");
            effort.show(&name);
            let before = settings(effort, millions * 1e6, scatterings, 7, case.steps_per_voxel);
            let cost = case.cost(before, against(i), effort, level).map_err(|e| e.within(&name))?;
            rows.push(
                Row::new(table, name.clone(), "speed-up", "ratio", cost.speed_up()).beside(paper(millions)),
            );
            rows.push(Row::new(table, name.clone(), "photons recomputed", "share", cost.shares.photons));
            rows.push(Row::new(table, name.clone(), "segments recomputed", "share", cost.shares.segments));
            rows.push(Row::new(table, name, "edit", "s", cost.edit.total));
        }
    }
    Ok(rows)
}

/// Figure 7: the Cornell box's sphere recoloured.
pub fn figure_7(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 7: Cornell box, sphere recoloured, 7 segments, 2 samples per voxel";
    by_photons(TABLE, &Case::cornell_box(effort)?, |_| Some(15.0), effort, level)
}

/// Figure 8: the CT-like volume's vessels recoloured.
pub fn figure_8(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 8: CT-like, vessels recoloured, 7 segments, 4 samples per voxel";
    // "When using more than 0.5 million photons."
    let paper = |millions: f64| (millions > 0.5).then_some(8.0);
    by_photons(TABLE, &Case::ct(effort)?, paper, effort, level)
}

/// Figure 9: the same edits over the number of segments.
pub fn figure_9(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "fig. 9: time of an edit by segments per ray, 2.1 M photons, one scattering";
    let mut rows = Vec::new();
    for (scene, case) in [("Cornell box", Case::cornell_box(effort)?), ("CT-like", Case::ct(effort)?)] {
        for (i, &segments) in effort.pick(&[1, 2, 4, 7, 10, 15, 20][..], &[1, 7]).iter().enumerate() {
            let name = format!("{scene}, {segments} segment(s)");
            effort.show(&name);
            let before = settings(effort, 2.1e6, 1, segments, case.steps_per_voxel);
            let cost = case.cost(before, against(i), effort, level).map_err(|e| e.within(&name))?;
            rows.push(Row::new(TABLE, name.clone(), "edit: photons", "s", cost.edit.stages.photons));
            rows.push(Row::new(TABLE, name.clone(), "edit: segments", "s", cost.edit.stages.segments));
            rows.push(Row::new(TABLE, name.clone(), "edit: total", "s", cost.edit.total));
            rows.push(Row::new(TABLE, name, "segments recomputed", "share", cost.shares.segments));
        }
    }
    Ok(rows)
}

/// The default settings on the CT-like volume: the first picture, a local edit, and what is kept in memory.
pub fn defaults(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "default settings, CT-like; two threads";
    /// Bytes of a photon's position, direction and flux, as in the paper.
    const BARE: f64 = 28.0;
    let few = json!({ "render": { "photon": { "photons": 1 << 14 } } });
    let before = effort.pick(json!({}), few);
    let name = "vessels recoloured";
    let cost = Case::ct(effort)?.cost(before, Against::Equal, effort, level).map_err(|e| e.within(name))?;
    let mut rows = vec![
        Row::new(TABLE, "first picture", "from the document", "s", cost.scratch.total).at_most(3.0),
        Row::new(TABLE, name, "photons recomputed", "share", cost.shares.photons),
        Row::new(TABLE, name, "segments recomputed", "share", cost.shares.segments),
        Row::new(TABLE, name, "edit", "s", cost.edit.total).at_most(0.25),
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
