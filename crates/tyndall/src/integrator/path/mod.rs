//! Unbiased Monte Carlo: one path from the camera per sample, by the scheme of Exposure Render as described in
//! \[Khlebnikov14, sec. 3\], extended to any order of scattering.
//!
//! A path flies to a collision, samples one light there, scatters, and flies on. Light that can be found by light
//! sampling and by scattering is weighted by the balance heuristic \[Veach97\]. Paths may have any length and need no
//! stack. A session that will be edited keeps samples with what they depend on, so that an edit retakes only those that
//! it touched.

mod samples;
mod settings;
mod tracer;

pub use settings::Settings;

use super::{
    Edited, ItemChanges, KeptCount, KeptItems, Limits, Method, MethodReport, MovedKey, PixelCounts,
    Resources, Stop, Updated,
};
use crate::film::{Goal, PixelSample, Tile};
use crate::math::Ray;
use crate::sampling::PathSampler;
use crate::scene::{Difference, Scene};
use crate::simd::Level;
use rayon::prelude::*;
use samples::{SampleCounts, SampleKeeper, SampleTile};
use std::any::Any;
use tracer::{CameraPath, TraceOne, TracePixels};

/// The path tracer. If it has memory to keep samples, an edit retakes only those that it touched.
#[derive(Debug)]
pub struct PathTracer {
    level: Level,
    keeper: Option<SampleKeeper>,
}

/// State of a tile.
#[derive(Debug, Default)]
pub struct TileState {
    /// A path that a stop left unfinished.
    pending: Option<CameraPath>,
    samples: SampleTile,
}

impl PathTracer {
    /// With these vector instructions; keeps no samples.
    #[must_use]
    pub fn with_level(level: Level) -> Self {
        Self { level, keeper: None }
    }

    /// An unbiased estimate of the radiance that arrives along a world ray.
    #[must_use]
    pub fn trace(&self, scene: &Scene, ray: Ray, numbers: PathSampler) -> PixelSample {
        self.level.run(TraceOne { scene, path: CameraPath::new(ray, numbers) })
    }
}

impl Method for PathTracer {
    const NAME: &'static str = "path";
    const ABOUT: &'static str =
        "Unbiased, progressive path tracing through all orders of scattering: the ground truth.";
    const MOVED_KEYS: &'static [MovedKey] = &[MovedKey { key: "majorant_cell", now: "medium.majorant_cell" }];

    type Settings = Settings;
    type TileState = TileState;

    fn new(scene: &Scene, settings: &Settings, resources: &Resources) -> Self {
        let wanted = u64::from(settings.history_memory) << 20;
        let bytes = usize::try_from(wanted).unwrap_or(usize::MAX).min(resources.edit_memory);
        Self { level: resources.level, keeper: SampleKeeper::new(scene, bytes) }
    }

    fn is_touched_by(&self, difference: &Difference) -> bool {
        // Majorant cells determine which random numbers tracking uses.
        difference.view() || difference.light() || difference.majorants || difference.seed
    }

    fn update(&mut self, edit: &Edited, tiles: &mut [TileState], limits: &Limits) -> Updated {
        let Some(keeper) = self.keeper.as_mut().filter(|_| SampleKeeper::survives(edit.difference)) else {
            return Updated::StartAnew;
        };
        let Some(query) = keeper.update(edit, limits) else { return Updated::Stopped };
        tiles.par_iter_mut().for_each(|tile| {
            tile.pending = None;
            tile.samples.ask(query);
        });
        Updated::Done
    }

    fn is_settling(&self, _: &Scene, _: u32) -> bool {
        self.keeper.as_ref().is_some_and(|keeper| !keeper.reading.is_complete())
    }

    fn prepare(&mut self, _: &Scene, _: u32, limits: &Limits) -> bool {
        self.keeper.as_mut().is_none_or(|keeper| keeper.reading.complete(limits))
    }

    fn count_anew(&mut self, tiles: &mut [TileState]) {
        tiles.iter_mut().for_each(|tile| tile.samples.counts = SampleCounts::default());
    }

    fn refine(&self, scene: &Scene, tile: &mut Tile, state: &mut TileState, goal: Goal, stop: &Stop) {
        let TileState { pending, samples: kept } = state;
        self.level.run(TracePixels { scene, tile, pending, kept, keeper: self.keeper.as_ref(), goal, stop });
    }

    fn report(&self, tiles: &[TileState], pixels: &PixelCounts) -> MethodReport {
        let sum = |of: fn(&SampleTile) -> usize| tiles.iter().map(|tile| of(&tile.samples)).sum::<usize>();
        let kept = KeptCount { name: "samples", count: sum(SampleTile::len), bytes: sum(SampleTile::bytes) };
        MethodReport {
            kept: vec![kept],
            items_computed: self.keeper.as_ref().map(|_| sum(|tile| tile.counts.taken)),
            ..MethodReport::of_pixels(pixels, sum(|tile| tile.counts.found))
        }
    }

    fn kept_items(&self, tiles: &[TileState]) -> Option<Box<dyn KeptItems>> {
        let samples = || tiles.iter().map(|tile| tile.samples.clone()).collect();
        self.keeper.as_ref().map(|_| Box::new(KeptSamples(samples())) as _)
    }
}

/// The samples of all tiles at one time.
struct KeptSamples(Vec<SampleTile>);

impl KeptItems for KeptSamples {
    fn compare(&self, other: &dyn KeptItems) -> ItemChanges {
        let other: &dyn Any = other;
        let other = other.downcast_ref::<Self>().map_or(&[][..], |other| &other.0);
        let mut changes = ItemChanges::default();
        for (i, samples) in self.0.iter().enumerate() {
            let alone = ItemChanges { differing: 0, new: samples.len() };
            changes += other.get(i).map_or(alone, |other| samples.compare(other));
        }
        changes
    }
}
