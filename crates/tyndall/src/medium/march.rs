//! Marching: the midpoint rule on one grid of steps per track.
//!
//! Step `k` covers `[k step, (k + 1) step]`, the last one what is left. The grid does not depend on the transfer
//! function, so skipping empty space leaves every other sample where it was and changes no bit. Whether a sample is
//! skipped depends only on the cell that it is in.

use super::march_notes::MarchNotes;
use super::skip::Skip;
use super::{Medium, Track};
use crate::math::cast;
use crate::simd::{Kernel, Lanes, Level, MOST_LANES};
use fearless_simd::prelude::*;

/// The steps of one track.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Steps {
    /// Steps of full width.
    whole: i32,
    /// All steps, including the last, narrower one.
    count: i32,
    /// Width of the last one, world units.
    rest: f32,
}

impl Steps {
    pub(super) fn new(track: &Track, step: f32) -> Self {
        let whole = cast::truncate(track.length / step).min(i32::MAX - 1);
        let rest = (track.length - whole as f32 * step).max(0.0);
        // A remainder of rounding error would be a step of no width.
        Self { whole, count: whole + i32::from(rest > 1e-4 * step), rest }
    }

    /// All steps.
    pub(super) fn count(&self) -> i32 {
        self.count
    }

    #[inline(always)]
    pub(super) fn midpoint(&self, k: i32, step: f32) -> f32 {
        let width = if k < self.whole { step } else { self.rest };
        k as f32 * step + 0.5 * width
    }
}

/// The samples that a packet of tracks takes at once, one per lane.
pub(crate) struct PacketSample<S: Lanes> {
    /// World distance along each track.
    pub t: S::f32s,
    /// Width of the step, world units.
    pub width: S::f32s,
    /// In index space.
    pub position: [S::f32s; 3],
    /// Data value.
    pub value: S::f32s,
    /// Optical thickness of the step; 0 in lanes that take no sample.
    pub thickness: S::f32s,
}

