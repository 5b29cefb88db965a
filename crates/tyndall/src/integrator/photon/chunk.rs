//! Some hundred paths of one light that start near each other: traced together, so that they read the same matter, and
//! traced again where an edit touched them.

use super::paths::{Begun, Interactions, Photon, Tracer, Walk, bounce_of};
use super::settings;
use super::spatial::Changed;
use crate::integrator::Stop;
use crate::integrator::history::{Histories, Past};
use crate::math::cast;
use crate::sampling::LightPathSampler;
use crate::simd::{Kernel, Lanes};
use std::ops::Range;

/// Paths in a chunk at most.
pub(super) const PATHS: usize = 1024;

/// Paths of one light, with their interactions and what both depend on.
#[derive(Clone, Debug)]
pub(super) struct Chunk {
    /// Numbers of the paths among those of their light.
    paths: Vec<u32>,
    /// All of them, or none yet.
    traced: Traced,
    /// What has changed since they were traced.
    changed: Past,
    /// What is to take their place, when a stop came before all were traced again.
    underway: Option<Box<Underway>>,
}

/// Paths that have been traced, from the first on.
#[derive(Clone, Debug)]
struct Traced {
    /// Where each path's interactions end.
    ends: Vec<u32>,
    /// What each path as a whole depends on.
    flight: Histories,
    scatter: Histories,
    interactions: Interactions,
}

/// Paths that have been traced again, and the next one on its way.
#[derive(Clone, Debug)]
struct Underway {
    traced: Traced,
    walk: Option<Walk>,
}

impl Traced {
    fn new(groups: u8, each_has_a_past: bool) -> Self {
        let (flight, scatter) = (Histories::new(groups), Histories::new(groups));
        Self { ends: Vec::new(), flight, scatter, interactions: Interactions::new(groups, each_has_a_past) }
    }

    fn range(&self, path: usize) -> Range<usize> {
        let start = if path > 0 { self.ends[path - 1] } else { 0 };
        start as usize..self.ends[path] as usize
    }

    fn past(&self, path: usize) -> Past {
        Past { flight: self.flight.get(path), scatter: self.scatter.get(path) }
    }

    /// The interactions of a path that changes leave valid: since histories only grow along a path, all up to one
    /// \[Jonsson12, sec. 4.3.1\].
    fn valid(&self, path: usize, changed: &Past) -> Range<usize> {
        let whole = self.range(path);
        let is_valid = |past: Past| !past.meets(changed);
        let valid = whole.clone().rev().find(|&i| self.interactions.past(i).is_some_and(is_valid));
        whole.start..valid.map_or(whole.start, |i| i + 1)
    }

    /// Ends a path whose interactions are there.
    fn end(&mut self, past: &Past) {
        self.flight.push(past.flight);
        self.scatter.push(past.scatter);
        self.ends.push(cast::fit_u32(self.interactions.photons.len()));
    }

    /// Lets go of room that is not needed.
    fn shrink_to_fit(&mut self) {
        self.ends.shrink_to_fit();
        self.flight.shrink_to_fit();
        self.scatter.shrink_to_fit();
        self.interactions.shrink_to_fit();
    }
}

impl Chunk {
    /// Paths yet to be traced.
    pub fn new(paths: Vec<u32>, groups: u8, histories: settings::Histories) -> Self {
        let traced = Traced::new(groups, histories == settings::Histories::Interactions);
        Self { paths, traced, changed: Past::NOTHING, underway: None }
    }

    /// The interactions, path by path.
    pub fn photons(&self) -> &[Photon] {
        &self.traced.interactions.photons
    }

    /// Paths in it.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    fn is_traced(&self) -> bool {
        self.traced.ends.len() == self.len()
    }

    /// Whether all paths are as the scene would have them.
    pub fn is_valid(&self) -> bool {
        self.is_traced() && self.changed.is_empty()
    }

    /// What an edit changed.
    pub fn add_change(&mut self, changed: &Past) {
        if !changed.is_empty() {
            self.changed.add(changed);
            self.underway = None;
        }
    }

    /// Bytes kept for the paths themselves, and for their interactions.
    pub fn bytes(&self) -> [usize; 2] {
        let Traced { ends, flight, scatter, interactions } = &self.traced;
        let histories = flight.bytes() + scatter.bytes();
        [size_of_val(&self.paths[..]) + size_of_val(&ends[..]) + histories, interactions.bytes()]
    }

    /// Paths that are other ones in another chunk of the same paths, or were not traced there.
    pub fn differing(&self, other: &Self) -> usize {
        let photons = |chunk: &Self, path| {
            bytemuck::cast_slice::<_, u8>(&chunk.photons()[chunk.traced.range(path)]).to_vec()
        };
        if !self.is_traced() {
            return 0;
        }
        if !other.is_traced() || self.paths != other.paths {
            return self.len();
        }
        (0..self.len()).filter(|&path| photons(self, path) != photons(other, path)).count()
    }
}

/// Traces the paths of a chunk that are not valid, each on from its last valid interaction, unless a stop comes first; gives
/// how many.
pub(super) struct Update<'a> {
    pub chunk: &'a mut Chunk,
    pub tracer: Tracer<'a>,
    /// The numbers of a path.
    pub numbers: &'a dyn Fn(u32) -> LightPathSampler,
    /// Where interactions changed.
    pub places: &'a Changed,
    pub stop: &'a Stop<'a>,
}

impl Kernel for Update<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> usize {
        let Self { chunk, tracer, numbers, places, stop } = self;
        let (old, changed, was_traced) = (&chunk.traced, &chunk.changed, chunk.is_traced());
        let touched = |path: usize| !was_traced || old.past(path).meets(changed);
        let mut retraced = 0;
        if (0..chunk.len()).any(touched) {
            let groups = tracer.reading.groups.count();
            let begin =
                || Underway { traced: Traced::new(groups, old.interactions.have_pasts()), walk: None };
            let mut next = chunk.underway.take().map_or_else(begin, |underway| *underway);
            for path in next.traced.ends.len()..chunk.len() {
                let (new, numbers) = (&mut next.traced, numbers(chunk.paths[path]));
                if !touched(path) {
                    new.interactions.extend(&old.interactions, old.range(path));
                    new.end(&old.past(path));
                    continue;
                }
                let (kept, of_old) =
                    if was_traced { (old.valid(path, changed), old.range(path)) } else { (0..0, 0..0) };
                let mut walk = next.walk.take().unwrap_or_else(|| {
                    new.interactions.extend(&old.interactions, kept.clone());
                    let from = kept.clone().last().and_then(|i| {
                        let (photon, past) = (old.interactions.photons[i], old.interactions.past(i)?);
                        Some(Begun { photon, bounce: bounce_of(&numbers, i - kept.start), past })
                    });
                    tracer.begin(&numbers, from)
                });
                if !tracer.go_on(&mut walk, &numbers, &mut new.interactions, stop) {
                    next.walk = Some(walk);
                    chunk.underway = Some(Box::new(next));
                    return retraced;
                }
                // A gather weighs photons by the opacity where they are.
                let matter_changed =
                    |photon: &Photon| tracer.read_at(photon.index_place()).meets(changed.flight);
                let first = new.ends.last().map_or(0, |&end| end as usize) + kept.len();
                let of_old = &old.interactions.photons[kept.end..of_old.end];
                places.mark_difference(of_old, &new.interactions.photons[first..], matter_changed);
                new.end(&walk.past);
                retraced += 1;
            }
            next.traced.shrink_to_fit();
            chunk.traced = next.traced;
        }
        chunk.changed = Past::NOTHING;
        retraced
    }
}
