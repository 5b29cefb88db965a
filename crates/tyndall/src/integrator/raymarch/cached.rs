//! Light at positions in matter, with the shadows of a grid.

use super::light_points::{Arrivals, LightPoints};
use crate::integrator::shadow_grid::{Corners, ShadowGrid};
use crate::math::{Ray, Rgb, Vec3, cast};
use crate::medium::{PacketSample, RelativeGradient};
use crate::scattering::{Brdf, Event};
use crate::scene::Scene;
use crate::simd::{Lanes, MOST_LANES};
use fearless_simd::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Computes what positions send towards the camera.
pub(super) struct CachedLight<'a> {
    scene: &'a Scene,
    points: &'a LightPoints,
    grid: &'a ShadowGrid,
    space: Arrivals,
    /// See [`Shadows`].
    thickness: f32,
}

/// What is known of a position's shadows.
pub(in crate::integrator) struct Shadows<'a> {
    pub corners: Corners<'a>,
    /// Of the data, along the world's axes, as long as [`RelativeGradient::length`] says.
    pub gradient: Vec3,
    /// Optical thickness through a skin with a gradient of length 1, per unit of the grid's integrals.
    pub thickness: f32,
}

/// Smallest cosine between a direction and the gradient: rays closer to the skin of matter run along it.
const LEAST_COS: f32 = 0.25;

impl Shadows<'_> {
    /// Transmittance to light points, from number `first` on, in these directions.
    #[inline(always)]
    pub fn transmittance<S: Lanes>(&self, simd: S, first: usize, [x, y, z]: [S::f32s; 3]) -> S::f32s {
        let g = self.gradient;
        // By how much values grow away from the light.
        let slope = x * -g.x + y * -g.y + z * -g.z;
        let least = (LEAST_COS * g.length()).max(f32::MIN_POSITIVE);
        let slope = slope.abs().max(least).copysign(slope);
        self.corners.transmittance(simd, first, S::f32s::splat(simd, self.thickness) / slope)
    }
}

impl<'a> CachedLight<'a> {
    pub fn new(scene: &'a Scene, points: &'a LightPoints, grid: &'a ShadowGrid) -> Self {
        let (medium, space) = (&*scene.medium, points.arrivals());
        let per_value = f64::from(medium.density()) / medium.gradient_unit();
        let thickness = cast::single(per_value * grid.integral_unit().unwrap_or(0.0));
        Self { scene, points, grid, space, thickness }
    }

    /// Adds to the radiance of each lane what its position sends back along its ray, times `covered`; lanes that cover nothing are
    /// passed over.
    #[inline(always)]
    pub fn add<S: Lanes>(
        &mut self,
        simd: S,
        sample: &PacketSample<S>,
        covered: S::f32s,
        rays: &[Ray; MOST_LANES],
        radiance: &mut [Rgb; MOST_LANES],
    ) {
        let medium = &*self.scene.medium;
        let [gx, gy, gz] = medium.gradient_lanes(simd, sample.position);
        let [x, y, z] = &sample.position;
        for lane in 0..S::WIDTH {
            let covered = covered.as_slice()[lane];
            if covered <= 0.0 {
                continue;
            }
            let position = Vec3::new(x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane]);
            let value = sample.value.as_slice()[lane];
            let optics = medium.transfer().optics(value);
            let gradient = Vec3::new(gx.as_slice()[lane], gy.as_slice()[lane], gz.as_slice()[lane]);
            let event = medium.event_with(&optics, RelativeGradient::of(gradient));
            let here = medium.volume().grid().index_to_world(position);
            let arriving = self.points.arriving(here, &mut self.space);
            let corners = self.grid.around(position, value);
            let shadows = Shadows { corners, gradient, thickness: self.thickness };
            let count = self.points.vectors::<S>();
            let light = scattered(simd, &event, -rays[lane].direction, arriving, &shadows, count);
            radiance[lane] += (optics.emitted() + light) * covered;
        }
    }
}

/// Light that is scattered in direction `w_out`, per unit extinction.
#[inline(always)]
fn scattered<S: Lanes>(
    simd: S,
    event: &Event,
    w_out: Vec3,
    arriving: &Arrivals,
    shadows: &Shadows,
    vectors: usize,
) -> Rgb {
    let zero = S::f32s::splat(simd, 0.0);
    let normal = event.normal.filter(|_| event.q > 0.0);
    let is_glossy = normal.is_some() && event.brdf != Brdf::Lambert;
    // The normal on the camera's side.
    let side = normal.map_or(Vec3::ZERO, |n| n * 1.0_f32.copysign(n.dot(w_out)));
    let (mut by_matter, mut by_surface) = ([zero; 3], [zero; 3]);
    let mut glossy = Rgb::BLACK;
    for i in 0..vectors {
        let light = arriving.lanes(simd, i);
        let [dx, dy, dz] = light.direction;
        let kept = shadows.transmittance(simd, i * S::WIDTH, light.direction);
        let phase = event.phase.eval_between_lanes(simd, [-dx, -dy, -dz], w_out) * kept;
        let [r, g, b] = light.radiance;
        by_matter = [
            r.mul_add(phase, by_matter[0]),
            g.mul_add(phase, by_matter[1]),
            b.mul_add(phase, by_matter[2]),
        ];
        if is_glossy {
            for lane in 0..S::WIDTH {
                let (direction, radiance) = arriving.of(i * S::WIDTH + lane);
                let cos = direction.dot(side);
                let kept = kept.as_slice()[lane];
                if cos > 0.0 && kept > 0.0 && !radiance.is_black() {
                    glossy += event.brdf.eval(side, direction, w_out, &event.surface) * radiance * (cos * kept);
                }
            }
        } else if normal.is_some() {
            let cos = (dx * side.x + dy * side.y + dz * side.z).max(zero) * kept;
            by_surface =
                [r.mul_add(cos, by_surface[0]), g.mul_add(cos, by_surface[1]), b.mul_add(cos, by_surface[2])];
        }
    }
    let q = if normal.is_some() { event.q } else { 0.0 };
    let mut sum = event.surface.albedo * total::<S>(by_matter) * (1.0 - q);
    if is_glossy {
        sum += glossy * q;
    } else if q > 0.0 {
        sum += event.surface.albedo * total::<S>(by_surface) * (q * FRAC_1_PI);
    }
    sum
}

/// Sums of all lanes.
#[inline(always)]
fn total<S: Lanes>([r, g, b]: [S::f32s; 3]) -> Rgb {
    Rgb::new(sum::<S>(&r), sum::<S>(&g), sum::<S>(&b))
}

/// The sum of all lanes, four at a time.
#[inline(always)]
fn sum<S: Lanes>(lanes: &S::f32s) -> f32 {
    let mut sums = [0.0; 4];
    for four in lanes.as_slice().chunks_exact(4) {
        for (sum, x) in sums.iter_mut().zip(four) {
            *sum += x;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
