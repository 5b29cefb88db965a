//! `tyndall replay`: edits against a live session, each timed, and on demand held against a render from nothing.

use crate::args::ReplayOptions;
use crate::edits::{self, Edit};
use crate::input::Input;
use crate::machine::{Interrupt, check_film, check_photons, pool, sample_memory, vector_instructions};
use crate::{Failure, output, say};
use serde_json::{Map, Value, json};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tyndall::film::Image;
use tyndall::integrator::Kept;
use tyndall::message::{excerpt, place, sentence};
use tyndall::scene::document::{self, Document};
use tyndall::scene::{Assets, Scene};
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_formats::assets;

/// Plays EDITS against SCENE.
pub fn run(options: &ReplayOptions) -> Result<(), Failure> {
    let interrupt = Interrupt::listen();
    let threads = pool(options.run.threads)?;
    let level = vector_instructions()?;
    let mut input = Input::open(&options.input)?;
    output::check(&options.outputs, options.run.stats.as_deref())?;
    let edits = edits::read(&options.edits)?;

    input.override_with(&options.scene, options.samples)?;
    let mut live = Live::open(input, &options.input, threads, level, &interrupt)?;
    interrupt.ask_from_now_on();
    let begun = Instant::now();
    live.refine(1);
    let first_s = begun.elapsed().as_secs_f64();
    if !options.run.quiet {
        live.notes();
    }

    let mut reports = Vec::new();
    let told_on_stdout = options.run.stats.as_deref() == Some(Path::new("-"));
    let show = !options.run.quiet && !told_on_stdout;
    if show {
        say(&heading(options.verify))?;
    }
    let mut played = Ok(());
    for (number, edit) in edits.iter().enumerate() {
        let report = Edit::read(edit, number)
            .map_err(|e| Failure::input(format!("{}: {e}", place(&options.edits))))
            .and_then(|edit| {
                let at = format!("{}: {}", place(&options.edits), edit.at);
                live.play(&edit, &at, options.verify).map(|report| (edit.name, report))
            });
        match report {
            Ok((name, report)) => {
                if show {
                    say(&report.line(&name))?;
                }
                report.warn(&name);
                reports.push(report.to_value(&name));
            }
            Err(failure) => {
                played = Err(failure);
                break;
            }
        }
    }

    if let Some(place) = &options.run.stats {
        let statistics = json!({
            "integrator": live.session.scene().render.integrator.name(),
            "size": live.session.film().size(),
            "threads": live.session.threads(),
            "simd": level.name(),
            "seed": live.document.render.seed,
            "first_s": first_s,
            "edits": reports,
        });
        output::statistics(place, &statistics)?;
    }
    // Also before a bad edit: nothing is lost.
    if !options.outputs.is_empty() && live.session.film().samples() > 0 {
        live.refine(live.document.render.samples);
        output::pictures(&options.outputs, live.session.film(), &live.document, &live.input.folder)?;
    }
    played?;
    if interrupt.asked() { Err(Failure::Interrupted) } else { Ok(()) }
}

/// A scene under edit.
struct Live<'a> {
    /// Where the document comes from.
    input: Input,
    /// The document as it was typed, with all edits so far.
    value: Value,
    document: Document,
    assets: Assets,
    session: Session,
    pool: Arc<rayon::ThreadPool>,
    level: Level,
    interrupt: &'a Interrupt,
    told: Vec<String>,
}

/// What one edit cost, and what it came to.
struct Report {
    /// Method and size of the picture.
    integrator: &'static str,
    size: [u32; 2],
    latency_s: f64,
    recomputed: Vec<(&'static str, f64)>,
    check: Option<Check>,
}

/// What there was before an edit.
struct Before {
    samples: u32,
    image: Image,
    kept: Option<Kept>,
}

/// A live picture held against one from nothing.
struct Check {
    scratch_s: f64,
    max_abs_diff: f64,
    /// Pixels, light paths and segments, or samples, that were kept and are wrong.
    false_negatives: usize,
    /// Those that were computed again for nothing; `None` where before and after cannot be compared.
    false_positives: Option<usize>,
}

impl Check {
    fn fails(&self) -> bool {
        self.max_abs_diff > 0.0 || self.false_negatives > 0
    }
}

impl<'a> Live<'a> {
    fn open(
        mut input: Input,
        path: &Path,
        pool: Arc<rayon::ThreadPool>,
        level: Level,
        interrupt: &'a Interrupt,
    ) -> Result<Self, Failure> {
        let mut value = input.value.clone();
        let (document, assets, source) = pool.install(|| input.load(path))?;
        if input.bare && value.is_object() {
            // Chosen by the volume, and no edit's to lose.
            value = document::apply(&json!({ "medium": { "density": document.medium.density } }), &value);
        }
        let at = place(path);
        check_film(document.film.size, &at)?;
        let scene = build(&pool, &document, &assets, &at)?;
        let mut session = Session::with_level(scene, pool.clone(), level);
        session.keep_samples(sample_memory(&document));
        Ok(Self { input, value, document, assets, session, pool, level, interrupt, told: source.notes })
    }

    /// Tells once what the user should know.
    fn notes(&mut self) {
        let of_scene = self.session.scene().notes().into_iter().map(str::to_owned);
        for text in self.told.drain(..).chain(of_scene) {
            drop(writeln!(std::io::stderr(), "tyndall: note: {}", sentence(&text)));
        }
    }

    fn refine(&mut self, samples: u32) {
        refine(&mut self.session, samples, self.interrupt);
    }

