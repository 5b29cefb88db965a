//! Marching on one grid of steps per track, each with all that lies between the data values at its two ends.
//!
//! Step `k` covers `[k step, (k + 1) step]`, the last one what is left. Its extinction is the mean over all values
//! between those at its ends, as if values changed linearly along it \[Engel01\]; with interpolation `nearest` it is that
//! of the first value up to where the value changes, and of the second from there (in flights, the plain mean of the two). The grid does not depend on the
//! transfer function. Steps between two empty cells are skipped, which changes no bit: such cells touch, so that all
//! values between belong to empty cells.

use super::march_notes::MarchNotes;
use super::packet_sample::PacketSample;
use super::skip::{LaneCells, Skip};
use super::step_ends::StepEnds;
use super::{Medium, Track};
use crate::math::cast;
use crate::simd::{Lanes, MOST_LANES};
use crate::transfer::OpacityLanes;
use fearless_simd::prelude::*;

/// The steps of one track.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Steps {
    /// Steps of full width.
    pub whole: i32,
    /// All steps, including the last, narrower one.
    pub count: i32,
    /// Width of the last one, world units.
    pub rest: f32,
}

impl Steps {
    pub(super) fn new(track: &Track, step: f32) -> Self {
        let whole = cast::truncate(track.length / step).min(i32::MAX - 1);
        let rest = (track.length - whole as f32 * step).max(0.0);
        // A remainder of rounding error would be a step of no width.
        Self { whole, count: whole + i32::from(rest > 1e-4 * step), rest }
    }

    /// Where a step begins and how wide it is.
    pub(super) fn at(&self, k: i32, step: f32) -> [f32; 2] {
        [k as f32 * step, if k < self.whole { step } else { self.rest }]
    }
}

/// A march along a packet of tracks, at most one per lane. Each lane takes the steps of its own track that may hold
/// matter, nearest first.
pub(crate) struct PacketMarch<'a, S: Lanes> {
    simd: S,
    medium: &'a Medium,
    width: f32,
    origin: [S::f32s; 3],
    direction: [S::f32s; 3],
    whole: S::i32s,
    count: S::i32s,
    rest: S::f32s,
    /// See [`PacketSample::within`].
    within: S::f32s,
    skip: Skip<'a, S>,
    /// Whether steps are short enough that those between empty cells can be skipped.
    skips: bool,
    k: S::i32s,
    /// Value and opacity where step `k` begins, in the lanes `known`.
    value: S::f32s,
    opacity: OpacityLanes<S>,
    known: S::mask32s,
    /// The cells where step `k` begins; `None` at the first step.
    cells: Option<LaneCells<S>>,
    /// Steps for which every lane stays in cells that hold matter.
    occupied: i32,
    /// Lanes that go on.
    pub active: S::mask32s,
}

impl<'a, S: Lanes> PacketMarch<'a, S> {
    /// With steps of `step` world units.
    #[inline(always)]
    pub fn new(simd: S, medium: &'a Medium, tracks: &[Track; MOST_LANES], step: f32) -> Self {
        let mut numbers = [[0.0; MOST_LANES]; 8];
        let mut whole = [0; MOST_LANES];
        let mut count = [0; MOST_LANES];
        let mut farthest = 0.0_f32;
        for (lane, track) in tracks.iter().enumerate() {
            let steps = Steps::new(track, step);
            let (o, d) = (track.ray.origin, track.ray.direction);
            for (lanes, x) in
                numbers.iter_mut().zip([o.x, o.y, o.z, d.x, d.y, d.z, steps.rest, 0.5 + track.shift])
            {
                lanes[lane] = x;
            }
            whole[lane] = steps.whole;
            count[lane] = steps.count;
            farthest = farthest.max(d.abs().max_element() * step);
        }
        let [ox, oy, oz, dx, dy, dz, rest, within] = &numbers;
        let origin = [load(simd, ox), load(simd, oy), load(simd, oz)];
        let direction = [load(simd, dx), load(simd, dy), load(simd, dz)];
        let count = S::i32s::from_slice(simd, &count[..S::WIDTH]);
        let k = S::i32s::splat(simd, 0);
        Self {
            simd,
            medium,
            width: step,
            origin,
            direction,
            whole: S::i32s::from_slice(simd, &whole[..S::WIDTH]),
            count,
            rest: load(simd, rest),
            within: load(simd, within),
            skip: Skip::new(simd, medium, origin, direction, step),
            skips: farthest < medium.majorants.edge(),
            k,
            value: S::f32s::splat(simd, 0.0),
            opacity: OpacityLanes::none(simd),
            known: k.simd_lt(k),
            cells: None,
            occupied: 0,
            active: k.simd_lt(count),
        }
    }

    /// The step that each lane takes next.
    #[inline(always)]
    pub fn step(&self) -> S::i32s {
        self.k
    }

    /// Continues at the given steps.
    #[inline(always)]
    pub fn go_to(&mut self, k: S::i32s) {
        self.k = k;
        self.occupied = 0;
        self.cells = None;
        self.known = k.simd_lt(k);
        self.active = k.simd_lt(self.count);
    }

