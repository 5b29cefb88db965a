//! Refinement passes: each has its own photons and rays, so that the picture converges \[Knaus11\].

use super::map::MapState;
use super::settings::Settings;
use super::stored::Photon;
use super::view::{Stretches, View};
use super::{build_map, plan};
use crate::film::{Goal, PixelSample, Tile};
use crate::integrator::cells::ChangeMarks;
use crate::integrator::light_paths::{Ground, HistoryDetail, LightPaths, Plan, Tracing, sources};
use crate::integrator::{Limits, Stop, drop_elsewhere};
use crate::sampling::address::Purpose;
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes};

/// The photons of a pass.
#[derive(Debug)]
pub(super) struct Pass {
    pub number: u32,
    settings: Settings,
    /// In voxels.
    radius: f32,
    lights: Vec<LightPaths<Photon>>,
    pub map: MapState,
}

/// Trade-off between variance and bias of successive passes, between 0 and 1: the value that \[Knaus11\] found best.
const ALPHA: f64 = 2.0 / 3.0;

/// Radius of a pass divided by that of the base map: volumes shrink by `(i + alpha) / (i + 1)` per pass \[Knaus11\].
fn shrunk(pass: u32) -> f32 {
    let volume: f64 = (1..=pass).map(|i| (f64::from(i) + ALPHA) / (f64::from(i) + 1.0)).product();
    crate::math::cast::single(volume.cbrt())
}

impl Pass {
    pub fn new(scene: &Scene, settings: &Settings, number: u32) -> Self {
        let sources = sources(scene);
        // No pass survives an edit.
        let plan =
            Plan { histories: HistoryDetail::Paths, pass: number, ..plan(scene, settings, sources.len()) };
        let lights = sources.into_iter().map(|source| LightPaths::new(source, &plan)).collect();
        Self {
            number,
            settings: *settings,
            radius: settings.radius * shrunk(number),
            lights,
            map: MapState::Absent,
        }
    }

    /// Traces and sorts the photons; false if stopped first.
    pub fn prepare(&mut self, scene: &Scene, ground: &Ground, limits: &Limits) -> bool {
        if self.map.ready().is_some() {
            return true;
        }
        let marks = ChangeMarks::off();
        let tracing = Tracing { scene, ground, marks: &marks, limits };
        let built = tracing.trace(&mut self.lights).finished
            && build_map(&mut self.map, scene, self.radius, &self.settings, &self.lights, limits);
        if built {
            drop_elsewhere(std::mem::take(&mut self.lights));
        }
        built
    }
}

/// Takes samples of the pixels of a tile until it reaches the goal, along jittered rays with jittered steps, unless stopped
/// first.
pub(super) struct GatherPass<'a> {
    pub view: View<'a>,
    pub tile: &'a mut Tile,
    pub goal: Goal,
    pub stop: &'a Stop<'a>,
}

impl Kernel for GatherPass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { view, tile, goal, stop } = self;
        let scene = view.scene;
        while !tile.has_reached(goal) {
            let mut stretches = Stretches::default();
            let (pixels, sample) = (tile.next(goal, S::WIDTH), tile.samples());
            let count = pixels.len();
            for (lane, [x, y]) in pixels.enumerate() {
                let pixel = y * scene.size[0] + x;
                let mut stream = Purpose::ViewRay { pixel, sample }.stream(scene.render.seed);
                let [in_x, in_y, u, v, within, due] = [(); 6].map(|()| stream.uniform());
                let ray = scene.camera.ray(scene.size, [x as f32 + in_x, y as f32 + in_y], [u, v]);
                let track = scene.medium.track(&ray, f32::INFINITY).shifted(within - 0.5);
                stretches.rays[lane] = ray;
                stretches.to[lane] = track.steps(view.step);
                stretches.tracks[lane] = track;
                stretches.due[lane] = due;
            }
            let found = view.march(simd, &stretches, &mut ());
            for lane in 0..count {
                let (ray, found) = (&stretches.rays[lane], &found[lane]);
                let alpha = 1.0 - found.transmittance;
                let distance = found.depth + alpha * stretches.tracks[lane].distance(0.0);
                tile.add(&PixelSample {
                    radiance: found.radiance + scene.behind(ray.direction) * found.transmittance,
                    alpha,
                    depth: distance * ray.direction.dot(scene.camera.view()),
                });
            }
            if stop.reached_now() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_to_nothing_but_slower_than_the_photons_grow() {
        assert_eq!(shrunk(0), 1.0);
        // The product of (i + a) / (i + 1) decreases as n^(a - 1): a factor of 1000^(-1/9) in the radius.
        let ratio = shrunk(100_000) / shrunk(100);
        assert!((ratio - 1000_f32.powf(-1.0 / 9.0)).abs() < 1e-3, "{ratio}");
    }
}
