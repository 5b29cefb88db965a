//! `tyndall replay`: edits against a live session, each timed, and with `--verify` compared with a render from nothing.

use crate::args::ReplayOptions;
use crate::edits::{self, Edit};
use crate::machine::{Interrupt, pool, vector_instructions};
use crate::reserve::{Plan, Reserve};
use crate::{Failure, output, overrides, say};
use serde_json::{Map, Value, json};
use std::io::Write;
use std::path::Path;
use std::time::Instant;
use tyndall::film::Image;
use tyndall::integrator::{KeptItems, WorkShare};
use tyndall::message::{excerpt, path_name, sentence};
use tyndall_live::{Budget, EditSource, Input, LiveSession, Options};

/// Plays EDITS against SCENE.
pub fn run(options: &ReplayOptions) -> Result<(), Failure> {
    let interrupt = Interrupt::listen();
    let threads = pool(options.run.threads)?;
    let level = vector_instructions()?;
    let mut input = Input::open(&options.input).map_err(Failure::input)?;
    output::check(&options.outputs, &[], options.run.stats.as_deref(), None)?;
    let edits = edits::read(&options.edits)?;

    overrides::lay_over(&mut input, &options.scene, options.samples)?;
    let on = Options { threads: threads.clone(), level, edits: true };
    let mut live = LiveSession::start(input, on).map_err(Failure::input)?;
    let writes = !options.outputs.is_empty();
    let plan = |live: &LiveSession| {
        let samples = live.document().render.samples();
        Reserve::new(&Plan::of_session(&options.outputs, live, samples, false))
    };
    let mut reserve = writes.then(|| plan(&live)).transpose()?;
    interrupt.picture_begins();
    let run = Run { verify: options.verify, interrupt: &interrupt };
    let begun = Instant::now();
    run.refine(&mut live, 1);
    let first_s = begun.elapsed().as_secs_f64();
    let note = |text: &str| {
        if !options.run.quiet {
            drop(writeln!(std::io::stderr(), "tyndall: note: {}", sentence(text)));
        }
    };
    live.notes().iter().for_each(|text| note(text));

    let mut reports = Vec::new();
    let told_on_stdout = options.run.stats.as_deref() == Some(Path::new("-"));
    let show = !options.run.quiet && !told_on_stdout;
    if show {
        say(&heading(options.verify))?;
    }
    let mut played = Ok(());
    for (number, edit) in edits.iter().enumerate() {
        let report = Edit::read(edit, number)
            .map_err(|e| Failure::input(format!("{}: {e}", path_name(&options.edits))))
            .and_then(|edit| {
                let at = format!("{}: {}", path_name(&options.edits), edit.at);
                play(&mut live, &edit, &at, &run).map(|report| (edit.name, report))
            });
        match report {
            Ok((name, report)) => {
                if show {
                    say(&report.line(&name))?;
                }
                report.notes.iter().for_each(|text| note(text));
                report.warn(&name);
                reports.push(report.to_value(&name));
            }
            Err(failure) => {
                played = Err(failure);
                break;
            }
        }
    }

    if let Some(path) = &options.run.stats {
        let statistics = json!({
            "integrator": live.scene().render.method.name(),
            "size": live.film().size(),
            "threads": threads.current_num_threads(),
            "simd": level.name(),
            "seed": live.scene().render.seed,
            "first_s": first_s,
            "edits": reports,
        });
        output::statistics(path, &statistics)?;
    }
    // Also when an edit was bad: the picture before it is not lost.
    if writes && live.film().samples() > 0 {
        // Edits may have changed the size.
        drop(reserve.take());
        reserve = Some(plan(&live)?);
        let samples = live.document().render.samples();
        run.refine(&mut live, samples);
        drop(reserve);
        output::notes(&options.outputs, live.document()).iter().for_each(|text| note(text));
        output::pictures(&options.outputs, live.film(), live.document(), live.folder(), None)?;
    }
    played?;
    if interrupt.is_requested() { Err(Failure::Interrupted) } else { Ok(()) }
}

/// What one edit cost, and its result.
struct Report {
    /// Method and size of the picture.
    integrator: &'static str,
    size: [u32; 2],
    latency_s: f64,
    recomputed: Vec<WorkShare>,
    check: Option<Check>,
    /// What a user should know that did not hold before the edit.
    notes: Vec<String>,
}

/// The state before an edit.
struct Before {
    samples: u32,
    image: Image,
    kept: Option<Box<dyn KeptItems>>,
}

/// A live picture compared with one from nothing.
struct Check {
    scratch_s: f64,
    max_abs_diff: f64,
    /// Pixels, light paths and segments, or samples, that were kept and are wrong.
    false_negatives: usize,
    /// Those that were recomputed with the same result; `None` where before and after cannot be compared.
    false_positives: Option<usize>,
}

impl Check {
    fn fails(&self) -> bool {
        self.max_abs_diff > 0.0 || self.false_negatives > 0
    }
}

