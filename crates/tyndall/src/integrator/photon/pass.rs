//! Refinement passes: photons and rays of their own, which make the picture converge \[Knaus11\].

use super::lights::{Ground, LightPaths, Plan, sources, trace};
use super::map::PhotonMap;
use super::sorted;
use super::spatial::Changed;
use super::view::{Stretches, View};
use crate::film::{PixelSample, Tile};
use crate::integrator::Stop;
use crate::sampling::address::Purpose;
use crate::scene::{Histories, PhotonSettings, Scene};
use crate::simd::{Kernel, Lanes};
use std::sync::atomic::AtomicUsize;

/// The photons of a pass.
#[derive(Debug)]
pub(super) struct Pass {
    pub number: u32,
    settings: PhotonSettings,
    /// Voxels.
    radius: f32,
    lights: Vec<LightPaths>,
    pub map: Option<PhotonMap>,
}

/// How much of each pass's variance stays; between 0 and 1, here what \[Knaus11\] found best.
const ALPHA: f64 = 2.0 / 3.0;

/// Radius of a pass over that of the base map: volumes shrink as `(i + alpha) / (i + 1)` \[Knaus11\].
fn shrunk(pass: u32) -> f32 {
    let volume: f64 = (1..=pass).map(|i| (f64::from(i) + ALPHA) / (f64::from(i) + 1.0)).product();
    crate::math::cast::single(volume.cbrt())
}

impl Pass {
    pub fn new(scene: &Scene, settings: &PhotonSettings, number: u32) -> Self {
        let sources = sources(scene);
        // Nothing of a pass lives through an edit.
        let plan = Plan { histories: Histories::Paths, ..Plan::new(scene, settings, number, sources.len()) };
        let lights = sources.into_iter().map(|source| LightPaths::new(source, &plan)).collect();
        Self { number, settings: *settings, radius: settings.radius * shrunk(number), lights, map: None }
    }

    /// Traces and sorts the photons; false where a stop came first.
    pub fn prepare<'s>(
        &mut self,
        scene: &Scene,
        ground: &Ground,
        stop: &(impl Fn() -> Stop<'s> + Sync),
    ) -> bool {
        if self.map.is_some() {
            return true;
        }
        let traced = AtomicUsize::new(0);
        let whole = trace(&mut self.lights, scene, ground, self.number, &Changed::off(), &traced, stop);
        if whole {
            self.map = Some(sorted(scene, self.radius, &self.settings, &self.lights));
            self.lights = Vec::new();
        }
        whole
    }
}

/// Takes a sample of every pixel of a tile, along jittered rays with jittered steps, unless a stop comes first.
pub(super) struct Refine<'a> {
    pub view: View<'a>,
    pub tile: &'a mut Tile,
    pub stop: &'a Stop<'a>,
}

impl Kernel for Refine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { view, tile, stop } = self;
        let (scene, target) = (view.scene, tile.samples() + 1);
        while tile.samples() < target {
            let mut stretches = Stretches::default();
            let (pixels, sample) = tile.next(S::WIDTH);
            let count = pixels.len();
            for (lane, [x, y]) in pixels.enumerate() {
                let pixel = y * scene.size[0] + x;
                let mut stream = Purpose::ViewRay { pixel, sample }.stream(scene.render.seed);
                let [in_x, in_y, u, v, within, due] = [(); 6].map(|()| stream.uniform());
                let ray = scene.camera.ray(scene.size, [x as f32 + in_x, y as f32 + in_y], [u, v]);
                let track = scene.medium.track(&ray, f32::INFINITY).shifted((within - 0.5) * view.step);
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
            if stop.reached() {
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
        // The product of (i + a) / (i + 1) falls as n^(a - 1): by 1000^(-1/9) in the radius.
        let ratio = shrunk(100_000) / shrunk(100);
        assert!((ratio - 1000_f32.powf(-1.0 / 9.0)).abs() < 1e-3, "{ratio}");
    }
}
