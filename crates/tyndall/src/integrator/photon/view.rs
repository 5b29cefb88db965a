//! View rays through matter lit by photons \[Jonsson12, eq. 2\]: packets of ray segments.

use super::gather::{GatherSite, Scattered};
use super::gathering::Gathering;
use super::gathers::{Gathered, LaneGathers};
use super::map::PhotonMap;
use crate::integrator::view_march::{Coverage, Shader, composite};
use crate::math::{Ray, Rgb, Vec3, cast};
use crate::medium::{MarchNotes, PacketMarch, PacketSample, Track};
use crate::scene::Scene;
use crate::simd::{Lanes, MOST_LANES};
use crate::transfer::{HistoryGroups, Historygram};
use crate::volume::ValueBins;
use fearless_simd::prelude::*;

/// Maximum opacity that a ray accumulates between two gathers, unless the settings' gather spacing is reached first: so
/// little that one gather represents all of it.
const MOST_COVERED: f32 = 1.0 / 16.0;

/// Inputs for computing view rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    pub scene: &'a Scene,
    /// `None` if nothing scatters.
    pub map: Option<&'a PhotonMap>,
    /// World units.
    pub step: f32,
    /// Maximum distance between two gathers, in radii.
    pub gather_spacing: f32,
}

/// Stretches of rays, one per lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretches {
    pub rays: [Ray; MOST_LANES],
    pub tracks: [Track; MOST_LANES],
    /// First step and the one after the last; lanes without a stretch have none.
    pub from: [i32; MOST_LANES],
    pub to: [i32; MOST_LANES],
    /// Fraction of a gather due at the beginning, below 1. Uniformly distributed over rays, these fractions cause no
    /// bias.
    pub due: [f32; MOST_LANES],
}

impl Default for Stretches {
    fn default() -> Self {
        Self {
            rays: [Ray::default(); MOST_LANES],
            tracks: [Track::default(); MOST_LANES],
            from: [0; MOST_LANES],
            to: [0; MOST_LANES],
            due: [0.0; MOST_LANES],
        }
    }
}

/// The result of a stretch of a ray on its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stretch {
    pub radiance: Rgb,
    pub transmittance: f32,
    /// Sum of the sample distances inside the medium, weighted by each sample's share of the opacity.
    pub depth: f32,
    /// Number of gathers on it.
    pub gathers: usize,
}

/// Listener to a march that gathers photons.
pub(super) trait GatherNotes<S: Lanes>: MarchNotes<S> {
    /// Part of the light of a lane's ray, and where it was gathered if it can be gathered again.
    fn gathered(&mut self, lane: usize, part: Gathered, site: Option<GatherSite>);

    /// There is light of a glossy surface.
    fn glossy(&mut self, lane: usize);

    /// Light that all matter along a lane's ray emits, at the end.
    fn emitted(&mut self, lane: usize, light: Rgb);
}

impl<S: Lanes> GatherNotes<S> for () {
    #[inline(always)]
    fn gathered(&mut self, _: usize, _: Gathered, _: Option<GatherSite>) {}

    #[inline(always)]
    fn glossy(&mut self, _: usize) {}

    #[inline(always)]
    fn emitted(&mut self, _: usize, _: Rgb) {}
}

