//! A camera path: it flies from collision to collision and samples light at each.

use super::samples::{SampleKeeper, SampleTile};
use crate::film::{Goal, PixelSample, Tile};
use crate::integrator::Stop;
use crate::integrator::history::{Past, Writer};
use crate::integrator::next_event::ScatteringPoint;
use crate::math::{Ray, Rgb};
use crate::medium::FlightNotes;
use crate::sampling::PathSampler;
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes};
use std::ops::ControlFlow;

/// Russian roulette starts below this throughput; at 1, the survival probability of every path is its throughput.
/// Compared with 1/4, this reaches the same error in 0.75 (coloured cloud) to 1.02 (white cloud) of the time.
const ROULETTE_WEIGHT: f32 = 1.0;

/// Adds paths to the pixels of a tile until it reaches the goal, unless stopped first.
pub(super) struct TracePixels<'a> {
    pub scene: &'a Scene,
    pub tile: &'a mut Tile,
    /// A path that a stop left unfinished.
    pub pending: &'a mut Option<CameraPath>,
    pub kept: &'a mut SampleTile,
    /// `None` if no samples are kept.
    pub keeper: Option<&'a SampleKeeper>,
    pub goal: Goal,
    pub stop: &'a Stop<'a>,
}

impl Kernel for TracePixels<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { scene, tile, pending, kept, keeper, goal, stop } = self;
        while !tile.has_reached(goal) {
            let number = tile.taken();
            if let Some(sample) = kept.get(number) {
                tile.add(&sample);
                continue;
            }
            let Some(pixel) = tile.next(goal, 1).next() else { return };
            let sample = tile.samples();
            let mut path = pending.take().unwrap_or_else(|| CameraPath::of_pixel(scene, pixel, sample));
            let keeper = keeper.filter(|keeper| keeper.wants(kept, tile));
            let ended = if let Some(keeper) = keeper {
                let mut writer = keeper.reading.writer(&scene.medium, path.past);
                let ended = path.go_on(simd, scene, stop, &mut writer);
                path.past = writer.past;
                ended
            } else {
                path.go_on(simd, scene, stop, &mut ())
            };
            if !ended {
                *pending = Some(path);
                return;
            }
            if keeper.is_some() {
                kept.put(number, &path.seen, &path.past, tile.pixel_count());
            }
            tile.add(&path.seen);
            // A path that leaves the medium without scattering asks nowhere else.
            if stop.reached() {
                return;
            }
        }
    }
}

/// Recorder of everything that a path reads.
trait PathNotes: FlightNotes {
    /// Records a read of the optical properties of `value` where light scatters.
    fn scatters(&mut self, value: f32);
}

/// Records nothing.
impl PathNotes for () {
    #[inline(always)]
    fn scatters(&mut self, _: f32) {}
}

impl PathNotes for Writer<'_> {
    #[inline(always)]
    fn scatters(&mut self, value: f32) {
        self.past.scatter |= self.read(value);
    }
}

/// Traces one path to its end.
pub(super) struct TraceOne<'a> {
    pub scene: &'a Scene,
    pub path: CameraPath,
}

impl Kernel for TraceOne<'_> {
    type Output = PixelSample;

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) -> PixelSample {
        while !self.path.go_on(simd, self.scene, &Stop::never(), &mut ()) {}
        self.path.seen
    }
}

/// A path being traced.
#[derive(Clone, Debug)]
pub struct CameraPath {
    numbers: PathSampler,
    ray: Ray,
    throughput: Rgb,
    /// Pdf of the ray's direction; `None` for the camera ray, whose direction was not sampled by scattering.
    pdf: Option<f32>,
    /// Number of scatterings so far.
    order: u32,
    seen: PixelSample,
    /// What it depends on, if that is recorded.
    past: Past,
}

impl CameraPath {
    pub(super) fn new(ray: Ray, numbers: PathSampler) -> Self {
        let seen = PixelSample::default();
        Self { numbers, ray, throughput: Rgb::WHITE, pdf: None, order: 0, seen, past: Past::NOTHING }
    }

    fn of_pixel(scene: &Scene, [x, y]: [u32; 2], sample: u32) -> Self {
        let numbers = PathSampler::new(scene.render.seed, y * scene.size[0] + x, sample);
        let (in_pixel, on_lens) = numbers.camera();
        let film = [x as f32 + in_pixel[0], y as f32 + in_pixel[1]];
        Self::new(scene.camera.ray(scene.size, film, on_lens), numbers)
    }

    /// Continues to the path's end, or until a stop, but for at least one scattering; returns whether the path has
    /// ended.
    #[inline(always)]
    fn go_on<S: Lanes>(&mut self, simd: S, scene: &Scene, stop: &Stop, notes: &mut impl PathNotes) -> bool {
        while self.scatter(simd, scene, notes).is_continue() {
            if stop.reached() {
                return false;
            }
        }
        true
    }

    /// Flies to the next collision, samples light there and scatters; breaks if the path ends.
    #[inline(always)]
    fn scatter<S: Lanes>(&mut self, simd: S, scene: &Scene, notes: &mut impl PathNotes) -> ControlFlow<()> {
        let medium = &*scene.medium;
        let Self { numbers, ray, throughput, pdf, order, seen, .. } = self;
        let u = numbers.bounce(*order);
        let track = medium.track(ray, f32::INFINITY);
        let collision = medium.free_flight_noting(&track, u.flight_depth(), &mut numbers.stream, notes);
        let reach = collision.map_or(f32::INFINITY, |c| track.distance(c.t));
        if let Some(pdf) = *pdf {
            seen.radiance += *throughput * scene.lights.passed(ray, reach, pdf);
        }
        let Some(collision) = collision else {
            if *order == 0 {
                seen.radiance += scene.behind(ray.direction);
            }
            return ControlFlow::Break(());
        };
        let optics = medium.transfer().optics(collision.value);
        // At the last order only emission is read. Emission affects how lights are chosen. A path that has scattered
        // has already sampled a light, so its history includes that dependence; a path of order 0 has not.
        if *order < scene.render.max_scatter || *order == 0 {
            notes.scatters(collision.value);
        }
        if *order == 0 {
            seen.alpha = 1.0;
            seen.depth = reach * ray.direction.dot(scene.camera.view());
        }
        let emitted = optics.emitted();
        if !emitted.is_black() {
            let sigma_t = medium.density() * optics.opacity;
            let weight =
                pdf.map_or(1.0, |pdf| scene.lights.flight_weight(collision.position, sigma_t, reach, pdf));
            seen.radiance += *throughput * emitted * weight;
        }
        if *order == scene.render.max_scatter {
            return ControlFlow::Break(());
        }
        let event = medium.event(collision.position, &optics);
        let here = medium.volume().grid().index_to_world(collision.position);
        let point = ScatteringPoint { event: &event, position: here, w_out: -ray.direction };
        seen.radiance += *throughput * point.direct(simd, scene, &u, &mut numbers.stream, notes);
        let Some(scattered) = event.sample(-ray.direction, u.scatter) else { return ControlFlow::Break(()) };
        *throughput *= scattered.weight;
        let brightest = throughput.max_component();
        if brightest < ROULETTE_WEIGHT {
            let survival = brightest / ROULETTE_WEIGHT;
            if u.roulette >= survival {
                return ControlFlow::Break(());
            }
            *throughput /= survival;
        }
        *ray = Ray::new(here, scattered.direction);
        *pdf = Some(scattered.pdf);
        *order += 1;
        ControlFlow::Continue(())
    }
}
