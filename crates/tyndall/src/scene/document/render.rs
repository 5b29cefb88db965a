//! How the picture is computed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{LightSamples, MajorantCell, Samples, ScatteringOrder, StepLength};

/// How the picture is computed: the method, its effort, and its own settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// The method.
    pub integrator: Integrator,

    /// Keeps light that scattered at most this many times; 1 is single scattering, 0 leaves emission, background and
    /// visible surfaces.
    #[schemars(with = "ScatteringOrder")]
    pub max_scatter: u32,

    /// Samples per pixel at which rendering stops.
    #[schemars(with = "Samples")]
    pub samples: u32,

    /// Seed of the random numbers: the same seed gives the same picture, bit for bit.
    pub seed: u64,

    /// Settings of the integrator `raymarch`.
    pub raymarch: RaymarchSettings,

    /// Settings of the integrator `path`.
    pub path: PathSettings,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            integrator: Integrator::default(),
            max_scatter: 64,
            samples: 64,
            seed: 0,
            raymarch: RaymarchSettings::default(),
            path: PathSettings::default(),
        }
    }
}

/// The method by which light is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Ray marching with shadow rays: emission, absorption and single scattering; deterministic, fast and flat.
    Raymarch,
    /// Unbiased, progressive path tracing through all orders of scattering: the ground truth.
    #[default]
    Path,
}

/// Settings of the integrator `raymarch`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RaymarchSettings {
    /// Step along the ray, in voxels (cube root of the voxel volume).
    #[schemars(with = "StepLength")]
    pub step: f32,

    /// Fixed, stratified points on each area or environment light.
    #[schemars(with = "LightSamples")]
    pub light_samples: u32,
}

impl Default for RaymarchSettings {
    fn default() -> Self {
        Self { step: 0.5, light_samples: 16 }
    }
}

/// Settings of the integrator `path`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PathSettings {
    /// Edge, in voxels, of the cells that each keep their own majorant of the extinction; 0 is one majorant for the whole
    /// volume. It changes the speed, never the expected picture.
    #[schemars(with = "MajorantCell")]
    pub majorant_cell: u32,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self { majorant_cell: 8 }
    }
}
