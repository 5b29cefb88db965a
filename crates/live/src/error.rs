//! Why a session could not be opened or edited.

use crate::assets::AssetError;
use crate::build::SceneError;
use crate::document::DocumentError;

/// Why a session could not be opened, or an edit not be applied; `at` names the file, or the edit in it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// A file that cannot be read as what it should be.
    #[error("{at}: {problem}")]
    File {
        /// The file.
        at: String,
        /// What was found, what was expected, and the mend.
        problem: String,
    },
    /// A picture whose metadata cannot be read; the message names it.
    #[error("{0}")]
    Picture(String),
    /// A document or a patch that describes no scene.
    #[error("{at}: {source}")]
    Document {
        /// Where it comes from.
        at: String,
        /// What is wrong with it.
        source: DocumentError,
    },
    /// A volume's file, which its own message names.
    #[error(transparent)]
    Volume(Box<AssetError>),
    /// Something else that a document names.
    #[error("{at}: {source}")]
    Asset {
        /// Where the document comes from.
        at: String,
        /// Why it cannot be had.
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
        "{at}: {key}: {what} {} MiB, but {} MiB are free; expected {mend}",
        .needed >> 20,
        .available >> 20
    )]
    Memory {
        /// Where the document comes from.
        at: String,
        /// The key that asks for it.
        key: String,
        /// For what, with its verb: "5 light paths may need".
        what: String,
        /// Bytes.
        needed: u64,
        /// Bytes.
        available: u64,
        /// What would take less.
        mend: &'static str,
    },
}
