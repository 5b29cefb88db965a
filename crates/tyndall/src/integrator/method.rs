//! What a method of computing light is to everything outside its folder.

use super::{Limits, Stop};
use crate::film::{Goal, Tile};
use crate::scene::{Difference, MethodChoice, MethodSettings, Scene};
use crate::simd::Level;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::any::Any;
use std::fmt::Debug;

/// A method of computing light: its name and settings, and its state while it works on a scene.
///
/// Everything about a sample follows from the scene, its pixel and its number, so that neither threads nor the slices of time
/// in which a session works leave a trace in the picture. All functions here are called once for a pass or a tile, never once
/// for a sample. Those that run for long may use the current thread pool.
pub trait Method: Sized + Send + Sync + 'static {
    /// Name in the scene document and on the command line: lower-case words joined by hyphens.
    const NAME: &'static str;

    /// What it is, in a sentence for lists and for the document's schema.
    const ABOUT: &'static str;

    /// Whether samples of a pixel are random, so that the picture has an error estimate.
    const HAS_NOISE: bool = true;

    /// Whether light bends where the refractive index changes; else a scene with an index is told that it is ignored.
    const BENDS_LIGHT: bool = false;

    /// Keys of its table in the document that now stand elsewhere.
    const MOVED_KEYS: &'static [MovedKey] = &[];

    /// Its settings; `Default` gives those of a document that names none.
    type Settings: Clone
        + Debug
        + Default
        + PartialEq
        + Serialize
        + DeserializeOwned
        + JsonSchema
        + Send
        + Sync
        + 'static;

    /// State kept for each tile beside its pixels; the default is that of a tile not yet begun.
    type TileState: Default + Send + Sync + 'static;

    /// Checks what a JSON Schema cannot express.
    ///
    /// # Errors
    /// [`SettingProblem`] for the first setting that cannot be.
    fn check(settings: &Self::Settings) -> Result<(), SettingProblem> {
        let _ = settings;
        Ok(())
    }

    /// Settings that mean the same but ask for little work: for thumbnails and tests.
    #[must_use]
    fn draft(settings: &Self::Settings) -> Self::Settings {
        settings.clone()
    }

    /// What the method leaves out of this scene, or does differently from what a user may expect; one sentence each.
    fn notes(settings: &Self::Settings, scene: &Scene) -> Vec<&'static str> {
        let _ = (settings, scene);
        Vec::new()
    }

    /// The most memory that it may need for a scene beyond film and medium; `None` if that is negligible.
    fn memory(settings: &Self::Settings, scene: &Scene) -> Option<MemoryNeed> {
        let _ = (settings, scene);
        None
    }

    /// Prepares the method for a scene, without any long computation.
    fn new(scene: &Scene, settings: &Self::Settings, resources: &Resources) -> Self;

    /// Whether samples taken before an edit may differ, by a bit or more, from those that would be taken now.
    fn is_touched_by(&self, difference: &Difference) -> bool;

    /// Goes on from one scene to another that touches it, and keeps what of its own state and of the tiles' is still valid;
    /// false where that is nothing, and the method is to begin anew. Called for edits that leave its settings alone.
    fn update(&mut self, edit: &Edited, tiles: &mut [Self::TileState]) -> bool {
        let _ = (edit, tiles);
        false
    }

    /// Begins to count anew what is computed, after an edit that did not touch the method.
    fn count_anew(&mut self, tiles: &mut [Self::TileState]) {
        let _ = tiles;
    }

    /// Prepares what sample number `sample` of all pixels needs; false if a stop came first.
    fn prepare(&mut self, scene: &Scene, sample: u32, limits: &Limits) -> bool {
        let _ = (scene, sample, limits);
        true
    }

    /// Samples that may follow each other without being prepared one by one.
    fn samples_at_once(&self) -> u32 {
        u32::MAX
    }

    /// Adds samples to the pixels of a tile until it has come as far as `goal`, or is told to stop. What is then half done
    /// waits in `state` and is taken up by the next call, so that slices of any length get on.
    fn refine(&self, scene: &Scene, tile: &mut Tile, state: &mut Self::TileState, goal: Goal, stop: &Stop);

    /// What was computed and is kept; `pixels` tells how many samples the film has taken.
    fn report(&self, tiles: &[Self::TileState], pixels: &PixelCounts) -> MethodReport {
        let _ = tiles;
        MethodReport::of_pixels(pixels, 0)
    }

    /// A copy of what it keeps through edits beside pixels, for checks; `None` where that is nothing.
    fn kept_items(&self, tiles: &[Self::TileState]) -> Option<Box<dyn KeptItems>> {
        let _ = tiles;
        None
    }

    /// The method with its default settings, as a scene asks for it.
    #[must_use]
    fn usual() -> MethodChoice {
        Self::choose(Self::Settings::default())
    }

    /// The method with these settings, as a scene asks for it.
    #[must_use]
    fn choose(settings: Self::Settings) -> MethodChoice {
        MethodChoice::new(Chosen::<Self>(settings))
    }
}

