//! Free flight and transmittance through inhomogeneous matter.
//!
//! Both walk the cells of the [`MajorantGrid`](super::MajorantGrid), which holds the smallest and the
//! largest extinction of each. Where these are equal the cell is homogeneous, and transmittance looks nothing up. A step too
//! short for single precision still advances by one unit in the last place, so that no flight gets stuck.

use super::{CellStretch, Medium, Track};
use crate::math::Vec3;
use crate::sampling::Stream;
use crate::simd::MOST_LANES;
use crate::simd::{Kernel, Lanes, Level};
use fearless_simd::prelude::*;

/// Transmittance estimates below this weight undergo Russian roulette: they are not worth their look-ups.
const ROULETTE_WEIGHT: f32 = 0.1;

/// Optical thickness of the control above which an estimate undergoes Russian roulette too.
const ROULETTE_DEPTH: f32 = 2.5;

/// A real collision of a free flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// World distance inside the medium, along the track.
    pub t: f32,
    /// Where, in index space.
    pub position: Vec3,
    /// The data value there.
    pub value: f32,
}

/// Listener to everything that a flight or a transmittance estimate reads.
pub(crate) trait FlightNotes {
    /// Whether there is a listener; then empty cells are crossed one by one, so that each is reported.
    const LISTENS: bool = true;

    /// A cell's majorant is read.
    fn most(&mut self, cell: usize);

    /// A cell's smallest and largest opacity are read.
    fn limits(&mut self, cell: usize);

    /// The opacity of a data value is read.
    fn value(&mut self, value: f32);
}

/// No listener.
impl FlightNotes for () {
    const LISTENS: bool = false;

    #[inline(always)]
    fn most(&mut self, _: usize) {}

    #[inline(always)]
    fn limits(&mut self, _: usize) {}

    #[inline(always)]
    fn value(&mut self, _: f32) {}
}

impl Medium {
    /// Flies to the next real collision, or out of the medium (`None`): delta tracking
    /// \[Woodcock65\] with local majorants \[Yue10\].
    ///
    /// `first` is the optical depth to the first tentative collision, exponentially distributed; the
    /// random numbers for later ones come from `stream`.
    #[inline]
    #[must_use]
    pub fn free_flight(&self, track: &Track, first: f32, stream: &mut Stream) -> Option<Collision> {
        self.free_flight_noting(track, first, stream, &mut ())
    }

    /// [`Self::free_flight`] that reports everything it depends on: its random numbers depend on the majorants of the
    /// cells that it crosses, and on no others.
    #[inline(always)]
    pub(crate) fn free_flight_noting<N: FlightNotes>(
        &self,
        track: &Track,
        first: f32,
        stream: &mut Stream,
        notes: &mut N,
    ) -> Option<Collision> {
        if N::LISTENS {
            self.fly(track, self.majorants.walk_singly(track), first, stream, notes)
        } else {
            self.fly(track, self.majorants.walk(track), first, stream, notes)
        }
    }

    #[inline(always)]
    fn fly(
        &self,
        track: &Track,
        cells: impl Iterator<Item = CellStretch>,
        first: f32,
        stream: &mut Stream,
        notes: &mut impl FlightNotes,
    ) -> Option<Collision> {
        let mut depth = first;
        for cell in cells {
            notes.most(cell.cell);
            let majorant = cell.most * self.density;
            let mut t = cell.start;
            // False at once in an empty cell, where the step is infinite or 0/0.
            while t + depth / majorant < cell.end {
                t = (t + depth / majorant).max(t.next_up());
                let position = track.at(t);
                let level = stream.uniform() * cell.most;
                let value = self.volume.value(position);
                notes.value(value);
                if level < self.transfer.opacity(value) {
                    return Some(Collision { t, position, value });
                }
                depth = stream.exponential();
            }
            depth = (depth - (cell.end - t) * majorant).max(0.0);
        }
        None
    }

    /// An unbiased estimate of the transmittance along a track: residual ratio tracking \[Novak14\], in
    /// which each cell's smallest extinction is the control and is integrated exactly. The positions of the tentative
    /// collisions do not depend on the values found there, so many are looked up at once. Reports everything it reads.
    #[inline(always)]
    pub(crate) fn transmittance_lanes<S: Lanes, N: FlightNotes>(
        &self,
        simd: S,
        track: &Track,
        stream: &mut Stream,
        notes: &mut N,
    ) -> f32 {
        if N::LISTENS {
            self.track_ratio(simd, track, self.majorants.walk_singly(track), stream, notes)
        } else {
            self.track_ratio(simd, track, self.majorants.walk(track), stream, notes)
        }
    }

