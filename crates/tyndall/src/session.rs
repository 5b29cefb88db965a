//! A session: a scene, its integrator and the film, refined slice by slice.

use crate::film::{Film, Image};
use crate::integrator::{Integrator, Kept, Stop, TileState};
use crate::scene::{Difference, IntegratorKind, Scene};
use crate::simd::Level;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// When a slice of work ends; the first limit met counts.
#[derive(Clone, Debug)]
pub struct Budget {
    /// Samples that every pixel shall have in the end.
    pub samples: u32,
    /// Point in time at which to stop; pixels that have had their turn then have a sample more than others.
    pub deadline: Option<Instant>,
    /// Raised from elsewhere to stop soon.
    pub cancel: Arc<AtomicBool>,
}

impl Budget {
    /// So many samples in every pixel, whatever it takes.
    #[must_use]
    pub fn samples(samples: u32) -> Self {
        Self { samples, deadline: None, cancel: Arc::default() }
    }
}

/// How far a session is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples that every pixel has at least.
    pub samples: u32,
    /// Samples per pixel on average.
    pub mean_samples: f64,
}

/// Renders a scene on threads of its own.
pub struct Session {
    scene: Scene,
    integrator: Integrator,
    film: Film,
    /// What the method keeps of each tile beside its pixels.
    tiles: Vec<TileState>,
    threads: Arc<rayon::ThreadPool>,
    level: Level,
    /// Bytes in which samples are kept for edits to come.
    sample_memory: usize,
    /// Samples per pixel, on average, that the last edit left in the film.
    kept: f64,
    /// Time spent since the last edit on what a sample needs beforehand, and on samples.
    spent: [Duration; 2],
}

impl Session {
    /// Prepares a scene; `threads` is shared with whoever made the scene, never the global pool.
    #[must_use]
    pub fn new(scene: Scene, threads: Arc<rayon::ThreadPool>) -> Self {
        Self::with_level(scene, threads, Level::best())
    }

    /// [`Self::new`] with certain vector instructions instead of the widest.
    #[must_use]
    pub fn with_level(scene: Scene, threads: Arc<rayon::ThreadPool>, level: Level) -> Self {
        let integrator = threads.install(|| Integrator::new(&scene, level, 0));
        let mut film = Film::new(scene.size);
        let tiles = vec![TileState::default(); film.tiles_mut().len()];
        let (kept, spent) = (0.0, [Duration::ZERO; 2]);
        Self { integrator, film, tiles, scene, threads, level, sample_memory: 0, kept, spent }
    }

    /// From now on `path` keeps in so many bytes the first samples of each pixel, 32 bytes for each, so that an edit takes again
    /// those alone that it touched; 0, as at first, keeps none. It changes no picture. What was rendered so far is begun anew if
    /// the number of bytes changes. Other methods do not ask: photon mapping keeps what it needs, marching nothing.
    pub fn keep_samples(&mut self, bytes: usize) {
        if self.sample_memory != bytes {
            self.sample_memory = bytes;
            if matches!(self.integrator, Integrator::Path(_)) {
                self.begin_anew();
            }
        }
    }

    fn begin_anew(&mut self) {
        self.film = Film::new(self.scene.size);
        self.tiles = vec![TileState::default(); self.film.tiles_mut().len()];
        let Self { scene, threads, level, sample_memory, .. } = self;
        self.integrator = threads.install(|| Integrator::new(scene, *level, *sample_memory));
    }

    /// Goes on with an edited scene; gives what the edit changed. This is the only place where light is discarded, and the
    /// difference alone decides what: after it the session will come to the picture that a new one would.
    pub fn set_scene(&mut self, scene: Scene) -> Difference {
        let difference = Difference::between(&self.scene, &scene);
        let old = std::mem::replace(&mut self.scene, scene);
        if self.integrator.is_touched_by(&difference) {
            self.film = Film::new(self.scene.size);
            self.tiles.resize_with(self.film.tiles_mut().len(), TileState::default);
            let Self { integrator, tiles, scene, threads, .. } = self;
            if !threads.install(|| integrator.update(&old, scene, &difference, tiles)) {
                self.begin_anew();
            }
        } else {
            self.integrator.count_anew(&mut self.tiles);
        }
        self.kept = self.film.mean_samples();
        self.spent = [Duration::ZERO; 2];
        difference
    }

    /// Of what the session is made of, the share that was really computed since the last edit, or since the beginning:
    /// of the `pixels` the share of their samples so far; of light paths (`photons`) and view-ray `segments` those computed.
    #[must_use]
    pub fn recomputed(&self) -> Vec<(&'static str, f64)> {
        let share = |[all, computed]: [usize; 2]| computed as f64 / all.max(1) as f64;
        match &self.integrator {
            Integrator::RayMarch(_) | Integrator::Path(_) => {
                let [width, height] = self.scene.size.map(f64::from);
                let found: usize = self.tiles.iter().map(|tile| tile.samples()[2]).sum();
                let samples = self.film.mean_samples();
                let taken = samples - self.kept - found as f64 / (width * height);
                vec![("pixels", if samples > 0.0 { taken.max(0.0) / samples } else { 0.0 })]
            }
            Integrator::Photon(photon) => {
                let segments = self.tiles.iter().map(TileState::segments);
                let segments = segments.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
                vec![("photons", share(photon.paths())), ("segments", share(segments))]
            }
        }
    }

