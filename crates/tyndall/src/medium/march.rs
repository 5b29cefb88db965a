//! Marching on one grid of steps per track, each with all that lies between the data values at its two ends.
//!
//! Step `k` covers `[k step, (k + 1) step]`, the last one what is left. Its extinction is the mean over all values
//! between those at its ends, as if values changed linearly along it \[Engel01\]; with interpolation `nearest` it is that
//! of the first value up to where the value changes, and of the second from there (in flights, the plain mean of the two). The grid does not depend on the
//! transfer function. Steps between two empty cells are skipped, which changes no bit: such cells touch, so that all
//! values between belong to empty cells.

use super::march_notes::MarchNotes;
use super::skip::{LaneCells, Skip};
use super::step_ends::{Site, StepEnds};
use super::{Medium, Track};
use crate::math::{Rgb, Vec3, cast};
use crate::simd::{Kernel, Lanes, Level, MOST_LANES, log2_unfused, one_minus_exp};
use crate::transfer::OpacityLanes;
use fearless_simd::prelude::*;
use std::f32::consts::LN_2;

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

    /// Where a step begins and how wide it is.
    pub(super) fn at(&self, k: i32, step: f32) -> [f32; 2] {
        [k as f32 * step, if k < self.whole { step } else { self.rest }]
    }
}

/// The steps that a packet of tracks takes at once, one per lane.
pub(crate) struct PacketSample<S: Lanes> {
    /// World distance of its middle along each track.
    pub t: S::f32s,
    /// World units.
    pub width: S::f32s,
    /// Optical thickness; 0 in lanes that take no step.
    pub thickness: S::f32s,
    /// Ends in index space.
    from: [S::f32s; 3],
    to: [S::f32s; 3],
    ends: StepEnds<S>,
    /// The share of what is visible of the step that lies in front of its site.
    within: S::f32s,
}

/// Where steps are seen.
pub(crate) struct SeenLanes<S: Lanes> {
    /// In index space.
    pub position: [S::f32s; 3],
    /// Data values.
    pub value: S::f32s,
    /// The share of what is visible of the step that each stands for; 0 in lanes without a position.
    pub weight: S::f32s,
}

impl<S: Lanes> SeenLanes<S> {
    /// A lane's position in index space.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> Vec3 {
        let [x, y, z] = &self.position;
        Vec3::new(x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane])
    }
}

impl<S: Lanes> PacketSample<S> {
    /// How many sites at most a step is seen at.
    pub const SITES: usize = 2;

    /// Where some lanes' steps are seen, at the first or second of their sites; `None` if none of them has that site. Steps
    /// have two where they are thick and hold a peak, which light may reach from either side: sites stand for equal shares of what is
    /// visible of a step. In constant thin matter the only site is the step's middle.
    #[inline(always)]
    pub fn seen(&self, simd: S, medium: &Medium, lanes: S::mask32s, site: usize) -> Option<SeenLanes<S>> {
        let two = self.ends.is_narrow() & self.thickness.simd_gt(S::f32s::splat(simd, THICK));
        let lanes = if site == 0 { lanes } else { lanes & two };
        if !lanes.any_true() {
            return None;
        }
        let one = S::f32s::splat(simd, 1.0);
        let weight = two.select(one * 0.5, one);
        let within = (self.within + site as f32) * weight;
        Some(self.seen_within(simd, medium, lanes, within, weight))
    }

    /// Where some lanes' steps are seen, each at one site only.
    #[inline(always)]
    pub fn seen_once(&self, simd: S, medium: &Medium, lanes: S::mask32s) -> SeenLanes<S> {
        self.seen_within(simd, medium, lanes, self.within, S::f32s::splat(simd, 1.0))
    }

    /// Adds to the radiance of each lane what its step emits, times `covered`; lanes that cover nothing are passed over.
    #[inline(always)]
    pub fn add_emitted(&self, simd: S, medium: &Medium, covered: S::f32s, radiance: &mut [Rgb; MOST_LANES]) {
        let lanes = covered.simd_gt(S::f32s::splat(simd, 0.0));
        for site in 0..Self::SITES {
            let Some(seen) = self.seen(simd, medium, lanes, site) else { break };
            let covered = covered * seen.weight;
            for (lane, radiance) in radiance.iter_mut().enumerate().take(S::WIDTH) {
                let covered = covered.as_slice()[lane];
                if covered > 0.0 {
                    *radiance += medium.transfer.emitted(seen.value.as_slice()[lane]) * covered;
                }
            }
        }
    }