    /// Continues at the given steps, up to `end` (exclusive) or the end of a lane's track if that comes first.
    #[inline(always)]
    pub fn go_between(&mut self, k: S::i32s, end: S::i32s) {
        self.count = self.count.min(end);
        self.go_to(k);
    }

    /// The next steps, at least one of which met matter; everything read is reported to `notes`. No lane's bits
    /// depend on what is in the others.
    #[inline(always)]
    pub fn next<N: MarchNotes<S>>(&mut self, notes: &mut N) -> Option<PacketSample<S>> {
        let simd = self.simd;
        let zero = S::f32s::splat(simd, 0.0);
        while self.active.any_true() {
            let k = self.k;
            let start = k.to_float::<S::f32s>() * self.width;
            let is_whole = k.simd_lt(self.whole);
            let width = is_whole.select(S::f32s::splat(simd, self.width), self.rest);
            // As where the next step starts, to the last bit: a march that resumes there reads the same.
            let end = is_whole.select((k + 1).to_float::<S::f32s>() * self.width, start + self.rest);
            let to = at::<S>(self.origin, self.direction, end);
            let mut here = self.active;
            self.k = k + 1;
            if self.occupied == 0 && self.skips {
                let before = match self.cells.take() {
                    Some(cells) => cells,
                    None => self.skip.cells::<N>(at::<S>(self.origin, self.direction, start)),
                };
                let cells = self.skip.cells::<N>(to);
                let leap = self.skip.leap(self.k, &cells);
                let empty = before.empty & cells.empty;
                let skipped = here & empty;
                notes.cells(simd, skipped, before.number);
                notes.cells(simd, skipped, cells.number);
                here &= !empty;
                self.k = empty.select(leap, self.k);
                let held = (before.empty | cells.empty) & self.active;
                self.cells = Some(cells);
                if held.any_true() {
                    if !here.any_true() {
                        self.known = here;
                        self.active &= self.k.simd_lt(self.count);
                        continue;
                    }
                } else {
                    // Lanes that have ended do not limit the count.
                    let far = S::i32s::splat(simd, i32::MAX);
                    self.occupied = least(self.active.select(leap - (k + 1), far).as_slice());
                }
            } else {
                self.occupied -= i32::from(self.skips);
            }
            self.active &= self.k.simd_lt(self.count);
            let medium = self.medium;
            let fresh = here & !self.known;
            if fresh.any_true() {
                let value = medium.volume.value_lanes(simd, at::<S>(self.origin, self.direction, start));
                self.value = fresh.select(value, self.value);
                self.opacity = medium.transfer.read_lanes(simd, value).or(fresh, self.opacity);
            }
            let value = medium.volume.value_lanes(simd, to);
            let opacity = medium.transfer.read_lanes(simd, value);
            let (values, opacities) = ([self.value, value], [self.opacity, opacity]);
            let from = at::<S>(self.origin, self.direction, start);
            let mut ends = StepEnds::new(simd, medium.interpolates, values, opacities);
            let inside = here & if medium.interpolates { ends.vary() } else { ends.differ() };
            ends.refine(simd, medium, [from, to], inside);
            notes.between(simd, here, ends.range());
            (self.value, self.opacity, self.known) = (value, opacity, here);
            let thickness = here.select(ends.mean * width * medium.density, zero);
            if thickness.simd_gt(zero).any_true() {
                let t = start + width * 0.5;
                return Some(PacketSample { t, width, thickness, from, to, ends, within: self.within });
            }
        }
        None
    }
}

#[inline(always)]
fn least(numbers: &[i32]) -> i32 {
    numbers.iter().copied().fold(i32::MAX, i32::min)
}

#[inline(always)]
fn load<S: Lanes>(simd: S, lanes: &[f32; MOST_LANES]) -> S::f32s {
    S::f32s::from_slice(simd, &lanes[..S::WIDTH])
}

#[inline(always)]
fn at<S: Lanes>(origin: [S::f32s; 3], direction: [S::f32s; 3], t: S::f32s) -> [S::f32s; 3] {
    let ([ox, oy, oz], [dx, dy, dz]) = (origin, direction);
    [dx.mul_add(t, ox), dy.mul_add(t, oy), dz.mul_add(t, oz)]
}

impl Track {
    /// Number of steps of a march along it.
    #[must_use]
    pub fn steps(&self, step: f32) -> i32 {
        Steps::new(self, step).count
    }

    /// The same track, with each sample of a march moved from the middle of what is seen of its step by the share `by` of it,
    /// -1/2 to 1/2.
    #[must_use]
    pub fn shifted(&self, by: f32) -> Self {
        Self { shift: by, ..*self }
    }

    /// Where a step begins and ends.
    #[must_use]
    pub fn step_ends(&self, k: i32, step: f32) -> [f32; 2] {
        let [start, width] = Steps::new(self, step).at(k, step);
        [start, start + width]
    }
}
