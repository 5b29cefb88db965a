//! The scene document: the text, TOML or JSON, in which users describe a scene, and the edits that change it.
//!
//! A document is first a [`Value`], which is what edits ([`apply`], [`set()`]) work on. [`Document::from_value`] checks
//! it against the [`schema()`], which is derived from the types here, then against rules that a schema cannot express,
//! and returns a [`Document`]: every key is given or at its default, every number is in its range. It mirrors the file;
//! what the file leaves open, such as an automatic camera, is decided when the scene is built, since that needs the
//! volume.
//!
//! ```
//! use tyndall_live::document::{Document, apply};
//!
//! let document = Document::from_toml("volume = { path = 'head.nrrd' }\nmedium = { density = 0.2 }")?;
//! assert_eq!(document.render.max_scatter, 64);
//!
//! let patch = serde_json::json!({ "medium": { "densty": 0.3 } });
//! let error = Document::from_value(apply(&document.to_value(), &patch)).unwrap_err();
//! assert_eq!(error.path(), "medium.densty");
//! # Ok::<(), tyndall_live::document::DocumentError>(())
//! ```

mod advice;
mod camera;
mod check;
mod clip;
mod describe;
mod error;
mod film;
mod light;
mod medium;
mod moved;
mod node;
mod number;
mod patch;
mod render;
mod schema;
mod set;
mod shape;
mod studio;
#[cfg(test)]
mod tests;
mod text;
mod transfer;
mod validate;
mod volume;

pub use camera::{AutoView, Camera};
pub use clip::Clip;
pub use error::{DocumentError, Problem, Problems};
pub use film::{Background, Exposure, Film, Tone};
pub use light::{Axes, Light};
pub use medium::{Brdf, Medium, Phase};
pub use moved::move_old_keys;
pub use patch::apply;
pub use render::Render;
pub use schema::schema;
pub use set::set;
pub use studio::{Softbox, Studio};
pub use text::{value_from_json, value_from_toml};
pub use transfer::{TransferFunction, TransferPoint};
pub use volume::{DataType, Endian, FieldKind, Interpolation, Procedural, Raw, Volume};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tyndall::message::sentence;

/// The key of the camera's table.
pub(crate) const CAMERA: &str = "camera";

/// A scene: what is rendered, under which light, from where, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Tyndall scene")]
pub struct Document {
    /// Version of the document format.
    #[serde(default = "first_version")]
    #[schemars(with = "shape::Version")]
    pub version: u32,

    /// The matter that is rendered.
    pub volume: Volume,

    /// How each data value looks; when omitted, a preset that suits the kind of volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transfer_function: Option<TransferFunction>,

    /// Properties of the whole volume: the scale of its extinction, and how it scatters.
    #[serde(default)]
    pub medium: Medium,

    /// Lights, any number of any type; when omitted, a soft sun and a sky. An empty list is darkness.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(max = 250_000))]
    pub lights: Option<Vec<Light>>,

    /// The viewpoint of the picture; when omitted, an automatic view that fits the volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,

    /// Size of the picture, and how radiance becomes an 8-bit image.
    #[serde(default)]
    pub film: Film,

    /// How the picture is computed.
    #[serde(default)]
    pub render: Render,

    /// Cuts through the volume; all of them apply.
    #[serde(default)]
    pub clip: Vec<Clip>,
}

impl Document {
    /// Reads a document in TOML.
    ///
    /// # Errors
    /// [`DocumentError`] if the text is not TOML, or not a scene document.
    pub fn from_toml(text: &str) -> Result<Self, DocumentError> {
        Self::from_value(value_from_toml(text)?)
    }

    /// Reads a document in JSON.
    ///
    /// # Errors
    /// [`DocumentError`] if the text is not JSON, or not a scene document.
    pub fn from_json(text: &str) -> Result<Self, DocumentError> {
        Self::from_value(value_from_json(text)?)
    }

    /// Checks a value, and reads it as a document.
    ///
    /// # Errors
    /// [`DocumentError::Content`] with what is wrong: where, what was found, what was expected, and how to fix it.
    pub fn from_value(mut value: Value) -> Result<Self, DocumentError> {
        move_old_keys(&mut value)?;
        check::check(&mut value)?;
        let document: Self = serde_json::from_value(value).map_err(|error| {
            DocumentError::one(Problem::new(
                "",
                sentence(&error.to_string()),
                "a document as the schema describes it",
            ))
        })?;
        validate::validate(&document)?;
        Ok(document)
    }

    /// Whether two documents are equal except for their cameras.
    pub(crate) fn equals_but_for_camera(&self, other: &Self) -> bool {
        let Self { version, volume, transfer_function, medium, lights, camera: _, film, render, clip } = self;
        (version, volume, medium, film) == (&other.version, &other.volume, &other.medium, &other.film)
            && (transfer_function, lights) == (&other.transfer_function, &other.lights)
            && (render, clip) == (&other.render, &other.clip)
    }

    /// The document as a value, with every default written out; [`Self::from_value`] turns it into an equal document.
    ///
    /// # Panics
    /// Never: a document always serializes to a JSON value.
    #[must_use]
    pub fn to_value(&self) -> Value {
        number::to_value(self).expect("tables of plain keys")
    }
}

fn first_version() -> u32 {
    1
}
