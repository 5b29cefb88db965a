//! The type-erased interface of a running method, which a session drives.

use super::Limits;
use super::disposal::drop_elsewhere;
use super::method::{
    Chosen, Edited, KeptItems, MemoryNeed, Method, MethodReport, MovedKey, PixelCounts, Resources,
    SettingProblem, Updated,
};
use crate::film::{Film, Goal};
use crate::scene::{Difference, MethodChoice, Scene};
use rayon::prelude::*;
use schemars::{Schema, SchemaGenerator};
use serde_json::Value;

/// A running [`Method`] with the state of each tile. Called once per pass, never per sample.
pub(crate) trait Engine: Send + Sync {
    /// See [`Method::is_touched_by`].
    fn is_touched_by(&self, difference: &Difference) -> bool;
    /// See [`Method::update`]; starts anew if the edit selects another method. `tiles` is the film's new number of tiles.
    fn update(&mut self, edit: &Edited, tiles: usize, limits: &Limits) -> Updated;
    /// See [`Method::is_settling`].
    fn is_settling(&self, scene: &Scene, first: u32) -> bool;
    /// See [`Method::count_anew`].
    fn count_anew(&mut self);
    /// See [`Method::prepare`].
    fn prepare(&mut self, scene: &Scene, sample: u32, limits: &Limits) -> bool;
    /// See [`Method::samples_at_once`].
    fn samples_at_once(&self) -> u32;
    /// See [`Method::refine`]; refines the first `tiles` tiles, or all, in parallel on the current pool.
    fn refine(&mut self, scene: &Scene, film: &mut Film, goal: Goal, tiles: usize, limits: &Limits);
    /// See [`Method::report`].
    fn report(&self, pixels: &PixelCounts) -> MethodReport;
    /// See [`Method::kept_items`].
    fn kept_items(&self) -> Option<Box<dyn KeptItems>>;
}

/// A method with its states of the film's tiles.
struct Driver<M: Method> {
    method: M,
    tiles: Vec<M::TileState>,
}

impl<M: Method> Engine for Driver<M> {
    fn is_touched_by(&self, difference: &Difference) -> bool {
        self.method.is_touched_by(difference)
    }

    fn update(&mut self, edit: &Edited, tiles: usize, limits: &Limits) -> Updated {
        if edit.difference.method {
            return Updated::StartAnew;
        }
        let updated = self.method.update(edit, &mut self.tiles, limits);
        if updated == Updated::Done {
            if tiles < self.tiles.len() {
                drop_elsewhere(self.tiles.split_off(tiles));
            }
            self.tiles.resize_with(tiles, M::TileState::default);
        }
        updated
    }

    fn is_settling(&self, scene: &Scene, first: u32) -> bool {
        self.method.is_settling(scene, first)
    }

    fn count_anew(&mut self) {
        self.method.count_anew(&mut self.tiles);
    }

    fn prepare(&mut self, scene: &Scene, sample: u32, limits: &Limits) -> bool {
        self.method.prepare(scene, sample, limits)
    }

    fn samples_at_once(&self) -> u32 {
        self.method.samples_at_once()
    }

    fn refine(&mut self, scene: &Scene, film: &mut Film, goal: Goal, tiles: usize, limits: &Limits) {
        let (method, whole) = (&self.method, film.measured_luminance());
        let work = film.tiles_mut().par_iter_mut().zip(&mut self.tiles).take(tiles);
        work.with_max_len(1).for_each(|(tile, state)| {
            let stop = limits.stop();
            if !tile.has_reached(goal) && !stop.reached() {
                method.refine(scene, tile, state, goal, &stop);
                tile.measure_noise(whole);
            }
        });
    }

    fn report(&self, pixels: &PixelCounts) -> MethodReport {
        self.method.report(&self.tiles, pixels)
    }

    fn kept_items(&self) -> Option<Box<dyn KeptItems>> {
        self.method.kept_items(&self.tiles)
    }
}

/// An entry in the list of methods: what is known about a method before it runs.
#[derive(Debug)]
pub struct MethodEntry {
    /// See [`Method::NAME`].
    pub name: &'static str,
    /// See [`Method::ABOUT`].
    pub about: &'static str,
    /// See [`Method::HAS_NOISE`].
    pub has_noise: bool,
    /// See [`Method::DEFAULT_SAMPLES`].
    pub default_samples: u32,
    /// See [`Method::MOVED_KEYS`].
    pub moved_keys: &'static [MovedKey],
    default_settings: fn() -> MethodChoice,
    schema: fn(&mut SchemaGenerator) -> Schema,
    read: fn(Value) -> Result<MethodChoice, serde_json::Error>,
    write: fn(&MethodChoice) -> Option<Value>,
    draft: fn(&MethodChoice) -> MethodChoice,
    check: fn(&MethodChoice) -> Result<(), SettingProblem>,
    notes: fn(&Scene) -> Vec<&'static str>,
    memory: fn(&Scene) -> Option<MemoryNeed>,
    start: fn(&Scene, &Resources) -> Box<dyn Engine>,
}

