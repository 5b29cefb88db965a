//! The transfer function: from data values to optical quantities.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{Color, DataValue, Fraction, FractionColor, Positive};

/// How each data value looks: a named `preset`, or `points`; with neither, a preset that suits the kind of volume.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = { "required": ["preset", "points"] }))]
pub struct TransferFunction {
    /// Name of a preset, as `tyndall presets` lists them.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub preset: Option<String>,

    /// Points of a function that is piecewise linear in the data value and clamped outside; values must
    /// ascend. Two points at one value are a jump: from that value on, the later one applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub points: Option<Vec<TransferPoint>>,
}

/// The optical quantities at one data value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferPoint {
    /// Data value, in the file's units (for CT, Hounsfield units).
    #[schemars(with = "DataValue")]
    pub value: f64,

    /// Extinction at this value as a fraction of `medium.density`, from 0 to 1; not alpha per step.
    #[schemars(with = "Fraction")]
    pub opacity: f32,

    /// Scattered fraction of the extinction, per colour channel.
    #[serde(default = "default_albedo")]
    #[schemars(with = "FractionColor")]
    pub albedo: [f32; 3],

    /// Emitted radiance Le, in W m^-2 sr^-1; matter adds sigma_a Le per unit length.
    #[serde(default)]
    #[schemars(with = "Color")]
    pub emission: [f32; 3],

    /// Degree to which matter with a gradient acts as a surface (`medium.brdf`) instead of a cloud (`medium.phase`).
    #[serde(default)]
    #[schemars(with = "Fraction")]
    pub surface: f32,

    /// Reflectance of the surface at normal incidence, per colour channel.
    #[serde(default = "default_specular")]
    #[schemars(with = "FractionColor")]
    pub specular: [f32; 3],

    /// Roughness of the surface: 0 is a mirror, 1 is dull.
    #[serde(default = "default_roughness")]
    #[schemars(with = "Fraction")]
    pub roughness: f32,

    /// Refractive index; 1 is vacuum.
    #[serde(default = "vacuum")]
    #[schemars(with = "Positive")]
    pub ior: f32,
}

impl TransferPoint {
    /// A point whose other quantities have their defaults.
    #[must_use]
    pub fn new(value: f64, opacity: f32) -> Self {
        Self {
            value,
            opacity,
            albedo: default_albedo(),
            emission: [0.0; 3],
            surface: 0.0,
            specular: default_specular(),
            roughness: default_roughness(),
            ior: vacuum(),
        }
    }
}

fn default_albedo() -> [f32; 3] {
    [0.8; 3]
}

fn default_specular() -> [f32; 3] {
    [0.04; 3]
}

fn default_roughness() -> f32 {
    0.3
}

fn vacuum() -> f32 {
    1.0
}
