//! The methods of computing light.

mod path;
mod raymarch;

pub use path::Path;
pub use raymarch::RayMarch;

use crate::film::PixelSample;
use crate::scene::{IntegratorKind, Scene};

/// A method that works pixel by pixel: everything about a sample follows from its pixel and number.
#[derive(Clone, Debug)]
pub enum Integrator {
    /// See [`RayMarch`].
    RayMarch(RayMarch),
    /// See [`Path`].
    Path(Path),
}

impl Integrator {
    /// The scene's method, prepared for the scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        match scene.render.integrator {
            IntegratorKind::RayMarch { step, light_samples } => {
                Self::RayMarch(RayMarch::new(scene, step, light_samples))
            }
            IntegratorKind::Path => Self::Path(Path),
        }
    }

    /// The `sample`-th sample of a pixel.
    #[inline]
    #[must_use]
    pub fn sample(&self, scene: &Scene, pixel: [u32; 2], sample: u32) -> PixelSample {
        match self {
            Self::RayMarch(raymarch) => raymarch.sample(scene, pixel, sample),
            Self::Path(path) => path.sample(scene, pixel, sample),
        }
    }
}
