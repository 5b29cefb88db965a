//! A photographer's studio: an environment without a file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{BoxAngle, Color, Elevation, Fraction};

/// A gradient from ground to ceiling, and softboxes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Studio {
    /// Radiance straight up, in W m^-2 sr^-1.
    #[schemars(with = "Color")]
    pub zenith: [f32; 3],

    /// Radiance at the horizon, in W m^-2 sr^-1.
    #[schemars(with = "Color")]
    pub horizon: [f32; 3],

    /// Radiance straight down, in W m^-2 sr^-1.
    #[schemars(with = "Color")]
    pub ground: [f32; 3],

    /// Lamps; their radiance is added to that behind them.
    #[schemars(length(max = 100))]
    pub softboxes: Vec<Softbox>,
}

/// A lamp behind a rectangle of cloth, infinitely far away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Softbox {
    /// Rotation of its middle about the up axis, in degrees: 0 in front, 90 to the viewer's right, 180 behind the volume.
    pub azimuth: f32,

    /// Angle of its middle above the horizon, in degrees.
    #[schemars(with = "Elevation")]
    pub elevation: f32,

    /// Degrees from edge to edge, across and upwards.
    #[schemars(with = "[BoxAngle; 2]")]
    pub size: [f32; 2],

    /// Width of the band about each edge in which the radiance falls to nothing, over half of the size.
    #[serde(default = "soft")]
    #[schemars(with = "Fraction")]
    pub softness: f32,

    /// Radiance in the middle, in W m^-2 sr^-1.
    #[schemars(with = "Color")]
    pub radiance: [f32; 3],
}

fn soft() -> f32 {
    0.5
}
