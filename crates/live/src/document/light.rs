//! Lights: pure sources, which the camera does not see, except a visible environment.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{Color, ConeAngle, Position, Positive, Vector};
use super::studio::Studio;

/// A light. It blocks no light, casts no shadow, and may be inside the volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Light {
    /// Light from far away, like the sun.
    Directional {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
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
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
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
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
        /// Centre, in world units.
        #[schemars(with = "Position")]
        position: [f64; 3],
        /// Point that the light faces.
        #[schemars(with = "Position")]
        target: [f64; 3],
        /// Up direction of the rectangle, along which its height is measured; when omitted, the up axis.
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
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
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
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
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
    /// Light from all around: exactly one of a constant `radiance`, a `map` and a `studio`.
    #[schemars(extend("oneOf" = [{ "required": ["radiance"] }, { "required": ["map"] }, { "required": ["studio"] }]))]
    Environment {
        /// Name by which edits find the light.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Whose axes its directions and positions are given in.
        #[serde(default, skip_serializing_if = "Axes::are_of_world")]
        axes: Axes,
        /// Radiance from every direction, in W m^-2 sr^-1.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Color>")]
        radiance: Option<[f32; 3]>,
        /// File of a latitude-longitude picture of the surroundings, relative to the document; OpenEXR or Radiance HDR.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(length(min = 1))]
        map: Option<String>,
        /// A gradient with softboxes.
        #[serde(skip_serializing_if = "Option::is_none")]
        studio: Option<Studio>,
        /// Rotation of the surroundings about the up axis, in degrees.
        #[serde(default)]
        rotation: f32,
        /// Whether the camera sees the environment; if not, it sees black.
        #[serde(default = "yes")]
        visible: bool,
    },
}

/// The axes in which the directions and positions of a light are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axes {
    /// The world's.
    #[default]
    World,
    /// The camera's, from the centre of the volume: x to the right of the picture, y up, z to the viewer. The light follows the camera.
    Camera,
}

impl Axes {
    fn are_of_world(&self) -> bool {
        *self == Self::World
    }
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

    /// The axes in which its directions and positions are given.
    #[must_use]
    pub fn axes(&self) -> Axes {
        match self {
            Self::Directional { axes, .. }
            | Self::Point { axes, .. }
            | Self::Rect { axes, .. }
            | Self::Disk { axes, .. }
            | Self::Sphere { axes, .. }
            | Self::Environment { axes, .. } => *axes,
        }
    }
}

fn yes() -> bool {
    true
}
