//! Why a session could not be opened or edited.

use crate::assets::AssetError;
use crate::document::DocumentError;
use crate::scene_error::SceneError;

/// Why a session could not be opened or an edit could not be applied; `at` names the file or the edit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// A file that cannot be read, or is not of the expected kind.
    #[error("{at}: {problem}")]
    File {
        /// The file.
        at: String,
        /// What was found, what was expected, and how to fix it.
        problem: String,
    },
    /// A picture whose metadata cannot be read; the message names the file.
    #[error("{0}")]
    Picture(String),
    /// A document, or a patch to one, that does not describe a scene.
    #[error("{at}: {source}")]
    Document {
        /// Where it comes from.
        at: String,
        /// What is wrong with it.
        source: DocumentError,
    },
    /// A volume that cannot be loaded; the source's message names the file.
    #[error(transparent)]
    Volume(Box<AssetError>),
    /// Another asset that cannot be loaded.
    #[error("{at}: {source}")]
    Asset {
        /// Where the document comes from.
        at: String,
        /// Why it cannot be loaded.
        source: Box<AssetError>,
    },
    /// A document that does not fit its volume.
    #[error("{at}: {source}")]
    Scene {
        /// Where the document comes from.
        at: String,
        /// What does not fit.
        source: SceneError,
    },
    /// More memory would be needed than is free.
    #[error(
        "{at}: {key}: {what} {} MiB, but {} MiB are free; expected {fix}",
        .needed >> 20,
        .available >> 20
    )]
    Memory {
        /// Where the document comes from.
        at: String,
        /// The key that sets how much is needed.
        key: String,
        /// What needs the memory, with its verb: "5 light paths may need".
        what: String,
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        available: u64,
        /// What would need less.
        fix: &'static str,
    },
}
