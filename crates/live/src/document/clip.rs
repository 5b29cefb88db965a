//! Clips: what is cut away from the volume.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{Position, Vector};

/// A cut through the volume; what is cut away is vacuum. If there are several clips, all apply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Clip {
    /// Cuts away everything on the side that the normal points to.
    Plane {
        /// Name by which edits find the clip.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// A point on the plane, in world units.
        #[schemars(with = "Position")]
        point: [f64; 3],
        /// Direction to the side that is cut away; any length but 0.
        #[schemars(with = "Vector")]
        normal: [f32; 3],
    },
    /// Cuts away everything outside an axis-aligned box.
    Box {
        /// Name by which edits find the clip.
        #[serde(skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Lowest corner, in world units.
        #[schemars(with = "Position")]
        min: [f64; 3],
        /// Highest corner, in world units.
        #[schemars(with = "Position")]
        max: [f64; 3],
    },
}

impl Clip {
    /// The name by which edits find the clip.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        let (Self::Plane { name, .. } | Self::Box { name, .. }) = self;
        name.as_deref()
    }
}