/// Applies an edit, and renders until every pixel has a sample of the new scene; `at` says which edit it is.
fn play(live: &mut LiveSession, edit: &Edit, at: &str, run: &Run) -> Result<Report, Failure> {
    let before = run.verify.then(|| {
        let samples = live.document().render.samples();
        run.refine(live, samples);
        Before { samples: live.film().samples(), image: live.image(), kept: live.session().kept_items() }
    });
    let begun = Instant::now();
    let notes = live
        .edit_from(&edit.patch, EditSource { name: at, ..EditSource::default() })
        .map_err(Failure::input)?
        .notes;
    run.refine(live, 1);
    let latency_s = begun.elapsed().as_secs_f64();
    if run.interrupt.is_requested() {
        return Err(Failure::Interrupted);
    }
    let recomputed = live.session().recomputed();
    let check = before.map(|before| check(live, &recomputed, &before, run)).transpose()?;
    let (integrator, size) = (live.scene().render.method.name(), live.film().size());
    Ok(Report { integrator, size, latency_s, recomputed, check, notes })
}

/// Renders the edited scene from nothing, and compares.
fn check(
    live: &mut LiveSession,
    recomputed: &[WorkShare],
    before: &Before,
    run: &Run,
) -> Result<Check, Failure> {
    let begun = Instant::now();
    let mut fresh = live.fresh().map_err(Failure::input)?;
    run.refine(&mut fresh, 1);
    let scratch_s = begun.elapsed().as_secs_f64();

    // Pictures are equal only at equal sample counts, and a kept picture may have more samples than requested.
    let samples = live.document().render.samples().max(live.film().samples());
    run.refine(live, samples);
    run.refine(&mut fresh, samples);
    if run.interrupt.is_requested() {
        return Err(Failure::Interrupted);
    }
    let computed = live.report().items_computed;
    let of_items = live.session().kept_items().zip(computed).zip(fresh.session().kept_items());
    let (live, fresh) = (live.image(), fresh.image());
    let differing = live.rgba.iter().zip(&fresh.rgba).filter(|(a, b)| a != b).count();
    let same_size = before.image.size == live.size;
    let (false_negatives, false_positives) = if let Some(((kept, computed), of_fresh)) = of_items {
        let positives = |before: &dyn KeptItems| {
            let changes = kept.compare(before);
            computed.saturating_sub(changes.differing + changes.new)
        };
        let before = before.kept.as_deref().filter(|_| same_size);
        (kept.compare(&*of_fresh).differing, before.map(positives))
    } else {
        let redone = recomputed.iter().any(|work| work.share > 0.0);
        let same_as_before = || before.image.rgba.iter().zip(&live.rgba).filter(|(a, b)| a == b).count();
        let comparable = same_size && before.samples == samples;
        let positives = if redone { comparable.then(same_as_before) } else { Some(0) };
        (if redone { 0 } else { differing }, positives)
    };
    Ok(Check { scratch_s, max_abs_diff: farthest(&live, &fresh), false_negatives, false_positives })
}

/// How edits are played.
struct Run<'a> {
    verify: bool,
    interrupt: &'a Interrupt,
}

impl Run<'_> {
    fn refine(&self, live: &mut LiveSession, samples: u32) {
        live.refine(&Budget { cancel: self.interrupt.flag(), ..Budget::samples(samples) });
    }
}

/// The largest difference of two pictures of one size, over all channels.
fn farthest(a: &Image, b: &Image) -> f64 {
    let pairs = a.rgba.as_flattened().iter().zip(b.rgba.as_flattened());
    pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}

/// The headings of the columns of [`Report::line`].
fn heading(verify: bool) -> String {
    let checked = if verify { "  from nothing  speed-up  largest difference  false -  false +" } else { "" };
    format!("{:<32} {:>10}  recomputed{checked}\n", "edit", "latency")
}

impl Report {
    fn line(&self, name: &str) -> String {
        let shares: Vec<_> =
            self.recomputed.iter().map(|work| format!("{:.1} % {}", work.share * 100.0, work.name)).collect();
        let name = excerpt(name);
        let mut line = format!("{name:<32} {:>8.1} ms  {}", self.latency_s * 1e3, shares.join(", "));
        if let Some(check) = &self.check {
            let positives = check.false_positives.map_or("-".into(), |n| n.to_string());
            let checked = format!(
                "  {:>9.1} ms  {:>7.1}x  {:>18.2e}  {:>7}  {positives:>7}",
                check.scratch_s * 1e3,
                check.scratch_s / self.latency_s,
                check.max_abs_diff,
                check.false_negatives,
            );
            line.push_str(&checked);
        }
        line + "\n"
    }

    /// Warns if the picture is not the one from nothing.
    fn warn(&self, name: &str) {
        if let Some(check) = self.check.as_ref().filter(|check| check.fails()) {
            drop(writeln!(
                std::io::stderr(),
                "tyndall: warning: edit `{}`: the picture differs from the one from nothing by up to {:.2e}, \
                 and {} kept parts of it are wrong",
                excerpt(name),
                check.max_abs_diff,
                check.false_negatives
            ));
        }
    }

    fn to_value(&self, name: &str) -> Value {
        let shares: Map<_, _> =
            self.recomputed.iter().map(|work| (work.name.into(), json!(work.share))).collect();
        let mut value = json!({
            "name": name,
            "integrator": self.integrator,
            "size": self.size,
            "latency_s": self.latency_s,
            "recomputed": shares,
        });
        if let Some(check) = &self.check {
            value["scratch_s"] = json!(check.scratch_s);
            value["speedup"] = json!(check.scratch_s / self.latency_s);
            value["max_abs_diff"] = json!(check.max_abs_diff);
            value["false_negatives"] = json!(check.false_negatives);
            value["false_positives"] = json!(check.false_positives);
        }
        value
    }
}
