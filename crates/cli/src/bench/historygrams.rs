//! The tables of \[Jonsson12, sec. 6.2\]: the cost of edits when photons and view-ray segments survive them.

use super::Row;
use super::edit::{Against, Cost, Edit, PerStage};
use super::photon_scenes::{self, COLD, Layer, Tissue, key, sphere};
use super::scenes::Bench;
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use tyndall::simd::Level;
use tyndall_live::document;

/// A row of \[Jonsson12, table 1\]: seconds for photons and gathering without Historygrams and with them, the shares computed
/// again, the overhead of setting up, and the speed-up.
struct Paper {
    without: PerStage,
    with: PerStage,
    shares: PerStage,
    overhead: f64,
    speed_up: f64,
}

const fn per_stage(photons: f64, segments: f64) -> PerStage {
    PerStage { photons, segments }
}

const HAND: Paper = Paper {
    without: per_stage(0.22, 1.97),
    with: per_stage(0.10, 1.63),
    shares: per_stage(0.19, 0.29),
    overhead: 0.16,
    speed_up: 1.3,
};
const CORNELL: Paper = Paper {
    without: per_stage(0.32, 9.11),
    with: per_stage(0.04, 0.57),
    shares: per_stage(0.03, 0.18),
    overhead: 0.26,
    speed_up: 15.2,
};
const ENGINE: Paper = Paper {
    without: per_stage(0.37, 5.41),
    with: per_stage(0.10, 0.64),
    shares: per_stage(0.05, 0.19),
    overhead: 0.05,
    speed_up: 7.7,
};
const LADY_SKIN: Paper = Paper {
    without: per_stage(0.37, 1.31),
    with: per_stage(0.25, 0.43),
    shares: per_stage(0.74, 0.24),
    overhead: 0.25,
    speed_up: 2.4,
};
const LADY_ALL: Paper = Paper {
    without: per_stage(0.23, 1.32),
    with: per_stage(0.15, 1.11),
    shares: per_stage(0.71, 1.0),
    overhead: 0.03,
    speed_up: 1.2,
};
const VESSELS: Paper = Paper {
    without: per_stage(0.11, 1.25),
    with: per_stage(0.03, 0.16),
    shares: per_stage(0.24, 0.04),
    overhead: 0.08,
    speed_up: 6.8,
};
const KIDNEY: Paper = Paper {
    without: per_stage(0.11, 0.95),
    with: per_stage(0.07, 0.25),
    shares: per_stage(0.35, 0.09),
    overhead: 0.11,
    speed_up: 3.2,
};

/// The least share of the allowed speed-up that an edit should reach.
const OF_BOUND: f64 = 0.75;

/// An edit should take at most this factor times [`Cost::due`], and [`LATENCY_SECONDS`] more.
const LATENCY_FACTOR: f64 = 1.3;
const LATENCY_SECONDS: f64 = 0.06;

/// See [`Edit::patience`].
const PATIENCE: f64 = 6.0;

/// The parameters that the paper gives for each picture: light paths, scatterings, segments of a ray, samples per voxel.
pub fn settings(effort: &Effort, photons: f64, scatterings: u32, segments: u32, samples: f64) -> Value {
    let photons = (photons / effort.pick(1.0, 64.0)).round();
    let photon = json!({ "photons": photons, "segments": segments, "steps_per_voxel": samples });
    json!({ "render": { "max_scatter": scatterings, "photon": photon } })
}

/// One row of table 1, all its columns.
fn row(table: &'static str, name: &str, cost: &Cost, paper: Option<&Paper>, wanted: Option<f64>) -> Vec<Row> {
    // Sums of the paper's figures have no more digits than these.
    let of = |figure: &dyn Fn(&Paper) -> f64| paper.map(|p| (figure(p) * 100.0).round() / 100.0);
    let seconds = |quantity, ours| Row::new(table, name, quantity, "s", ours);
    let ratio = |quantity, ours| Row::new(table, name, quantity, "ratio", ours);
    let share = |quantity, ours| Row::new(table, name, quantity, "share", ours);
    let Cost { scratch, edit, shares, .. } = cost;
    let mut rows = vec![
        seconds("without: photons", scratch.stages.photons).beside(of(&|p| p.without.photons)),
        seconds("without: segments", scratch.stages.segments).beside(of(&|p| p.without.segments)),
        seconds("without: total", scratch.total).beside(of(&|p| p.without.sum())),
        seconds("with: photons", edit.stages.photons).beside(of(&|p| p.with.photons)),
        share("with: photons recomputed", shares.photons).beside(of(&|p| p.shares.photons)),
        seconds("with: segments", edit.stages.segments).beside(of(&|p| p.with.segments)),
        share("with: segments recomputed", shares.segments).beside(of(&|p| p.shares.segments)),
        seconds("with: total", edit.total).beside(of(&|p| p.with.sum())),
    ];
    let speed_up = ratio("speed-up", cost.speed_up()).beside(of(&|p| p.speed_up));
    rows.push(if let Some(wanted) = wanted { speed_up.at_least(wanted) } else { speed_up });
    if let Some(bound) = cost.bound() {
        rows.push(ratio("speed-up that the shares allow", bound));
        rows.push(ratio("reached of what they allow", cost.speed_up() / bound).at_least(OF_BOUND));
    }
    rows.push(share("gathers made again", cost.gathers));
    if let Some(bound) = cost.bound_by_gathers() {
        rows.push(ratio("speed-up that the gathers allow", bound));
        rows.push(ratio("reached of what those allow", cost.speed_up() / bound).at_least(OF_BOUND));
    }
    let allowed = LATENCY_FACTOR * cost.due() + LATENCY_SECONDS;
    rows.push(ratio("latency over 1.3 x due + 60 ms", cost.edit.total / allowed).at_most(1.0));
    if let Some(plain) = cost.plain {
        let overhead = share("set-up, over one segment a ray", scratch.total / plain - 1.0);
        rows.push(overhead.at_most(0.26).beside(of(&|p| p.overhead)));
    }
    rows
}

