//! The medium: how dense the matter is, and how it scatters light.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{MajorantCell, MeanCosine, NonNegative, Positive};

/// Properties of the whole volume: the scale of its extinction, and how it scatters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Medium {
    /// Extinction per world unit where the transfer function's opacity is 1.
    #[schemars(with = "NonNegative")]
    pub density: f32,

    /// Phase function of matter that scatters like a cloud.
    pub phase: Phase,

    /// BRDF of matter that scatters like a surface.
    pub brdf: Brdf,

    /// How readily a gradient acts as a surface: light scatters from a surface with probability
    /// `surface * (1 - exp(-gradient_factor * |grad v| * h / range))`, where h is the voxel's edge and range is
    /// `gradient_range`.
    #[schemars(with = "NonNegative")]
    pub gradient_factor: f32,

    /// Range, in data values, that gradients are measured against; when omitted, 2600 HU for CT and the robust range of other
    /// data.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Positive>")]
    pub gradient_range: Option<f32>,

    /// Edge, in voxels, of the cells that each have their own majorant of the extinction; 0 means one majorant for the
    /// whole volume. It changes the speed, never the expected picture.
    #[schemars(with = "MajorantCell")]
    pub majorant_cell: u32,
}

impl Default for Medium {
    fn default() -> Self {
        Self {
            density: 1.0,
            phase: Phase::default(),
            brdf: Brdf::default(),
            gradient_factor: 10.0,
            gradient_range: None,
            majorant_cell: 8,
        }
    }
}

/// Phase function: the density over solid angle of the directions into which a cloud scatters light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(extend("default" = { "type": "isotropic" }))]
pub enum Phase {
    /// The same in all directions.
    #[default]
    Isotropic,
    /// One lobe, set by its mean cosine.
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle, between -1 and 1; positive is forward.
        #[serde(default)]
        #[schemars(with = "MeanCosine")]
        g: f32,
    },
    /// Schlick's lobe, `(1 - k^2) / (4 pi (1 - k cos)^2)`: close to Henyey-Greenstein, and cheaper.
    Schlick {
        /// Shape of the lobe, between -1 and 1; positive is forward.
        #[serde(default)]
        #[schemars(with = "MeanCosine")]
        k: f32,
    },
}

/// BRDF of surfaces inside the volume; albedo, specular and roughness come from the transfer function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(extend("default" = { "type": "lambert" }))]
pub enum Brdf {
    /// Matt: albedo / pi.
    #[default]
    Lambert,
    /// The model of Ashikhmin and Shirley with both exponents `2 / roughness^4 - 2`.
    AshikhminShirley,
    /// The two-parameter ABC model of measured, glossy materials.
    Abc {
        /// Sharpness of the lobe: the larger, the narrower.
        #[serde(default = "default_width")]
        #[schemars(with = "NonNegative")]
        b: f32,
        /// Fall-off of the lobe's tail.
        #[serde(default = "default_fall_off")]
        #[schemars(with = "NonNegative")]
        c: f32,
    },
}

fn default_width() -> f32 {
    100.0
}

fn default_fall_off() -> f32 {
    1.0
}
