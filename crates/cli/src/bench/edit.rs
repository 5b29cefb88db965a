//! The cost of an edit of a photon-mapped scene, against a render of the edited scene from nothing.

use super::scenes::Bench;
use super::timing::{Effort, median};
use crate::Failure;
use serde_json::{Value, json};
use std::time::Instant;
use tyndall::integrator::KeptCount;
use tyndall::scene::Scene;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document;

/// What an edit is compared with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// Renders from nothing, whose picture it must equal bit for bit.
    Equal,
    /// Renders from nothing, whose picture it need not equal.
    Unequal,
    /// The first picture of its own session: as much work where only a colour is edited, in half the time, without a check.
    First,
}

/// An edit to measure.
pub struct Edit<'a> {
    /// The document.
    pub bench: &'a Bench,
    /// The patch from the document to the scene before the edit.
    pub before: Value,
    /// The edit itself, a patch to that scene.
    pub patch: Value,
    /// What it is compared with.
    pub against: Against,
    /// Whether one segment per ray is measured too.
    pub plain: bool,
    /// Renders from nothing are repeated for this many seconds, edits for four times as many; each runs at least once.
    pub patience: f64,
}

/// A figure for each stage of a photon mapper; the stages are named for the items that they compute.
#[derive(Clone, Copy, Default)]
pub struct PerStage {
    /// Tracing light paths.
    pub photons: f64,
    /// Marching the segments of view rays.
    pub segments: f64,
}

impl PerStage {
    /// The figures, looked up by the stages' names.
    fn by_name(figure: impl Fn(&str) -> f64) -> Self {
        Self { photons: figure("photons"), segments: figure("segments") }
    }

    /// Both together.
    pub fn sum(self) -> f64 {
        self.photons + self.segments
    }
}

/// How long a picture took.
#[derive(Clone, Copy)]
pub struct Seconds {
    /// The stages alone.
    pub stages: PerStage,
    /// From the document to the picture.
    pub total: f64,
}

impl Seconds {
    /// Of the last picture of a session, begun at `start`.
    fn of(session: &Session, start: Instant) -> Self {
        let total = start.elapsed().as_secs_f64();
        Self { stages: PerStage::by_name(|stage| seconds(session, stage)), total }
    }
}

/// What an edit cost; times are medians.
pub struct Cost {
    /// A render of the edited scene from nothing.
    pub scratch: Seconds,
    /// The edit of the live session.
    pub edit: Seconds,
    /// The share of the photons and segments of a render from nothing that the edit computed.
    pub shares: PerStage,
    /// The share of the gathers of a render from nothing that the edit made.
    pub gathers: f64,
    /// The whole from nothing with one segment per ray.
    pub plain: Option<f64>,
    /// See [`Session::kept`].
    pub kept: Vec<KeptCount>,
}

/// A live session that shows the scene before the edits.
pub struct Live {
    before: Scene,
    session: Session,
    /// How long its first picture took.
    pub first: Seconds,
}

impl Live {
    /// Renders a patched document from nothing.
    pub fn start(bench: &Bench, patch: &Value, level: Level) -> Result<Self, Failure> {
        /// As much as is of use.
        const BYTES: usize = 1 << 30;
        let start = Instant::now();
        let before = bench.scene(patch)?;
        let session = bench.render_for_edits(&before, level, 1, BYTES);
        let first = Seconds::of(&session, start);
        Ok(Self { before, session, first })
    }

    /// Goes back to the scene before the edits.
    pub fn restore(&mut self) {
        self.session.set_scene(self.before.clone());
        self.session.refine(&Budget::samples(1));
    }
}

