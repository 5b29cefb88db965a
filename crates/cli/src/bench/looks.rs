//! How soon an edit shows: the time from the patch to coarse pictures in the caller's buffer, and the time of a look.

use super::Row;
use super::scenes::ct;
use super::timing::{Effort, median};
use crate::Failure;
use crate::machine::pool;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tyndall::film::{Stride, Viewer};
use tyndall::integrator::METHODS;
use tyndall::simd::Level;
use tyndall_live::{Budget, Input, LiveSession, Options};

/// Targets in milliseconds, for the default method on a scan.
const EIGHTS_MS: f64 = 50.0;
const FOURS_MS: f64 = 130.0;
const LOOK_MS: f64 = 4.0;

/// After this long no further edits of a method are measured.
const PATIENCE: Duration = Duration::from_secs(20);

/// Alternating edits of camera and transfer function, on files or a generated volume, with every method.
pub fn edits(effort: &Effort, level: Level, files: &[PathBuf]) -> Result<Vec<Row>, Failure> {
    const TABLE: &str =
        "from the patch to the picture, 800 x 800 pixels, medians of up to 20 edits in 20 s, two threads";
    let mut inputs = Vec::new();
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        inputs.push((name, Input::open(file).map_err(Failure::input)?));
    }
    if files.is_empty() {
        let input = Input::of_document(ct(effort.pick(256, 32)), Path::new(""));
        inputs.push(("CT-like".to_owned(), input));
    }
    let mut rows = Vec::new();
    for (name, input) in inputs {
        for method in METHODS {
            effort.show(&format!("{name}, {}", method.name));
            let side = effort.pick(800, 32);
            let mut input = input.clone();
            let patch = json!({ "film": { "size": [side, side] }, "render": { "integrator": method.name } });
            input.patch(&patch).map_err(Failure::input)?;
            let on = Options { threads: pool(Some(2))?, level, edits: true };
            let mut live = LiveSession::start(input, on).map_err(Failure::input)?;
            let times = Times::of(&mut live, effort.pick(20, 2))?;
            let row = |quantity, times| {
                Row::new(TABLE, format!("{name}, {}", method.name), quantity, "ms", median(times))
            };
            rows.push(row("every 8th pixel", times.eights).at_most(EIGHTS_MS));
            rows.push(row("every 4th pixel", times.fours).at_most(FOURS_MS));
        }
    }
    Ok(rows)
}

/// Milliseconds from the patch to a picture, for each edit.
#[derive(Default)]
struct Times {
    eights: Vec<f64>,
    fours: Vec<f64>,
}

impl Times {
    fn of(live: &mut LiveSession, edits: usize) -> Result<Self, Failure> {
        let mut times = Self::default();
        let (mut viewer, mut picture) = (Viewer::default(), Vec::new());
        live.refine(&Budget::coarse(Stride::Four));
        let first = Instant::now();
        for edit in 0..edits {
            if edit > 0 && first.elapsed() > PATIENCE {
                break;
            }
            let patch = if edit.is_multiple_of(2) {
                json!({ "camera": { "auto": { "azimuth": 20 + 7 * edit } } })
            } else {
                json!({ "transfer_function": { "points": points(live) } })
            };
            let begun = Instant::now();
            live.edit(&patch).map_err(Failure::input)?;
            for (budget, times) in [
                (Budget::coarse(Stride::Eight), &mut times.eights),
                (Budget::coarse(Stride::Four), &mut times.fours),
            ] {
                live.refine(&budget);
                live.look(&mut viewer, &mut picture);
                times.push(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
        Ok(times)
    }
}

/// The scene's transfer function with 2 % less opacity.
fn points(live: &LiveSession) -> Vec<Value> {
    let of = |p: &tyndall::transfer::Point| {
        let optics = &p.optics;
        json!({
            "value": p.value, "opacity": 0.98 * optics.opacity, "albedo": optics.albedo.to_array(),
            "emission": optics.emission.to_array(), "surface": optics.surface,
            "specular": optics.specular.to_array(), "roughness": optics.roughness,
        })
    };
    live.scene().medium.transfer().points().iter().map(of).collect()
}

/// A look at a film of one megapixel, all of which changed.
pub fn look(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str = "a look at 1000 x 1000 pixels that all changed, two threads";
    let side = effort.pick(1000, 64);
    let mut document = ct(32);
    document["film"] = json!({ "size": [side, side] });
    document["render"] = json!({ "max_scatter": 0 });
    let on = Options { threads: pool(Some(2))?, level, edits: false };
    let input = Input::of_document(document, Path::new(""));
    let mut live = LiveSession::start(input, on).map_err(Failure::input)?;
    let mut rows = Vec::new();
    for samples in effort.pick(&[1, 20, 100][..], &[1]) {
        live.refine(&Budget::samples(*samples));
        let mut picture = Vec::new();
        let seconds = effort.seconds(&mut || live.look(&mut Viewer::default(), &mut picture));
        rows.push(
            Row::new(TABLE, format!("{samples} samples"), "time", "ms", seconds * 1e3).at_most(LOOK_MS),
        );
    }
    Ok(rows)
}
