//! Some hundred paths of one light that start near each other: traced together, so that they read the same matter, and
//! traced again where an edit touched them.

use super::paths::{Begun, Interactions, Photon, Tracer, bounce_of};
use super::spatial::Changed;
use crate::integrator::history::{Histories, Past};
use crate::math::cast;
use crate::sampling::LightPathSampler;
use crate::scene;
use crate::simd::{Kernel, Lanes};
use std::ops::Range;

/// Paths in a chunk at most.
pub(super) const PATHS: usize = 1024;

/// Paths of one light, with their interactions and what both depend on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chunk {
    /// Numbers of the paths among those of their light.
    paths: Vec<u32>,
    /// Where each path's interactions end.
    ends: Vec<u32>,
    /// What each path as a whole depends on.
    flight: Histories,
    scatter: Histories,
    interactions: Interactions,
    /// What has changed since the paths were traced.
    changed: Past,
    traced: bool,
}

impl Chunk {
    /// Paths yet to be traced.
    pub fn new(paths: Vec<u32>, groups: u8, histories: scene::Histories) -> Self {
        Self {
            ends: Vec::new(),
            flight: Histories::with_len(groups, paths.len()),
            scatter: Histories::with_len(groups, paths.len()),
            interactions: Interactions::new(groups, histories == scene::Histories::Interactions),
            changed: Past::NOTHING,
            traced: false,
            paths,
        }
    }

    /// The interactions, path by path.
    pub fn photons(&self) -> &[Photon] {
        &self.interactions.photons
    }

    /// Paths in it.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Whether all paths are as the scene would have them.
    pub fn is_valid(&self) -> bool {
        self.traced && self.changed.is_empty()
    }

    /// What an edit changed.
    pub fn add_change(&mut self, changed: &Past) {
        self.changed.add(changed);
    }

    /// Bytes kept for the paths themselves, and for their interactions.
    pub fn bytes(&self) -> [usize; 2] {
        let histories = self.flight.bytes() + self.scatter.bytes();
        let paths = size_of_val(&self.paths[..]) + size_of_val(&self.ends[..]) + histories;
        [paths, self.interactions.bytes()]
    }

    fn range(&self, path: usize) -> Range<usize> {
        let start = if path > 0 { self.ends[path - 1] } else { 0 };
        start as usize..self.ends[path] as usize
    }

    fn past(&self, path: usize) -> Past {
        Past { flight: self.flight.get(path), scatter: self.scatter.get(path) }
    }

    /// Paths that are other ones in another chunk of the same paths, or were not traced there.
    pub fn differing(&self, other: &Self) -> usize {
        let photons =
            |chunk: &Self, path| bytemuck::cast_slice::<_, u8>(&chunk.photons()[chunk.range(path)]).to_vec();
        if !self.traced {
            return 0;
        }
        if !other.traced || self.paths != other.paths {
            return self.len();
        }
        (0..self.len()).filter(|&path| photons(self, path) != photons(other, path)).count()
    }

    /// The interactions of a path that the changes leave valid: since histories only grow along a path, all up to one
    /// \[Jonsson12, sec. 4.3.1\].
    fn valid(&self, path: usize) -> Range<usize> {
        let whole = self.range(path);
        let is_valid = |past: Past| !past.meets(&self.changed);
        let valid = whole.clone().rev().find(|&i| self.interactions.past(i).is_some_and(is_valid));
        whole.start..valid.map_or(whole.start, |i| i + 1)
    }
}

/// Traces the paths of a chunk that are not valid, each on from its last valid interaction; gives how many.
pub(super) struct Update<'a> {
    pub chunk: &'a mut Chunk,
    pub tracer: Tracer<'a>,
    /// The numbers of a path.
    pub numbers: &'a dyn Fn(u32) -> LightPathSampler,
    /// Where interactions changed.
    pub places: &'a Changed,
}

impl Kernel for Update<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> usize {
        let Self { chunk, tracer, numbers, places } = self;
        let touched = |chunk: &Chunk, path: usize| !chunk.traced || chunk.past(path).meets(&chunk.changed);
        let mut retraced = 0;
        if (0..chunk.len()).any(|path| touched(chunk, path)) {
            let mut found = Interactions::like(&chunk.interactions, tracer.reading.groups.count());
            let mut ends = Vec::with_capacity(chunk.len());
            for path in 0..chunk.len() {
                if touched(chunk, path) {
                    let (kept, old) =
                        if chunk.traced { (chunk.valid(path), chunk.range(path)) } else { (0..0, 0..0) };
                    found.extend(&chunk.interactions, kept.clone());
                    let first = found.photons.len();
                    let numbers = numbers(chunk.paths[path]);
                    let from = kept.clone().last().and_then(|i| {
                        let (photon, past) = (chunk.photons()[i], chunk.interactions.past(i)?);
                        Some(Begun { photon, bounce: bounce_of(&numbers, i - kept.start), past })
                    });
                    let past = tracer.trace(&numbers, from, &mut found);
                    chunk.flight.set(path, past.flight);
                    chunk.scatter.set(path, past.scatter);
                    // A gather weighs photons by the opacity where they are.
                    let matter_changed =
                        |photon: &Photon| tracer.read_at(photon.index_place()).meets(chunk.changed.flight);
                    let (old, new) = (&chunk.photons()[kept.end..old.end], &found.photons[first..]);
                    places.mark_difference(old, new, matter_changed);
                    retraced += 1;
                } else {
                    found.extend(&chunk.interactions, chunk.range(path));
                }
                ends.push(cast::fit_u32(found.photons.len()));
            }
            found.photons.shrink_to_fit();
            chunk.interactions = found;
            chunk.ends = ends;
        }
        chunk.traced = true;
        chunk.changed = Past::NOTHING;
        retraced
    }
}
