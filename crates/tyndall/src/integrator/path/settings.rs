//! Settings of `render.path`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the integrator `path`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "PathSettings")]
pub struct Settings {
    /// Memory, in MiB, in which a session that edits the scene keeps the first samples of each pixel, 32 bytes each, so
    /// that an edit retakes only those that it touched; 0 keeps none. It affects the speed, never the picture.
    #[schemars(range(min = 0, max = 1_048_576))]
    pub history_memory: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { history_memory: 512 }
    }
}
