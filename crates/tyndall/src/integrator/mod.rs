//! The methods of computing light, a folder each, and the one interface by which everything else meets them.
//!
//! A new method is a folder with a type that implements [`Method`], and a line in each of the two lists here. Command
//! line, scene document, sessions, tests and continuous integration go over [`METHODS`].

mod cells;
mod engine;
mod history;
mod light_paths;
mod method;
mod next_event;
mod stop;
mod view_march;

pub mod path;
pub mod photon;
pub mod raymarch;

#[cfg(test)]
mod plain;

pub(crate) use engine::Engine;
pub use engine::MethodEntry;
pub use method::{
    Edited, ItemChanges, KeptCount, KeptItems, MemoryNeed, Method, MethodReport, MovedKey, NamedCount,
    PixelCounts, Resources, SettingProblem, StageNames, WorkShare,
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

/// The method of a scene that names none: unbiased, the truth that others are held against.
pub static DEFAULT_METHOD: MethodEntry = MethodEntry::of::<path::PathTracer>();

/// The method of a name.
#[must_use]
pub fn method_named(name: &str) -> Option<&'static MethodEntry> {
    METHODS.iter().find(|method| method.name == name)
}

/// The method that a scene asks for.
///
/// # Panics
/// If the choice is of a method that is not in the list.
#[must_use]
pub fn method_of(choice: &MethodChoice) -> &'static MethodEntry {
    method_named(choice.name()).unwrap_or_else(|| panic!("method `{}` is not in the list", choice.name()))
}
