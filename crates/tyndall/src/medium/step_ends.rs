//! The two ends of a step, and what lies between them.

use super::Medium;
use super::site::{Piece, Site, between_values, share_of_line};
use crate::simd::Lanes;
use crate::transfer::OpacityLanes;
use fearless_simd::prelude::*;

/// Halvings of a step in the search for the border between two voxels that are not interpolated.
const HALVINGS: usize = 6;

/// Values inside a step are read if the largest of three opacities, at its two ends and on average between them, is more than this many
/// times the smallest. Where opacity changes less, it matters little how the values get from one end to the other.
pub(super) const STEADY: f32 = 2.0;

/// Planes through voxel centres that a step crosses, at which the trilinear field bends: the first along each axis. Steps are shorter than
/// a voxel unless voxels are flat or `step` is large; later bends are then missed.
const BENDS: usize = 3;
/// The pieces that they divide a step into.
const PIECES: usize = BENDS + 1;

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

/// Where a step crosses planes through voxel centres, nearest first. Between two of them the field is smooth, and nearly linear.
struct Bends<S: Lanes> {
    /// As shares of the step; 1 in place of planes that it does not cross.
    shares: [S::f32s; BENDS],
    values: [S::f32s; BENDS],
}

impl<S: Lanes> StepEnds<S> {
    /// With the values at the ends, between which there are others if they are interpolated.
    #[inline(always)]
    pub fn new(simd: S, interpolates: bool, values: [S::f32s; 2], opacities: [OpacityLanes<S>; 2]) -> Self {
        let [from, to] = opacities;
        let half = S::f32s::splat(simd, 0.5);
        let bends = Bends { shares: [half; BENDS], values: [values[0]; BENDS] };
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

    /// Lanes with different values at the ends.
    #[inline(always)]
    pub fn differ(&self) -> S::mask32s {
        let [from, to] = self.values;
        !from.simd_eq(to)
    }

    /// Lanes in which opacity varies along the step, and is not slight.
    #[inline(always)]
    pub fn vary_above(&self, slight: f32) -> S::mask32s {
        let [from, to] = self.opacities;
        self.vary() & self.mean.max(from.opacity).max(to.opacity).simd_gt(slight)
    }

    /// Reads values inside some lanes' steps, between two positions in index space.
    #[inline(always)]
    pub fn refine(&mut self, simd: S, medium: &Medium, positions: [[S::f32s; 3]; 2], lanes: S::mask32s) {
        if lanes.any_true() {
            self.refine_apart(simd, medium, &positions, lanes);
        }
    }

    /// [`Self::refine`] as a function of its own for each level: compiled into every march, it would be most of them.
    #[inline(never)]
    fn refine_apart(&mut self, simd: S, medium: &Medium, positions: &[[S::f32s; 3]; 2], lanes: S::mask32s) {
        simd.vectorize(
            #[inline(always)]
            || {
                if medium.interpolates {
                    let [from, to] = self.opacities;
                    self.bend(simd, medium, *positions, lanes & !from.is_edge(simd, to));
                } else {
                    self.find_border(simd, medium, *positions, lanes);
                }
            },
        );
    }

    /// Reads the values where the field bends, in some lanes.
    #[inline(always)]
    fn bend(&mut self, simd: S, medium: &Medium, [from, to]: [[S::f32s; 3]; 2], bent: S::mask32s) {
        let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
        let [x, y, z] =
            [crossing(simd, from[0], to[0]), crossing(simd, from[1], to[1]), crossing(simd, from[2], to[2])];
        let (x, y) = (x.min(y), x.max(y));
        let (y, z) = (y.min(z), y.max(z));
        let (x, y) = (x.min(y), x.max(y));
        self.bends.shares = [x, y, z];
        let [first, last] = self.opacities;
        let (mut before, mut share) = (first, zero);
        let mut mean = share;
        for i in 0..BENDS {
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

    /// Where in their steps some lanes have met a share of the matter.
    #[inline(always)]
    pub fn site(&self, simd: S, medium: &Medium, share: S::f32s, lanes: S::mask32s) -> Site<S> {
        let [from, to] = self.opacities;
        let [first, second] = self.values;
        let at = share_of_line(simd, [from.opacity, to.opacity], share);
        let mut site = Site { share: at, value: between_values::<S>(first, second, at) };
        // Where the value changes from one to the other at once.
        let jumps = if medium.interpolates { from.is_edge(simd, to) } else { S::mask32s::splat(simd, true) };
        if jumps.any_true() {
            site = self.site_beside(simd, share).or(jumps, site);
        }
        let bent = self.bent & lanes;
        if bent.any_true() {
            site = self.site_between(simd, medium, share).or(bent, site);
        }
        site
    }

    /// [`Self::site`] where the first value holds up to the border, and the second after it.
    #[inline(always)]
    fn site_beside(&self, simd: S, share: S::f32s) -> Site<S> {
        let (from, to) = (self.opacities[0].opacity, self.opacities[1].opacity);
        let zero = S::f32s::splat(simd, 0.0);
        let border = self.border;
        let (first, second) = (from * border, to * (-border + 1.0));
        let wanted = share * (first + second);
        let is_first = wanted.simd_lt(first) | second.simd_le(zero);
        let in_first = first.simd_gt(zero).select(border * (wanted / first), share);
        let in_second = (-border + 1.0).mul_add((wanted - first) / second, border);
        let [from, to] = self.values;
        Site { share: is_first.select(in_first, in_second), value: is_first.select(from, to) }
    }

    /// [`Self::site`] with the values where the field bends. A function of its own, since it is rarely needed.
    #[inline(never)]
    fn site_between(&self, simd: S, medium: &Medium, share: S::f32s) -> Site<S> {
        simd.vectorize(
            #[inline(always)]
            || self.piece_with(simd, medium, share).search(simd, medium),
        )
    }

    /// The piece of the step in which a share of its matter is met.
    #[inline(always)]
    fn piece_with(&self, simd: S, medium: &Medium, share: S::f32s) -> Piece<S> {
        let zero = S::f32s::splat(simd, 0.0);
        let one = S::f32s::splat(simd, 1.0);
        let [x, y, z] = self.bends.values;
        let [first, last] = self.opacities;
        let mut opacities = [first, first, first, first, last];
        for i in 0..BENDS {
            opacities[i + 1] = medium.transfer.read_lanes(simd, self.bends.values[i]);
        }
        let values = [self.values[0], x, y, z, self.values[1]];
        let [x, y, z] = self.bends.shares;
        let shares = [zero, x, y, z, one];
        let mut matter = [zero; PIECES];
        let mut total = zero;
        for i in 0..PIECES {
            matter[i] = (shares[i + 1] - shares[i]) * opacities[i].mean(simd, opacities[i + 1]);
            total += matter[i];
        }
        let wanted = share * total;
        let mut piece =
            Piece { shares: [share; 2], values: [values[0]; 2], opacities: [first; 2], met: zero };
        let mut before = zero;
        for i in 0..PIECES {
            // The last piece that begins before it.
            let here = matter[i].simd_gt(zero) & before.simd_le(wanted);
            for end in 0..2 {
                piece.shares[end] = here.select(shares[i + end], piece.shares[end]);
                piece.values[end] = here.select(values[i + end], piece.values[end]);
                piece.opacities[end] = opacities[i + end].or(here, piece.opacities[end]);
            }
            piece.met = here.select(((wanted - before) / matter[i]).min(one), piece.met);
            before += matter[i];
        }
        piece
    }
}

/// The share of the way along an axis at which the first plane through voxel centres is crossed; 1 if there is none.
#[inline(always)]
fn crossing<S: Lanes>(simd: S, from: S::f32s, to: S::f32s) -> S::f32s {
    let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
    let way = to - from;
    let forward = way.simd_ge(zero);
    let border = forward.select(from.floor() + 1.0, from.ceil() - 1.0);
    let share = (border - from) / way;
    share.simd_lt(one).select(share, one)
}

#[inline(always)]
fn between<S: Lanes>(from: [S::f32s; 3], to: [S::f32s; 3], share: S::f32s) -> [S::f32s; 3] {
    let ([x, y, z], [u, v, w]) = (from, to);
    [(u - x).mul_add(share, x), (v - y).mul_add(share, y), (w - z).mul_add(share, z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec3, cast};
    use crate::medium::MediumSettings;
    use crate::simd::{Kernel, Level};
    use crate::transfer::{Optics, Point, TransferFunction};
    use crate::volume::{Grid, Interpolation, ValueMap, Volume, Voxels};
    use std::sync::Arc;
    use tyndall_testing::SplitMix;

    /// Random values from 0 to 255 and peaks from narrow to wide.
    fn medium(random: &mut SplitMix, interpolation: Interpolation) -> Medium {
        let grid = Grid::centred([6; 3], [1.0; 3]).unwrap();
        let voxels = Voxels::U8((0..216).map(|_| random.bits().to_le_bytes()[0]).collect());
        let volume = Volume::new(grid, voxels, ValueMap::IDENTITY).unwrap().with_interpolation(interpolation);
        let point =
            |value: f32, opacity: f32| Point { value, optics: Optics { opacity, ..Optics::default() } };
        let points = vec![
            point(20.0, 0.0),
            point(60.0, 0.3),
            point(100.0, 0.02),
            point(128.0, 0.02),
            point(130.0, 0.9),
            point(133.0, 0.02),
            point(200.0, 0.1),
            point(200.0, 1.0),
        ];
        let transfer = TransferFunction::for_volume(&volume, points).unwrap();
        let settings = MediumSettings::plain(1.0);
        Medium::new(Arc::new(volume), Arc::new(transfer), &settings)
    }

    /// Mean opacity, share and value of steps given by their ends, and the range of values in them.
    struct Found<'a>(&'a Medium, &'a [[Vec3; 2]], f32);

    impl Kernel for Found<'_> {
        type Output = Vec<[f32; 5]>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<[f32; 5]> {
            let Self(medium, steps, share) = self;
            let mut found = Vec::new();
            for steps in steps.chunks_exact(S::WIDTH) {
                let along = |end: usize, axis: usize| S::f32s::from_fn(simd, |lane| steps[lane][end][axis]);
                let positions = [0, 1].map(|end| [along(end, 0), along(end, 1), along(end, 2)]);
                let values = positions.map(|position| medium.volume.value_lanes(simd, position));
                let opacities = values.map(|value| medium.transfer.read_lanes(simd, value));
                let mut ends = StepEnds::new(simd, medium.interpolates, values, opacities);
                let all = S::mask32s::splat(simd, true);
                let lanes = if medium.interpolates { all } else { ends.differ() };
                ends.refine(simd, medium, positions, lanes);
                let met = ends.site(simd, medium, S::f32s::splat(simd, share), all);
                for lane in 0..S::WIDTH {
                    let [least, most] = ends.range();
                    let lanes = [&ends.mean, &met.share, &met.value, &least, &most];
                    found.push(lanes.map(|lanes| lanes.as_slice()[lane]));
                }
            }
            found
        }
    }

    /// Steps of half a voxel along an axis, on which interpolated values change linearly between borders of voxels.
    fn steps(random: &mut SplitMix) -> Vec<[Vec3; 2]> {
        (0..160)
            .map(|i| {
                let from = Vec3::from_array(random.uniforms()) * 4.0 + 0.5;
                let mut to = from;
                to[i % 3] += if i % 2 == 0 { 0.5 } else { -0.5 };
                [from, to]
            })
            .collect()
    }

    #[test]
    fn a_step_has_the_mean_opacity_of_its_line_and_is_met_where_that_says() {
        const PARTS: u16 = 4000;
        let mut random = SplitMix::new(94);
        for interpolation in [Interpolation::Linear, Interpolation::Nearest] {
            let medium = medium(&mut random, interpolation);
            let steps = steps(&mut random);
            for share in [0.1, 0.5, 0.8] {
                for level in Level::available() {
                    let found = level.run(Found(&medium, &steps, share));
                    assert_eq!(found.len(), steps.len());
                    for (&[from, to], [mean, met, value, least, most]) in steps.iter().zip(found) {
                        let at = |i: f32| medium.volume.value(from + (to - from) * (i / f32::from(PARTS)));
                        let opacities: Vec<f64> = (0..PARTS)
                            .map(|i| f64::from(medium.transfer.opacity(at(f32::from(i) + 0.5))))
                            .collect();
                        let expected = opacities.iter().sum::<f64>() / f64::from(PARTS);
                        let is_noted = |value: f32| least - 0.01 <= value && value <= most + 0.01;
                        assert!(
                            (0..PARTS).all(|i| is_noted(at(f32::from(i)))),
                            "{least} to {most}, {level:?}"
                        );
                        let off = (f64::from(mean) - expected).abs();
                        // A border between voxels is found to a 128th of a step, on which opacity may rise to 1.
                        let near = if medium.interpolates { 0.002 } else { 0.008 };
                        assert!(off < near, "{mean} for {expected}, {level:?}");
                        let before = opacities.iter().take(cast::index(met * f32::from(PARTS))).sum::<f64>();
                        let before = before / f64::from(PARTS) / expected.max(1e-9);
                        let apart = (before - f64::from(share)).abs();
                        // Within one part of the step opacity may jump.
                        assert!(
                            expected < 1e-3 || apart < 0.03 || !medium.interpolates && apart < 0.1,
                            "{before} is met where {share} should be, from {from} to {to}, {level:?}"
                        );
                        let there = at(met * f32::from(PARTS));
                        let beside = !medium.interpolates
                            && [from, to].iter().any(|&end| medium.volume.value(end) == value);
                        assert!((value - there).abs() < 0.5 || beside, "{value} for {there}, {level:?}");
                    }
                }
            }
        }
    }
}
