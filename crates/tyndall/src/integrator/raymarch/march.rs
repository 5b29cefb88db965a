//! Marching along packets of view rays, with shadow rays from positions in matter.

use super::Settings;
use super::cached::CachedLight;
use super::light_points::points_on_lights;
use super::shadows::CachedShadows;
use crate::film::{Goal, PixelSample, Tile};
use crate::integrator::Stop;
use crate::integrator::view_march::{Coverage, OPAQUE, Shader, composite};
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::{PacketMarch, PacketSample, Track, TrackStart};
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes, Level, MOST_LANES};
use fearless_simd::prelude::*;

/// The ray marcher with its fixed sample points on lights.
#[derive(Debug)]
pub struct RayMarch {
    /// World units.
    pub(super) step: f32,
    /// Points in the unit square, the same for every shaded position.
    light_points: Vec<[f32; 2]>,
    /// `None` if every shadow ray is marched.
    pub(super) shadows: Option<CachedShadows>,
    pub(super) level: Level,
}

impl RayMarch {
    /// For a scene, with these vector instructions.
    #[must_use]
    pub fn of_scene(scene: &Scene, settings: &Settings, level: Level) -> Self {
        let Settings { step, light_samples, .. } = *settings;
        let light_points = points_on_lights(light_samples as usize);
        let shadows = CachedShadows::of_scene(scene, settings);
        Self { step: step * scene.medium.volume().grid().voxel_size(), light_points, shadows, level }
    }

    /// Adds rays to the pixels of a tile until it reaches the goal; see [`crate::integrator::Method::refine`].
    pub(super) fn refine_tile(
        &self,
        scene: &Scene,
        tile: &mut Tile,
        pending: &mut Option<Box<Packet>>,
        goal: Goal,
        stop: &Stop,
    ) {
        self.level.run(MarchPixels { raymarch: self, scene, tile, pending, goal, stop });
    }

    /// The radiance that arrives along a world ray, with exact shadows.
    #[must_use]
    pub fn march(&self, scene: &Scene, ray: &Ray) -> PixelSample {
        self.level.run(MarchOne { raymarch: self, scene, packet: Packet::new(scene, [*ray].into_iter()) })
    }

    /// A pixel's `sample`-th ray. Samples vary only the position in the pixel and on the lens; the first goes through
    /// the middle of the pixel.
    pub(super) fn ray(scene: &Scene, [x, y]: [u32; 2], sample: u32) -> Ray {
        let [in_x, in_y] = spread(sample);
        let film = [x as f32 + in_x, y as f32 + in_y];
        // Lens points have their own lattice, shifted per pixel so that defocus shows as grain, not as ghost images.
        let [turn_x, turn_y] = spread(y.wrapping_mul(7919).wrapping_add(x));
        let [u, v] = spread(sample.wrapping_mul(3));
        scene.camera.ray(scene.size, film, [(u + turn_x).fract(), (v + turn_y).fract()])
    }

    /// Marches a packet to its end, or until a stop, but for at least one shadow ray or position; returns whether it has
    /// ended.
    #[inline(always)]
    fn go_on<S: Lanes>(
        &self,
        simd: S,
        scene: &Scene,
        packet: &mut Packet,
        cached: Option<&mut CachedLight>,
        stop: &Stop,
    ) -> bool {
        let mut seen = Coverage {
            alpha: S::f32s::from_slice(simd, &packet.alpha[..S::WIDTH]),
            depth: S::f32s::from_slice(simd, &packet.depth[..S::WIDTH]),
        };
        let mut march = PacketMarch::<S>::new(simd, &scene.medium, &packet.tracks, self.step);
        march.go_to(S::i32s::from_slice(simd, &packet.k[..S::WIDTH]));
        let mut shader = DirectShader { raymarch: self, scene, packet, cached, stop, moved: false };
        let stopped = composite(simd, &mut march, &mut seen, &mut shader, &mut ());
        packet.keep::<S>(stopped.unwrap_or(march.step()), &seen);
        stopped.is_none()
    }

