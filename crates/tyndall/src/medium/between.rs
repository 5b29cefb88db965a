//! The two ends of a step, and what lies between them.

use super::Medium;
use crate::math::Vec3;
use crate::simd::Lanes;
use crate::transfer::{Between, OpacityLanes};
use fearless_simd::prelude::*;

/// Halvings of a step in the search for the border between two voxels that are not interpolated.
const HALVINGS: usize = 6;

/// How many times the smallest opacity at the ends of a step and on average between them is the largest where values
/// inside the step are read too. Where opacity changes less, it matters little how the values get from one end to the other.
const STEADY: f32 = 2.0;

/// Borders between voxels that a step crosses, at most one along each axis, and the parts that they divide it into.
const BORDERS: usize = 3;
const PARTS: usize = BORDERS + 1;

/// What lies between the ends of a step per lane.
pub(super) struct StepEnds<S: Lanes> {
    values: [S::f32s; 2],
    opacities: [OpacityLanes<S>; 2],
    /// Mean opacity.
    pub mean: S::f32s,
    /// The share of the step before the value changes, where values are not interpolated.
    border: S::f32s,
    /// Where the field may bend, in the lanes `bent`.
    bends: Bends<S>,
    bent: S::mask32s,
}

/// The borders between voxels that a step crosses, nearest first. Between two of them the field is smooth, and nearly
/// linear.
struct Bends<S: Lanes> {
    /// As shares of the step; 1 in place of borders that it does not cross.
    shares: [S::f32s; BORDERS],
    values: [S::f32s; BORDERS],
}

impl<S: Lanes> StepEnds<S> {
    /// With the values at the ends, between which there are others if they are interpolated.
    #[inline(always)]
    pub fn new(simd: S, interpolates: bool, values: [S::f32s; 2], opacities: [OpacityLanes<S>; 2]) -> Self {
        let [from, to] = opacities;
        let half = S::f32s::splat(simd, 0.5);
        let bends = Bends { shares: [half; BORDERS], values: [values[0]; BORDERS] };
        let bent = S::mask32s::splat(simd, false);
        let mean = if interpolates { from.mean(simd, to) } else { (from.opacity + to.opacity) * 0.5 };
        Self { values, opacities, mean, border: half, bends, bent }
    }

    /// Lanes in which opacity varies along the step.
    #[inline(always)]
    pub fn vary(&self) -> S::mask32s {
        let [from, to] = self.opacities;
        let most = self.mean.max(from.opacity).max(to.opacity);
        let least = self.mean.min(from.opacity).min(to.opacity);
        most.simd_gt(least * STEADY)
    }

    /// Lanes in which most of the matter lies between the ends, and its mean opacity is not slight.
    #[inline(always)]
    pub fn are_narrow(&self, slight: f32) -> S::mask32s {
        let [from, to] = self.opacities;
        self.mean.simd_gt((from.opacity.max(to.opacity) * STEADY).max(slight))
    }

    /// Reads values inside some lanes' steps, between two positions in index space.
    #[inline(always)]
    pub fn refine(&mut self, simd: S, medium: &Medium, positions: [[S::f32s; 3]; 2], lanes: S::mask32s) {
        if medium.interpolates {
            let [from, to] = self.opacities;
            let bent = lanes & !from.is_edge(simd, to);
            if bent.any_true() {
                self.bend(simd, medium, positions, bent);
            }
        } else {
            self.find_border(simd, medium, positions, lanes);
        }
    }

    /// Reads the values at the borders between voxels in some lanes.
    #[inline(always)]
    fn bend(&mut self, simd: S, medium: &Medium, [from, to]: [[S::f32s; 3]; 2], bent: S::mask32s) {
        let one = S::f32s::splat(simd, 1.0);
        let [x, y, z] =
            [crossing(simd, from[0], to[0]), crossing(simd, from[1], to[1]), crossing(simd, from[2], to[2])];
        let (x, y) = (x.min(y), x.max(y));
        let (y, z) = (y.min(z), y.max(z));
        let (x, y) = (x.min(y), x.max(y));
        self.bends.shares = [x, y, z];
        let [first, last] = self.opacities;
        let (mut before, mut share) = (first, one - one);
        let mut mean = share;
        for i in 0..BORDERS {
            let here = self.bends.shares[i];
            let value = medium.volume.value_lanes(simd, between::<S>(from, to, here));
            let opacity = medium.transfer.read_lanes(simd, value);
            mean = before.mean(simd, opacity).mul_add(here - share, mean);
            self.bends.values[i] = value;
            (before, share) = (opacity, here);
        }
        mean = before.mean(simd, last).mul_add(one - share, mean);
        // No lane's bits may depend on what is in the others.
        self.mean = bent.select(mean, self.mean);
        self.bent = bent;
    }

    /// Finds where the value changes in some lanes.
    #[inline(always)]
    fn find_border(&mut self, simd: S, medium: &Medium, [from, to]: [[S::f32s; 3]; 2], lanes: S::mask32s) {
        let [first, second] = self.values;
        let differ = lanes & !first.simd_eq(second);
        if !differ.any_true() {
            return;
        }
        let mut border = self.border;
        let mut half = 0.25;
        for _ in 0..HALVINGS {
            let value = medium.volume.value_lanes(simd, between::<S>(from, to, border));
            border = value.simd_eq(first).select(border + half, border - half);
            half *= 0.5;
        }
        // No lane's bits may depend on what is in the others.
        self.border = differ.select(border, self.border);
        let [from, to] = self.opacities;
        let mean = (to.opacity - from.opacity).mul_add(-self.border + 1.0, from.opacity);
        self.mean = differ.select(mean, self.mean);
    }

