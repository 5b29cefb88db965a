//! Paths from the lights of a scene and from its glowing matter, generic over what a method stores at a vertex. All
//! lights have the same number of paths, so that editing one light does not change the paths of others; an edit
//! retraces the paths that it touched.

mod chunk;
mod tracer;

pub(crate) use chunk::{Chunk, ChunkBytes};
pub(crate) use tracer::{Arrival, Vertex, most_kept};

use crate::integrator::Limits;
use crate::integrator::cells::ChangeMarks;
use crate::integrator::history::Reading;
use crate::light::{Enclosure, Light};
use crate::math::{Rgb, cast};
use crate::sampling::LightPathSampler;
use crate::sampling::address::Emitter;
use crate::scene::Scene;
use crate::simd::Level;
use chunk::Update;
use rayon::prelude::*;
use siphasher::sip::SipHasher13;
use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use tracer::{EmissionSource, Tracer};

/// The paths of one light.
#[derive(Clone, Debug)]
pub(crate) struct LightPaths<V> {
    /// `None` for glowing matter.
    pub light: Option<Light>,
    /// Distinguishes its random numbers from those of other lights.
    pub stream: u32,
    pub chunks: Vec<Chunk<V>>,
    /// Number of paths started, including those that missed.
    pub count: u32,
}

/// What tracing needs besides the scene.
#[derive(Debug)]
pub(crate) struct Ground {
    pub reading: Reading,
    pub enclosure: Enclosure,
    pub level: Level,
}

/// Which part of a path has a history of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HistoryDetail {
    /// Each vertex: an edit retraces a path from the first vertex that it touched.
    Vertices,
    /// The whole path: an edit retraces it from the beginning.
    Paths,
}

/// Which paths to create for each light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub count: u32,
    pub seed: u64,
    pub pass: u32,
    /// Groups of values in a history.
    pub groups: u8,
    pub histories: HistoryDetail,
}

impl Plan {
    /// Number of paths of each source, out of `paths` in total.
    pub fn share(paths: u32, sources: usize) -> u32 {
        (paths / cast::fit_u32(sources.max(1))).max(1)
    }
}

/// The random numbers of the paths of a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathNumbers {
    seed: u64,
    pass: u32,
    stream: u32,
}

impl PathNumbers {
    /// The random numbers of one path.
    #[inline(always)]
    fn of(&self, path: u32) -> LightPathSampler {
        LightPathSampler::new(self.seed, self.pass, self.stream, path)
    }
}

/// The source of light paths.
#[derive(Clone, Debug)]
pub(crate) struct PathSource {
    /// `None` for glowing matter.
    pub light: Option<Light>,
    /// Distinguishes its random numbers from those of other sources.
    pub stream: u32,
}

/// A scene's lights and its glowing matter, with the streams of their random numbers. A stream is derived from the
/// light's name if it has one, so that adding or removing other lights does not change it; otherwise from its index.
/// Sorted by stream, which is also the order in which light is summed.
pub(crate) fn sources(scene: &Scene) -> Vec<PathSource> {
    let lights = scene.lights.lights();
    let mut first_of: HashMap<&str, usize> = HashMap::new();
    for (i, name) in scene.light_names.iter().enumerate() {
        if let Some(name) = name {
            first_of.entry(name).or_insert(i);
        }
    }
    let stream = |i: usize| match &scene.light_names[i] {
        Some(name) if first_of[name.as_str()] == i => Emitter::Named { hash: hash_of(name) }.number(),
        _ => Emitter::Unnamed { index: cast::fit_u32(i) }.number(),
    };
    let of_light = |(i, light): (usize, &Light)| PathSource { light: Some(light.clone()), stream: stream(i) };
    let matter =
        scene.lights.emission().map(|_| PathSource { light: None, stream: Emitter::Matter.number() });
    let mut sources: Vec<_> = lights.iter().enumerate().map(of_light).chain(matter).collect();
    sources.sort_by_key(|source| source.stream);
    sources
}

/// Tells a light's name from others. The standard library's hasher may change with the compiler, and every picture with it.
fn hash_of(name: &str) -> u32 {
    cast::low_u32(SipHasher13::new().hash(name.as_bytes()))
}

