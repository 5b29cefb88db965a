//! Coverage (alpha), depth, and the background seen through matter.

use crate::scenes::{Setup, blocks, mean, slab, trace};
use std::sync::Arc;
use tyndall::film::PixelSample;
use tyndall::integrator::path::PathTracer;
use tyndall::integrator::raymarch::{RayMarch, Settings};
use tyndall::integrator::{METHODS, Method};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::ClipShape;
use tyndall::scattering::Phase;
use tyndall::scene::{Background, Scene};
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point};

/// Conservative matter that no light falls on, before a bright background.
fn before_a_wall(thickness: f32) -> Scene {
    let mut scene = slab(thickness, 1.0, Phase::Isotropic).scene();
    scene.background = Background::Color(Rgb::splat(3.0));
    scene
}

/// A quantity of a sample.
type Part = fn(&PixelSample) -> f32;

#[test]
fn alpha_depth_and_background_have_closed_forms() {
    const PARTS: [(&str, Part); 3] =
        [("radiance", |s| s.radiance.g), ("alpha", |s| s.alpha), ("depth", |s| s.depth)];
    // The ray starts 2 from the slab's top, along its oblique direction; the camera looks straight down.
    let cos = 0.6_f64;
    let out = Vec3::new(0.8, 0.0, 0.6);
    let ray = Ray::new(Vec3::Z * 0.5 + out * 2.0, -out);
    for thickness in [0.4_f32, 1.2] {
        let scene = before_a_wall(thickness);
        let sigma = f64::from(thickness);
        let tau = sigma / cos;
        let through = (-tau).exp();
        let inside = (1.0 - through * (1.0 + tau)) / sigma;
        let expected = [3.0 * through, 1.0 - through, cos * (2.0 * (1.0 - through) + inside)];
        // Steps are in units of the cube root of the voxel's volume, which is large for this wide slab.
        let march = RayMarch::of_scene(
            &scene,
            &Settings { step: 1e-3 / 1e5_f32.powf(2.0 / 3.0), light_samples: 1, ..Settings::default() },
            Level::best(),
        )
        .march(&scene, &ray);
        for ((name, pick), expected) in PARTS.into_iter().zip(expected) {
            let marched = f64::from(pick(&march));
            assert!(
                (marched / expected - 1.0).abs() < 1e-3,
                "{name} by marching {marched}, expected {expected}"
            );
            let walked = mean(8, 1_000_000, |numbers, _| f64::from(pick(&trace(&scene, ray, numbers))));
            walked.against(expected).assert_within(3.5, 3e-3);
        }
    }
}

/// Samples are spread uniformly over the whole pixel.
#[test]
fn a_pixel_is_covered_as_far_as_matter_fills_it() {
    // Matter fills x < 1/4, which is three quarters of a pixel from -1/2 to 1/2.
    let nothing = Optics { opacity: 0.0, ..Optics::default() };
    let points = vec![Point { value: 0.0, optics: nothing }, Point { value: 1.0, optics: Optics::default() }];
    let half = blocks([64; 3], [2.0; 3], |p| f32::from(u8::from(p[0] < 40)));
    let scene = Setup::new(half, points, 1e4).scene();
    let covered = |integrator| {
        let mut scene = scene.clone();
        scene.size = [1, 1];
        scene.render.method = integrator;
        let threads = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
        let mut session = Session::new(scene, threads);
        session.refine(&Budget::samples(4096));
        session.image().rgba[0][3]
    };
    let walked = covered(PathTracer::usual());
    let marched = covered(RayMarch::choose(Settings { step: 0.5, light_samples: 1, ..Settings::default() }));
    for share in [walked, marched] {
        assert!((share - 0.75).abs() < 2e-3, "{share} of the pixel is covered");
    }
}

/// A march that samples each step at a random place must not leave the part of its ray that is kept.
#[test]
fn what_is_cut_away_is_in_no_sample() {
    // Matter fills z < 0, and all that is below z = 0.001 is cut away: an eighth of a step of `photon`, a 250th of a voxel.
    let nothing = Optics { opacity: 0.0, ..Optics::default() };
    let points = vec![Point { value: 0.0, optics: nothing }, Point { value: 1.0, optics: Optics::default() }];
    let half = blocks([8; 3], [2.0; 3], |p| f32::from(u8::from(p[2] < 4)));
    let clip = vec![ClipShape::Plane { point: Vec3::Z * 0.001, normal: -Vec3::Z }];
    let scene = Setup { clip, max_scatter: 0, ..Setup::new(half, points, 1e4) }.scene();
    for method in METHODS {
        let mut scene = scene.clone();
        scene.render.method = method.default_settings();
        let threads = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
        let mut session = Session::new(scene, threads);
        session.refine(&Budget::samples(64));
        assert_eq!(session.image().rgba[0][3], 0.0, "alpha of `{}`", method.name);
    }
}
