//! From INPUT and the options to a checked document and its assets.

use crate::Failure;
use crate::args::SceneOptions;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tyndall::message::{excerpt, place};
use tyndall::scene::Assets;
use tyndall::scene::document::{self, Document};
use tyndall_formats::assets::{self, AssetError};
use tyndall_formats::image::{Metadata, read_metadata};

/// A document as it was found, before any override.
pub struct Input {
    /// The document.
    pub value: Value,
    /// The folder that its paths start from.
    pub folder: PathBuf,
    /// Whether it is a volume without a scene, whose look is chosen here.
    pub bare: bool,
}

/// Density of a bare volume times its box's diagonal: opaque matter stops light within a 200th of it.
const BARE_THICKNESS: f32 = 200.0;

/// Text documents larger than this are no scenes.
const LARGEST_DOCUMENT: u64 = 256 << 20;

/// Memory that a byte of text may become: a million lights were seen to take 33 times their text.
const MEMORY_PER_BYTE: u64 = 40;

impl Input {
    /// Finds out what INPUT is: a scene by its extension, a picture with a scene inside, or a volume.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let scene = |value| Ok(Self { value, folder: folder.clone(), bare: false });
        match extension.as_str() {
            "toml" => scene(in_file(path, document::value_from_toml(&read_text(path, "a scene document")?))?),
            "json" => scene(in_file(path, document::value_from_json(&read_text(path, "a scene document")?))?),
            "png" | "jpg" | "jpeg" | "tif" | "tiff" | "exr" => {
                let metadata = read_metadata(path).map_err(Failure::input)?;
                let text = metadata.as_ref().and_then(|m| m.get(Metadata::SCENE)).ok_or_else(|| {
                    Failure::input(format!(
                        "{}: a picture without a scene in its metadata; expected one that Tyndall made, a scene \
                         (.toml, .json) or a volume (NRRD, NIfTI, MetaImage, NumPy)",
                        place(path)
                    ))
                })?;
                scene(in_file(path, document::value_from_json(text))?)
            }
            _ => {
                let name = path.file_name().ok_or_else(|| {
                    Failure::input(format!(
                        "{}: expected a file: a scene, a picture or a volume",
                        place(path)
                    ))
                })?;
                let name = name.to_str().ok_or_else(|| {
                    Failure::input(format!("{}: a name that is no Unicode; rename the file", place(path)))
                })?;
                Ok(Self { value: json!({ "volume": { "path": name } }), folder, bare: true })
            }
        }
    }

    /// Lays the options over the document: `--set` in their order, then the others.
    pub fn override_with(&mut self, options: &SceneOptions, samples: Option<u32>) -> Result<(), Failure> {
        for assignment in &options.set {
            document::set(&mut self.value, assignment)
                .map_err(|e| Failure::usage(format!("--set {}: {e}", excerpt(assignment))))?;
        }
        let mut patch = json!({});
        if let Some(integrator) = options.integrator {
            patch["render"]["integrator"] = integrator.name().into();
        }
        if let Some(samples) = samples {
            patch["render"]["samples"] = samples.into();
        }
        if let Some(seed) = options.seed {
            patch["render"]["seed"] = seed.into();
        }
        if let Some(order) = options.max_scatter {
            patch["render"]["max_scatter"] = order.into();
        }
        if let Some(size) = options.size {
            patch["film"]["size"] = json!(size);
        }
        if let Some(preset) = &options.preset {
            patch["transfer_function"]["preset"] = preset.as_str().into();
        }
        // Anything but a table would become one, and the check would not find what really stands in the file.
        if self.value.is_object() {
            self.value = document::apply(&self.value, &patch);
        }
        Ok(())
    }

    /// Checks the document and reads what it names; its value is gone then, which of a million lights is a gigabyte.
    pub fn load(&mut self, path: &Path) -> Result<(Document, Assets, assets::Source), Failure> {
        let thickness_is_free = self.bare && self.value.pointer("/medium/density").is_none();
        let mut document = in_file(path, Document::from_value(self.value.take()))?;
        let (assets, source) = assets::load(&document, &self.folder).map_err(|e| of_assets(&e, path))?;
        if thickness_is_free {
            document.medium.density = BARE_THICKNESS / assets.volume.grid().diagonal();
        }
        Ok((document, assets, source))
    }
}

/// Why what a document names cannot be had.
fn of_assets(error: &AssetError, document: &Path) -> Failure {
    match error {
        AssetError::Volume(_) => Failure::input(error),
        // Of the others each begins with a key.
        _ => Failure::input(format!("{}: {error}", place(document))),
    }
}

/// Says of which file the trouble is.
pub fn in_file<T>(path: &Path, result: Result<T, document::DocumentError>) -> Result<T, Failure> {
    result.map_err(|e| Failure::input(format!("{}: {e}", place(path))))
}

/// The text of a file that should be `what`.
pub fn read_text(path: &Path, what: &str) -> Result<String, Failure> {
    let fail = |problem: &dyn std::fmt::Display| Failure::input(format!("{}: {problem}", place(path)));
    let unreadable = |e| fail(&format!("cannot be read: {e}; check the path"));
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(fail(&format!("not a file; expected {what}")));
    }
    if about.len() > LARGEST_DOCUMENT {
        return Err(fail(&format!("{} bytes; {what} has at most {LARGEST_DOCUMENT}", about.len())));
    }
    let needed = about.len().saturating_mul(MEMORY_PER_BYTE);
    if let Some(available) = tyndall_formats::memory::available().filter(|&available| needed > available) {
        return Err(fail(&format!(
            "{what} of {} MiB takes up to {} MiB of memory, but {} MiB are free; expected a smaller one",
            about.len() >> 20,
            needed >> 20,
            available >> 20
        )));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|e| {
        fail(&format!("byte {} is no UTF-8; expected {what} in UTF-8", e.utf8_error().valid_up_to()))
    })
}
