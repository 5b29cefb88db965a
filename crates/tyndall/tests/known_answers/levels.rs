//! Every vector instruction set gives the same picture, and ray marching gives the one that its definition predicts.

use crate::scenes::{Setup, blocks, volume};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tyndall::camera::{Camera, Lens};
use tyndall::film::Image;
use tyndall::integrator::path::PathTracer;
use tyndall::integrator::raymarch::{RayMarch, Settings, Shadows};
use tyndall::integrator::{METHODS, Method, MethodEntry};
use tyndall::light::{Directional, Environment, Light, PointLight};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::Medium;
use tyndall::scene::{MethodChoice, Scene};
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point};

const MARCH: Settings = Settings { step: 0.5, light_samples: 3, shadows: Shadows::Exact };

/// Glowing, reflecting and purely scattering matter with empty space between, in blocks of 9 x 7 x 11 voxels.
fn scene(majorant_cell: usize) -> Scene {
    let value = |p: [usize; 3]| {
        let block = (p[0] / 9 + p[1] / 7 + p[2] / 11) % 4;
        if block == 0 { 0.2 + ((p[0] * 5 + p[1] * 3 + p[2] * 7) % 11) as f32 / 14.0 } else { 0.0 }
    };
    let matter = Optics { albedo: Rgb::new(0.9, 0.6, 0.3), surface: 0.5, ..Optics::default() };
    let glow = Optics { emission: Rgb::new(0.3, 0.1, 0.0), ..matter };
    let points = vec![
        Point { value: 0.1, optics: Optics { opacity: 0.0, ..matter } },
        Point { value: 0.5, optics: Optics { opacity: 0.4, ..matter } },
        Point { value: 0.5, optics: glow },
        Point { value: 1.0, optics: glow },
    ];
    let mut setup = Setup::new(volume([41, 37, 52], [2.0, 2.2, 1.8], value), points, 25.0);
    setup.lights = vec![
        Light::Directional(Directional::new(Vec3::new(1.0, -1.0, -1.0), Rgb::WHITE, 0.0)),
        Light::Environment(Environment::constant(Rgb::splat(0.4), true)),
    ];
    setup.majorant_cell = majorant_cell;
    let mut scene = setup.scene();
    scene.size = [37, 29];
    let position = Vec3::new(3.0, 2.0, 10.0);
    scene.camera = Camera::new(position, Vec3::ZERO, Vec3::Y, Lens::Orthographic { height: 4.0 });
    scene
}

fn picture(mut scene: Scene, method: MethodChoice, level: Level, samples: u32) -> Image {
    scene.render.method = method;
    let threads = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap());
    let mut session = Session::with_level(scene, threads, level);
    session.refine(&Budget::samples(samples));
    session.image()
}