/// A method's settings, which tell whose they are.
pub(super) struct Chosen<M: Method>(pub M::Settings);

impl<M: Method> Debug for Chosen<M> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_tuple(M::NAME).field(&self.0).finish()
    }
}

impl<M: Method> MethodSettings for Chosen<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }

    fn equals(&self, other: &dyn MethodSettings) -> bool {
        let other: &dyn Any = other;
        other.downcast_ref::<Self>().is_some_and(|other| other.0 == self.0)
    }
}

/// What a method may use.
#[derive(Clone, Copy, Debug)]
pub struct Resources {
    /// Vector instructions.
    pub level: Level,
    /// Bytes that it may use, within its settings, for what only future edits need; 0 if there will be none.
    pub edit_memory: usize,
}

/// An edit: two scenes and what differs between them.
#[derive(Clone, Copy, Debug)]
pub struct Edited<'a> {
    /// The scene before.
    pub old: &'a Scene,
    /// The scene after.
    pub new: &'a Scene,
    /// What changed.
    pub difference: &'a Difference,
}

/// A key of a method's table that now stands elsewhere in the document.
#[derive(Clone, Copy, Debug)]
pub struct MovedKey {
    /// The key in the method's table.
    pub key: &'static str,
    /// Where it stands now, with dots between its parts.
    pub now: &'static str,
}

/// What is wrong with a setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingProblem {
    /// Its key.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What was expected.
    pub expected: &'static str,
}

/// Memory that a method may need.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryNeed {
    /// Most bytes to be expected; random path lengths may exceed it slightly.
    pub bytes: u64,
    /// The setting that it depends on most.
    pub key: &'static str,
    /// For what, in the plural: "5 light paths".
    pub what: String,
    /// What would take less.
    pub mend: &'static str,
}

/// Samples that a film has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelCounts {
    /// Pixels.
    pub pixels: usize,
    /// Samples per pixel, on average.
    pub samples: f64,
    /// Samples per pixel, on average, that the last edit left.
    pub left: f64,
}

/// What a method has computed since the last edit, or since the beginning, and what it keeps for edits to come.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MethodReport {
    /// Of each kind of work item, such as pixels or view-ray segments, the share that was computed.
    pub recomputed: Vec<WorkShare>,
    /// What is kept through edits beside pixels.
    pub kept: Vec<KeptCount>,
    /// Of what is kept through edits beside pixels, the items that were computed; `None` where nothing is kept.
    pub items_computed: Option<usize>,
    /// Further counts that benches ask for.
    pub counts: Vec<NamedCount>,
    /// Names of the two stages that time is spent on: before samples are taken, and while they are.
    pub stages: StageNames,
}

/// The share of a kind of work item that was computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkShare {
    /// What kind.
    pub name: &'static str,
    /// 0 to 1.
    pub share: f64,
}

impl WorkShare {
    /// So many of all; none of none is nothing.
    #[must_use]
    pub fn new(name: &'static str, computed: usize, all: usize) -> Self {
        Self { name, share: computed as f64 / all.max(1) as f64 }
    }
}

/// How many items of a kind are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptCount {
    /// What kind.
    pub name: &'static str,
    /// How many.
    pub count: usize,
    /// What they take together.
    pub bytes: usize,
}

/// A count with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedCount {
    /// Of what.
    pub name: &'static str,
    /// How many.
    pub count: usize,
}

/// Names of the two stages of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageNames {
    /// What is made before samples are taken; `None` where that is nothing.
    pub preparation: Option<&'static str>,
    /// What samples are taken of.
    pub sampling: &'static str,
}

impl Default for StageNames {
    fn default() -> Self {
        Self { preparation: None, sampling: PIXELS }
    }
}

/// The work items that every method has.
const PIXELS: &str = "pixels";

impl MethodReport {
    /// Of a method that computes samples of pixels, of which so many were `found` among those that it keeps.
    #[must_use]
    pub fn of_pixels(pixels: &PixelCounts, found: usize) -> Self {
        let taken = pixels.samples - pixels.left - found as f64 / pixels.pixels as f64;
        let share = if pixels.samples > 0.0 { taken.max(0.0) / pixels.samples } else { 0.0 };
        Self { recomputed: vec![WorkShare { name: PIXELS, share }], ..Self::default() }
    }
}

/// What a method kept through edits at one time.
pub trait KeptItems: Any + Send + Sync {
    /// Holds them against what was kept at another time, or by another session.
    fn compare(&self, other: &dyn KeptItems) -> ItemChanges;
}

/// How what was kept at one time differs from what was kept at another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItemChanges {
    /// Items that were kept at both times, and differ.
    pub differing: usize,
    /// Items that were kept at the first time alone.
    pub new: usize,
}

impl std::ops::AddAssign for ItemChanges {
    fn add_assign(&mut self, other: Self) {
        self.differing += other.differing;
        self.new += other.new;
    }
}
