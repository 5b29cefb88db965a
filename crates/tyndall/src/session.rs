//! A session: a scene, its integrator and the film, refined slice by slice.

use crate::film::{Film, Image};
use crate::integrator::Integrator;
use crate::scene::{IntegratorKind, Scene};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// When a slice of work ends; the first limit met counts.
#[derive(Clone, Debug)]
pub struct Budget {
    /// Samples that every pixel shall have in the end.
    pub samples: u32,
    /// Point in time after which no tile is begun.
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

    fn is_spent(&self) -> bool {
        self.cancel.load(Ordering::Relaxed) || self.deadline.is_some_and(|end| Instant::now() >= end)
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
    threads: Arc<rayon::ThreadPool>,
}

impl Session {
    /// Prepares a scene; `threads` is shared with whoever made the scene, never the global pool.
    #[must_use]
    pub fn new(scene: Scene, threads: Arc<rayon::ThreadPool>) -> Self {
        let integrator = threads.install(|| Integrator::new(&scene));
        Self { integrator, film: Film::new(scene.size), scene, threads }
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
        let (scene, integrator) = (&self.scene, &self.integrator);
        while self.film.samples() < budget.samples && !budget.is_spent() {
            let pass = self.film.samples() + 1;
            let tiles = self.film.tiles_mut();
            self.threads.install(|| {
                tiles.par_iter_mut().with_max_len(1).for_each(|tile| {
                    if tile.samples() < pass && !budget.is_spent() {
                        tile.add_pass(|pixel, n| integrator.sample(scene, pixel, n));
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
