//! A chunk: up to 1024 paths of one light that start close together. They are traced together, so that they read the
//! same matter; an edit retraces those that it touched.

use super::tracer::{LightPath, Resumed, Tracer, Vertex, Vertices, bounce_of};
use super::{HistoryDetail, PathNumbers};
use crate::integrator::Stop;
use crate::integrator::cells::ChangeMarks;
use crate::integrator::history::{PackedHistories, Past};
use crate::math::cast;
use crate::simd::{Kernel, Lanes};
use std::ops::Range;

/// Maximum number of paths in a chunk.
pub(super) const PATHS: usize = 1024;

/// Paths of one light, with their interactions and what both depend on.
#[derive(Clone, Debug)]
pub(crate) struct Chunk<V> {
    /// Numbers of the paths among those of the light.
    paths: Vec<u32>,
    /// The results: of all paths, or of none yet.
    traced: Traced<V>,
    /// What has changed since they were traced.
    changed: Past,
    /// Whether the flux of all vertices has changed, and their positions are yet to be marked.
    to_be_marked: bool,
    /// The partial replacement of `traced`, if a stop interrupted retracing.
    underway: Option<Box<Underway<V>>>,
}

/// Bytes of a chunk, histories included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChunkBytes {
    /// Bytes of data per path.
    pub paths: usize,
    pub vertices: usize,
}

/// Traced paths, in order from the first.
#[derive(Clone, Debug)]
struct Traced<V> {
    /// The end of each path's range of interactions.
    ends: Vec<u32>,
    /// What each path as a whole depends on.
    flight: PackedHistories,
    scatter: PackedHistories,
    vertices: Vertices<V>,
}

/// Paths that have been retraced, and the next one if it is unfinished.
#[derive(Clone, Debug)]
struct Underway<V> {
    traced: Traced<V>,
    path: Option<LightPath>,
}

impl<V: Vertex> Traced<V> {
    fn new(groups: u8, each_has_a_past: bool) -> Self {
        let (flight, scatter) = (PackedHistories::new(groups), PackedHistories::new(groups));
        Self { ends: Vec::new(), flight, scatter, vertices: Vertices::new(groups, each_has_a_past) }
    }

    fn range(&self, path: usize) -> Range<usize> {
        let start = if path > 0 { self.ends[path - 1] } else { 0 };
        start as usize..self.ends[path] as usize
    }

    fn past(&self, path: usize) -> Past {
        Past { flight: self.flight.get(path), scatter: self.scatter.get(path) }
    }

    /// The interactions of a path that a change leaves valid: since histories only grow along a path, these are the
    /// first ones \[Jonsson12, sec. 4.3.1\].
    fn valid(&self, path: usize, changed: &Past) -> Range<usize> {
        let whole = self.range(path);
        let is_valid = |past: Past| !past.meets(changed);
        let valid = whole.clone().rev().find(|&i| self.vertices.past(i).is_some_and(is_valid));
        whole.start..valid.map_or(whole.start, |i| i + 1)
    }

    /// Ends a path whose interactions have been added.
    fn end(&mut self, past: &Past) {
        self.flight.push(past.flight);
        self.scatter.push(past.scatter);
        self.ends.push(cast::fit_u32(self.vertices.stored.len()));
    }

    /// Releases unused memory.
    fn shrink_to_fit(&mut self) {
        self.ends.shrink_to_fit();
        self.flight.shrink_to_fit();
        self.scatter.shrink_to_fit();
        self.vertices.shrink_to_fit();
    }
}

impl<V: Vertex> Chunk<V> {
    /// A chunk of paths yet to be traced.
    pub fn new(paths: Vec<u32>, groups: u8, histories: HistoryDetail) -> Self {
        let traced = Traced::new(groups, histories == HistoryDetail::Vertices);
        Self { paths, traced, changed: Past::NOTHING, to_be_marked: false, underway: None }
    }

    /// The vertices, path by path.
    pub fn vertices(&self) -> &[V] {
        &self.traced.vertices.stored
    }

