//! Optical thickness along a track: what shadow rays need. The track's steps fill the lanes.

use super::march::Steps;
use super::step_ends::StepEnds;
use super::{Medium, Track};
use crate::math::cast;
use crate::simd::{Kernel, Lanes, Level, MOST_LANES};
use crate::transfer::OpacityLanes;
use fearless_simd::prelude::*;

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