    #[inline(always)]
    fn track_ratio<S: Lanes>(
        &self,
        simd: S,
        track: &Track,
        cells: impl Iterator<Item = CellStretch>,
        stream: &mut Stream,
        notes: &mut impl FlightNotes,
    ) -> f32 {
        let mut transmittance = 1.0_f32;
        let mut control = 0.0_f32;
        let mut depth = stream.exponential();
        let mut collisions = Tentative::new();
        for cell in cells {
            notes.limits(cell.cell);
            // Repeated, so that it does not matter how many empty cells follow.
            while control > ROULETTE_DEPTH {
                if stream.uniform() >= (-ROULETTE_DEPTH).exp() {
                    return 0.0;
                }
                control -= ROULETTE_DEPTH;
            }
            control += cell.least * self.density * (cell.end - cell.start);
            let spread = cell.most - cell.least;
            let majorant = spread * self.density;
            let mut t = cell.start;
            // False at once in a homogeneous cell, where the step is infinite or 0/0.
            while t + depth / majorant < cell.end {
                t = (t + depth / majorant).max(t.next_up());
                if collisions.push::<S>(t, cell.least, spread) {
                    transmittance *= collisions.take(simd, self, track, notes);
                    if transmittance < ROULETTE_WEIGHT {
                        if stream.uniform() * ROULETTE_WEIGHT >= transmittance {
                            return 0.0;
                        }
                        transmittance = ROULETTE_WEIGHT;
                    }
                }
                depth = stream.exponential();
            }
            depth = (depth - (cell.end - t) * majorant).max(0.0);
        }
        transmittance * collisions.take(simd, self, track, notes) * (-control).exp()
    }

    /// An unbiased estimate of the transmittance along a track, by residual ratio tracking \[Novak14\].
    #[must_use]
    pub fn transmittance(&self, level: Level, track: &Track, stream: &mut Stream) -> f32 {
        struct Estimate<'a>(&'a Medium, &'a Track, &'a mut Stream);
        impl Kernel for Estimate<'_> {
            type Output = f32;

            #[inline(always)]
            fn run<S: Lanes>(self, simd: S) -> f32 {
                self.0.transmittance_lanes(simd, self.1, self.2, &mut ())
            }
        }
        level.run(Estimate(self, track, stream))
    }
}

/// Tentative collisions, gathered until there are enough for the lanes.
struct Tentative {
    t: [f32; MOST_LANES],
    least: [f32; MOST_LANES],
    spread: [f32; MOST_LANES],
    count: usize,
    enough: usize,
}

/// Size of the first batch: small, since light is often lost at once. Each later batch is twice as large.
const FIRST_TENTATIVE: usize = 2;

impl Tentative {
    #[inline(always)]
    fn new() -> Self {
        Self {
            t: [0.0; MOST_LANES],
            least: [0.0; MOST_LANES],
            spread: [1.0; MOST_LANES],
            count: 0,
            enough: FIRST_TENTATIVE,
        }
    }

    /// Adds one; whether there are now enough.
    #[inline(always)]
    fn push<S: Lanes>(&mut self, t: f32, least: f32, spread: f32) -> bool {
        self.t[self.count] = t;
        self.least[self.count] = least;
        self.spread[self.count] = spread;
        self.count += 1;
        self.count == S::WIDTH.min(self.enough)
    }

    /// Takes the pending collisions: the product of their probabilities of not being real.
    #[inline(always)]
    fn take<S: Lanes, N: FlightNotes>(
        &mut self,
        simd: S,
        medium: &Medium,
        track: &Track,
        notes: &mut N,
    ) -> f32 {
        if self.count == 0 {
            return 1.0;
        }
        let position = track.lanes(simd, S::f32s::from_slice(simd, &self.t[..S::WIDTH]));
        let value = medium.volume.value_lanes(simd, position);
        if N::LISTENS {
            for &value in &value.as_slice()[..self.count] {
                notes.value(value);
            }
        }
        let least = S::f32s::from_slice(simd, &self.least[..S::WIDTH]);
        let spread = S::f32s::from_slice(simd, &self.spread[..S::WIDTH]);
        let residual = medium.transfer.opacity_lanes(simd, value) - least;
        let chance = (residual / spread).max(0.0).min(1.0);
        let mut product = 1.0;
        for chance in &chance.as_slice()[..self.count] {
            product *= 1.0 - chance;
        }
        self.count = 0;
        self.enough = (2 * self.enough).min(MOST_LANES);
        product
    }
}