impl Edit<'_> {
    /// Plays the edit against a live session, again and again, by turns with renders from nothing.
    ///
    /// # Errors
    /// Where the live picture is not the one from nothing.
    pub fn measure(&self, effort: &Effort, level: Level) -> Result<Cost, Failure> {
        self.measure_in(&mut Live::start(self.bench, &self.before, level)?, effort, level)
    }

    /// The same in a live session that shows the scene before the edit.
    ///
    /// # Errors
    /// As [`Self::measure`].
    pub fn measure_in(&self, live: &mut Live, effort: &Effort, level: Level) -> Result<Cost, Failure> {
        /// Edits after which the median hardly moves.
        const EDITS: usize = 3;
        let bench = self.bench;
        let after = document::apply(&self.before, &self.patch);
        let one = document::apply(&after, &json!({ "render": { "photon": { "segments": 1 } } }));
        let (mut scratch, mut edit, mut plain) = (Times::default(), Times::default(), Times::default());
        let Live { before, session: live, first } = live;
        if self.against == Against::First {
            scratch.0.push(*first);
        }
        let (mut picture, mut all, mut kept) = (Vec::new(), computed(live), live.report().kept);
        let (mut all_gathers, mut gathers) = (gathers_of(live), 0.0);
        let mut shares = PerStage::default();
        let begun = Instant::now();
        let patient = |times: f64| begun.elapsed().as_secs_f64() < times * self.patience && effort.has_time();
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
            edit.add(live, start);
            let done = computed(live);
            let share = |done: f64, all: f64| if all > 0.0 { done / all } else { 0.0 };
            shares = PerStage {
                photons: share(done.photons, all.photons),
                segments: share(done.segments, all.segments),
            };
            gathers = gathers_of(live) as f64 / all_gathers.max(1) as f64;
            if self.against == Against::Equal {
                check(&bits(live), &picture)?;
            }
            if !patient(4.0) {
                break;
            }
        }
        let plain = self.plain.then(|| plain.medians().total);
        Ok(Cost { scratch: scratch.medians(), edit: edit.medians(), shares, gathers, plain, kept })
    }
}

impl Cost {
    /// Time of a render from nothing over that of the edit.
    pub fn speed_up(&self) -> f64 {
        self.scratch.total / self.edit.total
    }

    /// Seconds that the edit would take if it cost the same share of each stage's time as of its items.
    pub fn due(&self) -> f64 {
        self.due_for(self.shares.segments)
    }

    fn due_for(&self, share_of_segments: f64) -> f64 {
        let PerStage { photons, segments } = self.scratch.stages;
        self.shares.photons * photons + share_of_segments * segments
    }

    /// The speed-up if the edit took no longer than [`Self::due`]; `None` where nothing is computed again, which allows any.
    pub fn bound(&self) -> Option<f64> {
        self.bound_for(self.shares.segments)
    }

    /// The same, with each segment weighted by its number of gathers.
    pub fn bound_by_gathers(&self) -> Option<f64> {
        self.bound_for(self.gathers)
    }

    fn bound_for(&self, share_of_segments: f64) -> Option<f64> {
        let due = self.due_for(share_of_segments);
        (due > 0.0).then(|| self.scratch.stages.sum() / due)
    }
}

/// The times of several runs.
#[derive(Default)]
struct Times(Vec<Seconds>);

impl Times {
    fn add(&mut self, session: &Session, start: Instant) {
        self.0.push(Seconds::of(session, start));
    }

    fn medians(self) -> Seconds {
        let of = |time: fn(&Seconds) -> f64| median(self.0.iter().map(time).collect());
        let stages =
            PerStage { photons: of(|run| run.stages.photons), segments: of(|run| run.stages.segments) };
        Seconds { stages, total: of(|run| run.total) }
    }
}

/// Seconds that a stage took since the last edit.
pub fn seconds(session: &Session, stage: &str) -> f64 {
    session.spent().iter().find(|time| time.name == stage).map_or(0.0, |time| time.seconds)
}

/// The shares of photons and segments computed since the last edit.
fn computed(session: &Session) -> PerStage {
    let recomputed = session.recomputed();
    PerStage::by_name(|name| recomputed.iter().find(|work| work.name == name).map_or(0.0, |work| work.share))
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
        "the picture after the edit is not the one from nothing: {count} of {all} numbers differ, the first is {a} instead of {b}"
    )))
}
