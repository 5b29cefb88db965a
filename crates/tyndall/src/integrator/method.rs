//! The interface of a rendering method to everything outside its folder.

use super::{Limits, Stop};
use crate::film::{Goal, Tile};
use crate::scene::{Difference, MethodChoice, MethodSettings, Scene};
use crate::simd::Level;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::any::Any;
use std::fmt::Debug;

/// A rendering method: its name and settings, and its state while it renders a scene.
///
/// A sample is fully determined by the scene, its pixel and its number, so that the picture depends neither on threads
/// nor on the time slices in which a session works. All functions here are called once per pass or tile, never once per
/// sample. Long-running ones may use the current thread pool.
pub trait Method: Sized + Send + Sync + 'static {
    /// Name in the scene document and on the command line: lower-case words joined by hyphens.
    const NAME: &'static str;

    /// A one-sentence description, for lists and for the document's schema.
    const ABOUT: &'static str;

    /// Whether samples are random, so that the picture has a noise estimate.
    const HAS_NOISE: bool = true;

    /// Samples per pixel of a document that gives no number.
    const DEFAULT_SAMPLES: u32 = 64;

    /// Whether light bends where the refractive index changes; if not, a note says that a scene's index is ignored.
    const BENDS_LIGHT: bool = false;

    /// Keys of its table that have moved elsewhere in the document.
    const MOVED_KEYS: &'static [MovedKey] = &[];

    /// Its settings; `Default` gives those that apply if the document gives none.
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

    /// State kept for each tile besides its pixels; the default is that of a tile not yet started.
    type TileState: Default + Send + Sync + 'static;

    /// Checks what a JSON Schema cannot express.
    ///
    /// # Errors
    /// [`SettingProblem`] for the first invalid setting.
    fn check(settings: &Self::Settings) -> Result<(), SettingProblem> {
        let _ = settings;
        Ok(())
    }

    /// Settings for a similar picture with little work: for thumbnails and tests.
    #[must_use]
    fn draft(settings: &Self::Settings) -> Self::Settings {
        settings.clone()
    }

    /// What the method leaves out in this scene, or does differently from what a user may expect; one sentence each.
    fn notes(settings: &Self::Settings, scene: &Scene) -> Vec<&'static str> {
        let _ = (settings, scene);
        Vec::new()
    }

    /// Most memory that it may need for a scene besides film and medium; `None` if that is negligible.
    fn memory(settings: &Self::Settings, scene: &Scene) -> Option<MemoryNeed> {
        let _ = (settings, scene);
        None
    }

    /// Creates the method for a scene, without any long computation.
    fn new(scene: &Scene, settings: &Self::Settings, resources: &Resources) -> Self;

    /// Whether samples taken before an edit may differ, even by one bit, from those that would be taken now.
    fn is_touched_by(&self, difference: &Difference) -> bool;

    /// Updates to an edited scene, for an edit that touches the method but not its settings, or for several such edits at once.
    /// Keeps what is still valid of its own state and of the tiles'. Must not take long, but for what `limits` can stop.
    fn update(&mut self, edit: &Edited, tiles: &mut [Self::TileState], limits: &Limits) -> Updated {
        let _ = (edit, tiles, limits);
        Updated::StartAnew
    }

    /// Whether the film's first sample, whose number is `first`, must wait for [`Self::prepare`].
    fn is_settling(&self, scene: &Scene, first: u32) -> bool {
        let _ = (scene, first);
        false
    }

    /// Resets the counts of what was computed, at every edit.
    fn count_anew(&mut self, tiles: &mut [Self::TileState]) {
        let _ = tiles;
    }

    /// Prepares what sample number `sample` of all pixels needs; false if it was stopped first.
    fn prepare(&mut self, scene: &Scene, sample: u32, limits: &Limits) -> bool {
        let _ = (scene, sample, limits);
        true
    }

    /// Number of consecutive samples that need only one call of [`Self::prepare`].
    fn samples_at_once(&self) -> u32 {
        u32::MAX
    }

    /// Adds samples to the pixels of a tile until it reaches `goal`, or until `stop`. Unfinished work is kept in `state` and
    /// continued by the next call, so that time slices of any length make progress.
    fn refine(&self, scene: &Scene, tile: &mut Tile, state: &mut Self::TileState, goal: Goal, stop: &Stop);

    /// What was computed and is kept; `pixels` gives the number of samples that the film has taken.
    fn report(&self, tiles: &[Self::TileState], pixels: &PixelCounts) -> MethodReport {
        let _ = tiles;
        MethodReport::of_pixels(pixels, 0)
    }

    /// A copy of what it keeps across edits besides pixels, for tests; `None` if it keeps nothing.
    fn kept_items(&self, tiles: &[Self::TileState]) -> Option<Box<dyn KeptItems>> {
        let _ = tiles;
        None
    }

    /// The method with its default settings, in the form that a scene holds.
    #[must_use]
    fn usual() -> MethodChoice {
        Self::choose(Self::Settings::default())
    }

    /// The method with these settings, in the form that a scene holds.
    #[must_use]
    fn choose(settings: Self::Settings) -> MethodChoice {
        MethodChoice::new(Chosen::<Self>(settings))
    }
}

