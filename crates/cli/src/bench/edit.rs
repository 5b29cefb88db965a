//! What an edit of a photon-mapped scene costs, against the scene from nothing.

use super::scenes::Bench;
use super::timing::{Effort, median};
use crate::Failure;
use serde_json::{Value, json};
use std::time::Instant;
use tyndall::integrator::KeptCount;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document;

/// What an edit is held against.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// Renders from nothing, to whose picture it must come bit for bit.
    Equal,
    /// Renders from nothing, to whose picture it need not come.
    Unequal,
    /// The first picture of its own session, which is as much work where the edit is of a colour: half the time, no check.
    First,
}

/// An edit.
pub struct Edit<'a> {
    /// The document.
    pub bench: &'a Bench,
    /// The patch that gives the scene before it.
    pub before: Value,
    /// The patch that it is.
    pub patch: Value,
    pub against: Against,
    /// Whether a single segment per ray is measured too.
    pub plain: bool,
    /// Seconds during which the scene from nothing is rendered again, and a quarter of those during which the edit is played
    /// again; both are once in any case.
    pub patience: f64,
}

/// What it took, as medians.
pub struct Cost {
    /// From nothing: seconds for photons, for segments, and from the edited document to the picture.
    pub scratch: [f64; 3],
    /// The edit: the same.
    pub edit: [f64; 3],
    /// Of photons and segments that a picture from nothing computes, the share that the edit did.
    pub shares: [f64; 2],
    /// Of the places on view rays where a picture from nothing gathers photons, the share at which the edit did.
    pub gathers: f64,
    /// The whole from nothing with one segment per ray.
    pub plain: Option<f64>,
    /// See [`Session::kept`].
    pub kept: Vec<KeptCount>,
}

impl Edit<'_> {
    /// Plays the edit against a live session, again and again, by turns with renders from nothing.
    ///
    /// # Errors
    /// Where the live picture is not the one from nothing.
    pub fn measure(&self, effort: &Effort, level: Level) -> Result<Cost, Failure> {
        /// Edits after which the median hardly moves.
        const EDITS: usize = 3;
        let bench = self.bench;
        let after = document::apply(&self.before, &self.patch);
        let one = document::apply(&after, &json!({ "render": { "photon": { "segments": 1 } } }));
        let (mut scratch, mut edit, mut plain) = (Times::default(), Times::default(), Times::default());
        let start = Instant::now();
        let before = bench.scene(&self.before)?;
        let mut live = bench.render(&before, level, 1);
        if self.against == Against::First {
            scratch.add(&live, start);
        }
        let (mut picture, mut all, mut kept) = (Vec::new(), computed(&live), live.report().kept);
        let (mut all_gathers, mut gathers) = (gathers_of(&live), 0.0);
        let mut shares = [0.0; 2];
        let begun = Instant::now();
        let patient = |times: f64| begun.elapsed().as_secs_f64() < times * self.patience;
        for round in 0..effort.rounds.min(EDITS) {
            if round > 0 {
                live.set_scene(before.clone());
                live.refine(&Budget::samples(1));
            }
            if self.against != Against::First && (round == 0 || patient(1.0)) {
                let start = Instant::now();
                let fresh = bench.render(&bench.scene(&after)?, level, 1);
                scratch.add(&fresh, start);
                (picture, all, kept) = (bits(&fresh), computed(&fresh), fresh.report().kept);
                all_gathers = gathers_of(&fresh);
            }
            if self.plain && (round == 0 || patient(1.0)) {
                let start = Instant::now();
                plain.add(&bench.render(&bench.scene(&one)?, level, 1), start);
            }
            let start = Instant::now();
            live.set_scene(bench.scene(&after)?);
            live.refine(&Budget::samples(1));
            edit.add(&live, start);
            let done = computed(&live);
            shares = [0, 1].map(|i| if all[i] > 0.0 { done[i] / all[i] } else { 0.0 });
            gathers = gathers_of(&live) as f64 / all_gathers.max(1) as f64;
            if self.against == Against::Equal {
                check(&bits(&live), &picture)?;
            }
            if !patient(4.0) {
                break;
            }
        }
        let plain = self.plain.then(|| plain.medians()[2]);
        Ok(Cost { scratch: scratch.medians(), edit: edit.medians(), shares, gathers, plain, kept })
    }
}

impl Cost {
    /// How much sooner the edited picture is there than one from nothing.
    pub fn speed_up(&self) -> f64 {
        self.scratch[2] / self.edit[2]
    }

    /// Seconds that the shares computed would take if they cost their part of the whole: of photons, and of segments.
    pub fn due(&self) -> f64 {
        self.due_for(self.shares[1])
    }

    fn due_for(&self, of_segments: f64) -> f64 {
        self.shares[0] * self.scratch[0] + of_segments * self.scratch[1]
    }

    /// The speed-up if nothing cost but these.
    pub fn bound(&self) -> f64 {
        (self.scratch[0] + self.scratch[1]) / self.due().max(1e-9)
    }

    /// The same, with each segment weighed by the places in it where photons are gathered.
    pub fn bound_by_gathers(&self) -> f64 {
        (self.scratch[0] + self.scratch[1]) / self.due_for(self.gathers).max(1e-9)
    }
}

/// Seconds of the stages and of the whole, run by run.
#[derive(Default)]
struct Times([Vec<f64>; 3]);

impl Times {
    fn add(&mut self, session: &Session, start: Instant) {
        let total = start.elapsed().as_secs_f64();
        let [photons, segments] = STAGES.map(|stage| seconds(session, stage));
        for (times, time) in self.0.iter_mut().zip([photons, segments, total]) {
            times.push(time);
        }
    }

    fn medians(self) -> [f64; 3] {
        self.0.map(median)
    }
}

/// The stages of a photon mapper, which are its work items too.
const STAGES: [&str; 2] = ["photons", "segments"];

/// Seconds that a stage took since the last edit.
pub fn seconds(session: &Session, stage: &str) -> f64 {
    session.spent().iter().find(|time| time.name == stage).map_or(0.0, |time| time.seconds)
}

/// Of photons and segments the shares computed since the last edit.
fn computed(session: &Session) -> [f64; 2] {
    let recomputed = session.recomputed();
    let share = |name| recomputed.iter().find(|work| work.name == name).map_or(0.0, |work| work.share);
    STAGES.map(share)
}

/// Positions on view rays where photons were gathered since the last edit.
fn gathers_of(session: &Session) -> usize {
    session.report().counts.iter().find(|count| count.name == "gathers").map_or(0, |gathers| gathers.count)
}

/// The picture as bits: colour and alpha of all pixels, then their depth.
pub fn bits(session: &Session) -> Vec<u32> {
    let image = session.image();
    image.rgba.as_flattened().iter().chain(&image.depth).map(|x| x.to_bits()).collect()
}

/// Refuses a picture that is not the one from nothing.
///
/// # Errors
/// With the first numbers that differ.
pub fn check(live: &[u32], fresh: &[u32]) -> Result<(), Failure> {
    let numbers = |(a, b): (&u32, &u32)| (a != b).then(|| (f32::from_bits(*a), f32::from_bits(*b)));
    let mut differing = live.iter().zip(fresh).filter_map(numbers);
    let Some((a, b)) = differing.next() else { return Ok(()) };
    let (count, all) = (1 + differing.count(), live.len());
    Err(Failure::input(format!(
        "the picture after the edit is not the one from nothing: {count} of {all} numbers differ, the first is {a} in place of {b}"
    )))
}