    /// Where the share `within` of what is visible of a step lies in front.
    #[inline(always)]
    fn seen_within(
        &self,
        simd: S,
        medium: &Medium,
        lanes: S::mask32s,
        within: S::f32s,
        weight: S::f32s,
    ) -> SeenLanes<S> {
        let mut share = within;
        // A share of what is visible, not of what there is; both are the same where there is little.
        let thick = self.thickness.simd_gt(S::f32s::splat(simd, THIN));
        if thick.any_true() {
            let behind = -within * one_minus_exp(simd, self.thickness) + 1.0;
            let depth = log2_unfused(simd, behind) * -LN_2;
            share = thick.select(depth / self.thickness, share);
        }
        let Site { share, value } = self.ends.site(simd, medium, share, lanes);
        let ([ox, oy, oz], [tx, ty, tz]) = (self.from, self.to);
        let position =
            [(tx - ox).mul_add(share, ox), (ty - oy).mul_add(share, oy), (tz - oz).mul_add(share, oz)];
        SeenLanes { position, value, weight: lanes.select(weight, S::f32s::splat(simd, 0.0)) }
    }
}

/// Optical thickness up to which a step hides nothing of itself.
const THIN: f32 = 1e-3;
/// Optical thickness above which the front and the back of a step are lit differently.
const THICK: f32 = 0.5;

impl Medium {
    /// Optical thickness along a track by steps of `step` world units; it may end once it exceeds `enough`, at a
    /// step that depends on the level.
    #[must_use]
    pub fn optical_thickness(&self, level: Level, track: &Track, step: f32, enough: f32) -> f32 {
        struct Thickness<'a>(&'a Medium, &'a Track, f32, f32);
        impl Kernel for Thickness<'_> {
            type Output = f32;

            #[inline(always)]
            fn run<S: Lanes>(self, simd: S) -> f32 {
                let Self(medium, track, step, enough) = self;
                medium.thickness_lanes(simd, track, None, step, enough)
            }
        }
        level.run(Thickness(self, track, step, enough))
    }

    /// [`Self::optical_thickness`], many steps at once. `first` is what the track begins in, if that is known.
    #[inline(always)]
    pub(crate) fn thickness_lanes<S: Lanes>(
        &self,
        simd: S,
        track: &Track,
        first: Option<&TrackStart<S>>,
        step: f32,
        enough: f32,
    ) -> f32 {
        let steps = Steps::new(track, step);
        let mut along = Along::new(simd, self, track, steps, step, first);
        let mut k = 0;
        for cell in self.majorants.walk(track) {
            if cell.most <= 0.0 {
                continue;
            }
            k = k.max(cast::truncate(cell.start / step)).min(steps.count);
            while k < steps.count && k as f32 * step < cell.end {
                if along.push(k) > enough {
                    return along.thickness();
                }
                k += 1;
            }
        }
        along.rest()
    }
}

/// The data value where tracks begin, and its opacity, in all lanes. It need not be exactly that of the data there, but is
/// that of the matter from which light is seen.
#[derive(Clone, Copy)]
pub(crate) struct TrackStart<S: Lanes> {
    value: S::f32s,
    opacity: OpacityLanes<S>,
}

impl<S: Lanes> TrackStart<S> {
    #[inline(always)]
    pub fn new(simd: S, medium: &Medium, value: f32) -> Self {
        let value = S::f32s::splat(simd, value);
        Self { value, opacity: medium.transfer.read_lanes(simd, value) }
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

    /// Index-space positions at distances inside the medium.
    #[inline(always)]
    pub(super) fn lanes<S: Lanes>(&self, simd: S, t: S::f32s) -> [S::f32s; 3] {
        let (o, d) = (self.ray.origin.to_array(), self.ray.direction.to_array());
        let splat = [S::f32s::splat(simd, o[0]), S::f32s::splat(simd, o[1]), S::f32s::splat(simd, o[2])];
        [t.mul_add(d[0], splat[0]), t.mul_add(d[1], splat[1]), t.mul_add(d[2], splat[2])]
    }
}

/// Thickness that matters little on the way from a light.
const SLIGHT: f32 = 0.05;

/// Ends of one track's steps, gathered until they fill the lanes, the nearest last: then each lane's next end is in the
/// lane before it.
struct Along<'a, S: Lanes> {
    simd: S,
    medium: &'a Medium,
    track: &'a Track,
    steps: Steps,
    step: f32,
    /// The ends, numbered as the steps that begin there.
    pending: [i32; MOST_LANES],
    /// 1 where the step before an end is one of those to be added, 0 where it is not.
    joined: [f32; MOST_LANES],
    /// Mean opacity up to which values inside a step are not read.
    slight: f32,
    count: usize,
    /// The last end that was added.
    last: i32,
    /// The last lanes; only the farthest end, which is in the first of them, is read.
    value: S::f32s,
    opacity: OpacityLanes<S>,
    thickness: S::f32s,
}

