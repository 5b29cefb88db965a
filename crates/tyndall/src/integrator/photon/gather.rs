//! The radiance estimate from photons around a position \[Jonsson12, eq. 8\].

use super::gathering::Gathering;
use super::kernel::{Ball, GatherRegion, Slice};
use super::map::PhotonMap;
use super::matter::Matter;
use super::settings::Estimator;
use crate::integrator::cells::CellGrid;
use crate::math::{PackedDirection, Rgb, Vec3};
use crate::medium::{MarchNotes, Medium};
use crate::scattering::{Brdf, Event, Phase};
use crate::simd::{Lanes, unpack_directions};
use fearless_simd::prelude::*;
use std::f32::consts::{FRAC_1_PI, PI};
use std::ops::Range;

/// Light that a position scatters to the viewer, times the share that the viewer sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scattered {
    /// To be multiplied by the albedo; if it can be gathered again, with where that is.
    Plain(Rgb, Option<GatherSite>),
    /// By a glossy surface, whose albedo is not a factor.
    Glossy(Rgb),
}

/// What a point estimate depends on besides photons and the optics at its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GatherSite {
    /// Index space.
    position: Vec3,
    /// See [`Gathering::weight`].
    weight: f32,
    /// See [`Gathering::opacity`].
    most_opacity: f32,
    /// See [`Matter`].
    slope: Vec3,
    opacity: f32,
    /// See [`Ball::flattening`].
    axis: Vec3,
    share: f32,
    /// Zero where there is no surface.
    normal: Vec3,
    /// The share of the surface.
    q: f32,
}

impl PhotonMap {
    /// Light from all directions that a position scatters to the viewer. `notes` records the values that are read
    /// around the position.
    #[inline(always)]
    pub fn scattered<S: Lanes>(
        &self,
        simd: S,
        medium: &Medium,
        at: &Gathering,
        distances: &mut Vec<f32>,
        notes: &mut impl MarchNotes<S>,
    ) -> Scattered {
        let (points, number) = (&self.points, number_of(at.position));
        match self.estimate {
            Estimator::Point => {
                let ball = Ball::new(1.0, number, points);
                let (ball, matter) = self.fit(simd, medium, at, ball, notes);
                match self.within(simd, at, &ball, &matter) {
                    Scattered::Plain(light, _) => {
                        Scattered::Plain(light, Some(GatherSite::new(at, &ball, &matter)))
                    }
                    glossy @ Scattered::Glossy(_) => glossy,
                }
            }
            Estimator::Nearest(count) => {
                let radius = self.radius_of(simd, at, count as usize, distances);
                let ball = Ball::new(radius, number, points);
                let (ball, matter) = self.fit(simd, medium, at, ball, notes);
                self.within(simd, at, &ball, &matter)
            }
            Estimator::Beam => {
                let slice = Slice::new(at.width / self.radius, -at.w_out, number, points);
                let (slice, matter) = self.fit(simd, medium, at, slice, notes);
                self.within(simd, at, &slice, &matter)
            }
        }
    }

    /// Half of the width over which values spread between the points that look for matter around a position, or 0 where opacity changes
    /// so slowly with the value that points stand for what is between them.
    #[inline(always)]
    pub fn half_spread<S: Lanes>(&self, simd: S, medium: &Medium, position: Vec3) -> f32 {
        let edges = between_points(&self.grid);
        if !medium.may_peak_within(NARROW * edges.max_element()) {
            return 0.0;
        }
        let Vec3 { x, y, z } = position;
        let position = [S::f32s::splat(simd, x), S::f32s::splat(simd, y), S::f32s::splat(simd, z)];
        medium.half_spread(simd, position, edges.to_array()).as_slice()[0]
    }

    /// The light at a site with this data value, still to be multiplied by the albedo: equal to the last bit to that of
    /// [`Self::scattered`].
    #[inline(always)]
    pub fn scattered_again<S: Lanes>(
        &self,
        simd: S,
        medium: &Medium,
        site: &GatherSite,
        value: f32,
        w_out: Vec3,
    ) -> Rgb {
        let GatherSite { position, weight, most_opacity, slope, opacity, axis, share, normal, q } = *site;
        let optics = medium.transfer().optics(value);
        let event = medium.event_at_surface(&optics, (q > 0.0).then_some(normal), q);
        let at = Gathering {
            position,
            opacity: most_opacity,
            mean: most_opacity,
            half_spread: 0.0,
            event,
            w_out,
            width: 0.0,
            weight,
            lane: 0,
        };
        let matter = Matter { opacity, slope, lean: Vec3::ZERO };
        match self.within(simd, &at, &Ball::flat(axis, share, &self.points), &matter) {
            Scattered::Plain(light, _) | Scattered::Glossy(light) => light,
        }
    }

