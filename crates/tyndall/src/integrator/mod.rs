//! The rendering methods, each in its folder, and the one interface through which everything else uses them.
//!
//! A new method is a folder with a type that implements [`Method`], and a line in each of the two lists here. The
//! command line, scene document, sessions, tests and continuous integration iterate over [`METHODS`].

mod cells;
mod disposal;
mod engine;
mod history;
mod light_paths;
mod method;
mod next_event;
mod shadow_grid;
mod stop;
mod view_march;

pub mod path;
pub mod photon;
pub mod raymarch;

#[cfg(test)]
mod plain;

pub(crate) use disposal::drop_elsewhere;
pub(crate) use engine::Engine;
pub use engine::MethodEntry;
use engine::settings_of;
pub use method::{
    Edited, ItemChanges, KeptCount, KeptItems, MemoryNeed, Method, MethodReport, MovedKey, NamedCount,
    PixelCounts, Resources, SettingProblem, StageNames, Updated, WorkShare,
};
pub use stop::{Limits, Stop};

use crate::scene::MethodChoice;

/// All methods, in the order in which users see them.
pub static METHODS: &[MethodEntry] = &[
    MethodEntry::of::<raymarch::RayMarch>(),
    MethodEntry::of::<path::PathTracer>(),
    MethodEntry::of::<photon::PhotonMapper>(),
    #[cfg(test)]
    MethodEntry::of::<plain::Plain>(),
];

/// The method of a scene that names none: unbiased, the reference for the others.
pub static DEFAULT_METHOD: MethodEntry = MethodEntry::of::<path::PathTracer>();

/// The method with this name.
#[must_use]
pub fn method_named(name: &str) -> Option<&'static MethodEntry> {
    METHODS.iter().find(|method| method.name == name)
}

/// The method that a scene selects.
///
/// # Panics
/// If the method is not in the list.
#[must_use]
pub fn method_of(choice: &MethodChoice) -> &'static MethodEntry {
    method_named(choice.name()).unwrap_or_else(|| panic!("method `{}` is not in the list", choice.name()))
}
