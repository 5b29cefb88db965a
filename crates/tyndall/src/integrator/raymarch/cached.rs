//! Light at positions in matter, with the shadows of a grid.

use super::light_points::{Arrivals, LightPoints};
use crate::integrator::shadow_grid::{Corners, ShadowGrid};
use crate::math::{Ray, Rgb, Vec3};
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
}

impl<'a> CachedLight<'a> {
    pub fn new(scene: &'a Scene, points: &'a LightPoints, grid: &'a ShadowGrid) -> Self {
        Self { scene, points, grid, space: points.arrivals() }
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
            let corners = self.grid.around(position);
            let count = self.points.vectors::<S>();
            let light = scattered(simd, &event, -rays[lane].direction, arriving, &corners, count);
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
    shadows: &Corners,
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
        let kept = shadows.transmittance(simd, i * S::WIDTH);
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
