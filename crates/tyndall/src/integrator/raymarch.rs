//! Emission, absorption and single scattering by marching along the view ray, with shadow rays to
//! every light: the fast, flat, deterministic picture.
//!
//! Light that glowing matter sends to other matter is left out.

use crate::film::PixelSample;
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::scattering::Event;
use crate::scene::Scene;
use std::ops::ControlFlow;

/// Transmittance below which what is behind no longer shows.
const OPAQUE: f32 = 1e-4;

/// The ray marcher with its fixed points on lights.
#[derive(Clone, Debug)]
pub struct RayMarch {
    /// World units.
    step: f32,
    /// In the unit square, the same for every shaded point.
    light_points: Vec<[f32; 2]>,
}

impl RayMarch {
    /// `step` in voxels; `light_samples` points on each light that has an extent.
    #[must_use]
    pub fn new(scene: &Scene, step: f32, light_samples: u32) -> Self {
        let points = (0..light_samples).map(|i| hammersley(i, light_samples)).collect();
        Self { step: step * scene.medium.volume().grid().voxel_size(), light_points: points }
    }

    /// A pixel's `sample`-th ray. Samples serve the pixel filter and the lens alone; the first goes
    /// through the pixel's middle.
    #[must_use]
    pub fn sample(&self, scene: &Scene, [x, y]: [u32; 2], sample: u32) -> PixelSample {
        let [in_x, in_y] = spread(sample);
        let film = [x as f32 + in_x, y as f32 + in_y];
        // The lens point walks its own lattice, turned per pixel so that blur becomes grain, not ghosts.
        let [turn_x, turn_y] = spread(y.wrapping_mul(7919).wrapping_add(x));
        let [u, v] = spread(sample.wrapping_mul(3));
        let ray = scene.camera.ray(scene.size, film, [(u + turn_x).fract(), (v + turn_y).fract()]);
        self.march(scene, &ray)
    }

    /// The radiance that arrives along a world ray.
    #[must_use]
    pub fn march(&self, scene: &Scene, ray: &Ray) -> PixelSample {
        let medium = &*scene.medium;
        let track = medium.track(ray, f32::INFINITY);
        let along_view = ray.direction.dot(scene.camera.view());
        let mut seen = PixelSample::default();
        let mut transmittance = 1.0_f32;
        let _ = medium.march(&track, self.step, |t, width, place| {
            let optics = medium.optics(place);
            let thickness = medium.density() * optics.opacity * width;
            if thickness <= 0.0 {
                return ControlFlow::Continue(());
            }
            let mut source = Medium::emitted(&optics);
            if scene.render.max_scatter > 0 {
                let here = medium.volume().grid().index_to_world(place);
                source += self.direct(scene, &medium.event(place, &optics), here, -ray.direction);
            }
            let covered = -(-thickness).exp_m1() * transmittance;
            seen.radiance += source * covered;
            seen.depth += track.distance(t) * along_view * covered;
            seen.alpha += covered;
            transmittance -= covered;
            if transmittance < OPAQUE { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        seen.radiance += scene.behind(ray.direction) * (1.0 - seen.alpha);
        seen
    }

    /// Light from every lamp that a point scatters to `w_out`, per unit extinction.
    fn direct(&self, scene: &Scene, event: &Event, here: Vec3, w_out: Vec3) -> Rgb {
        let medium = &*scene.medium;
        let mut sum = Rgb::BLACK;
        for light in scene.lights.lights() {
            let points = if light.can_be_passed() { &self.light_points[..] } else { &[[0.5; 2]] };
            let share = 1.0 / points.len() as f32;
            for &u in points {
                let Some(sample) = light.sample(here, u) else { continue };
                let unshadowed = event.eval(w_out, sample.direction) * sample.radiance * share;
                if unshadowed.is_black() {
                    continue;
                }
                let track = medium.track(&Ray::new(here, sample.direction), sample.distance);
                let thickness = medium.optical_thickness(&track, self.step, -OPAQUE.ln());
                sum += unshadowed * (-thickness).exp();
            }
        }
        sum
    }
}

/// The `i`-th of `n` points of the Hammersley set: stratified in both coordinates.
fn hammersley(i: u32, n: u32) -> [f32; 2] {
    let radical_inverse = (i.reverse_bits() >> 8) as f32 / (1 << 24) as f32;
    [(i as f32 + 0.5) / n as f32, radical_inverse + 0.5 / n as f32 % 1.0]
}

/// The `i`-th point of the R2 sequence \[Roberts18\], which begins in the middle of the unit square.
fn spread(i: u32) -> [f32; 2] {
    // Inverse powers of the plastic number, as fractions of 2^32, so that no bit is lost for large i.
    let at = |step: u32| (i.wrapping_mul(step).wrapping_add(1 << 31) >> 8) as f32 / (1 << 24) as f32;
    [at(0xC13F_A9A9), at(0x91E1_0DA6)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_points_are_stratified_and_inside_the_square() {
        for n in [1, 16, 256] {
            let mut strata = vec![0; n as usize];
            for i in 0..n {
                let [u, v] = hammersley(i, n);
                assert!((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v), "{u}, {v} of {n}");
                strata[crate::math::cast::index(v * n as f32)] += 1;
            }
            assert!(strata.iter().all(|&k| k == 1), "{n}");
        }
        assert_eq!(spread(0), [0.5, 0.5]);
        let n = 4096;
        let mean = (0..n).map(|i| spread(i)[1]).sum::<f32>() / n as f32;
        assert!((mean - 0.5).abs() < 1e-3, "{mean}");
    }
}