    /// Fits the matter about a position, and a region to it.
    #[inline(always)]
    fn fit<S: Lanes, R: GatherRegion>(
        &self,
        simd: S,
        medium: &Medium,
        at: &Gathering,
        mut kernel: R,
        notes: &mut impl MarchNotes<S>,
    ) -> (R, Matter) {
        let index = self.grid.index_per_metric();
        let mut matter = Matter::about(simd, medium, at, index, &kernel, notes);
        // The radius in world units, divided by the mean free path.
        let thickness = self.radius * medium.density() * at.mean;
        if let Some((axis, share)) = flat_skin(matter.lean, kernel.radius(), thickness) {
            kernel = kernel.flattened(axis, share);
            matter = Matter::about(simd, medium, at, index, &kernel, notes);
        }
        (kernel, matter)
    }

    /// The estimate from the photons in a region.
    #[inline(always)]
    fn within<S: Lanes, R: GatherRegion>(
        &self,
        simd: S,
        at: &Gathering,
        kernel: &R,
        matter: &Matter,
    ) -> Scattered {
        if matter.opacity <= 0.0 {
            return Scattered::Plain(Rgb::BLACK, None);
        }
        let (q, slope) = (self.grid.to_metric(at.position), matter.slope);
        let own = S::f32s::splat(simd, at.opacity);
        let one = S::f32s::splat(simd, 1.0);
        let mut sum = Sum::new(simd, at);
        let number = S::f32s::from_fn(simd, |lane| lane as f32);
        let [x, [y0, y1], [z0, z1]] = self.grid.around(q, kernel.reach());
        for z in z0..=z1 {
            for y in y0..=y1 {
                let Range { start: mut i, end } = self.row(x, y, z);
                while i < end {
                    let [dx, dy, dz] = self.apart(simd, q, i);
                    let there = number.simd_lt(S::f32s::splat(simd, (end - i) as f32));
                    let near = kernel.holds(simd, [dx, dy, dz]) & there;
                    if near.any_true() {
                        let linear = -(dx * slope.x + dy * slope.y + dz * slope.z) + 1.0;
                        let share = (load(simd, &self.per_opacity, i) * own).min(one);
                        sum.add(self, i, near, linear * share);
                    }
                    i += S::WIDTH;
                }
            }
        }
        let light = sum.total() / (kernel.volume() * matter.opacity);
        // The quotient overflows single precision only in matter so thin that it is invisible.
        let light = if light.is_finite() { light * at.weight } else { Rgb::BLACK };
        if let Scattering::Glossy = sum.kind {
            Scattered::Glossy(light)
        } else {
            Scattered::Plain(light, None)
        }
    }

    /// Photons from the `i`-th on, relative to a metric position.
    #[inline(always)]
    fn apart<S: Lanes>(&self, simd: S, q: Vec3, i: usize) -> [S::f32s; 3] {
        [load(simd, &self.x, i) - q.x, load(simd, &self.y, i) - q.y, load(simd, &self.z, i) - q.z]
    }

    /// Distance of the `count`-th nearest photon, at most the radius, in units of the radius. The estimate uses only
    /// nearer photons, which makes it unbiased where photons are evenly distributed.
    #[inline(always)]
    fn radius_of<S: Lanes>(&self, simd: S, at: &Gathering, count: usize, distances: &mut Vec<f32>) -> f32 {
        let q = self.grid.to_metric(at.position);
        distances.clear();
        let [x, [y0, y1], [z0, z1]] = self.grid.around(q, Vec3::ONE);
        for z in z0..=z1 {
            for y in y0..=y1 {
                let Range { start: mut i, end } = self.row(x, y, z);
                while i < end {
                    let [dx, dy, dz] = self.apart(simd, q, i);
                    let squared = dx * dx + dy * dy + dz * dz;
                    let inside = squared.as_slice().iter().take(end - i).filter(|&&d| d < 1.0);
                    distances.extend(inside);
                    i += S::WIDTH;
                }
            }
        }
        if distances.len() < count {
            return 1.0;
        }
        let (_, nth, _) = distances.select_nth_unstable_by(count - 1, f32::total_cmp);
        // Photons may be exactly at the position; a sphere must not be empty.
        nth.sqrt().max(1e-3)
    }
}

/// Share of the distance between points below which a peak of opacity is so narrow that they miss it: of wider ones they see enough.
pub(super) const NARROW: f32 = 0.25;

/// Distances in voxels, along each axis of index space, between the points that look for matter in a region.
pub(super) fn between_points(grid: &CellGrid) -> Vec3 {
    /// In radii: the edge of a cube of a seventeenth of a ball.
    const EDGE: f32 = 0.63;
    let rows = grid.index_per_metric().transpose();
    Vec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()) * EDGE
}

impl GatherSite {
    /// Of a gather in a ball.
    fn new(at: &Gathering, ball: &Ball, matter: &Matter) -> Self {
        let (axis, share) = ball.flattening();
        Self {
            position: at.position,
            weight: at.weight,
            most_opacity: at.opacity,
            slope: matter.slope,
            opacity: matter.opacity,
            axis,
            share,
            normal: at.event.normal.unwrap_or(Vec3::ZERO),
            q: if at.event.is_surface() { at.event.q } else { 0.0 },
        }
    }
}

