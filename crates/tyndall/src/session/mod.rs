//! A session: a scene, its integrator and the film, refined in slices of time.

use crate::film::{Film, Goal, Image, Stride, Tone, Viewer};
use crate::integrator::{
    Edited, Engine, KeptItems, Limits, MethodReport, PixelCounts, Resources, Updated, WorkShare,
    drop_elsewhere, method_of,
};
use crate::scene::{Difference, Scene};
use crate::simd::Level;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// When a slice of work ends: as soon as any limit is reached.
#[derive(Clone, Debug)]
pub struct Budget {
    /// Number of samples to reach in every pixel.
    pub samples: u32,
    /// Pixels that are to have one sample more.
    pub more: Option<Stride>,
    /// Most samples to take in this slice, of all pixels together. Where it stops does not depend on threads. A slice takes at least one
    /// turn of one tile: up to 192 samples in the first pass, up to 256 later.
    pub pixel_samples: Option<u64>,
    /// Time at which to stop; some pixels may then have more samples than others.
    pub deadline: Option<Instant>,
    /// Set by another thread to stop soon.
    pub cancel: Arc<AtomicBool>,
}

impl Budget {
    /// This many samples in every pixel, without a time limit.
    #[must_use]
    pub fn samples(samples: u32) -> Self {
        Self { samples, more: None, pixel_samples: None, deadline: None, cancel: Arc::default() }
    }

    /// The first sample of some pixels: a coarse picture.
    #[must_use]
    pub fn coarse(stride: Stride) -> Self {
        Self { more: Some(stride), ..Self::samples(0) }
    }

    fn goal(&self) -> Goal {
        Goal { samples: self.samples, more: self.more }
    }
}

/// Progress of a session.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Minimum number of samples per pixel; in a part of a picture, those of the parts before it count.
    pub samples: u32,
    /// Samples that were taken of all pixels together; without those of earlier parts.
    pub pixel_samples: u64,
    /// Samples that were taken per pixel, on average; without those of earlier parts.
    pub mean_samples: f64,
    /// Fraction of the pixels that have a sample.
    pub coverage: f64,
    /// Noise of the picture, see [`Film::measured_error`]; `None` for a method without noise.
    pub relative_error: Option<f64>,
    /// Whether the first samples must wait: kept light has to be updated after an edit, or new light to be prepared. Later samples, which
    /// may need more light than the first, do not count.
    pub settling: bool,
}

/// Seconds that a stage of the work took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTime {
    /// Name of the stage.
    pub name: &'static str,
    /// Time spent.
    pub seconds: f64,
}

/// Time spent since the last edit.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    /// On preparation before sampling.
    preparing: Duration,
    sampling: Duration,
}

/// Renders a scene on a given thread pool.
pub struct Session {
    scene: Scene,
    /// The scene that the engine's light belongs to, if edits have touched it since; the film is then empty.
    unsettled: Option<Scene>,
    engine: Box<dyn Engine>,
    film: Film,
    threads: Arc<rayon::ThreadPool>,
    resources: Resources,
    /// Mean number of samples per pixel that the last edit left in the film.
    left: f64,
    spent: Spent,
}

impl Session {
    /// Prepares a scene; `threads` is shared with the code that built the scene, never the global pool.
    #[must_use]
    pub fn new(scene: Scene, threads: Arc<rayon::ThreadPool>) -> Self {
        Self::with_level(scene, threads, Level::best())
    }

    /// [`Self::new`] with the given vector instructions instead of the widest.
    #[must_use]
    pub fn with_level(scene: Scene, threads: Arc<rayon::ThreadPool>, level: Level) -> Self {
        Self::with_resources(scene, threads, Resources { level, edit_memory: 0 })
    }

    /// [`Self::new`] with the given vector instructions, and with memory for data that only future edits use. That
    /// memory does not change the picture.
    #[must_use]
    pub fn with_resources(scene: Scene, threads: Arc<rayon::ThreadPool>, resources: Resources) -> Self {
        let engine = threads.install(|| method_of(&scene.render.method).start(&scene, &resources));
        let film = Film::new(scene.size);
        let (left, spent) = (0.0, Spent::default());
        Self { engine, film, scene, unsettled: None, threads, resources, left, spent }
    }

    /// Continues with an edited scene, and returns what changed. This only drops the film, if the edit affects it; the next
    /// [`Self::refine`] updates kept light, once for all edits made until then. The picture is that of a new session.
    pub fn set_scene(&mut self, scene: Scene) -> Difference {
        let difference = Difference::between(&self.scene, &scene);
        let old = std::mem::replace(&mut self.scene, scene);
        if self.unsettled.is_some() {
            drop_elsewhere(old);
            self.clear_film();
        } else if self.engine.is_touched_by(&difference) {
            self.unsettled = Some(old);
            self.clear_film();
        }
        self.engine.count_anew();
        self.left = self.film.mean_samples();
        self.spent = Spent::default();
        difference
    }

    fn clear_film(&mut self) {
        if self.film.size() == self.scene.size {
            self.film.clear();
        } else {
            drop_elsewhere(std::mem::replace(&mut self.film, Film::new(self.scene.size)));
        }
    }

