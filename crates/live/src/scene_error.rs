//! Why no scene can be built.

use std::fmt::Display;

/// Why no scene can be built from a document and its assets.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{path}`: {problem}")]
pub struct SceneError {
    /// Where in the document.
    pub path: String,
    /// What was found, what was expected, and how to fix it.
    pub problem: String,
}

/// A problem at a place in the document.
pub(crate) fn fault(path: impl Into<String>, problem: impl Display) -> SceneError {
    SceneError { path: path.into(), problem: problem.to_string() }
}