    /// The smallest and the largest value between which all are that count.
    #[inline(always)]
    pub fn range(&self) -> [S::f32s; 2] {
        let [from, to] = self.values;
        let (mut least, mut most) = (from.min(to), from.max(to));
        if self.bent.any_true() {
            let [x, y, z] = self.bends.values;
            least = self.bent.select(least.min(x).min(y).min(z), least);
            most = self.bent.select(most.max(x).max(y).max(z), most);
        }
        [least, most]
    }

    /// Whether most of a lane's matter lies between the ends, so that light may reach it from either side.
    #[inline(always)]
    pub fn is_narrow(&self, lane: usize) -> bool {
        let [from, to] = self.opacities.map(|end| end.opacity.as_slice()[lane]);
        self.bent.test(lane) && self.mean.as_slice()[lane] > STEADY * from.max(to)
    }

    /// Where in a lane's step a share of its matter has been met.
    #[inline(always)]
    pub fn place(&self, medium: &Medium, lane: usize, share: f32) -> Between {
        let values = [self.values[0].as_slice()[lane], self.values[1].as_slice()[lane]];
        if self.bent.test(lane) {
            return self.bends.place(medium, lane, values, share);
        }
        if medium.interpolates {
            return medium.transfer.between(values, share);
        }
        let [from, to] = self.opacities;
        let opacities = [from.opacity.as_slice()[lane], to.opacity.as_slice()[lane]];
        Between::beside(values, opacities, self.border.as_slice()[lane], share)
    }
}

impl<S: Lanes> Bends<S> {
    /// [`StepEnds::place`] between given values at the ends.
    #[inline(always)]
    fn place(&self, medium: &Medium, lane: usize, [from, to]: [f32; 2], share: f32) -> Between {
        let [x, y, z] = &self.shares;
        let shares = [0.0, x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane], 1.0];
        let [x, y, z] = &self.values;
        let values = [from, x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane], to];
        place_in_parts(medium, shares, values, share)
    }
}

/// Where a share of the matter has been met on a way of several parts, from the shares of the way and the values at which they
/// begin and end.
#[cold]
fn place_in_parts(
    medium: &Medium,
    shares: [f32; PARTS + 1],
    values: [f32; PARTS + 1],
    share: f32,
) -> Between {
    let of = |i: usize| [values[i], values[i + 1]];
    let matter: [f32; PARTS] =
        std::array::from_fn(|i| (shares[i + 1] - shares[i]) * medium.transfer.mean_opacity(of(i)));
    let before: [f32; PARTS] = std::array::from_fn(|i| matter[..i].iter().sum());
    let wanted = share * matter.iter().sum::<f32>();
    // The last part that begins before it.
    let Some(i) = (0..PARTS).rev().find(|&i| matter[i] > 0.0 && before[i] <= wanted) else {
        return Between { share, value: values[0] };
    };
    let found = medium.transfer.between(of(i), ((wanted - before[i]) / matter[i]).min(1.0));
    Between { share: (shares[i + 1] - shares[i]).mul_add(found.share, shares[i]), ..found }
}

/// The share of the way along an axis at which the first border between voxels is crossed; 1 if there is none.
#[inline(always)]
fn crossing<S: Lanes>(simd: S, from: S::f32s, to: S::f32s) -> S::f32s {
    let one = S::f32s::splat(simd, 1.0);
    let way = to - from;
    let forward = way.simd_ge(one - one);
    let border = forward.select(from.floor() + 1.0, from.ceil() - 1.0);
    let share = (border - from) / way;
    share.simd_lt(one).select(share, one)
}

#[inline(always)]
fn between<S: Lanes>(from: [S::f32s; 3], to: [S::f32s; 3], share: S::f32s) -> [S::f32s; 3] {
    let ([x, y, z], [u, v, w]) = (from, to);
    [(u - x).mul_add(share, x), (v - y).mul_add(share, y), (w - z).mul_add(share, z)]
}

impl Medium {
    /// Mean opacity between two positions in index space, by the rule of [`StepEnds`].
    pub(super) fn mean_opacity(&self, [from, to]: [Vec3; 2]) -> f32 {
        let values = [from, to].map(|p| self.volume.value(p));
        let opacities = values.map(|value| self.transfer.opacity(value));
        if !self.interpolates {
            return 0.5 * (opacities[0] + opacities[1]);
        }
        let mean = self.transfer.mean_opacity(values);
        let most = mean.max(opacities[0]).max(opacities[1]);
        let least = mean.min(opacities[0]).min(opacities[1]);
        if most <= least * STEADY || self.transfer.is_edge(values) {
            return mean;
        }
        let way = to - from;
        let border = |x: f32, way: f32| if way >= 0.0 { x.floor() + 1.0 } else { x.ceil() - 1.0 };
        let crossing =
            |x: f32, way: f32| Some((border(x, way) - x) / way).filter(|&s| s < 1.0).unwrap_or(1.0);
        let mut shares = [crossing(from.x, way.x), crossing(from.y, way.y), crossing(from.z, way.z)];
        shares.sort_by(f32::total_cmp);
        let (mut before, mut share, mut mean) = (values[0], 0.0, 0.0);
        for here in shares.into_iter().chain([1.0]) {
            let value = self.volume.value(from + way * here);
            mean += (here - share) * self.transfer.mean_opacity([before, value]);
            (before, share) = (value, here);
        }
        mean
    }
}
