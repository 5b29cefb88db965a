//! Unbiased Monte Carlo: one path from the camera per sample, by the scheme of Exposure Render as
//! \[Khlebnikov14, sec. 3\] tells it, extended to any order of scattering.
//!
//! A path flies to a collision, asks one light for what it sends there, scatters, and flies on. Light
//! found by the two ways is weighed by the balance heuristic \[Veach97\]. Paths have any length and no stack.

use crate::film::PixelSample;
use crate::light::LightSample;
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::sampling::{BounceSample, PathSampler};
use crate::scattering::Event;
use crate::scene::Scene;

/// The path tracer; it keeps nothing between samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path;

/// A path whose throughput falls below this lives on by chance.
const ROULETTE_WEIGHT: f32 = 0.25;

impl Path {
    /// Radiance of a pixel by the `sample`-th path through it.
    #[must_use]
    pub fn sample(&self, scene: &Scene, [x, y]: [u32; 2], sample: u32) -> PixelSample {
        let mut numbers = PathSampler::new(scene.render.seed, y * scene.size[0] + x, sample);
        let (in_pixel, on_lens) = numbers.camera();
        let film = [x as f32 + in_pixel[0], y as f32 + in_pixel[1]];
        let ray = scene.camera.ray(scene.size, film, on_lens);
        Self::trace(scene, ray, &mut numbers)
    }

    /// An unbiased estimate of the radiance that arrives along a world ray.
    #[must_use]
    pub fn trace(scene: &Scene, mut ray: Ray, numbers: &mut PathSampler) -> PixelSample {
        let medium = &*scene.medium;
        let mut seen = PixelSample::default();
        let mut throughput = Rgb::WHITE;
        // Density of the ray's direction; none was drawn for the camera's own ray.
        let mut pdf = None;
        for order in 0..=scene.render.max_scatter {
            let u = numbers.bounce(order);
            let track = medium.track(&ray, f32::INFINITY);
            let collision = medium.free_flight(&track, u.flight_depth(), &mut numbers.stream);
            let reach = collision.map_or(f32::INFINITY, |c| track.distance(c.t));
            if let Some(pdf) = pdf {
                seen.radiance += throughput * scene.lights.passed(&ray, reach, pdf);
            }
            let Some(collision) = collision else {
                if order == 0 {
                    seen.radiance += scene.behind(ray.direction);
                }
                break;
            };
            let optics = medium.transfer().optics(collision.value);
            if order == 0 {
                seen.alpha = 1.0;
                seen.depth = reach * ray.direction.dot(scene.camera.view());
            }
            let emitted = Medium::emitted(&optics);
            if !emitted.is_black() {
                let sigma_t = medium.density() * optics.opacity;
                let weight =
                    pdf.map_or(1.0, |pdf| scene.lights.flight_weight(collision.place, sigma_t, reach, pdf));
                seen.radiance += throughput * emitted * weight;
            }
            if order == scene.render.max_scatter {
                break;
            }
            let event = medium.event(collision.place, &optics);
            let here = medium.volume().grid().index_to_world(collision.place);
            seen.radiance += throughput * direct(scene, &event, here, -ray.direction, &u, numbers);
            let Some(scattered) = event.sample(-ray.direction, u.scatter) else { break };
            throughput *= scattered.weight;
            let brightest = throughput.max_component();
            if brightest < ROULETTE_WEIGHT {
                let survival = brightest / ROULETTE_WEIGHT;
                if u.roulette >= survival {
                    break;
                }
                throughput /= survival;
            }
            ray = Ray::new(here, scattered.direction);
            pdf = Some(scattered.pdf);
        }
        seen
    }
}

/// Next-event estimation: what one light, drawn by power, sends to a point and on to `w_out`.
fn direct(
    scene: &Scene,
    event: &Event,
    here: Vec3,
    w_out: Vec3,
    u: &BounceSample,
    numbers: &mut PathSampler,
) -> Rgb {
    let medium = &*scene.medium;
    let Some(light) = scene.lights.sample(medium, here, u, &mut numbers.stream) else { return Rgb::BLACK };
    let unshadowed = event.eval(w_out, light.direction) * light.radiance * balance(event, w_out, &light);
    if unshadowed.is_black() {
        return Rgb::BLACK;
    }
    let track = medium.track(&Ray::new(here, light.direction), light.distance);
    unshadowed * medium.transmittance(&track, &mut numbers.stream)
}

/// Weight of drawing the light against drawing the scattered direction.
fn balance(event: &Event, w_out: Vec3, light: &LightSample) -> f32 {
    if light.pdf.is_infinite() { 1.0 } else { light.pdf / (light.pdf + event.pdf(w_out, light.direction)) }
}
