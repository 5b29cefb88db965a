//! `tyndall presets` and `tyndall schema`.

use crate::{Failure, say};
use tyndall::transfer::{PRESETS, Preset};
use tyndall_live::document;

/// One preset per line.
pub fn presets() -> Result<(), Failure> {
    let line = |preset: &Preset| format!("{:<14} {}\n", preset.name, preset.about);
    say(&PRESETS.iter().map(line).collect::<String>())
}

/// The JSON Schema of the scene document.
pub fn schema() -> Result<(), Failure> {
    say(&format!("{:#}\n", document::schema()))
}