impl Medium {
    /// Optical thickness along a track by the midpoint rule with steps of `step` world units; stops once it exceeds
    /// `enough`.
    #[must_use]
    pub fn optical_thickness(&self, level: Level, track: &Track, step: f32, enough: f32) -> f32 {
        struct Thickness<'a>(&'a Medium, &'a Track, f32, f32);
        impl Kernel for Thickness<'_> {
            type Output = f32;

            #[inline(always)]
            fn run<S: Lanes>(self, simd: S) -> f32 {
                let Self(medium, track, step, enough) = self;
                medium.thickness_lanes(simd, track, step, enough)
            }
        }
        level.run(Thickness(self, track, step, enough))
    }

    /// [`Self::optical_thickness`], many steps at once.
    #[inline(always)]
    pub(crate) fn thickness_lanes<S: Lanes>(&self, simd: S, track: &Track, step: f32, enough: f32) -> f32 {
        let steps = Steps::new(track, step);
        let mut along = Along::new(simd, self, track, steps, step);
        let mut k = 0;
        for cell in self.majorants.walk(track) {
            if cell.most <= 0.0 {
                // Up to the last step whose midpoint may be in this cell; the loop below corrects it.
                k = k.max(cast::truncate(cell.end / step - 0.5)).min(steps.count);
            }
            while k < steps.count && along.midpoint(k) < cell.end {
                if cell.most > 0.0 && along.push(k) && along.take() > enough {
                    return along.thickness();
                }
                k += 1;
            }
        }
        if along.count > 0 { along.take() } else { along.thickness() }
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
    /// Where in its step a sample is, as a share of the step's width.
    within: S::f32s,
    skip: Skip<'a, S>,
    k: S::i32s,
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
        }
        let [ox, oy, oz, dx, dy, dz, rest, within] = &numbers;
        let within = load(simd, within);
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
            within,
            skip: Skip::new(simd, medium, origin, direction, within, step),
            k,
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
        self.active = k.simd_lt(self.count);
    }

    /// Continues at the given steps, up to `end` (exclusive) or the end of a lane's track if that comes first.
    #[inline(always)]
    pub fn go_between(&mut self, k: S::i32s, end: S::i32s) {
        self.count = self.count.min(end);
        self.go_to(k);
    }

    /// The next samples, at least one of which met matter; everything read is reported to `notes`. No lane's bits
    /// depend on what is in the others.
    #[inline(always)]
    pub fn next<N: MarchNotes<S>>(&mut self, notes: &mut N) -> Option<PacketSample<S>> {
        let simd = self.simd;
        let zero = S::f32s::splat(simd, 0.0);
        while self.active.any_true() {
            let k = self.k;
            let width = k.simd_lt(self.whole).select(S::f32s::splat(simd, self.width), self.rest);
            let t = k.to_float::<S::f32s>() * self.width + width * self.within;
            let position = at::<S>(self.origin, self.direction, t);
            let mut here = self.active;
            self.k = k + 1;
            if self.occupied == 0 {
                let cells = self.skip.cells::<N>(position);
                notes.cells(simd, here & cells.empty, cells.number);
                let leap = self.skip.leap(k, &cells);
                here &= !cells.empty;
                self.k = cells.empty.select(leap, self.k);
                if (self.active & cells.empty).any_true() {
                    if !here.any_true() {
                        self.active &= self.k.simd_lt(self.count);
                        continue;
                    }
                } else {
                    // Lanes that have ended do not limit the count.
                    let far = S::i32s::splat(simd, i32::MAX);
                    self.occupied = least(self.active.select(leap - k, far).as_slice()) - 1;
                }
            } else {
                self.occupied -= 1;
            }
            self.active &= self.k.simd_lt(self.count);
            let value = self.medium.volume.value_lanes(simd, position);
            notes.values(simd, here, value);
            let opacity = self.medium.transfer.opacity_lanes(simd, value);
            let thickness = here.select(opacity * width * self.medium.density, zero);
            if thickness.simd_gt(zero).any_true() {
                return Some(PacketSample { t, width, position, value, thickness });
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

    /// The same track, with each sample of a march moved from the middle of its step by the share `by` of the step's width, -1/2 to 1/2.
    #[must_use]
    pub fn shifted(&self, by: f32) -> Self {
        Self { shift: by, ..*self }
    }

    /// The middle of a step.
    #[must_use]
    pub fn midpoint(&self, k: i32, step: f32) -> f32 {
        Steps::new(self, step).midpoint(k, step)
    }

    /// Index-space positions at distances inside the medium.
    #[inline(always)]
    pub(super) fn lanes<S: Lanes>(&self, simd: S, t: S::f32s) -> [S::f32s; 3] {
        let (o, d) = (self.ray.origin.to_array(), self.ray.direction.to_array());
        let splat = [S::f32s::splat(simd, o[0]), S::f32s::splat(simd, o[1]), S::f32s::splat(simd, o[2])];
        [t.mul_add(d[0], splat[0]), t.mul_add(d[1], splat[1]), t.mul_add(d[2], splat[2])]
    }
}

/// Steps of one track, gathered until they fill the lanes.
struct Along<'a, S: Lanes> {
    simd: S,
    medium: &'a Medium,
    track: &'a Track,
    steps: Steps,
    step: f32,
    pending: [i32; MOST_LANES],
    count: usize,
    thickness: S::f32s,
}

impl<'a, S: Lanes> Along<'a, S> {
    #[inline(always)]
    fn new(simd: S, medium: &'a Medium, track: &'a Track, steps: Steps, step: f32) -> Self {
        let thickness = S::f32s::splat(simd, 0.0);
        Self { simd, medium, track, steps, step, pending: [0; MOST_LANES], count: 0, thickness }
    }

    #[inline(always)]
    fn midpoint(&self, k: i32) -> f32 {
        self.steps.midpoint(k, self.step)
    }

    /// Whether the lanes are now full.
    #[inline(always)]
    fn push(&mut self, k: i32) -> bool {
        self.pending[self.count] = k;
        self.count += 1;
        self.count == S::WIDTH
    }

    /// Takes the pending samples; returns the thickness so far.
    #[inline(always)]
    fn take(&mut self) -> f32 {
        let simd = self.simd;
        let k = S::i32s::from_slice(simd, &self.pending[..S::WIDTH]);
        let whole = k.simd_lt(S::i32s::splat(simd, self.steps.whole));
        let width = whole.select(S::f32s::splat(simd, self.step), S::f32s::splat(simd, self.steps.rest));
        let t = k.to_float::<S::f32s>() * self.step + width * 0.5;
        let position = self.track.lanes(simd, t);
        let value = self.medium.volume.value_lanes(simd, position);
        let opacity = self.medium.transfer.opacity_lanes(simd, value);
        let number = S::f32s::from_fn(simd, |lane| lane as f32);
        let taken = number.simd_lt(S::f32s::splat(simd, self.count as f32));
        self.thickness += taken.select(opacity * width, S::f32s::splat(simd, 0.0));
        self.count = 0;
        self.thickness()
    }

    #[inline(always)]
    fn thickness(&self) -> f32 {
        self.thickness.as_slice().iter().sum::<f32>() * self.medium.density
    }
}