    /// Applies an edit, and renders until every pixel has a sample of the new scene; `at` says which edit it is.
    fn play(&mut self, edit: &Edit, at: &str, verify: bool) -> Result<Report, Failure> {
        let before = verify.then(|| {
            self.refine(self.document.render.samples);
            Before {
                samples: self.session.film().samples(),
                image: self.session.image(),
                kept: self.session.snapshot(),
            }
        });

        let begun = Instant::now();
        let value = document::apply(&self.value, &edit.patch);
        let (document, assets) = self.parse(&value, at)?;
        check_film(document.film.size, at)?;
        let scene = build(&self.pool, &document, &assets, at)?;
        if document.render.path != self.document.render.path {
            self.session.keep_samples(sample_memory(&document));
        }
        self.session.set_scene(scene);
        self.refine(1);
        let latency_s = begun.elapsed().as_secs_f64();
        (self.value, self.document, self.assets) = (value, document, assets);
        if self.interrupt.asked() {
            return Err(Failure::Interrupted);
        }
        let recomputed = self.session.recomputed().to_vec();
        let check = before.map(|before| self.check(at, &recomputed, &before)).transpose()?;
        let (integrator, size) = (self.session.scene().render.integrator.name(), self.document.film.size);
        Ok(Report { integrator, size, latency_s, recomputed, check })
    }

    /// The document of an edited value, through the parser, with what it names.
    fn parse(&self, value: &Value, at: &str) -> Result<(Document, Assets), Failure> {
        let document =
            Document::from_value(value.clone()).map_err(|e| Failure::input(format!("{at}: {e}")))?;
        let assets = self
            .pool
            .install(|| assets::reload(&document, &self.input.folder, (&self.document, &self.assets)))
            .map_err(|e| Failure::input(format!("{at}: {e}")))?;
        Ok((document, assets))
    }

    /// Renders the edited scene from nothing, and compares.
    fn check(
        &mut self,
        at: &str,
        recomputed: &[(&'static str, f64)],
        before: &Before,
    ) -> Result<Check, Failure> {
        let begun = Instant::now();
        let (document, assets) = self.parse(&self.value, at)?;
        let scene = build(&self.pool, &document, &assets, at)?;
        let mut fresh = Session::with_level(scene, self.pool.clone(), self.level);
        fresh.keep_samples(sample_memory(&document));
        refine(&mut fresh, 1, self.interrupt);
        let scratch_s = begun.elapsed().as_secs_f64();

        // Pictures are equal at equal numbers of samples, of which a kept one may have more than were asked for.
        let samples = document.render.samples.max(self.session.film().samples());
        self.refine(samples);
        refine(&mut fresh, samples, self.interrupt);
        if self.interrupt.asked() {
            return Err(Failure::Interrupted);
        }
        let of_items = self.session.snapshot().zip(self.session.computed()).zip(fresh.snapshot());
        let (live, fresh) = (self.session.image(), fresh.image());
        let differing = live.rgba.iter().zip(&fresh.rgba).filter(|(a, b)| a != b).count();
        let same_size = before.image.size == live.size;
        let (false_negatives, false_positives) = if let Some(((kept, computed), of_fresh)) = of_items {
            let positives = |before| computed.saturating_sub(kept.changed_since(before));
            (kept.differing(&of_fresh), before.kept.as_ref().filter(|_| same_size).map(positives))
        } else {
            let redone = recomputed.iter().any(|(_, share)| *share > 0.0);
            let same_as_before = || before.image.rgba.iter().zip(&live.rgba).filter(|(a, b)| a == b).count();
            let comparable = same_size && before.samples == samples;
            let positives = if redone { comparable.then(same_as_before) } else { Some(0) };
            (if redone { 0 } else { differing }, positives)
        };
        Ok(Check { scratch_s, max_abs_diff: farthest(&live, &fresh), false_negatives, false_positives })
    }
}

fn refine(session: &mut Session, samples: u32, interrupt: &Interrupt) {
    session.refine(&Budget { cancel: interrupt.flag(), ..Budget::samples(samples) });
}

fn build(pool: &rayon::ThreadPool, document: &Document, assets: &Assets, at: &str) -> Result<Scene, Failure> {
    let scene =
        pool.install(|| Scene::build(document, assets)).map_err(|e| Failure::input(format!("{at}: {e}")))?;
    check_photons(&scene.render, scene.size, at)?;
    Ok(scene)
}

/// The largest difference of two pictures of one size, over all channels.
fn farthest(a: &Image, b: &Image) -> f64 {
    let pairs = a.rgba.as_flattened().iter().zip(b.rgba.as_flattened());
    pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}

/// What the columns of [`Report::line`] are.
fn heading(verify: bool) -> String {
    let checked = if verify { "  from nothing  speed-up  largest difference  false -  false +" } else { "" };
    format!("{:<32} {:>10}  recomputed{checked}\n", "edit", "latency")
}

impl Report {
    fn line(&self, name: &str) -> String {
        let shares: Vec<_> =
            self.recomputed.iter().map(|(name, share)| format!("{:.1} % {name}", share * 100.0)).collect();
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

    /// Says so where the picture is not the one from nothing.
    fn warn(&self, name: &str) {
        if let Some(check) = self.check.as_ref().filter(|check| check.fails()) {
            drop(writeln!(
                std::io::stderr(),
                "tyndall: warning: edit `{}`: the picture differs from the one from nothing by up to {:.2e}, and {} parts of it were \
                 kept and are wrong",
                excerpt(name),
                check.max_abs_diff,
                check.false_negatives
            ));
        }
    }

    fn to_value(&self, name: &str) -> Value {
        let shares: Map<_, _> =
            self.recomputed.iter().map(|&(name, share)| (name.into(), json!(share))).collect();
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
