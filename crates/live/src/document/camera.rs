//! Cameras: placed by hand, or automatically so that the volume fits the picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{Elevation, FieldOfView, NonNegative, Position, Positive, Vector};

/// The viewpoint of the picture. Give a `position`, or `auto`, or neither for an automatic view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(extend("default" = { "type": "perspective" }))]
pub enum Camera {
    /// Near things look larger, as to the eye.
    #[schemars(extend(
        "not" = { "required": ["auto", "position"] },
        "dependentRequired" = { "target": ["position"] }
    ))]
    Perspective {
        /// Position of the eye, in world units.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Position>")]
        position: Option<[f64; 3]>,
        /// Point to look at; when omitted, the centre of the volume. Only with `position`.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Position>")]
        target: Option<[f64; 3]>,
        /// Direction that is up in the picture; when omitted, [0, 0, 1] for an anatomical volume, otherwise [0, 1, 0].
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Vector>")]
        up: Option<[f32; 3]>,
        /// Vertical field of view, in degrees.
        #[serde(default = "default_fov")]
        #[schemars(with = "FieldOfView")]
        fov: f32,
        /// Diameter of the lens, in world units; 0 is a pinhole, which has everything in focus.
        #[serde(default)]
        #[schemars(with = "NonNegative")]
        aperture: f32,
        /// Distance of the plane in focus, in world units; when omitted, the distance of the target.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Positive>")]
        focus: Option<f32>,
        /// Automatic view that fits the volume; excludes `position`.
        #[serde(skip_serializing_if = "Option::is_none")]
        auto: Option<AutoView>,
    },
    /// Parallel rays: sizes can be measured in the picture.
    #[schemars(extend(
        "not" = { "required": ["auto", "position"] },
        "dependentRequired" = { "target": ["position"] }
    ))]
    Orthographic {
        /// A point on the plane from which the rays start, in world units: the centre of the picture.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Position>")]
        position: Option<[f64; 3]>,
        /// Point to look at; when omitted, the centre of the volume. Only with `position`.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Position>")]
        target: Option<[f64; 3]>,
        /// Direction that is up in the picture; when omitted, [0, 0, 1] for an anatomical volume, otherwise [0, 1, 0].
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Vector>")]
        up: Option<[f32; 3]>,
        /// Height of the picture, in world units; when omitted, chosen so that the volume fits.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Positive>")]
        height: Option<f32>,
        /// Automatic view that fits the volume; excludes `position`.
        #[serde(skip_serializing_if = "Option::is_none")]
        auto: Option<AutoView>,
    },
}

impl Camera {
    /// Position of the eye; `None` means an automatic view.
    #[must_use]
    pub fn position(&self) -> Option<[f64; 3]> {
        let (Self::Perspective { position, .. } | Self::Orthographic { position, .. }) = self;
        *position
    }

    /// Point to look at; `None` means the centre of the volume.
    #[must_use]
    pub fn target(&self) -> Option<[f64; 3]> {
        let (Self::Perspective { target, .. } | Self::Orthographic { target, .. }) = self;
        *target
    }

    /// Direction that is up in the picture; `None` means the world's up.
    #[must_use]
    pub fn up(&self) -> Option<[f32; 3]> {
        let (Self::Perspective { up, .. } | Self::Orthographic { up, .. }) = self;
        *up
    }

    /// The automatic view, or its defaults if the document does not set it. Used only without a [`Self::position`].
    #[must_use]
    pub fn auto(&self) -> AutoView {
        let (Self::Perspective { auto, .. } | Self::Orthographic { auto, .. }) = self;
        auto.unwrap_or_default()
    }
}

impl Default for Camera {
    /// The automatic perspective view.
    fn default() -> Self {
        Self::Perspective {
            position: None,
            target: None,
            up: None,
            fov: default_fov(),
            aperture: 0.0,
            focus: None,
            auto: None,
        }
    }
}

fn default_fov() -> f32 {
    35.0
}

/// A view that looks at the centre of the volume from a distance at which it fits the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AutoView {
    /// Rotation of the eye about the up axis, in degrees; 0 sees the front. When omitted, it suits the kind of volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuth: Option<f32>,

    /// Angle of the eye above the horizon, in degrees. When omitted, chosen for the kind of volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Elevation>")]
    pub elevation: Option<f32>,

    /// Magnification: 1 fits the volume, 2 shows it twice as large.
    #[schemars(with = "Positive")]
    pub zoom: f32,
}

impl Default for AutoView {
    fn default() -> Self {
        Self { azimuth: None, elevation: None, zoom: 1.0 }
    }
}
