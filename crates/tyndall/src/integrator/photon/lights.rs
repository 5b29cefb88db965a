//! The light paths of a scene: of each light equally many, so that no edit of one light changes the paths of others.

use super::chunk::{self, Chunk, Update};
use super::paths::{Source, Tracer};
use super::spatial::Changed;
use crate::integrator::Stop;
use crate::integrator::history::Reading;
use crate::light::{Enclosure, Light};
use crate::math::{Rgb, cast};
use crate::sampling::LightPathSampler;
use crate::sampling::address::Emitter;
use crate::scene::{Histories, PhotonSettings, Scene};
use crate::simd::Level;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The paths of one light.
#[derive(Clone, Debug)]
pub(super) struct LightPaths {
    /// `None` for glowing matter.
    pub light: Option<Light>,
    /// Tells its random numbers from those of other lights.
    pub stream: u32,
    pub chunks: Vec<Chunk>,
    /// Paths, also those that missed.
    pub count: u32,
}

/// What tracing needs beside the scene.
#[derive(Debug)]
pub(super) struct Ground {
    pub reading: Reading,
    pub enclosure: Enclosure,
    pub level: Level,
}

/// What paths to make for each light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub count: u32,
    pub seed: u64,
    pub pass: u32,
    pub groups: u8,
    pub histories: Histories,
}

impl Plan {
    /// For so many sources: each has as many paths as the others.
    pub fn new(scene: &Scene, settings: &PhotonSettings, pass: u32, sources: usize) -> Self {
        Self {
            count: (settings.photons / cast::fit_u32(sources.max(1))).max(1),
            seed: scene.render.seed,
            pass,
            groups: settings.history_bits,
            histories: settings.histories,
        }
    }
}

/// A scene's lights and its glowing matter, with the streams of their random numbers: by name where a light has one, so that
/// it keeps them when others come and go; else by its number. In the order of the streams, in which photons are added up too.
pub(super) fn sources(scene: &Scene) -> Vec<(Option<Light>, u32)> {
    let lights = scene.lights.lights();
    let mut first_of: HashMap<&str, usize> = HashMap::new();
    for (i, name) in scene.light_names.iter().enumerate() {
        if let Some(name) = name {
            first_of.entry(name).or_insert(i);
        }
    }
    let stream = |i: usize| match &scene.light_names[i] {
        Some(name) if first_of[name.as_str()] == i => {
            let mut hasher = DefaultHasher::new();
            name.hash(&mut hasher);
            Emitter::Named { hash: cast::low_u32(hasher.finish()) }.number()
        }
        _ => Emitter::Unnamed { index: cast::fit_u32(i) }.number(),
    };
    let matter = scene.lights.emission().map(|_| (None, Emitter::Matter.number()));
    let mut sources: Vec<_> =
        (0..lights.len()).map(|i| (Some(lights[i].clone()), stream(i))).chain(matter).collect();
    sources.sort_by_key(|source| source.1);
    sources
}

impl LightPaths {
    /// Paths yet to be traced. In each block of paths that are stratified together, those that start alike come together.
    pub fn new((light, stream): (Option<Light>, u32), plan: &Plan) -> Self {
        let Plan { count, seed, pass, groups, histories } = *plan;
        const BLOCK: u32 = LightPathSampler::STRATIFIED;
        let of_block = |block: u32| {
            let key = |path: u32| morton(LightPathSampler::new(seed, pass, stream, path).emission());
            let last = (block + 1).saturating_mul(BLOCK).min(count);
            let mut keys: Vec<(u32, u32)> = (block * BLOCK..last).map(|path| (key(path), path)).collect();
            keys.sort_unstable();
            let chunks = keys.chunks(chunk::PATHS);
            let chunks =
                chunks.map(|keys| Chunk::new(keys.iter().map(|key| key.1).collect(), groups, histories));
            chunks.collect::<Vec<_>>()
        };
        let chunks = (0..count.div_ceil(BLOCK)).into_par_iter().flat_map_iter(of_block).collect();
        Self { light, stream, chunks, count }
    }

    /// Changes how many paths there are; whole blocks that are in both stay as they are.
    pub fn set_count(&mut self, plan: &Plan) {
        let other = Self::new((self.light.take(), self.stream), plan);
        let whole = (self.count.min(plan.count) / LightPathSampler::STRATIFIED) as usize;
        let chunks = whole * (LightPathSampler::STRATIFIED as usize).div_ceil(chunk::PATHS);
        let old = std::mem::replace(self, other);
        self.chunks.iter_mut().zip(old.chunks).take(chunks).for_each(|(new, old)| *new = old);
    }

    /// What the flux of its photons is to be multiplied by.
    pub fn color(&self) -> Rgb {
        self.light.as_ref().map_or(Rgb::WHITE, Light::color)
    }

    fn source<'a>(light: Option<&'a Light>, scene: &'a Scene) -> Option<Source<'a>> {
        light.map(Source::Light).or_else(|| scene.lights.emission().map(Source::Matter))
    }
}

/// Traces what is not valid; false where a stop came first. Counts the paths traced.
pub(super) fn trace<'s>(
    lights: &mut [LightPaths],
    scene: &Scene,
    ground: &Ground,
    pass: u32,
    places: &Changed,
    traced: &AtomicUsize,
    stop: &(impl Fn() -> Stop<'s> + Sync),
) -> bool {
    let seed = scene.render.seed;
    let mut work: Vec<(&mut Chunk, Source, u32)> = Vec::new();
    for LightPaths { light, stream, chunks, .. } in lights {
        if let Some(source) = LightPaths::source(light.as_ref(), scene) {
            let invalid = chunks.iter_mut().filter(|chunk| !chunk.is_valid());
            work.extend(invalid.map(|chunk| (chunk, source, *stream)));
        }
    }
    let unfinished = AtomicUsize::new(work.len());
    work.into_par_iter().with_max_len(1).for_each(|(chunk, source, stream)| {
        let stop = stop();
        if !stop.reached() {
            let Ground { reading, enclosure, .. } = ground;
            let tracer = Tracer { scene, source, enclosure, reading };
            let numbers = |path| LightPathSampler::new(seed, pass, stream, path);
            let update = Update { chunk: &mut *chunk, tracer, numbers: &numbers, places, stop: &stop };
            traced.fetch_add(ground.level.run(update), Ordering::Relaxed);
            if chunk.is_valid() {
                unfinished.fetch_sub(1, Ordering::Relaxed);
            }
        }
    });
    unfinished.into_inner() == 0
}

/// The place of four numbers in [0, 1) on a curve that fills their space: where numbers are alike, so are places.
fn morton(u: [f32; 4]) -> u32 {
    let steps = u.map(|u| cast::low_u32(cast::index(u * 256.0) as u64));
    let bit = |i: u32| {
        let of = |k: usize| (steps[k] >> i & 1) << (3 - k);
        of(0) | of(1) | of(2) | of(3)
    };
    (0..8).rev().fold(0, |key, i| key << 4 | bit(i))
}
