//! A minimal method, for tests: every ray sees a constant colour, and the matter is ignored. This folder and a line in
//! the list of methods are all that a new method needs.

use super::{Method, Resources, Stop};
use crate::film::{Goal, PixelSample, Tile};
use crate::math::Rgb;
use crate::scene::{Difference, Scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of `render.plain`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "PlainSettings")]
pub struct Settings {
    /// Radiance of every pixel.
    #[schemars(range(min = 0, max = 10))]
    pub radiance: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { radiance: 0.5 }
    }
}

/// Shows the radiance from the settings, brighter where the camera looks up.
pub struct Plain(Rgb);

impl Method for Plain {
    const NAME: &'static str = "plain";
    const ABOUT: &'static str = "A constant colour that ignores the matter, for tests.";
    const HAS_NOISE: bool = false;

    type Settings = Settings;
    type TileState = ();

    fn new(_: &Scene, settings: &Settings, _: &Resources) -> Self {
        Self(Rgb::splat(settings.radiance))
    }

    fn is_touched_by(&self, difference: &Difference) -> bool {
        difference.view()
    }

    fn refine(&self, scene: &Scene, tile: &mut Tile, (): &mut (), goal: Goal, stop: &Stop) {
        while !stop.reached() {
            let Some([x, y]) = tile.next(goal, 1).next() else { return };
            let ray = scene.camera.ray(scene.size, [x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
            let radiance = self.0 * (1.0 + ray.direction.y.max(0.0));
            tile.add(&PixelSample { radiance, ..PixelSample::default() });
        }
    }
}