/// A method's settings, with the method as their type parameter.
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

/// Resources that a method may use.
#[derive(Clone, Copy, Debug)]
pub struct Resources {
    /// Vector instructions.
    pub level: Level,
    /// Bytes that it may use, within its settings, for data that only future edits need; 0 if there will be no edits.
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

/// What came of updating a method to an edited scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Updated {
    /// It is up to date, and has kept what is still valid.
    Done,
    /// It was stopped first. The next call has the same old scene, to which all that is kept still belongs, but may have another new
    /// scene.
    Stopped,
    /// Nothing is valid: the method must be created again.
    StartAnew,
}

/// A key of a method's table that has moved elsewhere in the document.
#[derive(Clone, Copy, Debug)]
pub struct MovedKey {
    /// The key in the method's table.
    pub key: &'static str,
    /// Its new place in the document, as a dotted path.
    pub now: &'static str,
}

/// What is wrong with a setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingProblem {
    /// The setting's key.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What was expected.
    pub expected: &'static str,
}

/// Memory that a method may need.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryNeed {
    /// Expected maximum in bytes; random path lengths may exceed it slightly.
    pub bytes: u64,
    /// The setting that it depends on most.
    pub key: &'static str,
    /// What the memory is for, in the plural: "5 light paths".
    pub what: String,
    /// What would need less memory.
    pub fix: &'static str,
}

/// Samples that a film has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelCounts {
    /// Number of pixels.
    pub pixels: usize,
    /// Samples per pixel, on average.
    pub samples: f64,
    /// Mean number of samples per pixel that the last edit left in the film.
    pub left: f64,
}

/// What a method has computed since the last edit, or since the beginning, and what it keeps for future edits.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MethodReport {
    /// For each kind of work item, such as pixels or view-ray segments, the share that was computed.
    pub recomputed: Vec<WorkShare>,
    /// What is kept across edits besides pixels.
    pub kept: Vec<KeptCount>,
    /// Of the items kept across edits besides pixels, the number that were computed; `None` if nothing is kept.
    pub items_computed: Option<usize>,
    /// Further counts, for benchmarks.
    pub counts: Vec<NamedCount>,
    /// Names of the two timed stages: preparation and sampling.
    pub stages: StageNames,
}

/// The share of a kind of work item that was computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkShare {
    /// Name of the kind.
    pub name: &'static str,
    /// 0 to 1.
    pub share: f64,
}

impl WorkShare {
    /// The share `computed` of `all`; 0 if both are 0.
    #[must_use]
    pub fn new(name: &'static str, computed: usize, all: usize) -> Self {
        Self { name, share: computed as f64 / all.max(1) as f64 }
    }
}

/// Number of kept items of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptCount {
    /// Name of the kind.
    pub name: &'static str,
    /// Number of items.
    pub count: usize,
    /// Their total size in bytes.
    pub bytes: usize,
}

/// A count with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedCount {
    /// What is counted.
    pub name: &'static str,
    /// The count.
    pub count: usize,
}

/// Names of the two stages of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageNames {
    /// What is prepared before samples are taken; `None` if nothing is.
    pub preparation: Option<&'static str>,
    /// What sampling computes.
    pub sampling: &'static str,
}

impl Default for StageNames {
    fn default() -> Self {
        Self { preparation: None, sampling: PIXELS }
    }
}

/// Name of the work items that every method has.
const PIXELS: &str = "pixels";

impl MethodReport {
    /// The report of a method that computes pixel samples; `found` is the number that it reused from those it keeps.
    #[must_use]
    pub fn of_pixels(pixels: &PixelCounts, found: usize) -> Self {
        let taken = pixels.samples - pixels.left - found as f64 / pixels.pixels as f64;
        let share = if pixels.samples > 0.0 { taken.max(0.0) / pixels.samples } else { 0.0 };
        Self { recomputed: vec![WorkShare { name: PIXELS, share }], ..Self::default() }
    }
}

/// What a method keeps across edits, at one point in time.
pub trait KeptItems: Any + Send + Sync {
    /// Compares with what was kept at another time, or by another session.
    fn compare(&self, other: &dyn KeptItems) -> ItemChanges;
}

/// Differences between what was kept at two points in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItemChanges {
    /// Items that were kept at both times but differ.
    pub differing: usize,
    /// Items that were kept only at the first time.
    pub new: usize,
}

impl std::ops::AddAssign for ItemChanges {
    fn add_assign(&mut self, other: Self) {
        self.differing += other.differing;
        self.new += other.new;
    }
}
