//! Emission, absorption and single scattering by marching along the view ray, with shadow rays to
//! every light: deterministic, but flat.
//!
//! Light from glowing matter that other matter scatters is left out.

mod march;
mod settings;

pub use march::RayMarch;
pub use settings::Settings;

use super::{Method, Resources, Stop};
use crate::film::{Goal, Tile};
use crate::scene::{Difference, Scene};
use march::Packet;

impl Method for RayMarch {
    const NAME: &'static str = "raymarch";
    const ABOUT: &'static str =
        "Ray marching with shadow rays: emission, absorption and single scattering; deterministic and flat.";
    const HAS_NOISE: bool = false;
    // They only smooth edges.
    const DEFAULT_SAMPLES: u32 = 4;

    type Settings = Settings;
    /// A packet that a stop left unfinished.
    type TileState = Option<Box<Packet>>;

    fn draft(settings: &Settings) -> Settings {
        Settings { step: settings.step.max(0.2), light_samples: settings.light_samples.min(4) }
    }

    fn notes(_: &Settings, scene: &Scene) -> Vec<&'static str> {
        if scene.medium.transfer().emits() {
            vec![
                "`raymarch` leaves out light from glowing matter that other matter scatters; the default method includes it",
            ]
        } else {
            Vec::new()
        }
    }

    fn new(scene: &Scene, settings: &Settings, resources: &Resources) -> Self {
        Self::of_scene(scene, settings, resources.level)
    }

    fn is_touched_by(&self, difference: &Difference) -> bool {
        // Majorant cells determine the order in which a march sums its samples.
        difference.view() || difference.light() || difference.majorants
    }

    fn refine(
        &self,
        scene: &Scene,
        tile: &mut Tile,
        pending: &mut Option<Box<Packet>>,
        goal: Goal,
        stop: &Stop,
    ) {
        self.refine_tile(scene, tile, pending, goal, stop);
    }
}
