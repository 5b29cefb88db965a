//! `tyndall presets`, `tyndall looks` and `tyndall schema`.

use crate::{Failure, say};
use tyndall::transfer::{PRESETS, Preset};
use tyndall_live::{LOOKS, Look, document};

/// One preset per line.
pub fn presets() -> Result<(), Failure> {
    let line = |preset: &Preset| format!("{:<14} {}\n", preset.name, preset.about);
    say(&PRESETS.iter().map(line).collect::<String>())
}

/// One look per line.
pub fn looks() -> Result<(), Failure> {
    let line = |look: &Look| format!("{:<14} {}\n", look.name, look.about);
    say(&LOOKS.iter().map(line).collect::<String>())
}

/// The JSON Schema of the scene document.
pub fn schema() -> Result<(), Failure> {
    say(&format!("{:#}\n", document::schema()))
}
