//! A scene: everything that determines a picture, as one immutable value that is cheap to clone.

mod difference;
mod method;

pub use difference::{Difference, LightOrigin, LightsDifference};
pub use method::{MethodChoice, MethodSettings};

use crate::camera::Camera;
use crate::light::LightSet;
use crate::math::{Rgb, Vec3};
use crate::medium::Medium;
use std::sync::Arc;

/// Everything that determines a picture.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The matter.
    pub medium: Arc<Medium>,
    /// The lights.
    pub lights: Arc<LightSet>,
    /// Names by which edits find the lights, one per light.
    pub light_names: Vec<Option<String>>,
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture; at least 1 each.
    pub size: [u32; 2],
    /// The background.
    pub background: Background,
    /// How light is computed.
    pub render: RenderSettings,
}

/// What the camera sees behind the matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The visible environments; black without one.
    Environment,
    /// Nothing: the picture is transparent.
    Transparent,
    /// A colour that does not illuminate the matter.
    Color(Rgb),
}

/// How light is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// The method and its settings.
    pub method: MethodChoice,
    /// Light that has scattered more often is left out.
    pub max_scatter: u32,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Scene {
    /// If the volume is invisible, the reasons, one sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<&'static str> {
        let mut notes = Vec::new();
        let volume = self.medium.volume();
        let values = volume.value_range().map(crate::math::cast::single);
        if self.medium.transfer().opacity_range(values)[1] <= 0.0 {
            notes.push("no value of the data has any opacity: the volume is invisible");
        }
        if self.medium.clip().cuts_all(&volume.grid().index_bounds()) {
            notes.push("a clip cuts the whole volume away");
        }
        notes
    }

    /// Background radiance along a camera ray that meets no matter.
    #[must_use]
    pub fn behind(&self, direction: Vec3) -> Rgb {
        match self.background {
            Background::Environment => self.lights.sky(direction),
            Background::Transparent => Rgb::BLACK,
            Background::Color(color) => color,
        }
    }
}
