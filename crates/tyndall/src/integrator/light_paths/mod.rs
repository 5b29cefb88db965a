//! Paths from the lights of a scene and from its glowing matter, generic over what a method stores at a vertex. All
//! lights have the same number of paths, so that editing one light does not change the paths of others; an edit
//! retraces the paths that it touched.

mod chunk;
mod order;
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
use order::BlockOrder;
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
    /// Of the paths that have been ordered, block by block from the first.
    pub chunks: Vec<Chunk<V>>,
    plan: Plan,
    /// The order of the next block.
    ordering: BlockOrder,
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
    /// The refinement pass to which the paths belong; 0 is the base map, which edits keep.
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
    /// Paths yet to be ordered and traced.
    pub fn new(PathSource { light, stream }: PathSource, plan: &Plan) -> Self {
        Self { light, stream, chunks: Vec::new(), plan: *plan, ordering: BlockOrder::default() }
    }

    /// Number of paths started, including those that missed.
    pub fn count(&self) -> u32 {
        self.plan.count
    }

    /// Whether all paths are in chunks, and are up to date with the scene.
    pub fn is_valid(&self) -> bool {
        self.is_ordered() && self.chunks.iter().all(Chunk::is_valid)
    }

    fn is_ordered(&self) -> bool {
        self.chunks.len() == (self.plan.count as usize).div_ceil(chunk::PATHS)
    }

    /// Changes the number of paths. Of the paths so far, whole blocks that exist both before and after are kept; returns the
    /// others.
    pub fn set_count(&mut self, count: u32) -> Vec<Chunk<V>> {
        let blocks = (self.plan.count.min(count) / order::BLOCK) as usize;
        let kept = blocks * (order::BLOCK as usize).div_ceil(chunk::PATHS);
        self.plan.count = count;
        self.ordering = BlockOrder::default();
        self.chunks.split_off(kept.min(self.chunks.len()))
    }

    /// Distributes the paths over chunks, block by block, so that those with similar starts are traced together. False if stopped
    /// first.
    fn order(&mut self, limits: &Limits) -> bool {
        let numbers = self.numbers();
        let Plan { count, groups, histories, .. } = self.plan;
        while !self.is_ordered() {
            let first = cast::fit_u32(self.chunks.len() * chunk::PATHS);
            let block = first..first.saturating_add(order::BLOCK).min(count);
            let Some(paths) = self.ordering.go_on(block, &numbers, limits) else { return false };
            let chunks = paths.chunks(chunk::PATHS);
            self.chunks.extend(chunks.map(|paths| Chunk::new(paths.to_vec(), groups, histories)));
        }
        true
    }

    fn numbers(&self) -> PathNumbers {
        let Plan { seed, pass, .. } = self.plan;
        PathNumbers { seed, pass, stream: self.stream }
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
    /// Orders the paths that are not in chunks yet, then traces the invalid ones.
    pub fn trace<V: Vertex>(&self, lights: &mut [LightPaths<V>]) -> TracingProgress {
        let Self { scene, ground: Ground { reading, enclosure, level }, marks, limits } = *self;
        if !lights.iter_mut().all(|light| light.order(limits)) {
            return TracingProgress { traced: 0, finished: false };
        }
        let mut work: Vec<(&mut Chunk<V>, EmissionSource, PathNumbers)> = Vec::new();
        for paths in lights {
            let numbers = paths.numbers();
            let LightPaths { light, chunks, .. } = paths;
            if let Some(source) = LightPaths::<V>::source(light.as_ref(), scene) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// By `PYTHONHASHSEED=0 python3 -c "print(hex(hash(b'bulb') & 0xffffffff))"`, which is SipHash-1-3 with a key of zeros.
    #[test]
    fn the_random_numbers_of_a_named_light_never_change() {
        assert_eq!([hash_of("bulb"), hash_of("key light")], [0x7bcb8394, 0xef14a71]);
    }
}