    /// Radiance that a position adds in direction `w_out`, per unit extinction. `None` if stopped first, after at least one shadow ray:
    /// the light so far is in `lit`, from which the next call goes on.
    #[inline(always)]
    fn source<S: Lanes>(
        &self,
        simd: S,
        scene: &Scene,
        at: &ShadedPosition,
        lit: &mut LitSoFar,
        stop: &Stop,
    ) -> Option<Rgb> {
        let medium = &*scene.medium;
        let optics = medium.transfer().optics(at.value);
        let event = medium.event(at.position, &optics);
        let here = medium.volume().grid().index_to_world(at.position);
        let start = TrackStart::new(simd, medium, at.value);
        let lights = scene.lights.lights();
        while let Some(light) = lights.get(lit.light) {
            let points = if light.can_be_passed() { &self.light_points[..] } else { &[[0.5; 2]] };
            let share = 1.0 / points.len() as f32;
            while let Some(&u) = points.get(lit.point) {
                lit.point += 1;
                let Some(sample) = light.sample(here, u) else { continue };
                let unshadowed = event.eval(at.w_out, sample.direction) * sample.radiance * share;
                if unshadowed.is_black() {
                    continue;
                }
                let track = medium.track(&Ray::new(here, sample.direction), sample.distance);
                let thickness = medium.thickness_lanes(simd, &track, Some(&start), self.step, -OPAQUE.ln());
                lit.sum += unshadowed * (-thickness).exp();
                if stop.reached() {
                    return None;
                }
            }
            (lit.light, lit.point) = (lit.light + 1, 0);
        }
        Some(optics.emitted() + std::mem::take(lit).sum)
    }
}

/// A position to be shaded.
struct ShadedPosition {
    /// In index space.
    position: Vec3,
    /// Data value.
    value: f32,
    w_out: Vec3,
}

/// Light that has been found at a position, if a stop interrupted shading it.
#[derive(Clone, Copy, Debug, Default)]
struct LitSoFar {
    sum: Rgb,
    /// The next light, and the next point on it.
    light: usize,
    point: usize,
}

/// Adds emission and singly scattered light to a packet's rays.
struct DirectShader<'a, 'b> {
    raymarch: &'a RayMarch,
    scene: &'a Scene,
    packet: &'a mut Packet,
    /// `None` for exact shadows.
    cached: Option<&'a mut CachedLight<'b>>,
    stop: &'a Stop<'a>,
    /// Whether a position has been shaded since the march resumed; ensures progress however often it is stopped.
    moved: bool,
}

impl<S: Lanes> Shader<S, ()> for DirectShader<'_, '_> {
    #[inline(always)]
    fn shade(&mut self, simd: S, sample: &PacketSample<S>, covered: S::f32s, _: &mut ()) -> bool {
        let Self { raymarch, scene, packet, cached, stop, moved } = self;
        let lanes = covered.simd_gt(S::f32s::splat(simd, 0.0));
        if let Some(cached) = cached {
            if *moved && stop.reached() {
                return false;
            }
            cached.add(simd, sample, covered, &packet.rays, &mut packet.radiance);
            *moved = true;
        } else if scene.render.max_scatter > 0 {
            for site in packet.shaded / S::WIDTH..PacketSample::<S>::SITES {
                let Some(seen) = sample.seen(simd, &scene.medium, lanes, site) else { break };
                let covered = covered * seen.weight;
                for lane in packet.shaded % S::WIDTH..packet.count {
                    let covered = covered.as_slice()[lane];
                    if covered <= 0.0 {
                        continue;
                    }
                    let (position, value) = (seen.position(lane), seen.value.as_slice()[lane]);
                    let at = ShadedPosition { position, value, w_out: -packet.rays[lane].direction };
                    let stopped = *moved && stop.reached();
                    let source =
                        if stopped { None } else { raymarch.source(simd, scene, &at, &mut packet.lit, stop) };
                    let Some(source) = source else {
                        // The march resumes with this sample, of which some positions are already shaded.
                        packet.shaded = site * S::WIDTH + lane;
                        return false;
                    };
                    packet.radiance[lane] += source * covered;
                    *moved = true;
                }
                packet.shaded = 0;
            }
        } else {
            if *moved && stop.reached() {
                return false;
            }
            if scene.medium.transfer().emits() {
                sample.add_emitted(simd, &scene.medium, covered, &mut packet.radiance);
            }
            *moved = true;
        }
        packet.shaded = 0;
        true
    }
}

