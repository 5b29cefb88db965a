//! The fluence inside the box as estimated by light paths and by light sampling.

use crate::emit::{PROBE, grids, lights, uniforms};
use crate::scenes::{Setup, mean};
use std::f64::consts::PI;
use tyndall::light::{Emission, Enclosure, LightSample};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::sampling::{Stream, warp};
use tyndall::transfer::{Optics, Point};
use tyndall::volume::{Grid, Interpolation, ValueMap, Volume, Voxels};
use tyndall_testing::{Mean, ZTest};

/// What a path of flux 1 contributes to the mean fluence: its length inside the probe over the probe's volume.
fn crossing(ray: &Ray) -> f64 {
    let (center, radius) = PROBE;
    let to_center = center - ray.origin;
    let along = to_center.dot(ray.direction);
    let aside = (to_center - ray.direction * along).length_squared();
    let half_chord = (radius * radius - aside).max(0.0).sqrt();
    let volume = 4.0 / 3.0 * PI * f64::from(radius).powi(3);
    if along > 0.0 { response(ray.direction) * 2.0 * f64::from(half_chord) / volume } else { 0.0 }
}

/// The probe's sensitivity to light travelling in a direction: not uniform, so that a reversed path is detected.
fn response(travel: Vec3) -> f64 {
    1.0 + f64::from(travel.dot(Vec3::new(0.6, -0.48, 0.64)))
}

fn place_in_the_probe(stream: &mut Stream) -> Vec3 {
    let (center, radius) = PROBE;
    let direction = warp::sphere([stream.uniform(), stream.uniform()]);
    center + direction * (radius * stream.uniform().cbrt())
}

/// Asserts that the mean fluence by light paths equals that by light samples, both known to a percent.
fn compare(name: &str, by_paths: Mean, by_samples: Mean) {
    let variance = by_paths.variance_of_mean() + by_samples.variance_of_mean();
    let test = ZTest::new(by_paths.mean(), variance, by_samples.mean());
    assert!(test.is_within(4.0, 1e-2), "{name}: {test}");
}

/// The mean fluence over a small sphere by light paths equals that which [`Light::sample`] gives at points inside it.
#[test]
fn paths_bring_the_fluence_that_samples_see() {
    const PATHS: u32 = 1 << 20;
    for (grid_name, grid) in grids() {
        let box_ = Enclosure::new(&grid);
        for (name, light) in lights() {
            // Only a map has colours that vary with direction.
            for channel in if name == "map" { 0..3 } else { 1..2 } {
                let of = |rgb: Rgb| f64::from(rgb.to_array()[channel]);
                let by_paths = mean(7, PATHS, |_, stream| {
                    let emitted = light.emit(&box_, uniforms(stream));
                    emitted.map_or(0.0, |e| of(e.flux * light.color()) * crossing(&e.ray))
                });
                let seen = |s: LightSample| of(s.radiance) * response(-s.direction);
                let by_samples = mean(8, PATHS, |_, stream| {
                    let from = place_in_the_probe(stream);
                    light.sample(from, [stream.uniform(), stream.uniform()]).map_or(0.0, seen)
                });
                compare(&format!("{grid_name}, {name}, channel {channel}"), by_paths, by_samples);
            }
        }
    }
}

/// Glowing matter in the lower layers, vacuum above, where the probe is.
fn glowing(grid: Grid, layers: usize) -> Setup {
    let [nx, ny, _] = grid.dims();
    let data = (0..grid.len()).map(|i| if i / (nx * ny) < layers { 1.0 } else { 0.0 }).collect();
    let volume = Volume::new(grid, Voxels::F32(data), ValueMap::IDENTITY).unwrap();
    let look = |optics: Optics, at: f32| [-0.4, 0.4].map(|d| Point { value: at + d, optics });
    let albedo = Rgb::splat(0.3);
    let glow = Optics { emission: Rgb::new(0.5, 3.0, 1.0), opacity: 0.4, albedo, ..Optics::default() };
    let nothing = Optics { opacity: 0.0, ..Optics::default() };
    let points = [look(nothing, 0.0), look(glow, 1.0)].concat();
    Setup::new(volume.with_interpolation(Interpolation::Nearest), points, 2.0)
}

#[test]
fn glowing_matter_sends_all_its_power() {
    for (_, grid) in grids() {
        for layers in [8, 2] {
            let volume = f64::from(grid.voxel_size()).powi(3) * grid.len() as f64 * layers as f64 / 8.0;
            let scene = glowing(grid.clone(), layers).scene();
            let medium = &*scene.medium;
            let emission = Emission::new(medium).unwrap();
            let emitted = mean(5, 1 << 20, |_, stream| {
                let u = uniforms(stream);
                emission.emit(medium, u, stream).map_or(0.0, |e| f64::from(e.flux.g))
            });
            // In all directions: extinction 2 x 0.4, of which 1 - albedo = 0.7 absorbs, and source radiance 3.
            let expected = 4.0 * PI * 2.0 * 0.4 * 0.7 * 3.0 * volume;
            emitted.against(expected).assert_within(3.5, 2e-3);
        }
    }
}

#[test]
fn glowing_matter_brings_the_fluence_that_samples_see() {
    for (name, grid) in grids() {
        let scene = glowing(grid, 2).scene();
        let medium = &*scene.medium;
        let emission = Emission::new(medium).unwrap();
        for channel in [0, 1] {
            let of = |rgb: Rgb| f64::from(rgb.to_array()[channel]);
            let by_paths = mean(7, 1 << 21, |_, stream| {
                let u = uniforms(stream);
                emission.emit(medium, u, stream).map_or(0.0, |e| of(e.flux) * crossing(&e.ray))
            });
            let by_samples = mean(8, 1 << 20, |_, stream| {
                let from = place_in_the_probe(stream);
                let sample = emission.sample(medium, from, stream);
                sample.map_or(0.0, |s| of(s.radiance) * response(-s.direction))
            });
            compare(&format!("{name}, channel {channel}"), by_paths, by_samples);
        }
    }
}
