//! `tyndall render`.

use crate::args::RenderOptions;
use crate::machine::{Interrupt, pool, vector_instructions};
use crate::parts::{Share, StateInfo, StoredRender};
use crate::progress::Display;
use crate::refine::{StopConditions, refine};
use crate::reserve::{Plan, Reserve};
use crate::stats::{Stages, peak_memory};
use crate::turntable::Turntable;
use crate::{Failure, output, overrides};
use serde_json::json;
use std::io::Write;
use std::time::{Duration, Instant};
use tyndall::film::Film;
use tyndall::message::{path_name, sentence};
use tyndall_live::{Input, LiveSession, Options, look_of};

/// Renders INPUT to pictures and statistics.
pub fn run(options: &RenderOptions, started: Instant) -> Result<(), Failure> {
    let detail = |text: &str| {
        if options.verbose {
            // Optional, like progress.
            drop(writeln!(std::io::stderr(), "tyndall: {text}"));
        }
    };
    let mut stages = Stages::new(started);
    let interrupt = Interrupt::listen();
    let threads = pool(options.run.threads)?;
    let level = vector_instructions()?;
    let mut input = Input::open(&options.input).map_err(Failure::input)?;
    let turntable = options
        .turntable
        .map(|frames| Turntable::new(frames, options.fps, &options.outputs, &options.input))
        .transpose()?;
    let paths = match &turntable {
        Some(turntable) => turntable.pictures(),
        None => output::paths(&options.outputs, &options.input, "png")?,
    };
    let films = turntable.as_ref().map(Turntable::films).unwrap_or_default();
    output::check(&paths, &films, options.run.stats.as_deref(), options.save_look.as_deref())?;
    output::check_look(options.save_look.as_deref(), &options.input)?;
    if options.part.is_some() {
        output::check_exr(&paths, "--part")?;
    }
    if options.resumable {
        output::check_exr(&paths, "--resumable")?;
    }
    let stored = options.resume.as_deref().map(StoredRender::open).transpose()?;

    overrides::lay_over(&mut input, &options.scene, options.samples)?;
    let look = options.save_look.as_ref().map(|path| (path, look_of(&input.value, &input.folder)));
    let on = Options { threads: threads.clone(), level, edits: false };
    let loaded = input.load(&on).map_err(Failure::input)?;
    let load_s = stages.end("load");
    let mut live = LiveSession::of(loaded, on).map_err(Failure::input)?;
    if let Some((path, look)) = look {
        output::look(path, &look)?;
    }
    if !options.run.quiet {
        let shown = turntable.as_ref().map_or_else(|| paths.clone(), Turntable::first_pictures);
        let of_outputs = output::notes(&shown, live.document());
        for text in live.notes().iter().chain(&of_outputs) {
            drop(writeln!(std::io::stderr(), "tyndall: note: {}", sentence(text)));
        }
    }
    let prepared = stages.end("prepare");
    detail(&format!(
        "loaded in {load_s:.2} s, prepared in {prepared:.2} s, {} threads, {}",
        threads.current_num_threads(),
        level.name()
    ));

    let usual_samples = live.document().render.samples();
    let mut samples = usual_samples;
    if let Some(part) = options.part {
        let range = part.of_samples(samples).ok_or_else(|| too_many_parts(part, samples))?;
        live.go_on_with(Film::part(live.scene().size, range.first)).map_err(Failure::input)?;
        samples = range.end;
    }
    let keeps_samples = options.part.is_some() || options.resumable || options.resume.is_some();
    let info = keeps_samples.then(|| StateInfo::new(&live, level, options.part));
    let limited = options.time.is_some() || options.target_error.is_some();
    if limited && options.samples.is_none() {
        samples = u32::MAX;
    }
    if let (Some(stored), Some(info)) = (&stored, &info) {
        resume(&mut live, stored, info, samples)?;
        if live.film().samples() == samples && options.samples.is_none() && !options.run.quiet {
            let path = path_name(stored.path);
            drop(writeln!(
                std::io::stderr(),
                "tyndall: note: {path} already has the {samples} samples asked for; ask for more with --samples"
            ));
        }
    }
    // How many samples fit the time is not known.
    let expected = if limited { samples.min(usual_samples) } else { samples };
    let mut reserve = Some(Reserve::new(&Plan::of_session(&paths, &live, expected, keeps_samples))?);
    let stop = StopConditions {
        samples,
        time: options.time,
        error: options.target_error,
        // An error estimate needs two samples.
        usual_samples: usual_samples.max(2),
    };
    interrupt.picture_begins();
    let mut frames = Vec::new();
    let mut refined = |live: &mut LiveSession, frame| {
        let begun = Instant::now();
        let about = turntable.as_ref().map(|turntable| turntable.about(frame));
        let display = Display::new(options.progress, options.run.quiet);
        refine(live, &stop, &interrupt.flag(), display, about.as_deref());
        if interrupt.is_requested() {
            return;
        }
        frames.push(json!({
            "wall_s": begun.elapsed().as_secs_f64(),
            "samples_per_pixel": live.film().mean_samples(),
            "relative_error": live.session().relative_error(),
        }));
    };
    if let Some(turntable) = &turntable {
        drop(reserve.take());
        turntable.render(&mut live, &interrupt, &mut refined)?;
    } else {
        refined(&mut live, 0);
    }
    let rendered = stages.end("render");
    let interrupted = interrupt.is_requested();
    if interrupted && frames.is_empty() && live.film().mean_samples() == 0.0 {
        if !options.run.quiet {
            drop(writeln!(std::io::stderr(), "tyndall: interrupted before there was anything to write"));
        }
        return Err(Failure::Interrupted);
    }
    let late = |time: &Duration| {
        turntable.is_none() && live.film().samples() == 1 && rendered > 2.0 * time.as_secs_f64() + 0.5
    };
    if let Some(time) = stop.time.filter(late).filter(|_| !options.run.quiet) {
        let why = "the first sample of every pixel, without which a picture has holes,";
        let asked = time.as_secs_f64();
        drop(writeln!(
            std::io::stderr(),
            "tyndall: note: {why} took {rendered:.1} s, more than the {asked} s of --time"
        ));
    }
    detail(&format!("{:.2} samples per pixel in {rendered:.2} s", live.film().mean_samples()));

    drop(reserve);
    if turntable.is_none() {
        output::pictures(&paths, live.film(), live.document(), live.folder(), info.as_ref())?;
    }
    stages.end("write");
    if let Some(path) = &options.run.stats {
        let film = live.film();
        let mut statistics = json!({
            "integrator": live.scene().render.method.name(),
            "size": film.size(),
            "samples_per_pixel": film.mean_samples(),
            "wall_s": started.elapsed().as_secs_f64(),
            "load_s": load_s,
            "stages": stages.to_value(),
            "mean_radiance": film.mean_radiance(),
            "relative_error": live.session().relative_error(),
            "peak_memory_bytes": peak_memory(),
            "threads": threads.current_num_threads(),
            "simd": level.name(),
            "seed": live.scene().render.seed,
        });
        if turntable.is_some() {
            statistics["frames"] = frames.into();
        }
        output::statistics(path, &statistics)?;
    }
    if interrupted { Err(Failure::Interrupted) } else { Ok(()) }
}

/// More parts than chunks of samples.
fn too_many_parts(part: Share, samples: u32) -> Failure {
    let most = samples.div_ceil(Film::CHUNK);
    Failure::usage(format!(
        "--part {part}: {samples} samples are {most} chunks of up to {}, and a part needs one; expected at most {most} parts",
        Film::CHUNK
    ))
}

/// Continues with stored samples, to a number of `samples`.
fn resume(
    live: &mut LiveSession,
    stored: &StoredRender,
    info: &StateInfo,
    samples: u32,
) -> Result<(), Failure> {
    let name = path_name(stored.path);
    if let Some(part) = stored.info.part {
        return Err(Failure::input(format!(
            "{name}: is part {part} of a render, and a part cannot be resumed; merge all parts first, with --resumable"
        )));
    }
    stored.check_session(info, live.document())?;
    let film = stored.film()?;
    if film.most_samples() > samples {
        let found = film.most_samples();
        return Err(Failure::usage(format!(
            "{name}: some pixels already have {found} samples, more than the {samples} asked for; ask for at least {found} with --samples"
        )));
    }
    live.go_on_with(film).map_err(Failure::input)
}