/// Rays that march together, at most one per lane.
#[derive(Clone, Debug)]
pub struct Packet {
    count: usize,
    rays: [Ray; MOST_LANES],
    tracks: [Track; MOST_LANES],
    /// The step at which to resume.
    k: [i32; MOST_LANES],
    /// Number of positions in that step that have already been shaded: the first sites of all lanes come before the second.
    shaded: usize,
    /// What has been found at the next of them.
    lit: LitSoFar,
    radiance: [Rgb; MOST_LANES],
    alpha: [f32; MOST_LANES],
    /// Sum of the sample distances inside the medium, weighted by what each sample adds to `alpha`.
    depth: [f32; MOST_LANES],
}

impl Packet {
    pub(super) fn new(scene: &Scene, rays: impl Iterator<Item = Ray>) -> Self {
        let mut packet = Self {
            count: 0,
            rays: [Ray::default(); MOST_LANES],
            tracks: [Track::default(); MOST_LANES],
            k: [0; MOST_LANES],
            shaded: 0,
            lit: LitSoFar::default(),
            radiance: [Rgb::BLACK; MOST_LANES],
            alpha: [0.0; MOST_LANES],
            depth: [0.0; MOST_LANES],
        };
        for ray in rays {
            packet.rays[packet.count] = ray;
            packet.tracks[packet.count] = scene.medium.track(&ray, f32::INFINITY);
            packet.count += 1;
        }
        packet
    }

    /// Stores the current step and the coverage so far.
    #[inline(always)]
    fn keep<S: Lanes>(&mut self, k: S::i32s, seen: &Coverage<S>) {
        k.store_slice(&mut self.k[..S::WIDTH]);
        seen.alpha.store_slice(&mut self.alpha[..S::WIDTH]);
        seen.depth.store_slice(&mut self.depth[..S::WIDTH]);
    }

    /// The result of a finished ray.
    fn sample(&self, scene: &Scene, lane: usize) -> PixelSample {
        let (alpha, direction) = (self.alpha[lane], self.rays[lane].direction);
        let distance = self.depth[lane] + alpha * self.tracks[lane].distance(0.0);
        PixelSample {
            radiance: self.radiance[lane] + scene.behind(direction) * (1.0 - alpha),
            alpha,
            depth: distance * direction.dot(scene.camera.view()),
        }
    }
}

struct MarchPixels<'a> {
    raymarch: &'a RayMarch,
    scene: &'a Scene,
    tile: &'a mut Tile,
    pending: &'a mut Option<Box<Packet>>,
    goal: Goal,
    stop: &'a Stop<'a>,
}

impl Kernel for MarchPixels<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { raymarch, scene, tile, pending, goal, stop } = self;
        let mut cached = raymarch.shadows.as_ref().map(|shadows| shadows.light(scene));
        while !tile.has_reached(goal) {
            let mut packet = pending.take().unwrap_or_else(|| {
                let (pixels, sample) = (tile.next(goal, S::WIDTH), tile.samples());
                Box::new(Packet::new(scene, pixels.map(|pixel| RayMarch::ray(scene, pixel, sample))))
            });
            if !raymarch.go_on(simd, scene, &mut packet, cached.as_mut(), stop) {
                *pending = Some(packet);
                return;
            }
            for lane in 0..packet.count {
                tile.add(&packet.sample(scene, lane));
            }
            if stop.reached() {
                return;
            }
        }
    }
}

struct MarchOne<'a> {
    raymarch: &'a RayMarch,
    scene: &'a Scene,
    packet: Packet,
}

impl Kernel for MarchOne<'_> {
    type Output = PixelSample;

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) -> PixelSample {
        while !self.raymarch.go_on(simd, self.scene, &mut self.packet, None, &Stop::never()) {}
        self.packet.sample(self.scene, 0)
    }
}

/// The `i`-th point of the R2 sequence \[Roberts18\], which starts in the middle of the unit square.
fn spread(i: u32) -> [f32; 2] {
    // Inverse powers of the plastic number, as fractions of 2^32, so that no bits are lost for large i.
    let at = |step: u32| (i.wrapping_mul(step).wrapping_add(1 << 31) >> 8) as f32 / (1 << 24) as f32;
    [at(0xC13F_A9A9), at(0x91E1_0DA6)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_in_a_pixel_start_in_its_middle_and_average_to_it() {
        assert_eq!(spread(0), [0.5, 0.5]);
        let n = 4096;
        let mean = (0..n).map(|i| spread(i)[1]).sum::<f32>() / n as f32;
        assert!((mean - 0.5).abs() < 1e-3, "{mean}");
    }
}
