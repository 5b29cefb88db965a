//! Scans: the first picture of each method, and edits of `photon`, since their many values share groups of the Historygrams and their
//! matter fills much of the box.

use super::Row;
use super::edit::{Against, Edit, Live};
use super::photon_scenes::COLD;
use super::scenes::Bench;
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tyndall::integrator::METHODS;
use tyndall::message::path_name;
use tyndall::session::Budget;
use tyndall::simd::Level;
use tyndall_live::document;

/// A scan and its transfer function.
pub struct Scan {
    kind: &'static Kind,
    file: PathBuf,
}

/// What is known of a scan.
struct Kind {
    name: &'static str,
    file: &'static str,
    /// The tissues, in the order of their values; the first is recoloured, the last made thinner.
    tissues: [Tissue; 2],
}

/// Points of a transfer function that share a colour.
struct Tissue {
    name: &'static str,
    albedo: [f64; 3],
    /// Value, opacity and share of surface of each.
    points: &'static [[f64; 3]],
}

const BONE: [f64; 3] = [0.94, 0.89, 0.78];

const CHEST: Kind = Kind {
    name: "chest CT",
    file: "ct_chest_aorta_i16.nrrd",
    tissues: [
        Tissue {
            name: "vessels",
            albedo: [0.86, 0.16, 0.12],
            points: &[[90.0, 0.0, 0.4], [150.0, 0.35, 0.7], [260.0, 0.8, 0.7]],
        },
        Tissue { name: "bone", albedo: BONE, points: &[[380.0, 0.9, 0.6], [700.0, 1.0, 0.7]] },
    ],
};

const HEAD: Kind = Kind {
    name: "head CT",
    file: "ct_head_promed_i16.nrrd",
    tissues: [
        Tissue {
            name: "skin",
            albedo: [0.85, 0.6, 0.48],
            points: &[[-300.0, 0.0, 0.3], [-100.0, 0.02, 0.3], [150.0, 0.02, 0.3]],
        },
        Tissue { name: "bone", albedo: BONE, points: &[[300.0, 0.8, 0.6], [1200.0, 1.0, 0.7]] },
    ],
};

const MRI: Kind = Kind {
    name: "MRI",
    file: "mri_head.nii.gz",
    tissues: [
        Tissue {
            name: "skin",
            albedo: [0.85, 0.6, 0.48],
            points: &[[38.0, 0.0, 0.2], [60.0, 0.1, 0.2], [110.0, 0.3, 0.3]],
        },
        Tissue { name: "brain", albedo: [0.9, 0.82, 0.78], points: &[[150.0, 0.55, 0.3], [254.0, 1.0, 0.4]] },
    ],
};

/// Where the MRI lies in the sources.
const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/data");

/// The MRI of the sources, after those of the other scans that a folder holds.
///
/// # Errors
/// Where the folder holds none, or the MRI is gone.
pub fn find(folder: Option<&Path>) -> Result<Vec<Scan>, Failure> {
    let mut scans = Vec::new();
    if let Some(folder) = folder {
        let kinds = [&CHEST, &HEAD];
        let files = kinds.map(|kind| Scan { kind, file: folder.join(kind.file) });
        scans.extend(files.into_iter().filter(|scan| scan.file.is_file()));
        if scans.is_empty() {
            return Err(Failure::usage(format!(
                "--data {}: neither {} nor {} is there",
                path_name(folder),
                CHEST.file,
                HEAD.file
            )));
        }
    }
    let file = Path::new(EXAMPLES).join(MRI.file);
    if !file.is_file() {
        return Err(Failure::input(format!(
            "{}: the example that the table `scans` measures is not there; choose other tables by --table",
            path_name(&file)
        )));
    }
    scans.push(Scan { kind: &MRI, file });
    Ok(scans)
}

impl Kind {
    /// The transfer function, with the first tissue in a colour and the last as opaque as `share` of its points.
    fn transfer(&self, color: [f64; 3], share: f64) -> Value {
        let [first, last] = &self.tissues;
        let of = |tissue: &Tissue, albedo: [f64; 3], share: f64| {
            let point = |&[value, opacity, surface]: &[f64; 3]| json!({ "value": value, "opacity": share * opacity, "albedo": albedo, "surface": surface });
            tissue.points.iter().map(point).collect::<Vec<_>>()
        };
        let points = [of(first, color, 1.0), of(last, last.albedo, share)].concat();
        json!({ "transfer_function": { "points": points } })
    }
}

/// The most seconds that an edit should take with one scattering, and with several; `None` where nothing was set.
struct Reach {
    name: String,
    patch: Value,
    most: [Option<f64>; 2],
}

/// The edits of a scan.
fn edits_of(kind: &Kind) -> [Reach; 3] {
    let [first, last] = &kind.tissues;
    [
        Reach {
            name: format!("{} recoloured", first.name),
            patch: kind.transfer(COLD, 1.0),
            most: [Some(0.25), Some(0.6)],
        },
        Reach {
            name: format!("{} half as opaque", last.name),
            patch: kind.transfer(first.albedo, 0.5),
            most: [Some(1.0), None],
        },
        Reach {
            name: "camera turned by 15 degrees".to_owned(),
            patch: json!({ "camera": { "auto": { "azimuth": 35 } } }),
            most: [Some(0.4), None],
        },
    ]
}

