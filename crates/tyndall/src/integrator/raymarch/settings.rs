//! Settings of `render.raymarch`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the integrator `raymarch`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "RaymarchSettings")]
pub struct Settings {
    /// Step along the ray, in voxels (cube root of the voxel volume).
    #[schemars(range(min = 0.01, max = 10))]
    pub step: f32,

    /// Fixed, stratified points on each area or environment light.
    #[schemars(range(min = 1, max = 4096))]
    pub light_samples: u32,

    /// Where shadows come from.
    pub shadows: Shadows,
}

/// Where the shadows of `raymarch` come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Shadows {
    /// A grid that holds the transmittance to every point of every light, up to 512 MiB of it.
    #[default]
    Cached,
    /// A ray from every sample to every point of every light: a hundred times slower.
    Exact,
}

impl Default for Settings {
    fn default() -> Self {
        Self { step: 0.5, light_samples: 16, shadows: Shadows::Cached }
    }
}