impl View<'_> {
    /// Marches all stretches to their ends, or until they are opaque. A lane's result does not depend on the other
    /// lanes.
    #[inline(always)]
    pub fn march<S: Lanes, N: GatherNotes<S>>(
        &self,
        simd: S,
        stretches: &Stretches,
        notes: &mut N,
    ) -> [Stretch; MOST_LANES] {
        let mut gathering = GatheringShader {
            view: self,
            rays: &stretches.rays,
            scattered: [Rgb::BLACK; MOST_LANES],
            emitted: [Rgb::BLACK; MOST_LANES],
            gathers: [0; MOST_LANES],
            due: S::f32s::from_slice(simd, &stretches.due[..S::WIDTH]),
            spacing: self.gather_spacing * self.map.map_or(0.0, |map| map.radius),
            distances: Vec::new(),
        };
        let medium = &*self.scene.medium;
        let mut seen = Coverage::none(simd);
        let mut march = PacketMarch::<S>::new(simd, medium, &stretches.tracks, self.step);
        let ends = |k: &[i32; MOST_LANES]| S::i32s::from_slice(simd, &k[..S::WIDTH]);
        march.go_between(ends(&stretches.from), ends(&stretches.to));
        composite(simd, &mut march, &mut seen, &mut gathering, notes);
        let GatheringShader { scattered, emitted, gathers, .. } = gathering;
        let mut found = [Stretch::default(); MOST_LANES];
        for lane in 0..S::WIDTH {
            let transmittance = 1.0 - seen.alpha.as_slice()[lane];
            let depth = seen.depth.as_slice()[lane];
            // Last, so that the sum of all that was noted has the same bits.
            notes.emitted(lane, emitted[lane]);
            let radiance = scattered[lane] + emitted[lane];
            found[lane] = Stretch { radiance, transmittance, depth, gathers: gathers[lane] };
        }
        found
    }

    /// Light that a sample scatters to the viewer.
    #[inline(always)]
    fn scattered<S: Lanes>(
        &self,
        simd: S,
        sample: &ViewSample,
        distances: &mut Vec<f32>,
        notes: &mut impl GatherNotes<S>,
    ) -> Rgb {
        let Some(map) = self.map else { return Rgb::BLACK };
        let ViewSample { position, value, weight, width, w_out, lane } = *sample;
        let medium = &*self.scene.medium;
        let optics = medium.transfer().optics(value);
        let event = medium.event(position, &optics);
        let half_spread = map.half_spread(simd, medium, position);
        let (mut opacity, mut mean) = (optics.opacity, optics.opacity);
        if half_spread > 0.0 {
            let ends = [value - half_spread, value + half_spread];
            opacity = medium.transfer().opacity_range(ends)[1];
            mean = medium.transfer().mean_opacity(ends);
            let first = S::f32s::from_fn(simd, |lane| lane as f32).simd_lt(1.0);
            let ends = [S::f32s::splat(simd, ends[0]), S::f32s::splat(simd, ends[1])];
            notes.values_between_about(simd, lane, first, ends);
        }
        let at = Gathering { position, opacity, mean, half_spread, event, w_out, width, weight, lane };
        match map.scattered(simd, medium, &at, distances, notes) {
            Scattered::Plain(light, site) => {
                notes.gathered(lane, Gathered { light, value }, site);
                light * optics.albedo
            }
            Scattered::Glossy(light) => {
                notes.glossy(lane);
                light
            }
        }
    }
}

/// Gathers photons along view rays, as often as [`MOST_COVERED`] and `spacing` require, and adds emission.
struct GatheringShader<'a, S: Lanes> {
    view: &'a View<'a>,
    rays: &'a [Ray; MOST_LANES],
    scattered: [Rgb; MOST_LANES],
    emitted: [Rgb; MOST_LANES],
    gathers: [usize; MOST_LANES],
    /// Fraction of a gather that is due.
    due: S::f32s,
    /// Maximum distance between two gathers, world units.
    spacing: f32,
    /// Scratch space for gathers of the nearest photons.
    distances: Vec<f32>,
}

impl<S: Lanes, N: GatherNotes<S>> Shader<S, N> for GatheringShader<'_, S> {
    #[inline(always)]
    fn shade(&mut self, simd: S, sample: &PacketSample<S>, covered: S::f32s, notes: &mut N) -> bool {
        let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
        let medium = &*self.view.scene.medium;
        if medium.transfer().emits() {
            sample.add_emitted(simd, medium, covered, &mut self.emitted);
        }
        // Number of gathers for a step, at most one.
        let share = (covered * (1.0 / MOST_COVERED)).max(sample.width / self.spacing).min(one);
        let due = covered.simd_gt(zero).select(self.due + share, self.due);
        let now = due.simd_ge(one);
        self.due = now.select(due - 1.0, due);
        let weight = now.select(covered / share, zero);
        let width = sample.width / share;
        if !now.any_true() {
            return true;
        }
        let seen = sample.seen_once(simd, medium, now);
        for lane in 0..S::WIDTH {
            let weight = weight.as_slice()[lane];
            if weight > 0.0 {
                let here = ViewSample {
                    position: seen.position(lane),
                    value: seen.value.as_slice()[lane],
                    weight,
                    width: width.as_slice()[lane],
                    w_out: -self.rays[lane].direction,
                    lane,
                };
                self.scattered[lane] += self.view.scattered(simd, &here, &mut self.distances, notes);
                self.gathers[lane] += 1;
            }
        }
        true
    }
}