/// An edit for table 1.
fn edit(bench: &Bench, before: Value, patch: Value) -> Edit<'_> {
    Edit { bench, before, patch, against: Against::Equal, plain: false, patience: PATIENCE }
}

/// The edit of the Cornell box.
pub fn recoloured() -> Value {
    json!({ "transfer_function": sphere(COLD) })
}

/// The edit of the CT-like volume.
pub fn tissue(tissue: &Tissue) -> Value {
    json!({ "transfer_function": tissue.transfer() })
}

/// The Cornell box's sphere gets another colour.
pub fn cornell_box(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str =
        "table 1, Cornell box: nearest, one scattering, 7 segments, 2 samples per voxel; two threads";
    let bench = photon_scenes::cornell_box(effort)?;
    let mut rows = Vec::new();
    for (spatial, against) in [("cells", Against::Equal), ("off", Against::Unequal)] {
        let before = settings(effort, 4.2e6, 1, 7, 2.0);
        let before = document::apply(&before, &json!({ "render": { "photon": { "spatial": spatial } } }));
        let exact = against == Against::Equal;
        let measured = Edit { against, plain: exact, ..edit(&bench, before, recoloured()) };
        let name = format!("sphere recoloured, spatial = {spatial}");
        effort.show(&name);
        let cost = measured.measure(effort, level).map_err(|e| e.within(&name))?;
        rows.extend(row(TABLE, &name, &cost, Some(&CORNELL), exact.then_some(15.0)));
    }
    Ok(rows)
}

/// The CT-like volume: colour and opacity of one of its layers, and two scatterings.
pub fn ct(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "table 1, CT-like: 4 samples per voxel; two threads";
    let bench = photon_scenes::ct(effort)?;
    let usual = Tissue::USUAL;
    let vessels = tissue(&Tissue { vessels: COLD, ..usual });
    let clear = tissue(&Tissue { bone: Layer { opacity: 0.0, ..usual.bone }, ..usual });
    let bone = tissue(&Tissue { bone: Layer { albedo: COLD, ..usual.bone }, ..usual });
    let (single, double) = (settings(effort, 1.6e6, 1, 7, 4.0), settings(effort, 2.1e6, 2, 10, 4.0));
    let cases = [
        ("vessels recoloured", single.clone(), vessels, VESSELS),
        ("bone made clear", single, clear, KIDNEY),
        ("two scatterings, bone recoloured", double, bone, ENGINE),
    ];
    let mut rows = Vec::new();
    for (name, before, patch, paper) in cases {
        effort.show(name);
        let measured = Edit { plain: true, ..edit(&bench, before, patch) };
        let cost = measured.measure(effort, level).map_err(|e| e.within(name))?;
        rows.extend(row(TABLE, name, &cost, Some(&paper), None));
    }
    Ok(rows)
}

/// Edits that touch most of the light, or little that is expensive.
pub fn hard(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "table 1, hard edits, CT-like, one scattering; two threads";
    let bench = photon_scenes::ct(effort)?;
    let usual = Tissue::USUAL;
    let directions = [[1.0, -1.0, -1.0], [-1.0, -0.5, -0.5], [0.0, 1.0, -0.3]];
    let lights = json!({ "lights": directions.map(key) });
    let lady = document::apply(&settings(effort, 2.1e6, 1, 9, 1.5), &lights);
    let mut moved = directions;
    moved[0][0] = 0.5;
    let mirror = |roughness: f64| tissue(&Tissue { roughness: Some(roughness), ..usual });
    let glossy = json!({ "medium": { "brdf": { "type": "ashikhmin-shirley" } } });
    let hand = document::apply(&settings(effort, 2.1e6, 1, 10, 8.0), &glossy);
    let hand = document::apply(&hand, &mirror(0.4));
    let skin = tissue(&Tissue { skin: 0.5 * usual.skin, ..usual });
    let moved = json!({ "lights": moved.map(key) });
    let thinner = json!({ "medium": { "density": 50.0 / f64::from(photon_scenes::side(effort)) } });
    let cases = [
        ("three lights, outermost layer thinner", lady.clone(), skin, Some(LADY_SKIN), None),
        ("three lights, one of them turned", lady, moved, Some(LADY_ALL), None),
        ("mirror-like vessels made smoother", hand, mirror(0.2), Some(HAND), None),
        ("everything thinner", settings(effort, 1.6e6, 1, 7, 4.0), thinner, None, Some(0.95)),
    ];
    let mut rows = Vec::new();
    for (name, before, patch, paper, wanted) in cases {
        effort.show(name);
        let cost = edit(&bench, before, patch).measure(effort, level).map_err(|e| e.within(name))?;
        rows.extend(row(TABLE, name, &cost, paper.as_ref(), wanted));
    }
    Ok(rows)
}
