//! White furnace: with albedo 1 in a uniform environment every pixel has the radiance of the environment, whatever
//! the shape, the density, the phase function and the position of the camera.

use crate::scenes::{Setup, henyey_greenstein, mean, radiance, volume};
use tyndall::light::{Environment, Light};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::sampling::Stream;
use tyndall::scattering::{Abc, Brdf, Phase, Schlick};
use tyndall::transfer::{Optics, Point};
use tyndall_testing::Mean;

fn sky() -> Vec<Light> {
    vec![Light::Environment(Environment::constant(Rgb::WHITE, true))]
}

/// A lumpy field with a random transfer function of albedo 1.
fn random_setup(seed: u32, surface: f32) -> Setup {
    let mut s = Stream::new(99, [seed, 0, 0]);
    let n = [12 + (seed as usize * 7) % 20, 16, 24];
    let waves: Vec<f32> = (0..3).map(|_| 1.0 + 5.0 * s.uniform()).collect();
    let value = move |p: [usize; 3]| {
        let wave = |a: usize| (p[a] as f32 / n[a] as f32 * waves[a] * 2.0).sin();
        0.5 + 0.5 * wave(0) * wave(1) * wave(2)
    };
    let mut point = |value: f32| {
        let opacity = if s.uniform() < 0.3 { 0.0 } else { s.uniform() };
        let albedo = Rgb::WHITE;
        let specular = Rgb::splat(s.uniform());
        let roughness = s.uniform();
        Point { value, optics: Optics { opacity, albedo, surface, specular, roughness, ..Optics::default() } }
    };
    let points = vec![point(0.0), point(0.4), point(0.4), point(0.7), point(1.0)];
    let density = 10.0_f32.powf(-0.5 + 2.0 * s.uniform());
    Setup { lights: sky(), ..Setup::new(volume(n, [2.0; 3], value), points, density) }
}

/// From a random position, sometimes inside, in a random direction towards the middle.
fn any_ray(s: &mut Stream) -> Ray {
    let mut cube = || Vec3::new(s.uniform() - 0.5, s.uniform() - 0.5, s.uniform() - 0.5);
    let (from, to) = (cube() * 5.0, cube());
    Ray::new(from, (to - from).normalize())
}

fn seen(setup: Setup, paths: u32) -> Mean {
    let scene = setup.scene();
    radiance(&scene, paths, any_ray)
}

#[test]
fn phase_functions() {
    for seed in 0..8 {
        let g = [0.0, 0.3, -0.5, 0.8, 0.95, -0.9, 0.6, 0.0][seed as usize];
        let schlick = Phase::Schlick(Schlick::new(0.7).unwrap());
        let phase = if seed == 7 { schlick } else { henyey_greenstein(g) };
        let mean = seen(Setup { phase, ..random_setup(seed, 0.0) }, 400_000);
        mean.against(1.0).assert_within(3.5, 1e-3);
    }
}

#[test]
fn lambert_surfaces() {
    for seed in 0..4 {
        let surface = [1.0, 0.7, 0.3, 1.0][seed as usize];
        let mean = seen(random_setup(seed, surface), 400_000);
        mean.against(1.0).assert_within(3.5, 1e-3);
    }
}

/// Glossy surfaces may lose light between their facets, but never create any.
#[test]
fn glossy_surfaces_make_no_light() {
    for seed in 0..4 {
        let abc = Brdf::Abc(Abc::new(200.0, 1.2).unwrap());
        let brdf = if seed % 2 == 0 { Brdf::AshikhminShirley } else { abc };
        let mean = seen(Setup { brdf, ..random_setup(seed, 1.0) }, 200_000);
        let error = mean.variance_of_mean().sqrt();
        assert!(error < 2e-3, "noise {error}");
        assert!(mean.mean() < 1.0 + 4.0 * error, "{} +- {error}", mean.mean());
        // Each of several reflections loses the light that is trapped between facets, up to a third.
        assert!(mean.mean() > 0.3, "{} is darker than losses between facets explain", mean.mean());
    }
}

/// The same with the sky split into two lights, chosen by power; an escaping ray hits both.
#[test]
fn several_lights_add_up() {
    let half = Light::Environment(Environment::constant(Rgb::splat(0.25), true));
    let rest = Light::Environment(Environment::constant(Rgb::splat(0.75), true));
    let setup = Setup { lights: vec![half, rest], ..random_setup(3, 0.5) };
    seen(setup, 400_000).against(1.0).assert_within(3.5, 1e-3);
}

/// Each channel of absorbing matter is darker by exactly what it absorbs, and a channel of albedo 0 does not end
/// the path for the other channels.
#[test]
fn a_black_channel_does_not_end_the_walk() {
    let grey = |albedo: Rgb| {
        let mut setup = random_setup(5, 0.0);
        for point in &mut setup.points {
            point.optics.albedo = albedo;
        }
        setup.scene()
    };
    let (colored, white) = (grey(Rgb::new(0.0, 1.0, 0.5)), grey(Rgb::splat(0.5)));
    let channel = |scene: &tyndall::scene::Scene, pick: fn(Rgb) -> f32| {
        mean(7, 300_000, |numbers, s| {
            f64::from(pick(crate::scenes::trace(scene, any_ray(s), numbers).radiance))
        })
    };
    channel(&colored, |c| c.g).against(1.0).assert_within(3.5, 2e-3);
    let (half, same) = (channel(&colored, |c| c.b), channel(&white, |c| c.b));
    let error = half.variance_of_mean() + same.variance_of_mean();
    tyndall_testing::ZTest::new(half.mean(), error, same.mean()).assert();
}
