//! Lights: pure sources, which the camera does not see, except a visible environment.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{Color, ConeAngle, Position, Positive, Vector};

/// A light. It blocks no light, casts no shadow, and may be inside the volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Light {
    /// Light from far away, like the sun.
    Directional {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Direction in which the light travels; any length but 0.
        #[schemars(with = "Vector")]
        direction: [f32; 3],
        /// Irradiance on a surface that faces the light, in W m^-2.
        #[schemars(with = "Color")]
        irradiance: [f32; 3],
        /// Full angle of the cone that the light comes from, in degrees; 0 makes shadows sharp.
        #[serde(default)]
        #[schemars(with = "ConeAngle")]
        angle: f32,
    },
    /// A point that shines equally in all directions.
    Point {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Position of the light, in world units.
        #[schemars(with = "Position")]
        position: [f64; 3],
        /// Radiant intensity, in W sr^-1.
        #[schemars(with = "Color")]
        intensity: [f32; 3],
    },
    /// A rectangle that shines only from the side facing its target.
    Rect {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre, in world units.
        #[schemars(with = "Position")]
        position: [f64; 3],
        /// Point that the light faces.
        #[schemars(with = "Position")]
        target: [f64; 3],
        /// Up direction of the rectangle, along which its height is measured; when omitted, the world's up.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Vector>")]
        up: Option<[f32; 3]>,
        /// Width and height, in world units.
        #[schemars(with = "[Positive; 2]")]
        size: [f32; 2],
        /// Emitted radiance, in W m^-2 sr^-1.
        #[schemars(with = "Color")]
        radiance: [f32; 3],
    },
    /// A disk that shines only from the side facing its target.
    Disk {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre, in world units.
        #[schemars(with = "Position")]
        position: [f64; 3],
        /// Point that the light faces.
        #[schemars(with = "Position")]
        target: [f64; 3],
        /// Radius, in world units.
        #[schemars(with = "Positive")]
        radius: f32,
        /// Emitted radiance, in W m^-2 sr^-1.
        #[schemars(with = "Color")]
        radiance: [f32; 3],
    },
    /// A sphere that shines outwards.
    Sphere {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Centre, in world units.
        #[schemars(with = "Position")]
        position: [f64; 3],
        /// Radius, in world units.
        #[schemars(with = "Positive")]
        radius: f32,
        /// Emitted radiance, in W m^-2 sr^-1.
        #[schemars(with = "Color")]
        radiance: [f32; 3],
    },
    /// Light from all around: exactly one of a constant `radiance` and a `map`.
    #[schemars(extend("oneOf" = [{ "required": ["radiance"] }, { "required": ["map"] }]))]
    Environment {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Radiance from every direction, in W m^-2 sr^-1.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Color>")]
        radiance: Option<[f32; 3]>,
        /// File of a latitude-longitude picture of the surroundings, relative to the document; OpenEXR or Radiance HDR.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(length(min = 1))]
        map: Option<String>,
        /// Rotation of the surroundings about the world's up, in degrees.
        #[serde(default)]
        rotation: f32,
        /// Whether the camera sees the environment; if not, it sees black.
        #[serde(default = "yes")]
        visible: bool,
    },
}

impl Light {
    /// The name by which edits find the light.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Directional { name, .. }
            | Self::Point { name, .. }
            | Self::Rect { name, .. }
            | Self::Disk { name, .. }
            | Self::Sphere { name, .. }
            | Self::Environment { name, .. } => name.as_deref(),
        }
    }
}

fn yes() -> bool {
    true
}
