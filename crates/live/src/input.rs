//! Input files: a scene document, a picture with one in its metadata, or a bare volume.

use crate::assets::{self, AssetError, Assets, Source};
use crate::chosen;
use crate::document::{self, Document, DocumentError};
use crate::error::LiveError;
use crate::look::Look;
use crate::options::Options;
use crate::text_file::read_text;
use serde_json::{Value, json};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use tyndall::message::path_name;
use tyndall_formats::image::{Metadata, read_metadata};

/// A document as it was read, before any override.
#[derive(Clone, Debug)]
pub struct Input {
    /// The document.
    pub value: Value,
    /// The folder that its paths are relative to.
    pub folder: PathBuf,
    /// Whether the input is a volume without a scene, whose look is then chosen automatically.
    pub bare: bool,
    /// Whether the input is a picture of a version that did not state against what it measured gradients.
    pub lacks_gradient_range: bool,
    /// Its name in messages.
    pub name: String,
    /// Notes for the user on how it was read.
    pub notes: Vec<String>,
}

/// A checked document with its assets, from which a session starts.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The document.
    pub document: Document,
    /// The assets that it refers to.
    pub assets: Assets,
    /// What the volume's source contained besides the volume.
    pub source: Source,
    /// The document as it was written; null unless edits are expected, since with a million lights it takes a gigabyte.
    pub(crate) value: Value,
    pub(crate) folder: PathBuf,
    /// The input's name in messages.
    pub(crate) name: String,
    /// Notes for the user on how the document was read.
    pub(crate) notes: Vec<String>,
}

/// Density of a bare volume times the diagonal of its box: where opacity is 1, the mean free path is 1/200 of the
/// diagonal.
const BARE_THICKNESS: f32 = 200.0;

/// Extensions of pictures.
const PICTURES: [&str; 7] = ["png", "apng", "jpg", "jpeg", "tif", "tiff", "exr"];

/// A key that every picture states; those of earlier versions lack it.
const GRADIENT_RANGE: &str = "/medium/gradient_range";