    /// Number of paths.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    fn is_traced(&self) -> bool {
        self.traced.ends.len() == self.len()
    }

    /// Whether all paths are up to date with the scene.
    pub fn is_valid(&self) -> bool {
        self.is_traced() && self.changed.is_empty()
    }

    /// Records what an edit changed.
    pub fn add_change(&mut self, changed: &Past) {
        if !changed.is_empty() {
            self.changed.add(changed);
            self.underway = None;
        }
    }

    /// Records that an edit changed the flux of all vertices.
    pub fn must_mark(&mut self) {
        self.to_be_marked = true;
    }

    /// Whether vertices are yet to be marked because of their flux.
    pub fn is_to_be_marked(&self) -> bool {
        self.to_be_marked
    }

    /// Marks the positions of all vertices, because of their flux.
    pub fn mark_all(&mut self, marks: &ChangeMarks) {
        marks.mark_all(self.vertices());
        self.to_be_marked = false;
    }

    /// Bytes of the paths themselves, and of their interactions.
    pub fn bytes(&self) -> ChunkBytes {
        let Traced { ends, flight, scatter, vertices } = &self.traced;
        let histories = flight.bytes() + scatter.bytes();
        let paths = size_of_val(&self.paths[..]) + size_of_val(&ends[..]) + histories;
        ChunkBytes { paths, vertices: vertices.bytes() }
    }

    /// Number of paths that differ from those of another chunk, or were not traced there.
    pub fn differing(&self, other: &Self) -> usize {
        let vertices = |chunk: &Self, path| {
            bytemuck::cast_slice::<_, u8>(&chunk.vertices()[chunk.traced.range(path)]).to_vec()
        };
        if !self.is_traced() {
            return 0;
        }
        if !other.is_traced() || self.paths != other.paths {
            return self.len();
        }
        (0..self.len()).filter(|&path| vertices(self, path) != vertices(other, path)).count()
    }
}

/// Retraces the invalid paths of a chunk, each from its last valid vertex on, until a stop; returns how many were
/// traced.
pub(super) struct Update<'a, V> {
    pub chunk: &'a mut Chunk<V>,
    pub tracer: Tracer<'a>,
    /// The paths' random numbers.
    pub numbers: PathNumbers,
    /// Marks for the positions where vertices change.
    pub marks: &'a ChangeMarks,
    pub stop: &'a Stop<'a>,
}

impl<V: Vertex> Kernel for Update<'_, V> {
    type Output = usize;

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> usize {
        let Self { chunk, tracer, numbers, marks, stop } = self;
        let (old, changed, was_traced) = (&chunk.traced, &chunk.changed, chunk.is_traced());
        let touched = |path: usize| !was_traced || old.past(path).meets(changed);
        let mut retraced = 0;
        if (0..chunk.len()).any(touched) {
            let groups = tracer.reading.groups.count();
            let begin = || Underway { traced: Traced::new(groups, old.vertices.have_pasts()), path: None };
            let mut next = chunk.underway.take().map_or_else(begin, |underway| *underway);
            for path in next.traced.ends.len()..chunk.len() {
                let (new, numbers) = (&mut next.traced, numbers.of(chunk.paths[path]));
                if !touched(path) {
                    new.vertices.extend(&old.vertices, old.range(path));
                    new.end(&old.past(path));
                    continue;
                }
                let (kept, of_old) =
                    if was_traced { (old.valid(path, changed), old.range(path)) } else { (0..0, 0..0) };
                let mut light_path = next.path.take().unwrap_or_else(|| {
                    new.vertices.extend(&old.vertices, kept.clone());
                    let from = kept.clone().last().and_then(|i| {
                        let (vertex, past) = (old.vertices.stored[i], old.vertices.past(i)?);
                        Some(Resumed { vertex, bounce: bounce_of(&numbers, i - kept.start), past })
                    });
                    tracer.begin(&numbers, from)
                });
                if !tracer.go_on(&mut light_path, &numbers, &mut new.vertices, stop) {
                    next.path = Some(light_path);
                    chunk.underway = Some(Box::new(next));
                    return retraced;
                }
                // A gather weights photons by the opacity at their positions.
                let matter_changed = |vertex: &V| tracer.read_at(vertex.position()).meets(changed.flight);
                let first = new.ends.last().map_or(0, |&end| end as usize) + kept.len();
                let of_old = &old.vertices.stored[kept.end..of_old.end];
                marks.mark_difference(of_old, &new.vertices.stored[first..], matter_changed);
                new.end(&light_path.past);
                retraced += 1;
            }
            next.traced.shrink_to_fit();
            chunk.traced = next.traced;
        }
        chunk.changed = Past::NOTHING;
        retraced
    }
}
