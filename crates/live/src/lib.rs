//! Scene documents, and the live session that edits them: the basis of the program, a viewer or a script.
//!
//! A program that renders a file:
//! ```no_run
//! use std::path::Path;
//! use tyndall_live::{Budget, LiveSession, Options};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let mut live = LiveSession::open(Path::new("head.nii.gz"), Options::new()?)?;
//!     live.refine(&Budget::samples(16));
//!     let picture = live.image();
//!     println!("{:?}: {:?}", picture.size, picture.rgba[0]);
//!     Ok(())
//! }
//! ```
//! And one that edits: only the light that the edit affected is recomputed.
//! ```
//! use serde_json::json;
//! use std::path::Path;
//! use tyndall_live::{Budget, Input, LiveSession, Options};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = json!({ "volume": { "procedural": { "kind": "cloud", "size": [16, 16, 16] } }, "film": { "size": [32, 32] } });
//! let mut live = LiveSession::start(Input::of_document(scene, Path::new("")), Options::new()?)?;
//! live.refine(&Budget::samples(4));
//! live.edit(&json!({ "medium": { "density": 0.3 } }))?;
//! live.refine(&Budget::samples(4));
//! live.undo()?;
//! # assert_eq!(live.document().medium.density, 1.0);
//! # Ok(())
//! # }
//! ```
//!
//! The crate knows files (through `tyndall-formats`) and the renderer (`tyndall`), but no window, server, command line
//! or Python.

mod admission;
pub mod assets;
mod build;
mod chosen;
pub mod document;
mod error;
mod identity;
mod input;
mod lights;
mod look;
mod options;
mod orbit;
mod scene_error;
mod session;
mod text_file;
mod undo;

pub use assets::{Assets, Source};
pub use build::Built;
pub use error::LiveError;
pub use identity::{KeyDifference, SceneIdentity, first_difference};
pub use input::{Input, LoadedScene};
pub use look::{LOOKS, Look, look_of, look_text, read_look};
pub use options::Options;
pub use orbit::Orbit;
pub use scene_error::SceneError;
pub use session::{EditReport, EditSource, LiveSession};
pub use text_file::read_text;
pub use tyndall::session::{Budget, Progress};
