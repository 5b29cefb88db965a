//! What an input file is: a scene document, a picture that carries one, or a bare volume.

use crate::assets::{self, AssetError, Assets, Source};
use crate::document::{self, Document, DocumentError};
use crate::error::LiveError;
use crate::options::Options;
use serde_json::{Value, json};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use tyndall::message::path_name;
use tyndall_formats::image::{Metadata, read_metadata};

/// A document as it was found, before any override.
#[derive(Clone, Debug)]
pub struct Input {
    /// The document.
    pub value: Value,
    /// The folder that its paths start from.
    pub folder: PathBuf,
    /// Whether it is a volume without a scene, whose look is chosen here.
    pub bare: bool,
    /// How messages name it.
    pub name: String,
    /// What a user should know of how it was read.
    pub notes: Vec<String>,
}

/// A checked document with all that it names, from which a session starts.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The document.
    pub document: Document,
    /// What it names.
    pub assets: Assets,
    /// What the volume's source said beside the volume.
    pub source: Source,
    /// The document as it was written; null unless edits are to come, since that of a million lights is a gigabyte.
    pub(crate) value: Value,
    pub(crate) folder: PathBuf,
    /// How messages name the input.
    pub(crate) name: String,
    /// What a user should know of how the document was read.
    pub(crate) notes: Vec<String>,
}

/// Density of a bare volume times its box's diagonal: opaque matter stops light within a 200th of it.
const BARE_THICKNESS: f32 = 200.0;

/// Text documents larger than this are no scenes.
const LARGEST_DOCUMENT: u64 = 256 << 20;

/// Memory that a byte of text may become: a million lights were seen to take 33 times their text.
const MEMORY_PER_BYTE: u64 = 40;

impl Input {
    /// Finds out what a file is: a scene by its extension, a picture with a scene inside, or a volume.
    ///
    /// # Errors
    /// [`LiveError::File`], [`LiveError::Picture`] or [`LiveError::Document`], which name the file.
    pub fn open(path: &Path) -> Result<Self, LiveError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let text = || read_text(path, "a scene document");
        let (value, bare) = match extension.as_str() {
            "toml" => (in_file(path, document::value_from_toml(&text()?))?, false),
            "json" => (in_file(path, document::value_from_json(&text()?))?, false),
            "png" | "jpg" | "jpeg" | "tif" | "tiff" | "exr" => (of_picture(path)?, false),
            _ => (of_volume(path)?, true),
        };
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let mut input = Self { value, folder, bare, name: path_name(path), notes: Vec::new() };
        input.notes = in_file(path, document::move_old_keys(&mut input.value))?;
        Ok(input)
    }

    /// A document without a file; its paths start from `folder`.
    #[must_use]
    pub fn of_document(value: Value, folder: &Path) -> Self {
        Self { value, folder: folder.to_owned(), bare: false, name: "scene".to_owned(), notes: Vec::new() }
    }

    /// Lays a merge patch over the document.
    ///
    /// # Errors
    /// [`DocumentError`] if a key is there at its old place and at its new one.
    pub fn patch(&mut self, patch: &Value) -> Result<(), DocumentError> {
        let mut patch = patch.clone();
        self.notes.extend(document::move_old_keys(&mut patch)?);
        // Anything but a table would become one, and the check would not find what really stands in the file.
        if self.value.is_object() {
            self.value = document::apply(&self.value, &patch);
        }
        Ok(())
    }

    /// Sets one key of the document, see [`document::set()`].
    ///
    /// # Errors
    /// As there.
    pub fn set(&mut self, assignment: &str) -> Result<(), DocumentError> {
        document::set(&mut self.value, assignment)
    }

    /// Checks the document and reads what it names.
    ///
    /// # Errors
    /// [`LiveError`] with what is wrong with the document or the files.
    pub fn load(self, options: &Options) -> Result<LoadedScene, LiveError> {
        let Self { mut value, folder, bare, name, mut notes } = self;
        let in_document = |source| LiveError::Document { at: name.clone(), source };
        notes.extend(document::move_old_keys(&mut value).map_err(in_document)?);
        let density_is_free = bare && value.pointer("/medium/density").is_none();
        let kept = if options.edits { value.clone() } else { Value::Null };
        let mut document = Document::from_value(value).map_err(in_document)?;
        let (assets, source) = options
            .threads
            .install(|| assets::load(&document, &folder))
            .map_err(|error| of_assets(error, &name))?;
        let mut value = kept;
        if density_is_free {
            document.medium.density = BARE_THICKNESS / assets.volume.grid().diagonal();
            if options.edits {
                // Chosen by the volume, and no edit's to lose.
                value = document::apply(&value, &json!({ "medium": { "density": document.medium.density } }));
            }
        }
        Ok(LoadedScene { document, assets, source, value, folder, name, notes })
    }
}

/// Why what a document names cannot be had.
fn of_assets(source: AssetError, at: &str) -> LiveError {
    match source {
        AssetError::Volume(_) => LiveError::Volume(Box::new(source)),
        // Of the others each begins with a key.
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
    let name = name.to_str().ok_or_else(|| file(path, "a name that is no Unicode; rename the file"))?;
    Ok(json!({ "volume": { "path": name } }))
}

/// Says of which file the trouble is.
fn in_file<T>(path: &Path, result: Result<T, DocumentError>) -> Result<T, LiveError> {
    result.map_err(|source| LiveError::Document { at: path_name(path), source })
}

fn file(path: &Path, problem: impl Display) -> LiveError {
    LiveError::File { at: path_name(path), problem: problem.to_string() }
}

/// The text of a file that should be `what`.
///
/// # Errors
/// [`LiveError::File`] if it cannot be read, is no UTF-8, or is larger than any `what`.
pub fn read_text(path: &Path, what: &str) -> Result<String, LiveError> {
    let unreadable = |e: std::io::Error| file(path, format!("cannot be read: {e}; check the path"));
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(file(path, format!("not a file; expected {what}")));
    }
    if about.len() > LARGEST_DOCUMENT {
        return Err(file(path, format!("{} bytes; {what} has at most {LARGEST_DOCUMENT}", about.len())));
    }
    let needed = about.len().saturating_mul(MEMORY_PER_BYTE);
    if let Some(available) = tyndall_formats::memory::available().filter(|&available| needed > available) {
        let problem = format!(
            "{what} of {} MiB takes up to {} MiB of memory, but {} MiB are free; expected a smaller one",
            about.len() >> 20,
            needed >> 20,
            available >> 20
        );
        return Err(file(path, problem));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|e| {
        file(path, format!("byte {} is no UTF-8; expected {what} in UTF-8", e.utf8_error().valid_up_to()))
    })
}
