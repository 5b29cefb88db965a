//! Emission, absorption and single scattering by marching along the view ray: deterministic, but flat. Shadows come from a grid
//! (`shadow_grid`), or from rays to every point on the lights.
//!
//! Light from glowing matter that other matter scatters is left out.

mod cached;
mod light_points;
mod march;
mod settings;
mod shadows;

pub use march::RayMarch;
pub use settings::{Settings, Shadows};

use super::{
    Edited, Limits, MemoryNeed, Method, MethodReport, PixelCounts, Resources, StageNames, Stop, Updated,
    settings_of,
};
use crate::film::{Goal, Tile};
use crate::scene::{Difference, Scene};
use march::Packet;
use shadows::Plan;

impl Method for RayMarch {
    const NAME: &'static str = "raymarch";
    const ABOUT: &'static str = "Ray marching with cached shadows: emission, absorption and single scattering; deterministic and flat.";
    const HAS_NOISE: bool = false;
    // They only smooth edges.
    const DEFAULT_SAMPLES: u32 = 4;

    type Settings = Settings;
    /// A packet that a stop left unfinished.
    type TileState = Option<Box<Packet>>;

    fn draft(settings: &Settings) -> Settings {
        let (step, light_samples) = (settings.step.max(0.2), settings.light_samples.min(4));
        Settings { step, light_samples, ..*settings }
    }

    fn notes(settings: &Settings, scene: &Scene) -> Vec<&'static str> {
        let mut notes = Vec::new();
        if scene.medium.transfer().emits() {
            notes.push(
                "`raymarch` leaves out light from glowing matter that other matter scatters; the default method includes it",
            );
        }
        notes.extend(Plan::of_scene(scene, settings).note());
        notes
    }

    fn memory(settings: &Settings, scene: &Scene) -> Option<MemoryNeed> {
        let bytes = Plan::of_scene(scene, settings).most_bytes(scene, settings)?;
        Some(MemoryNeed {
            bytes,
            key: "render.raymarch.light_samples",
            what: format!("shadows of {} points on each light", settings.light_samples),
            fix: "fewer of them, or `render.raymarch.shadows = \"exact\"`",
        })
    }

    fn new(scene: &Scene, settings: &Settings, resources: &Resources) -> Self {
        Self::of_scene(scene, settings, resources.level)
    }

    fn is_touched_by(&self, difference: &Difference) -> bool {
        // Majorant cells determine the order in which a march sums its samples.
        difference.view() || difference.light() || difference.majorants
    }

    fn update(&mut self, edit: &Edited, tiles: &mut [Self::TileState], _: &Limits) -> Updated {
        tiles.iter_mut().for_each(|pending| *pending = None);
        self.update_shadows(edit, &settings_of::<Self>(edit.new));
        Updated::Done
    }

    fn is_settling(&self, _: &Scene, _: u32) -> bool {
        self.shadows.as_ref().is_some_and(|shadows| !shadows.is_ready())
    }

    fn prepare(&mut self, scene: &Scene, _: u32, limits: &Limits) -> bool {
        self.prepare_shadows(scene, limits)
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

    fn report(&self, _: &[Self::TileState], pixels: &PixelCounts) -> MethodReport {
        let preparation = self.shadows.as_ref().map(|_| "shadows");
        let stages = StageNames { preparation, ..StageNames::default() };
        MethodReport { stages, ..MethodReport::of_pixels(pixels, 0) }
    }
}