/// First pictures, and edits of one tissue's colour, of one's opacity and of the camera, with one scattering and with four.
pub fn edits(effort: &Effort, level: Level, scans: &[Scan]) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for scan in scans {
        rows.extend(of_scan(effort, level, scan).map_err(|e| e.within(scan.kind.name))?);
    }
    Ok(rows)
}

fn of_scan(effort: &Effort, level: Level, Scan { kind, file }: &Scan) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "scans: photon, default settings, 512 x 512 pixels; two threads";
    /// The target for the first picture with one scattering.
    const FIRST: f64 = 1.0;
    effort.show(&format!("{}, loading", kind.name));
    let side = effort.pick(512, 64);
    let value = json!({
        "version": 1,
        "volume": { "path": file },
        "transfer_function": kind.transfer(kind.tissues[0].albedo, 1.0)["transfer_function"],
        "camera": { "auto": { "azimuth": 20, "elevation": 10 } },
        "film": { "size": [side, side] },
        "render": { "integrator": "photon", "photon": { "photons": effort.pick(1 << 20, 1 << 12) } },
    });
    let bench = Bench::new(value, 2)?;
    let mut rows = Vec::new();
    for (i, (scatterings, words)) in [(1, "one scattering"), (4, "four scatterings")].into_iter().enumerate()
    {
        let case = |name: &str| format!("{}, {words}: {name}", kind.name);
        effort.show(&case("first picture"));
        let before = json!({ "render": { "max_scatter": scatterings } });
        let mut live = Live::start(&bench, &before, level)?;
        let first = Row::new(TABLE, case("first picture"), "from nothing", "s", live.first.total);
        rows.push(if i == 0 { first.at_most(FIRST) } else { first });
        for Reach { name, patch, most } in edits_of(kind) {
            let name = case(&name);
            effort.show(&name);
            live.restore();
            let (against, before) = (Against::Equal, before.clone());
            let edit = Edit { bench: &bench, before, patch, against, plain: false, patience: PATIENCE };
            let cost = edit.measure_in(&mut live, effort, level).map_err(|e| e.within(&name))?;
            let row = |quantity, unit, ours| Row::new(TABLE, name.clone(), quantity, unit, ours);
            let seconds = row("edit", "s", cost.edit.total);
            rows.extend([
                row("from nothing", "s", cost.scratch.total),
                row("photons recomputed", "share", cost.shares.photons),
                row("segments recomputed", "share", cost.shares.segments),
                row("gathers made again", "share", cost.gathers),
                if let Some(most) = most[i] { seconds.at_most(most) } else { seconds },
                row("speed-up", "ratio", cost.speed_up()).at_least(1.0),
            ]);
        }
    }
    Ok(rows)
}

/// The first picture of each method of a bare file, and what an edit of the transfer function costs `raymarch`.
pub fn first_pictures(effort: &Effort, level: Level, scans: &[Scan]) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "first pictures of bare files, 512 x 512 pixels, default settings; two threads";
    /// Seconds to the whole picture of `raymarch`; an edit should take half of that.
    const RAYMARCH: f64 = 2.5;
    let mut rows = Vec::new();
    let side = effort.pick(512, 64);
    for Scan { kind, file } in scans {
        effort.show(&format!("{}, loading", kind.name));
        let bench = Bench::of_file(file, &json!({ "film": { "size": [side, side] } }), 2, level)?;
        for method in METHODS {
            let case = format!("{}, {}", kind.name, method.name);
            effort.show(&case);
            let patch = json!({ "render": { "integrator": method.name } });
            let scene = bench.scene(&patch)?;
            // Without noise a picture is whole when its edges are smooth; with noise the first sample is a picture.
            let samples = if method.has_noise { 1 } else { method.default_samples };
            let seconds = effort.seconds(&mut || drop(bench.render(&scene, level, samples)));
            let row = Row::new(TABLE, case.clone(), format_samples(samples), "s", seconds);
            if method.has_noise {
                rows.push(row);
                continue;
            }
            rows.push(row.at_most(RAYMARCH));
            let edits = [1.0, 0.5]
                .map(|share| document::apply(&patch, &kind.transfer(kind.tissues[0].albedo, share)));
            let edited = [bench.scene(&edits[0])?, bench.scene(&edits[1])?];
            let mut session = bench.render(&edited[0], level, samples);
            let mut turn = 0;
            let seconds = effort.seconds(&mut || {
                turn += 1;
                session.set_scene(edited[turn % 2].clone());
                session.refine(&Budget::samples(samples));
            });
            rows.push(
                Row::new(TABLE, case, "after an edit of opacity", "s", seconds).at_most(0.5 * RAYMARCH),
            );
        }
    }
    Ok(rows)
}

/// What is measured of a first picture.
fn format_samples(samples: u32) -> &'static str {
    if samples == 1 { "first sample" } else { "all samples" }
}

/// See [`Edit::patience`].
const PATIENCE: f64 = 1.5;
