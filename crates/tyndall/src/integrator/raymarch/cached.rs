//! Light at positions in matter, with the shadows of a grid.

use super::light_points::{Arrivals, LightPoints};
use crate::integrator::shadow_grid::{Corners, ShadowGrid};
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::{PacketSample, SeenLanes};
use crate::scattering::{Brdf, Event, Surface};
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
        let lanes = covered.simd_gt(S::f32s::splat(simd, 0.0));
        for site in 0..PacketSample::<S>::SITES {
            if let Some(seen) = sample.seen(simd, &self.scene.medium, lanes, site) {
                self.add_seen(simd, &seen, covered * seen.weight, rays, radiance);
            }
        }
    }

    /// [`Self::add`] for one site of each lane's step.
    #[inline(always)]
    fn add_seen<S: Lanes>(
        &mut self,
        simd: S,
        seen: &SeenLanes<S>,
        covered: S::f32s,
        rays: &[Ray; MOST_LANES],
        radiance: &mut [Rgb; MOST_LANES],
    ) {
        let medium = &*self.scene.medium;
        let edges = medium.edges_lanes(simd, seen.position);
        let places = self.grid.places(simd, seen.position);
        let vectors = self.points.vectors::<S>();
        let [nx, ny, nz] = &edges.normal;
        for lane in 0..S::WIDTH {
            let covered = covered.as_slice()[lane];
            if covered <= 0.0 {
                continue;
            }
            let optics = medium.transfer().optics(seen.value.as_slice()[lane]);
            let q = optics.surface * edges.share.as_slice()[lane];
            let normal = Vec3::new(nx.as_slice()[lane], ny.as_slice()[lane], nz.as_slice()[lane]);
            let event = Event {
                phase: medium.phase(),
                brdf: medium.brdf(),
                surface: Surface {
                    albedo: optics.albedo,
                    specular: optics.specular,
                    roughness: optics.roughness,
                },
                normal: (q > 0.0).then_some(normal),
                q,
            };
            let grid = medium.volume().grid();
            let arriving = self.points.arriving(grid, seen.position(lane), &mut self.space);
            let corners = self.grid.corners(&places, lane);
            let light = scattered(simd, &event, -rays[lane].direction, arriving, &corners, vectors);
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
    let Event { phase, brdf, surface, normal, q } = *event;
    let q = if normal.is_some() { q } else { 0.0 };
    let is_glossy = q > 0.0 && brdf != Brdf::Lambert;
    // The normal on the camera's side.
    let side = normal.map_or(Vec3::ZERO, |n| n * 1.0_f32.copysign(n.dot(w_out)));
    // What scatters evenly shares the albedo.
    let (by_matter, by_surface) = (1.0 - q, if is_glossy { 0.0 } else { q * FRAC_1_PI });
    let mut even = [zero; 3];
    let mut glossy = Rgb::BLACK;
    for i in 0..vectors {
        let light = arriving.lanes(simd, i);
        let [dx, dy, dz] = light.direction;
        let kept = shadows.transmittance(simd, i * S::WIDTH);
        let mut scattered = phase.eval_between_lanes(simd, [-dx, -dy, -dz], w_out) * by_matter;
        if by_surface > 0.0 {
            let cos = dx.mul_add(side.x, dy.mul_add(side.y, dz * side.z));
            scattered = cos.max(zero).mul_add(by_surface, scattered);
        }
        let scattered = scattered * kept;
        let [r, g, b] = light.radiance;
        even = [r.mul_add(scattered, even[0]), g.mul_add(scattered, even[1]), b.mul_add(scattered, even[2])];
        if is_glossy {
            for lane in 0..S::WIDTH {
                let (direction, radiance) = arriving.of(i * S::WIDTH + lane);
                let cos = direction.dot(side);
                let kept = kept.as_slice()[lane];
                if cos > 0.0 && kept > 0.0 && !radiance.is_black() {
                    glossy += brdf.eval(side, direction, w_out, &surface) * radiance * (cos * kept);
                }
            }
        }
    }
    let [r, g, b] = even;
    surface.albedo * Rgb::new(sum::<S>(r), sum::<S>(g), sum::<S>(b)) + glossy * q
}

/// The sum of all lanes, by halves.
#[inline(always)]
fn sum<S: Lanes>(lanes: S::f32s) -> f32 {
    let mut all = [0.0; MOST_LANES];
    lanes.store_slice(&mut all[..S::WIDTH]);
    let mut eight = [0.0; 8];
    for i in 0..8 {
        eight[i] = all[i] + all[i + 8];
    }
    let mut four = [0.0; 4];
    for i in 0..4 {
        four[i] = eight[i] + eight[i + 4];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}
