//! The methods of computing light.

mod path;
mod raymarch;
mod stop;

pub use path::Path;
pub use raymarch::RayMarch;
pub use stop::Stop;

use crate::film::Tile;
use crate::scene::{Difference, IntegratorKind, Scene};
use crate::simd::Level;
use path::Walk;
use raymarch::Packet;

/// A method that works pixel by pixel: everything about a sample follows from its pixel and number.
#[derive(Clone, Debug)]
pub enum Integrator {
    /// See [`RayMarch`].
    RayMarch(RayMarch),
    /// See [`Path`].
    Path(Path),
}

impl Integrator {
    /// The scene's method, prepared for the scene and the processor's vector instructions.
    #[must_use]
    pub fn new(scene: &Scene, level: Level) -> Self {
        match scene.render.integrator {
            IntegratorKind::RayMarch { step, light_samples } => {
                Self::RayMarch(RayMarch::new(scene, step, light_samples, level))
            }
            IntegratorKind::Path => Self::Path(Path::new(level)),
        }
    }

    /// Whether samples taken before an edit may differ, by a bit or more, from those that would be taken now.
    #[must_use]
    pub fn is_touched_by(&self, difference: &Difference) -> bool {
        // Cells decide which numbers tracking draws, and in which order a march adds up what it meets.
        let touched = difference.view() || difference.light() || difference.majorants;
        match self {
            Self::RayMarch(_) => touched,
            Self::Path(_) => touched || difference.seed,
        }
    }

    /// Adds a sample to every pixel of a tile until the tile has `samples`, or is told to stop. What is then half done
    /// waits in `pending` and is taken up by the next call, so that slices however thin get on and leave no trace.
    pub fn refine(&self, scene: &Scene, tile: &mut Tile, pending: &mut Pending, samples: u32, stop: &Stop) {
        match self {
            Self::RayMarch(raymarch) => raymarch.refine(scene, tile, &mut pending.packet, samples, stop),
            Self::Path(path) => path.refine(scene, tile, &mut pending.walk, samples, stop),
        }
    }
}

/// What a stop left half done in a tile; empty for a tile that none has met.
#[derive(Clone, Debug, Default)]
pub struct Pending {
    walk: Option<Walk>,
    packet: Option<Box<Packet>>,
}
