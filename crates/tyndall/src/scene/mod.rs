//! A scene: everything that decides a picture, as one immutable value, cheap to clone.

mod build;
mod difference;
pub mod document;

pub use build::{Assets, SceneError};
pub use difference::{Difference, LightOrigin, LightsDifference};

use crate::camera::Camera;
use crate::light::LightSet;
use crate::math::{Rgb, Vec3};
use crate::medium::Medium;
use crate::transfer::Grouping;
use std::sync::Arc;

/// Everything that decides a picture.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The matter.
    pub medium: Arc<Medium>,
    /// What shines on it.
    pub lights: Arc<LightSet>,
    /// Names by which edits find the lights, one per light.
    pub light_names: Vec<Option<String>>,
    /// Who looks.
    pub camera: Camera,
    /// Width and height of the picture; at least 1 each.
    pub size: [u32; 2],
    /// What is behind everything.
    pub background: Background,
    /// How light is computed.
    pub render: RenderSettings,
}

/// What the camera sees behind everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The visible environments; black without one.
    Environment,
    /// Nothing: the picture is transparent there.
    Transparent,
    /// A colour that lights nothing.
    Color(Rgb),
}

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// By which method.
    pub integrator: IntegratorKind,
    /// Light that scattered more often is left out.
    pub max_scatter: u32,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A method of computing light, with its own settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegratorKind {
    /// Emission, absorption and single scattering by marching; deterministic.
    RayMarch {
        /// Step in voxels.
        step: f32,
        /// Fixed points on each area or environment light.
        light_samples: u32,
    },
    /// Unbiased Monte Carlo.
    Path,
    /// Photon mapping that survives edits.
    Photon(PhotonSettings),
}

/// Settings of photon mapping; lengths in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonSettings {
    /// Light paths, of all lights together.
    pub photons: u32,
    /// Radius of gathering; positive.
    pub radius: f32,
    /// Segments of each view ray; at least 1.
    pub segments: u32,
    /// Steps of a view ray in each voxel; positive.
    pub steps_per_voxel: f32,
    /// Radii between gathers along a view ray at most; 0 gathers at every step.
    pub gather_spacing: f32,
    /// How light is estimated from photons.
    pub estimate: Estimate,
    /// Which part of a path has a history of its own.
    pub histories: Histories,
    /// Groups of values in a Historygram, 1 to 128.
    pub history_bits: u8,
    /// How values are put into groups.
    pub bins: Grouping,
    /// How segments learn which photons changed.
    pub spatial: SpatialHistory,
}

/// How light is estimated from photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimate {
    /// By all photons within the radius.
    #[default]
    Point,
    /// By so many nearest ones, within the radius at most.
    Nearest(u32),
    /// By all photons within the radius of the ray \[Jarosz08\].
    Beam,
}

/// Which part of a path has a history of its own \[Jonsson12, sec. 6.2.1\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Histories {
    /// Each interaction: an edit retraces paths from where it touched them.
    #[default]
    Interactions,
    /// The whole path: less memory, and paths are retraced from their beginning.
    Paths,
}

/// How segments learn which photons changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpatialHistory {
    /// By a bit for each cell of the photon map: exact.
    #[default]
    Cells,
    /// By 64 bits along each axis \[Jonsson12, sec. 4.3.2\]: exact, but soon true everywhere.
    Axes,
    /// Not at all: segments keep the light that they had, which is wrong.
    Off,
}

impl IntegratorKind {
    /// The name in the scene document.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::RayMarch { .. } => "raymarch",
            Self::Path => "path",
            Self::Photon(_) => "photon",
        }
    }
}

impl Scene {
    /// What the chosen method leaves out of this scene, a sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<&'static str> {
        let marching = matches!(self.render.integrator, IntegratorKind::RayMarch { .. });
        let bends = self.medium.transfer().points().iter().any(|p| p.optics.ior != 1.0);
        let mut notes = Vec::new();
        let volume = self.medium.volume();
        let values = volume.value_range().map(crate::math::cast::single);
        if self.medium.transfer().opacity_range(values)[1] <= 0.0 {
            notes.push("no value of the data has any opacity: nothing of the volume can be seen");
        }
        if self.medium.clip().cuts_all(&volume.grid().index_bounds()) {
            notes.push("a clip cuts the whole volume away");
        }
        if marching && self.medium.transfer().emits() {
            notes.push(
                "`raymarch` leaves out the light that glowing matter sends to other matter; `path` has it",
            );
        }
        if let IntegratorKind::Photon(PhotonSettings { spatial: SpatialHistory::Off, .. }) =
            self.render.integrator
        {
            notes.push(
                "with `spatial = \"off\"` edits leave light where it was: the picture is not the one from nothing",
            );
        }
        if bends {
            notes.push("the refractive index is ignored: light goes straight");
        }
        notes
    }

    /// Radiance of a camera ray that meets nothing.
    #[must_use]
    pub fn behind(&self, direction: Vec3) -> Rgb {
        match self.background {
            Background::Environment => self.lights.sky(direction),
            Background::Transparent => Rgb::BLACK,
            Background::Color(color) => color,
        }
    }
}