impl MethodEntry {
    /// The entry for a method.
    #[must_use]
    pub const fn of<M: Method>() -> Self {
        Self {
            name: M::NAME,
            about: M::ABOUT,
            has_noise: M::HAS_NOISE,
            default_samples: M::DEFAULT_SAMPLES,
            moved_keys: M::MOVED_KEYS,
            default_settings: M::usual,
            schema: |generator| generator.subschema_for::<M::Settings>(),
            read: |value| serde_json::from_value(value).map(M::choose),
            write: |choice| serde_json::to_value(chosen::<M>(choice)?).ok(),
            draft: |choice| chosen::<M>(choice).map_or_else(|| choice.clone(), |s| M::choose(M::draft(s))),
            check: |choice| chosen::<M>(choice).map_or(Ok(()), M::check),
            notes: notes::<M>,
            memory: |scene| M::memory(&settings_of::<M>(scene), scene),
            start: start::<M>,
        }
    }

    /// The key of its table in the scene document: its name with underscores.
    #[must_use]
    pub fn table(&self) -> String {
        self.name.replace('-', "_")
    }

    /// The method with the settings that apply if the document gives none.
    #[must_use]
    pub fn default_settings(&self) -> MethodChoice {
        (self.default_settings)()
    }

    /// The JSON Schema of its settings.
    #[must_use]
    pub fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.schema)(generator)
    }

    /// The method with settings from a document.
    ///
    /// # Errors
    /// If the value does not match the schema.
    pub fn read(&self, settings: Value) -> Result<MethodChoice, serde_json::Error> {
        (self.read)(settings)
    }

    /// Its settings as a JSON value; `None` if `choice` is of another method.
    #[must_use]
    pub fn write(&self, choice: &MethodChoice) -> Option<Value> {
        (self.write)(choice)
    }

    /// See [`Method::draft`].
    #[must_use]
    pub fn draft(&self, choice: &MethodChoice) -> MethodChoice {
        (self.draft)(choice)
    }

    /// See [`Method::check`].
    ///
    /// # Errors
    /// [`SettingProblem`] for the first invalid setting.
    pub fn check(&self, choice: &MethodChoice) -> Result<(), SettingProblem> {
        (self.check)(choice)
    }

    /// See [`Method::notes`] and [`Method::BENDS_LIGHT`].
    #[must_use]
    pub fn notes(&self, scene: &Scene) -> Vec<&'static str> {
        (self.notes)(scene)
    }

    /// See [`Method::memory`].
    #[must_use]
    pub fn memory(&self, scene: &Scene) -> Option<MemoryNeed> {
        (self.memory)(scene)
    }

    /// Creates the method for a scene, with nothing computed yet.
    pub(crate) fn start(&self, scene: &Scene, resources: &Resources) -> Box<dyn Engine> {
        (self.start)(scene, resources)
    }
}

fn chosen<M: Method>(choice: &MethodChoice) -> Option<&M::Settings> {
    choice.settings::<Chosen<M>>().map(|chosen| &chosen.0)
}

/// A scene's settings; the defaults if it selects another method.
pub(super) fn settings_of<M: Method>(scene: &Scene) -> M::Settings {
    chosen::<M>(&scene.render.method).cloned().unwrap_or_default()
}

fn notes<M: Method>(scene: &Scene) -> Vec<&'static str> {
    let mut notes = M::notes(&settings_of::<M>(scene), scene);
    let bends = scene.medium.transfer().points().iter().any(|p| p.optics.ior != 1.0);
    if bends && !M::BENDS_LIGHT {
        notes.push("the refractive index is ignored: light travels in straight lines");
    }
    notes
}

fn start<M: Method>(scene: &Scene, resources: &Resources) -> Box<dyn Engine> {
    let method = M::new(scene, &settings_of::<M>(scene), resources);
    let tiles = std::iter::repeat_with(M::TileState::default).take(Film::tile_count(scene.size)).collect();
    Box::new(Driver { method, tiles })
}