impl<V: Vertex> LightPaths<V> {
    /// Paths yet to be traced. Within each block of paths that are stratified together, they are sorted so that paths
    /// with similar starts are adjacent.
    pub fn new(PathSource { light, stream }: PathSource, plan: &Plan) -> Self {
        let Plan { count, seed, pass, groups, histories } = *plan;
        const BLOCK: u32 = LightPathSampler::STRATIFIED;
        let numbers = PathNumbers { seed, pass, stream };
        let of_block = |block: u32| {
            let key = |path: u32| morton(numbers.of(path).emission());
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

    /// Changes the number of paths; whole blocks that exist both before and after are kept.
    pub fn set_count(&mut self, plan: &Plan) {
        let other = Self::new(PathSource { light: self.light.take(), stream: self.stream }, plan);
        let whole = (self.count.min(plan.count) / LightPathSampler::STRATIFIED) as usize;
        let chunks = whole * (LightPathSampler::STRATIFIED as usize).div_ceil(chunk::PATHS);
        let old = std::mem::replace(self, other);
        self.chunks.iter_mut().zip(old.chunks).take(chunks).for_each(|(new, old)| *new = old);
    }

    /// The factor for the flux of its photons.
    pub fn color(&self) -> Rgb {
        self.light.as_ref().map_or(Rgb::WHITE, Light::color)
    }

    fn source<'a>(light: Option<&'a Light>, scene: &'a Scene) -> Option<EmissionSource<'a>> {
        light.map(EmissionSource::Light).or_else(|| scene.lights.emission().map(EmissionSource::Matter))
    }
}

/// What is needed to trace the paths of all lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracing<'a> {
    pub scene: &'a Scene,
    pub ground: &'a Ground,
    /// The refinement pass to which the paths belong; 0 is the base map, which edits keep.
    pub pass: u32,
    /// Marks for the positions where vertices change.
    pub marks: &'a ChangeMarks,
    pub limits: &'a Limits<'a>,
}

/// Progress of tracing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TracingProgress {
    /// Number of paths traced.
    pub traced: usize,
    /// Whether all paths are valid now; false if it was stopped first.
    pub finished: bool,
}

impl Tracing<'_> {
    /// Traces the invalid paths.
    pub fn trace<V: Vertex>(&self, lights: &mut [LightPaths<V>]) -> TracingProgress {
        let Self { scene, ground: Ground { reading, enclosure, level }, pass, marks, limits } = *self;
        let seed = scene.render.seed;
        let mut work: Vec<(&mut Chunk<V>, EmissionSource, PathNumbers)> = Vec::new();
        for LightPaths { light, stream, chunks, .. } in lights {
            if let Some(source) = LightPaths::<V>::source(light.as_ref(), scene) {
                let numbers = PathNumbers { seed, pass, stream: *stream };
                let invalid = chunks.iter_mut().filter(|chunk| !chunk.is_valid());
                work.extend(invalid.map(|chunk| (chunk, source, numbers)));
            }
        }
        let (unfinished, traced) = (AtomicUsize::new(work.len()), AtomicUsize::new(0));
        work.into_par_iter().with_max_len(1).for_each(|(chunk, source, numbers)| {
            let stop = limits.stop();
            if !stop.reached() {
                let tracer = Tracer { scene, source, enclosure, reading };
                let update = Update { chunk: &mut *chunk, tracer, numbers, marks, stop: &stop };
                traced.fetch_add(level.run(update), Ordering::Relaxed);
                if chunk.is_valid() {
                    unfinished.fetch_sub(1, Ordering::Relaxed);
                }
            }
        });
        TracingProgress { traced: traced.into_inner(), finished: unfinished.into_inner() == 0 }
    }
}

/// The Morton code of four numbers in [0, 1): similar numbers have similar codes.
fn morton(u: [f32; 4]) -> u32 {
    let steps = u.map(|u| cast::low_u32(cast::index(u * 256.0) as u64));
    let bit = |i: u32| {
        let of = |k: usize| (steps[k] >> i & 1) << (3 - k);
        of(0) | of(1) | of(2) | of(3)
    };
    (0..8).rev().fold(0, |key, i| key << 4 | bit(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By `PYTHONHASHSEED=0 python3 -c "print(hex(hash(b'bulb') & 0xffffffff))"`, which is SipHash-1-3 with a key of zeros.
    #[test]
    fn the_random_numbers_of_a_named_light_never_change() {
        assert_eq!([hash_of("bulb"), hash_of("key light")], [0x7bcb8394, 0xef14a71]);
    }
}