/// A pseudo-random number that depends on the position alone.
#[inline(always)]
fn number_of(position: Vec3) -> usize {
    let mixed = |hash: u32, x: f32| (hash ^ x.to_bits()).wrapping_mul(0x9e37_79b9).rotate_left(15);
    position.to_array().into_iter().fold(0, mixed) as usize
}

/// Optical depth over which fluence decreases approximately linearly.
const MOST_THICK: f32 = 1.5;

/// At a boundary of matter, the matter's mean position is displaced by at least this share of the radius.
const LEAN_OF_SKIN: f32 = 0.1;

/// The axis along which a gather is flattened, and to what share of its radius: at the surface of matter so dense that
/// little light penetrates as deep as the radius. `thickness` is the optical depth of the map's radius.
#[inline(always)]
fn flat_skin(lean: Vec3, radius: f32, thickness: f32) -> Option<(Vec3, f32)> {
    let thickness = thickness * radius;
    if thickness <= MOST_THICK {
        return None;
    }
    let skin = (lean.length() / (LEAN_OF_SKIN * radius)).min(1.0);
    let share = 1.0 - skin * (1.0 - MOST_THICK / thickness);
    lean.try_normalize().map(|axis| (axis, share))
}

#[inline(always)]
fn load<S: Lanes>(simd: S, numbers: &[f32], i: usize) -> S::f32s {
    S::f32s::from_slice(simd, &numbers[i..i + S::WIDTH])
}

/// The sum over photons, each weighted by the scattering function.
struct Sum<'a, S: Lanes> {
    simd: S,
    event: &'a Event,
    w_out: Vec3,
    kind: Scattering,
    /// Still to be multiplied by the albedo.
    lanes: [S::f32s; 3],
    /// Of glossy surfaces.
    glossy: Rgb,
}

/// How a photon's weight depends on its direction.
#[derive(Clone, Copy, Debug)]
enum Scattering {
    /// Not at all: isotropic scattering.
    Even,
    /// By the phase function and, at a diffuse surface, by the cosine on the viewer's side: the surface's share and its
    /// normal.
    Smooth(f32, Vec3),
    /// By any BRDF.
    Glossy,
}

impl<'a, S: Lanes> Sum<'a, S> {
    #[inline(always)]
    fn new(simd: S, at: &'a Gathering) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        let (event, w_out) = (&at.event, at.w_out);
        let kind = match (event.normal, event.brdf, event.phase) {
            (Some(normal), Brdf::Lambert, _) if event.is_surface() => {
                let cos = normal.dot(w_out);
                Scattering::Smooth(
                    event.q,
                    if cos == 0.0 { Vec3::ZERO } else { normal * 1.0_f32.copysign(cos) },
                )
            }
            _ if event.is_surface() => Scattering::Glossy,
            (_, _, Phase::Isotropic) => Scattering::Even,
            _ => Scattering::Smooth(0.0, Vec3::ZERO),
        };
        Self { simd, event, w_out, kind, lanes: [zero; 3], glossy: Rgb::BLACK }
    }

    #[inline(always)]
    fn add(&mut self, map: &PhotonMap, i: usize, near: S::mask32s, weight: S::f32s) {
        let simd = self.simd;
        let zero = S::f32s::splat(simd, 0.0);
        let scattered = match self.kind {
            Scattering::Even => S::f32s::splat(simd, 1.0 / (4.0 * PI)),
            Scattering::Smooth(q, normal) => {
                let words = S::u32s::from_slice(simd, &map.directions[i..i + S::WIDTH]);
                let [x, y, z] = unpack_directions(simd, words);
                let phase = self.event.phase.eval_between_lanes(simd, [x, y, z], self.w_out) * (1.0 - q);
                // The incident direction is opposite to the photon's direction of travel.
                let cos = (-(x * normal.x + y * normal.y + z * normal.z)).max(zero);
                cos * (q * FRAC_1_PI) + phase
            }
            Scattering::Glossy => return self.add_glossy(map, i, near.select(weight, zero)),
        };
        let weight = near.select(weight * scattered, zero);
        let [red, green, blue] = self.lanes;
        self.lanes = [
            load(simd, &map.red, i).mul_add(weight, red),
            load(simd, &map.green, i).mul_add(weight, green),
            load(simd, &map.blue, i).mul_add(weight, blue),
        ];
    }

    /// Adds photons one by one.
    #[inline(always)]
    fn add_glossy(&mut self, map: &PhotonMap, first: usize, weights: S::f32s) {
        for (i, &weight) in (first..).zip(weights.as_slice()) {
            if weight != 0.0 {
                let w_in = -PackedDirection::from_word(map.directions[i]).unpack();
                let flux = Rgb::new(map.red[i], map.green[i], map.blue[i]);
                self.glossy += self.event.eval(self.w_out, w_in) * flux * weight;
            }
        }
    }

    #[inline(always)]
    fn total(&self) -> Rgb {
        let [red, green, blue] = self.lanes;
        let sum = Rgb::new(total(red.as_slice()), total(green.as_slice()), total(blue.as_slice()));
        sum + self.glossy
    }
}

#[inline(always)]
fn total(lanes: &[f32]) -> f32 {
    lanes.iter().sum()
}
