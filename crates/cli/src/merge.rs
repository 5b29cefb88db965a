//! `tyndall merge`.

use crate::args::MergeOptions;
use crate::parts::{Share, StoredRender};
use crate::reserve::{Plan, Reserve};
use crate::{Failure, output};
use std::io::Write;
use std::path::Path;
use tyndall::film::Film;
use tyndall::message::{path_name, sentence};

/// Merges the parts of a render, given in any order, to the picture of the whole.
pub fn run(options: &MergeOptions) -> Result<(), Failure> {
    output::check(&options.outputs, &[], None, None)?;
    if options.resumable {
        output::check_exr(&options.outputs, "--resumable")?;
    }
    let mut parts: Vec<PartFile> =
        options.parts.iter().map(|path| PartFile::open(path)).collect::<Result<_, _>>()?;
    parts.sort_by_key(|part| part.share.number);
    check_complete(&parts)?;
    let reserve = parts.first().map(|part| Reserve::new(&plan(options, part))).transpose()?;
    let mut merged: Option<Film> = None;
    for part in &parts {
        let film = part.film()?;
        match &mut merged {
            Some(merged) => merged.append(&film),
            None => merged = Some(film),
        }
    }
    let (Some(first), Some(film)) = (parts.first(), merged) else {
        return Err(Failure::usage("found no part; name all of them"));
    };
    drop(reserve);
    let mut info = first.stored.info.clone();
    info.part = None;
    let info = options.resumable.then_some(info);
    for text in output::notes(&options.outputs, &first.stored.document) {
        drop(writeln!(std::io::stderr(), "tyndall: note: {}", sentence(&text)));
    }
    let folder = first.stored.path.parent().unwrap_or(Path::new(""));
    output::pictures(&options.outputs, &film, &first.stored.document, folder, info.as_ref())
}

/// Films of the whole and of a part, which may be as large, are in memory at once.
fn plan<'a>(options: &'a MergeOptions, first: &PartFile) -> Plan<'a> {
    let (size, samples) = (first.stored.document.film.size, first.stored.info.samples);
    let state = if options.resumable { Film::bytes([1, 1], 0, samples) } else { 0 };
    let work = Film::bytes(size, 0, samples).saturating_mul(2);
    Plan { paths: &options.outputs, size, state, work, threads: 1 }
}

/// A part, of which only the metadata have been read.
struct PartFile<'a> {
    stored: StoredRender<'a>,
    share: Share,
}

impl<'a> PartFile<'a> {
    fn open(path: &'a Path) -> Result<Self, Failure> {
        let stored = StoredRender::open(path)?;
        let share = stored.info.part.ok_or_else(|| {
            Failure::input(format!(
                "{}: a whole render, not a part of one; expected pictures that `render --part K/N` wrote",
                path_name(path)
            ))
        })?;
        Ok(Self { stored, share })
    }

    /// Reads its samples; refuses it if it was interrupted.
    fn film(&self) -> Result<Film, Failure> {
        let film = self.stored.film()?;
        let range = self.share.of_samples(self.stored.info.samples);
        let is_its = range.is_some_and(|range| range.first == film.first() && range.end == film.samples());
        if is_its && film.is_even() {
            return Ok(film);
        }
        let expected = range.map_or(0, |range| range.end - range.first);
        let found = film.mean_samples();
        let path = path_name(self.stored.path);
        Err(Failure::input(format!(
            "{path}: found {found:.2} samples per pixel, but part {} has {expected}: it was interrupted; render it again",
            self.share
        )))
    }
}

/// Refuses parts of different renders, a part that is there twice, and one that is missing; `parts` is in order.
fn check_complete(parts: &[PartFile]) -> Result<(), Failure> {
    let Some(first) = parts.first() else { return Ok(()) };
    let (count, samples) = (first.share.count, first.stored.info.samples);
    for part in parts {
        part.stored.check_mix(&first.stored)?;
        let (here, there) = (path_name(part.stored.path), path_name(first.stored.path));
        if part.stored.info.samples != samples {
            return Err(Failure::input(format!(
                "{here}: is part of a render of {} samples, but {there} of one of {samples}; expected parts of the same render",
                part.stored.info.samples
            )));
        }
        if part.share.count != count {
            return Err(Failure::input(format!(
                "{here}: is part {}, but {there} is part {}; expected parts of a render that is shared in the same number",
                part.share, first.share
            )));
        }
    }
    for pair in parts.windows(2) {
        if pair[0].share == pair[1].share {
            let [one, other] = [0, 1].map(|i| path_name(pair[i].stored.path));
            return Err(Failure::input(format!(
                "{other}: is part {}, and so is {one}; name each part once",
                pair[0].share
            )));
        }
    }
    let mut numbers = parts.iter().map(|part| part.share.number).peekable();
    let is_missing = |number: &u32| numbers.next_if_eq(number).is_none();
    // Enough to see what went wrong.
    let shown: Vec<String> =
        (1..=count).filter(is_missing).take(5).map(|number| Share { number, count }.to_string()).collect();
    if shown.is_empty() {
        return Ok(());
    }
    let more = count as usize - parts.len() - shown.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let shown = shown.join(", ");
    Err(Failure::input(format!(
        "found {} of {count} parts; missing: {shown}{more}; render these with --part",
        parts.len()
    )))
}