    /// Of what is kept through edits beside pixels, how many light paths and segments, or samples, were computed since the last
    /// edit; `None` where nothing is kept.
    #[must_use]
    pub fn computed(&self) -> Option<usize> {
        match &self.integrator {
            Integrator::Photon(photon) => {
                Some(photon.paths()[1] + self.tiles.iter().map(|tile| tile.segments()[1]).sum::<usize>())
            }
            Integrator::Path(path) if path.keeps() => {
                Some(self.tiles.iter().map(|tile| tile.samples()[1]).sum())
            }
            Integrator::Path(_) | Integrator::RayMarch(_) => None,
        }
    }

    /// Places on view rays where the first sample gathered photons since the last edit, or since the beginning: what segments
    /// cost, which hold few or many of them.
    #[must_use]
    pub fn gathers(&self) -> usize {
        self.tiles.iter().map(TileState::gathers).sum()
    }

    /// A copy of what the session keeps through edits beside pixels, for checks.
    #[must_use]
    pub fn snapshot(&self) -> Option<Kept> {
        Kept::of(&self.integrator, &self.tiles)
    }

    /// Seconds spent since the last edit, or since the beginning: of a photon mapper on `photons` and on `segments` and later
    /// passes, of others on `pixels`.
    #[must_use]
    pub fn spent(&self) -> Vec<(&'static str, f64)> {
        let [before, samples] = self.spent.map(|time| time.as_secs_f64());
        match &self.integrator {
            Integrator::RayMarch(_) | Integrator::Path(_) => vec![("pixels", samples)],
            Integrator::Photon(_) => vec![("photons", before), ("segments", samples)],
        }
    }

    /// What is kept for edits to come: of each kind how many there are, and the bytes of all together. A photon mapper keeps
    /// light `paths`, their `photons`, the `map` that sorts these, and `segments`; the path tracer `samples` if told so.
    #[must_use]
    pub fn kept(&self) -> Vec<(&'static str, [usize; 2])> {
        match &self.integrator {
            Integrator::RayMarch(_) => Vec::new(),
            Integrator::Path(_) => {
                let samples = self.tiles.iter().map(|tile| [tile.samples()[0], tile.bytes()]);
                vec![("samples", samples.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]))]
            }
            Integrator::Photon(photon) => {
                let ([of_paths, of_photons, map], photons) = (photon.bytes(), photon.photons());
                let paths = [photon.paths()[0], of_paths];
                let segments = self.tiles.iter().map(|tile| [tile.segments()[0], tile.bytes()]);
                let segments = segments.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
                vec![
                    ("paths", paths),
                    ("photons", [photons, of_photons]),
                    ("map", [photons, map]),
                    ("segments", segments),
                ]
            }
        }
    }

    /// Threads that work.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// What is rendered.
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

    /// Works until the budget is spent: pass by pass over all tiles, so that the picture is complete
    /// as early as can be. Every sample follows from its pixel and number, so threads and slices leave
    /// no trace in the bits.
    pub fn refine(&mut self, budget: &Budget) -> Progress {
        let stop = || Stop::when(&budget.cancel, budget.deadline);
        let Self { scene, integrator, film, tiles, threads, spent, .. } = self;
        while film.samples() < budget.samples && !stop().reached() {
            let so_far = film.samples();
            let begun = Instant::now();
            let prepared = threads.install(|| integrator.prepare(scene, so_far, &stop));
            spent[0] += begun.elapsed();
            if !prepared {
                break;
            }
            // Several passes at once, as soon as that delays no picture much, spare threads the waiting for each other.
            let passes = (so_far / 4).clamp(1, 16).min(integrator.samples_at_once());
            let pass = so_far.saturating_add(passes).min(budget.samples);
            let integrator = &*integrator;
            let begun = Instant::now();
            let work = film.tiles_mut().par_iter_mut().zip(&mut *tiles).with_max_len(1);
            threads.install(|| {
                work.for_each(|(tile, state)| {
                    let stop = stop();
                    if !stop.reached() {
                        integrator.refine(scene, tile, state, pass, &stop);
                    }
                });
            });
            spent[1] += begun.elapsed();
        }
        self.progress()
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress { samples: self.film.samples(), mean_samples: self.film.mean_samples() }
    }

    /// Noise of the picture so far, see [`Film::relative_error`]; `None` for a method without any, whose
    /// samples differ only by the pixel filter. Costs a walk over all pixels.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        match self.scene.render.integrator {
            IntegratorKind::RayMarch { .. } => None,
            IntegratorKind::Path | IntegratorKind::Photon(_) => self.film.relative_error(),
        }
    }
}