/// A sample of one ray.
struct ViewSample {
    /// In index space.
    position: Vec3,
    /// Data value.
    value: f32,
    /// Share of its light that the viewer sees.
    weight: f32,
    /// Length of the ray that it represents, world units.
    width: f32,
    w_out: Vec3,
    lane: usize,
}

/// Records what each lane's ray segment reads and gathers.
pub(super) struct Notes<'a> {
    pub groups: &'a HistoryGroups,
    /// See [`HistoryGroups::records`].
    pub records: &'a [Historygram],
    pub bins: ValueBins,
    /// For each majorant cell, the groups of values that can occur in it.
    pub cells: &'a [Historygram],
    pub read: [Historygram; MOST_LANES],
    pub gathers: &'a mut LaneGathers,
}

impl Notes<'_> {
    /// The bins of values, and that of nothing in lanes that read none.
    #[inline(always)]
    fn bins_read<S: Lanes>(&self, simd: S, read: S::mask32s, values: S::f32s) -> S::i32s {
        let nothing = cast::fit_u32(ValueBins::COUNT).cast_signed();
        read.select(self.bins.bin_lanes(simd, values), S::i32s::splat(simd, nothing))
    }
}

impl<S: Lanes> GatherNotes<S> for Notes<'_> {
    #[inline(always)]
    fn gathered(&mut self, lane: usize, part: Gathered, site: Option<GatherSite>) {
        self.gathers.add(lane, part, site);
    }

    #[inline(always)]
    fn glossy(&mut self, lane: usize) {
        self.gathers.add_glossy(lane);
    }

    #[inline(always)]
    fn emitted(&mut self, lane: usize, light: Rgb) {
        self.gathers.add_emitted(lane, light);
    }
}

impl<S: Lanes> MarchNotes<S> for Notes<'_> {
    const EACH_CELL: bool = true;

    #[inline(always)]
    fn between(&mut self, simd: S, lanes: S::mask32s, [from, to]: [S::f32s; 2]) {
        let [from, to] = [self.bins.bin_lanes(simd, from), self.bins.bin_lanes(simd, to)];
        let (first, last) = (from.min(to), from.max(to));
        let taken = lanes.select(S::i32s::splat(simd, 1), S::i32s::splat(simd, 0));
        for lane in 0..S::WIDTH {
            if taken.as_slice()[lane] > 0 {
                let bin = |bins: &S::i32s| bins.as_slice()[lane].cast_unsigned() as usize;
                self.read[lane] |= self.groups.between(bin(&first), bin(&last));
            }
        }
    }

    #[inline(always)]
    fn values_about(&mut self, simd: S, lane: usize, read: S::mask32s, values: S::f32s) {
        let bins = self.bins_read(simd, read, values);
        let mut all = Historygram::EMPTY;
        for i in 0..S::WIDTH {
            all |= self.records[bins.as_slice()[i].cast_unsigned() as usize];
        }
        self.read[lane] |= all;
    }

    #[inline(always)]
    fn values_between_about(&mut self, simd: S, lane: usize, read: S::mask32s, [from, to]: [S::f32s; 2]) {
        let [first, last] = [self.bins.bin_lanes(simd, from), self.bins.bin_lanes(simd, to)];
        let read = read.select(S::i32s::splat(simd, 1), S::i32s::splat(simd, 0));
        for i in 0..S::WIDTH {
            if read.as_slice()[i] > 0 {
                let bin = |bins: &S::i32s| bins.as_slice()[i].cast_unsigned() as usize;
                self.read[lane] |= self.groups.between(bin(&first), bin(&last));
            }
        }
    }

    #[inline(always)]
    fn cells(&mut self, simd: S, lanes: S::mask32s, cells: S::u32s) {
        if lanes.any_true() {
            let taken = lanes.select(S::u32s::splat(simd, 1), S::u32s::splat(simd, 0));
            for lane in 0..S::WIDTH {
                if taken.as_slice()[lane] > 0 {
                    self.read[lane] |= self.cells[cells.as_slice()[lane] as usize];
                }
            }
        }
    }
}