impl<'a, S: Lanes> Along<'a, S> {
    #[inline(always)]
    fn new(
        simd: S,
        medium: &'a Medium,
        track: &'a Track,
        steps: Steps,
        step: f32,
        first: Option<&TrackStart<S>>,
    ) -> Self {
        let thickness = S::f32s::splat(simd, 0.0);
        let unknown = TrackStart { value: thickness, opacity: OpacityLanes::none(simd) };
        let TrackStart { value, opacity } = *first.unwrap_or(&unknown);
        Self {
            simd,
            medium,
            track,
            steps,
            step,
            pending: [0; MOST_LANES],
            joined: [0.0; MOST_LANES],
            slight: SLIGHT / (step * medium.density),
            count: 0,
            // No end has been read if the first value is not known.
            last: if first.is_some() { 0 } else { -1 },
            value,
            opacity,
            thickness,
        }
    }

    /// Adds a step; returns the thickness so far if lanes were taken, else 0.
    #[inline(always)]
    fn push(&mut self, k: i32) -> f32 {
        let mut found = 0.0;
        if self.last != k {
            found = self.push_end(k, 0.0);
        }
        self.push_end(k + 1, 1.0).max(found)
    }

    #[inline(always)]
    fn push_end(&mut self, k: i32, joined: f32) -> f32 {
        self.last = k;
        self.count += 1;
        let lane = S::WIDTH - self.count;
        (self.pending[lane], self.joined[lane]) = (k, joined);
        if self.count == S::WIDTH { self.take() } else { 0.0 }
    }

    /// Adds the steps that end at the pending ends; returns the thickness so far.
    #[inline(always)]
    fn take(&mut self) -> f32 {
        let simd = self.simd;
        let medium = self.medium;
        let k = S::i32s::from_slice(simd, &self.pending[..S::WIDTH]);
        let end = k.to_float::<S::f32s>() * self.step;
        let partial = k.simd_gt(S::i32s::splat(simd, self.steps.whole));
        let width = partial.select(S::f32s::splat(simd, self.steps.rest), S::f32s::splat(simd, self.step));
        let t = partial.select(end - self.step + self.steps.rest, end);
        let position = self.track.lanes(simd, t);
        let value = medium.volume.value_lanes(simd, position);
        let opacity = medium.transfer.read_lanes(simd, value);
        let values = [value.slide::<1>(self.value), value];
        let opacities = [opacity.successors(self.opacity), opacity];
        let joined = S::f32s::from_slice(simd, &self.joined[..S::WIDTH]);
        let lanes = joined.simd_gt(S::f32s::splat(simd, 0.0));
        let mut ends = StepEnds::new(simd, medium.interpolates, values, opacities);
        let varying = lanes & ends.vary_above(self.slight);
        if varying.any_true() {
            let from = self.track.lanes(simd, t - width);
            ends.refine(simd, medium, [from, position], varying);
        }
        self.thickness += ends.mean * width * joined;
        (self.value, self.opacity) = (value, opacity);
        self.count = 0;
        self.joined = [0.0; MOST_LANES];
        self.thickness()
    }

    /// Takes what is pending; returns the thickness.
    #[inline(always)]
    fn rest(&mut self) -> f32 {
        if self.count == 0 {
            return self.thickness();
        }
        self.take()
    }

    #[inline(always)]
    fn thickness(&self) -> f32 {
        self.thickness.as_slice().iter().sum::<f32>() * self.medium.density
    }
}