fn farthest(a: &Image, b: &Image) -> f32 {
    let pairs = a.rgba.as_flattened().iter().zip(b.rgba.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn every_level_marches_to_the_same_picture() {
    for shadows in [Shadows::Exact, Shadows::Cached] {
        let march = || RayMarch::choose(Settings { shadows, ..MARCH });
        let scalar = picture(scene(8), march(), Level::available()[0], 2);
        assert!(scalar.rgba.iter().any(|p| p[3] > 0.6) && scalar.rgba.iter().any(|p| p[3] < 0.5));
        for level in Level::available() {
            let apart = farthest(&scalar, &picture(scene(8), march(), level, 2));
            assert!(apart < 1e-3, "{apart} apart with {level:?} and {shadows:?} shadows");
        }
    }
}

/// The estimators of the levels differ in rounding only: their means agree within the error.
#[test]
fn every_level_traces_to_the_same_mean() {
    let mean = |level| {
        let image = picture(scene(8), PathTracer::usual(), level, 400);
        let n = image.rgba.len() as f64;
        let sum: f64 = image.rgba.iter().map(|p| f64::from(p[1])).sum();
        let variance: f64 = image.variance.iter().map(|v| f64::from(v[1])).sum();
        (sum / n, variance.sqrt() / n)
    };
    let (scalar, error) = mean(Level::available()[0]);
    assert!(error < 0.01 * scalar, "an error of {error} at a mean of {scalar} is too large to compare");
    for level in Level::available() {
        let (found, _) = mean(level);
        // Most paths are the same, so two standard errors of one picture are a generous bound.
        assert!((found - scalar).abs() < 2.0 * error, "{found}, scalar {scalar} +- {error}, with {level:?}");
    }
}

/// Empty cells are leapt over; a single cell around everything is not empty, so there no sample is skipped.
#[test]
fn leaping_over_what_is_empty_changes_no_bit() {
    for level in Level::available() {
        let emission = |cell| {
            let mut scene = scene(cell);
            scene.render.max_scatter = 0;
            picture(scene, RayMarch::choose(MARCH), level, 3)
        };
        let (leapt, plain) = (emission(8), emission(0));
        assert!(leapt.rgba.iter().any(|p| p[0] > 0.01));
        assert_eq!(leapt, plain, "{level:?}");
    }
}

/// Compares with the plain sum of the rule: the mean extinction between the values at both ends of each step.
#[test]
fn a_packet_marches_as_the_rule_says() {
    let scene = scene(8);
    let medium: &Medium = &scene.medium;
    let step = 0.5 * medium.volume().grid().voxel_size();
    let march = RayMarch::of_scene(&scene, &MARCH, Level::best());
    let mut some = 0;
    for i in 0..200 {
        let angle = i as f32 * 0.37;
        let from = Vec3::new(3.0 * angle.cos(), ((i % 17) as f32 - 8.0) * 0.2, 3.0 * angle.sin());
        let to = Vec3::new((i % 7) as f32 - 3.0, (i % 5) as f32 - 2.0, (i % 3) as f32 - 1.0) * 0.2;
        let ray = Ray::new(from, (to - from).normalize());
        let track = medium.track(&ray, f32::INFINITY);
        let mut transmittance = 1.0;
        let mut k = 0;
        while (k as f32) * step < track.length() && transmittance > 1e-4 {
            let start = k as f32 * step;
            let end = track.length().min(start + step);
            let thickness = medium.mean_sigma_t([track.at(start), track.at(end)]) * (end - start);
            transmittance *= (-thickness).exp();
            k += 1;
        }
        let alpha = march.march(&scene, &ray).alpha;
        assert!(
            (alpha - (1.0 - transmittance)).abs() < 2e-4,
            "{alpha}, expected {} on ray {i}",
            1.0 - transmittance
        );
        some += usize::from(alpha > 0.01 && alpha < 0.99);
    }
    assert!(some > 20, "only {some} rays were partly covered");
}

/// A deadline stops rendering even in the middle of a sample, which here takes up to a million scatterings.
#[test]
fn a_deadline_stops_promptly() {
    let white = vec![Point { value: 0.0, optics: Optics { albedo: Rgb::WHITE, ..Optics::default() } }];
    let mut setup = Setup::new(blocks([4; 3], [2.0; 3], |_| 1.0), white, 900.0);
    setup.max_scatter = 1_000_000;
    let inside = PointLight { position: Vec3::new(0.1, 0.2, 0.3), intensity: Rgb::WHITE };
    setup.lights = vec![Light::Point(inside)];
    let whole = setup.scene();
    let march = RayMarch::choose(Settings { step: 0.001, light_samples: 1000, shadows: Shadows::Exact });
    for method in METHODS.iter().map(MethodEntry::default_settings).chain([march]) {
        let mut scene = whole.clone();
        scene.size = [256, 256];
        scene.render.method = method.clone();
        let threads = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap());
        let mut session = Session::new(scene, threads);
        for _ in 0..5 {
            let mut budget = Budget::samples(1000);
            let deadline = Instant::now() + Duration::from_millis(30);
            budget.deadline = Some(deadline);
            session.refine(&budget);
            // The goal is 5 ms; the rest allows for busy machines.
            let late = deadline.elapsed();
            assert!(late < Duration::from_millis(300), "{late:?} late with {method:?}");
        }
    }
}
