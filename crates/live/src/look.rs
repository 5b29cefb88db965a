//! Looks: everything that makes a picture of a volume but the volume, what is cut away and where it is seen from.

use crate::document::{self, Document};
use crate::error::LiveError;
use crate::text_file::read_text;
use serde_json::{Value, json};
use std::path::Path;
use tyndall::message::path_name;

/// A look that comes with Tyndall.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Its name.
    pub name: &'static str,
    /// What it shows and of which data, in one line.
    pub about: &'static str,
    /// Presets of the transfer function whose data it is made for, as [`tyndall::transfer::Preset::for_volume`] chooses them; none if it is made for all.
    presets: &'static [&'static str],
    /// The merge patch, TOML.
    text: &'static str,
}

macro_rules! looks {
    ($($name:literal for $presets:expr => $about:literal,)*) => {
        /// All looks that come with Tyndall.
        pub const LOOKS: &[Look] = &[$(Look {
            name: $name,
            about: $about,
            presets: &$presets,
            text: include_str!(concat!("../looks/", $name, ".toml")),
        }),*];
    };
}

looks! {
    "night" for [] => "any data: the function that suits them, in studio light on black",
    "paper" for [] => "any data: the function that suits them, in studio light on white",
    "ivory" for ["ct-bone"] => "CT: bone as carved ivory on black",
    "atlas" for ["ct-bone"] => "CT: bone on white, as in an atlas of anatomy",
    "portrait" for ["ct-bone"] => "CT: skin in the light of a portrait",
    "glass" for ["ct-bone"] => "CT: bone within skin of blue glass",
    "angio" for ["ct-bone"] => "CT with contrast agent: wet red vessels, with bone",
    "anatomy" for ["ct-bone"] => "CT: wet muscle and organs, with bone",
    "lungs" for ["ct-bone"] => "CT: lungs under a veil of skin",
    "phantom" for ["mri"] => "MRI: translucent tissue on black",
    "stone" for ["solid", "cloud"] => "rock and other solids: raking warm light",
    "smoke" for ["cloud"] => "simulations: a cloud between warm and cool light",
    "veils" for ["cloud", "solid"] => "simulations, any data: coloured veils at rising values, on black",
    "dye" for ["cloud"] => "microscopy: fluorescence on black",
    "stain" for ["cloud"] => "microscopy: a purple stain on white",
}

/// Keys that say what is seen and from where, and so are not part of a look.
const NO_LOOK: [&str; 3] = ["version", "volume", "clip"];

/// Keys of the camera that place it.
const PLACE: [&str; 6] = ["position", "target", "up", "focus", "height", "auto"];

impl Look {
    /// The look of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        LOOKS.iter().find(|look| look.name == name)
    }

    /// The look of a volume for which none is asked for.
    #[must_use]
    pub fn automatic() -> &'static Self {
        &LOOKS[0]
    }

    /// Whether it is made for data that are shown by this preset if none is asked for.
    #[must_use]
    pub fn suits(&self, preset: &str) -> bool {
        self.presets.is_empty() || self.presets.contains(&preset)
    }

    /// The merge patch that gives a document this look.
    #[must_use]
    pub fn patch(&self) -> Value {
        document::value_from_toml(self.text).expect("looks are tested")
    }
}

/// The merge patch in a file, TOML or else JSON. Paths of maps in it are relative to its folder; they become absolute.
///
/// # Errors
/// [`LiveError::File`] or [`LiveError::Document`], which name the file.
pub fn read_look(path: &Path) -> Result<Value, LiveError> {
    let name = path_name(path);
    let text = read_text(path, "a look")?;
    let in_file = |source| LiveError::Document { at: name.clone(), source };
    let read =
        if is_json(path) { document::value_from_json(&text) } else { document::value_from_toml(&text) };
    let mut look = read.map_err(in_file)?;
    let Some(table) = look.as_object_mut() else {
        let problem = "not a table; expected some of the keys of a scene, such as `lights`".to_owned();
        return Err(LiveError::File { at: name, problem });
    };
    if let Some(key) = NO_LOOK.iter().find(|key| table.contains_key(**key)) {
        let problem = format!("has `{key}`, which says what is seen; a look says how: leave it out");
        return Err(LiveError::File { at: name, problem });
    }
    absolute_maps(&mut look, path.parent().unwrap_or(Path::new("")));
    // Faults are told of the look, not of the scene that it would be part of.
    let whole = document::apply(&json!({ "volume": { "path": "any" } }), &look);
    Document::from_value(whole).map_err(in_file)?;
    Ok(look)
}

/// Makes the paths of maps, relative to `folder`, absolute.
fn absolute_maps(look: &mut Value, folder: &Path) {
    for light in look.get_mut("lights").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(map) = light.get("map").and_then(Value::as_str) {
            let path = folder.join(map);
            light["map"] = std::path::absolute(&path).unwrap_or(path).to_string_lossy().into();
        }
    }
}

/// The look of a document as it was written: a merge patch without what is seen, from where, how large and with how many samples. Paths of
/// maps, relative to `folder`, become absolute.
#[must_use]
pub fn look_of(document: &Value, folder: &Path) -> Value {
    let mut look = document.clone();
    let remove = |table: Option<&mut Value>, keys: &[&str]| {
        if let Some(table) = table.and_then(Value::as_object_mut) {
            keys.iter().for_each(|key| drop(table.shift_remove(*key)));
        }
    };
    remove(Some(&mut look), &NO_LOOK);
    remove(look.get_mut("camera"), &PLACE);
    remove(look.get_mut("film"), &["size"]);
    remove(look.get_mut("render"), &["samples", "seed"]);
    remove(look.get_mut("medium"), &["majorant_cell", "gradient_range"]);
    absolute_maps(&mut look, folder);
    look
}

/// The text of a look for a file of this name: JSON if its extension says so, else TOML.
#[must_use]
pub fn look_text(path: &Path, look: &Value) -> String {
    let json = || format!("{look:#}\n");
    if is_json(path) { json() } else { toml::to_string_pretty(look).unwrap_or_else(|_| json()) }
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}