impl Input {
    /// Opens a file as what its extension says: a scene, a picture with a scene in its metadata, or else a volume, which gets the look
    /// [`Look::automatic`].
    ///
    /// # Errors
    /// [`LiveError::File`], [`LiveError::Picture`] or [`LiveError::Document`], which name the file.
    pub fn open(path: &Path) -> Result<Self, LiveError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let text = || read_text(path, "a scene document");
        let (value, bare) = match extension.as_str() {
            "toml" => (in_file(path, document::value_from_toml(&text()?))?, false),
            "json" => (in_file(path, document::value_from_json(&text()?))?, false),
            picture if PICTURES.contains(&picture) => (of_picture(path)?, false),
            _ => (of_volume(path)?, true),
        };
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let lacks_gradient_range =
            PICTURES.contains(&extension.as_str()) && value.pointer(GRADIENT_RANGE).is_none();
        let mut input =
            Self { value, folder, bare, lacks_gradient_range, name: path_name(path), notes: Vec::new() };
        input.notes = in_file(path, document::move_old_keys(&mut input.value))?;
        if bare {
            input.value = document::apply(&input.value, &Look::automatic().patch());
        }
        Ok(input)
    }

    /// A document that is not in a file; its paths are relative to `folder`.
    #[must_use]
    pub fn of_document(value: Value, folder: &Path) -> Self {
        let (folder, name) = (folder.to_owned(), "scene".to_owned());
        Self { value, folder, bare: false, lacks_gradient_range: false, name, notes: Vec::new() }
    }

    /// Gives the document a look, before any other patch; that of a bare volume, which was chosen automatically, is dropped.
    ///
    /// # Errors
    /// As [`Self::patch`].
    pub fn give_look(&mut self, look: &Value) -> Result<(), DocumentError> {
        if self.bare {
            self.value = json!({ "volume": self.value["volume"] });
        }
        self.patch(look)
    }

    /// Applies a merge patch to the document.
    ///
    /// # Errors
    /// [`DocumentError`] if the patch has a key at both its old and its new path.
    pub fn patch(&mut self, patch: &Value) -> Result<(), DocumentError> {
        let mut patch = patch.clone();
        self.notes.extend(document::move_old_keys(&mut patch)?);
        // Anything but a table would become one, and the check would not see what the file really contains.
        if self.value.is_object() {
            self.value = document::apply(&self.value, &patch);
        }
        Ok(())
    }

    /// Sets one key of the document, see [`document::set()`].
    ///
    /// # Errors
    /// As [`document::set()`].
    pub fn set(&mut self, assignment: &str) -> Result<(), DocumentError> {
        document::set(&mut self.value, assignment)
    }

    /// Checks the document and loads its assets.
    ///
    /// # Errors
    /// [`LiveError`] if the document or one of the files is invalid.
    pub fn load(self, options: &Options) -> Result<LoadedScene, LiveError> {
        let Self { mut value, folder, bare, lacks_gradient_range, name, mut notes } = self;
        let in_document = |source| LiveError::Document { at: name.clone(), source };
        notes.extend(document::move_old_keys(&mut value).map_err(in_document)?);
        let density_is_free = bare && value.pointer("/medium/density").is_none();
        let kept = if options.edits { value.clone() } else { Value::Null };
        let mut document = Document::from_value(value).map_err(in_document)?;
        let range_is_free = lacks_gradient_range && document.medium.gradient_range.is_none();
        let (assets, source) = options
            .threads
            .install(|| assets::load(&mut document, &folder))
            .map_err(|error| of_assets(error, &name))?;
        let mut value = kept;
        if density_is_free {
            document.medium.density = BARE_THICKNESS / assets.volume.grid().diagonal();
            if options.edits {
                // Chosen to suit the volume; stored so that no edit loses it.
                value = document::apply(&value, &json!({ "medium": { "density": document.medium.density } }));
            }
        }
        if range_is_free {
            document.medium.gradient_range = chosen::robust_width(&assets.volume);
            if options.edits
                && let Some(range) = document.medium.gradient_range
            {
                value = document::apply(&value, &json!({ "medium": { "gradient_range": range } }));
            }
        }
        Ok(LoadedScene { document, assets, source, value, folder, name, notes })
    }
}

/// The error of a document's assets.
fn of_assets(source: AssetError, at: &str) -> LiveError {
    match source {
        AssetError::Volume(_) => LiveError::Volume(Box::new(source)),
        // The other messages begin with a key.
        _ => LiveError::Asset { at: at.to_owned(), source: Box::new(source) },
    }
}

/// The scene in a picture's metadata.
fn of_picture(path: &Path) -> Result<Value, LiveError> {
    let metadata = read_metadata(path).map_err(|e| LiveError::Picture(e.to_string()))?;
    let text = metadata.as_ref().and_then(|m| m.get(Metadata::SCENE)).ok_or_else(|| {
        file(
            path,
            "a picture without a scene in its metadata; expected one that Tyndall made, a scene (.toml, .json) or a volume \
             (NRRD, NIfTI, MetaImage, NumPy)",
        )
    })?;
    in_file(path, document::value_from_json(text))
}

/// The document of a bare volume.
fn of_volume(path: &Path) -> Result<Value, LiveError> {
    let name =
        path.file_name().ok_or_else(|| file(path, "expected a file: a scene, a picture or a volume"))?;
    let name = name.to_str().ok_or_else(|| file(path, "a name that is not Unicode; rename the file"))?;
    Ok(json!({ "volume": { "path": name } }))
}

/// Adds the file's name to an error.
fn in_file<T>(path: &Path, result: Result<T, DocumentError>) -> Result<T, LiveError> {
    result.map_err(|source| LiveError::Document { at: path_name(path), source })
}

fn file(path: &Path, problem: impl Display) -> LiveError {
    LiveError::File { at: path_name(path), problem: problem.to_string() }
}
