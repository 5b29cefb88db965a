//! A session: a scene, its integrator and the film, refined slice by slice.

use crate::film::{Film, Image};
use crate::integrator::{Integrator, Pending, Stop};
use crate::scene::{Difference, IntegratorKind, Scene};
use crate::simd::Level;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

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
    /// What a stop left half done, per tile.
    pending: Vec<Pending>,
    threads: Arc<rayon::ThreadPool>,
    level: Level,
    /// Samples per pixel, on average, that the last edit left valid.
    kept: f64,
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
        let integrator = threads.install(|| Integrator::new(&scene, level));
        let mut film = Film::new(scene.size);
        let pending = vec![Pending::default(); film.tiles_mut().len()];
        Self { integrator, film, pending, scene, threads, level, kept: 0.0 }
    }

    /// Goes on with an edited scene; gives what the edit changed. This is the only place where light is discarded, and the
    /// difference alone decides what: after it the session will come to the picture that a new one would.
    pub fn set_scene(&mut self, scene: Scene) -> Difference {
        let difference = Difference::between(&self.scene, &scene);
        if self.integrator.is_touched_by(&difference) {
            *self = Self::with_level(scene, self.threads.clone(), self.level);
        } else {
            self.scene = scene;
            self.kept = self.film.mean_samples();
        }
        difference
    }

    /// Of what the session is made of, the share that was really computed since the last edit, or since the beginning:
    /// of the `pixels` those that took samples.
    #[must_use]
    pub fn recomputed(&self) -> [(&'static str, f64); 1] {
        [("pixels", (self.film.mean_samples() - self.kept).min(1.0))]
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
        let (scene, integrator) = (&self.scene, &self.integrator);
        while self.film.samples() < budget.samples && !stop().reached() {
            // Several passes at once, as soon as that delays no picture much, spare threads the waiting for each other.
            let so_far = self.film.samples();
            let pass = so_far.saturating_add((so_far / 4).clamp(1, 16)).min(budget.samples);
            let tiles = self.film.tiles_mut().par_iter_mut().zip(&mut self.pending).with_max_len(1);
            self.threads.install(|| {
                tiles.for_each(|(tile, pending)| {
                    let stop = stop();
                    if !stop.reached() {
                        integrator.refine(scene, tile, pending, pass, &stop);
                    }
                });
            });
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
            IntegratorKind::Path => self.film.relative_error(),
        }
    }
}