    /// Tells the engine of all edits since the last call, as one difference between two scenes; it discards what they affect, now or
    /// when it next comes across it. False if stopped first.
    fn settle(&mut self, limits: &Limits) -> bool {
        let Self { scene, unsettled, engine, threads, resources, .. } = self;
        let Some(old) = unsettled else { return true };
        let difference = Difference::between(old, scene);
        let edit = Edited { old, new: scene, difference: &difference };
        let tiles = Film::tile_count(scene.size);
        match threads.install(|| engine.update(&edit, tiles, limits)) {
            Updated::Stopped => return false,
            Updated::Done => {}
            Updated::StartAnew => {
                let start = || method_of(&scene.render.method).start(scene, resources);
                drop_elsewhere(std::mem::replace(engine, threads.install(start)));
            }
        }
        drop_elsewhere(unsettled.take());
        true
    }

    /// What was computed since the last edit, or since the beginning, and what is kept for future edits.
    #[must_use]
    pub fn report(&self) -> MethodReport {
        let pixels = self.scene.size.iter().map(|&n| n as usize).product();
        let pixels = PixelCounts { pixels, samples: self.film.mean_samples(), left: self.left };
        self.engine.report(&pixels)
    }

    /// For each kind of work item, the share that was computed since the last edit, or since the beginning.
    #[must_use]
    pub fn recomputed(&self) -> Vec<WorkShare> {
        self.report().recomputed
    }

    /// A copy of what the session keeps across edits besides pixels, for tests; `None` if it keeps nothing.
    #[must_use]
    pub fn kept_items(&self) -> Option<Box<dyn KeptItems>> {
        self.engine.kept_items()
    }

    /// Seconds that each stage of the work took since the last edit, or since the beginning.
    #[must_use]
    pub fn spent(&self) -> Vec<StageTime> {
        let stages = self.report().stages;
        let Spent { preparing, sampling } = self.spent;
        let time = |name, time: Duration| StageTime { name, seconds: time.as_secs_f64() };
        let preparation = stages.preparation.map(|name| time(name, preparing));
        preparation.into_iter().chain([time(stages.sampling, sampling)]).collect()
    }

    /// Number of threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// The scene being rendered.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The film so far.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The picture so far.
    #[must_use]
    pub fn image(&self) -> Image {
        self.film.image()
    }

    /// Brings a viewer's picture up to date, on the session's threads; see [`Viewer::look`].
    pub fn look(&self, viewer: &mut Viewer, tone: Tone, picture: &mut Vec<[u8; 3]>) {
        self.threads.install(|| viewer.look(&self.film, tone, self.resources.level, picture));
    }

    /// Continues with the samples of another film of the same scene and size: that of an earlier session, or an empty part.
    ///
    /// # Panics
    /// If the size differs.
    pub fn go_on_with(&mut self, film: Film) {
        assert_eq!(film.size(), self.scene.size, "a film of the scene's size");
        self.film = film;
        self.left = self.film.mean_samples();
    }

    /// Renders until the budget is spent, pass by pass over all tiles, and the first pass from coarse pixels to fine ones, so that
    /// the whole picture shows as early as possible. Every sample is determined by its pixel and number, so the finished picture
    /// does not depend on threads or slices.
    pub fn refine(&mut self, budget: &Budget) -> Progress {
        let limits = Limits { cancel: &budget.cancel, deadline: budget.deadline };
        if self.film.has_reached(budget.goal()) || limits.stop().reached() {
            return self.progress();
        }
        let begun = Instant::now();
        let settled = self.settle(&limits);
        self.spent.preparing += begun.elapsed();
        if !settled {
            return self.progress();
        }
        let Self { scene, engine, film, threads, spent, .. } = self;
        let (begin, mut may_exceed) = (film.pixel_samples(), true);
        let end = budget.pixel_samples.map(|most| begin.saturating_add(most));
        while !film.has_reached(budget.goal()) && !limits.stop().reached() {
            let left = end.map(|end| end.saturating_sub(film.pixel_samples()));
            if left == Some(0) {
                break;
            }
            let so_far = film.samples();
            let begun = Instant::now();
            let prepared = threads.install(|| engine.prepare(scene, so_far, &limits));
            spent.preparing += begun.elapsed();
            if !prepared {
                break;
            }
            // Later, several passes at once do not delay the picture noticeably, and threads wait less for each other.
            let passes =
                if left.is_some() { 1 } else { (so_far / 4).clamp(1, 16).min(engine.samples_at_once()) };
            let pass = Goal::samples(so_far.saturating_add(passes));
            let is_first = so_far == film.first();
            let next = if is_first { film.coarse_goal().unwrap_or(pass) } else { pass };
            let goal = if next.is_beyond(budget.goal()) { budget.goal() } else { next };
            let Some(tiles) = left.map_or(Some(usize::MAX), |left| film.tiles_within(goal, left, may_exceed))
            else {
                break;
            };
            may_exceed = false;
            let begun = Instant::now();
            threads.install(|| engine.refine(scene, film, goal, tiles, &limits));
            spent.sampling += begun.elapsed();
        }
        self.progress()
    }

    /// Progress so far.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress {
            samples: self.film.samples(),
            pixel_samples: self.film.pixel_samples(),
            mean_samples: self.film.mean_samples(),
            coverage: self.film.coverage(),
            relative_error: self.film.measured_error().filter(|_| self.has_noise()),
            settling: self.unsettled.is_some() || self.engine.is_settling(&self.scene, self.film.first()),
        }
    }

    /// Noise of the picture so far, see [`Film::relative_error`]; `None` for a method without noise, whose
    /// samples differ only by the pixel filter. Visits all pixels.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        if self.has_noise() { self.film.relative_error() } else { None }
    }

    fn has_noise(&self) -> bool {
        method_of(&self.scene.render.method).has_noise
    }
}

#[cfg(test)]
mod tests;
