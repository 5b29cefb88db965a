//! Single scattering in a slab against its closed form: `raymarch`, and `path` with one scattering.

use crate::scenes::{Setup, henyey_greenstein, matter, radiance, slab, volume};
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::camera::{Camera, Lens};
use tyndall::integrator::Method;
use tyndall::integrator::raymarch::{RayMarch, Settings, Shadows};
use tyndall::light::{Directional, Disk, Environment, Light, PointLight, Rect, SphereLight};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::scene::Scene;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;

struct Case {
    thickness: f32,
    albedo: f32,
    g: f32,
    mu_in: f64,
    mu_out: f64,
}

const CASES: [Case; 3] = [
    Case { thickness: 0.3, albedo: 0.7, g: 0.0, mu_in: 1.0, mu_out: 0.6 },
    Case { thickness: 2.0, albedo: 0.9, g: 0.6, mu_in: 0.5, mu_out: 0.9 },
    Case { thickness: 6.0, albedo: 1.0, g: -0.3, mu_in: 0.7, mu_out: 0.7 },
];

impl Case {
    fn scene(&self) -> Scene {
        let mut setup = slab(self.thickness, self.albedo, henyey_greenstein(self.g));
        let (sin, cos) = ((1.0 - self.mu_in * self.mu_in).sqrt() as f32, self.mu_in as f32);
        let travels = Vec3::new(sin, 0.0, -cos);
        setup.lights = vec![Light::Directional(Directional::new(travels, Rgb::WHITE, 0.0))];
        setup.max_scatter = 1;
        setup.scene()
    }

    fn ray(&self) -> Ray {
        let out = Vec3::new(0.0, (1.0 - self.mu_out * self.mu_out).sqrt() as f32, self.mu_out as f32);
        Ray::new(Vec3::Z * 0.5 + out, -out)
    }

    /// `albedo p mu0 / (mu + mu0) (1 - exp(-b (1/mu + 1/mu0)))` for unit irradiance.
    fn expected(&self) -> f64 {
        let (mu, mu0, b) = (self.mu_out, self.mu_in, f64::from(self.thickness));
        let cos = -mu * mu0;
        let g = f64::from(self.g);
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
        f64::from(self.albedo) * phase * mu0 / (mu + mu0) * (1.0 - (-b * (1.0 / mu + 1.0 / mu0)).exp())
    }
}

#[test]
fn path_with_one_scattering() {
    for case in &CASES {
        let scene = case.scene();
        radiance(&scene, 2_000_000, |_| case.ray()).against(case.expected()).assert_within(3.0, 1e-3);
    }
}

/// The error of the midpoint rule falls with the square of the step. The slab is one voxel thick, so a
/// step of 1/64 is a few hundredths of optical thickness.
#[test]
fn raymarch_and_the_order_of_its_step_error() {
    // Steps are in units of the cube root of the voxel's volume, which is large for this wide slab.
    let voxel = 1e5_f64.powf(2.0 / 3.0);
    let mut worst = 0.0_f64;
    for case in &CASES {
        let scene = case.scene();
        let error = |steps: f64| {
            let march = RayMarch::of_scene(
                &scene,
                &Settings { step: (1.0 / (steps * voxel)) as f32, light_samples: 1, ..Settings::default() },
                Level::best(),
            );
            f64::from(march.march(&scene, &case.ray()).radiance.g) / case.expected() - 1.0
        };
        let (coarse, fine) = (error(32.0), error(256.0));
        // 8 times finer steps: about 64 times less error, plus single-precision rounding.
        assert!(fine.abs() < coarse.abs() / 30.0 + 2e-5, "error {coarse:e} at 1/32, {fine:e} at 1/256");
        assert!(coarse.abs() < 0.02, "error {coarse:e} at 1/32");
        worst = worst.max(coarse.abs());
    }
    // Where a step is seen half of what is visible of it, some cases have no error that shows.
    assert!(worst > 1e-5, "errors of at most {worst:e} at 1/32 show no order");
}

/// What arrives along a ray with cached shadows, which only pictures have.
fn with_cached_shadows(scene: &Scene, ray: &Ray, step: f32, light_samples: u32) -> f64 {
    let mut scene = scene.clone();
    let lens = Lens::Orthographic { height: 1e-4 };
    scene.camera = Camera::new(ray.origin, ray.at(1.0), Vec3::new(0.6, 0.8, 0.0), lens);
    scene.render.method = RayMarch::choose(Settings { step, light_samples, shadows: Shadows::Cached });
    let threads = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap());
    let mut session = Session::new(scene, threads);
    session.refine(&Budget::samples(1));
    f64::from(session.image().rgba[0][1])
}

/// Transmittance is linear between texels, a quarter of a voxel apart.
#[test]
fn cached_shadows_in_a_slab() {
    const LAYERS: usize = 48;
    for case in &CASES {
        let mut scene = case.scene();
        let wide = 1e5;
        let layers = volume([1, 1, LAYERS], [wide, wide, 1.0], |_| 0.0);
        let phase = henyey_greenstein(case.g);
        let mut setup = Setup { phase, ..Setup::new(layers, matter(case.albedo), case.thickness) };
        setup.lights = scene.lights.lights().to_vec();
        setup.max_scatter = 1;
        scene = setup.scene();
        let voxel = (wide * wide / LAYERS as f64).cbrt();
        let step = (1.0 / (LAYERS as f64 * 4.0 * voxel)) as f32;
        let off = with_cached_shadows(&scene, &case.ray(), step, 1) / case.expected() - 1.0;
        assert!(off.abs() < 5e-3, "{off:e} off at a thickness of {}", case.thickness);
    }
}

/// Single scattering from every light that has an extent or is inside the matter, by both methods.
#[test]
fn both_methods_agree_under_every_light() {
    let at = Vec3::new(0.3, 0.4, 0.2);
    let radiance_of = Rgb::splat(2.0);
    let lights = [
        ("sun", Light::Directional(Directional::new(-at, radiance_of, 40.0))),
        ("point", Light::Point(PointLight { position: at, intensity: radiance_of })),
        ("rect", Light::Rect(Rect::new(at, -at, Vec3::Y, [0.5, 0.3], radiance_of))),
        ("disk", Light::Disk(Disk::new(at, -at, 0.3, radiance_of))),
        ("sphere", Light::Sphere(SphereLight { middle: at, radius: 0.2, radiance: radiance_of })),
        ("sky", Light::Environment(Environment::constant(radiance_of, false))),
    ];
    for (name, light) in lights {
        let cloud = volume([32; 3], [2.0; 3], |_| 0.0);
        let mut setup = Setup::new(cloud, matter(0.8), 1.5);
        setup.lights = vec![light];
        setup.max_scatter = 1;
        let scene = setup.scene();
        let ray = Ray::new(Vec3::new(-0.4, -0.2, 3.0), -Vec3::Z);
        let marched = f64::from(
            RayMarch::of_scene(
                &scene,
                &Settings { step: 0.25, light_samples: 512, shadows: Shadows::Exact },
                Level::best(),
            )
            .march(&scene, &ray)
            .radiance
            .g,
        );
        // One ray sees few texels, and they hold bytes: here of 1/20 to 1/4.
        let cached = with_cached_shadows(&scene, &ray, 0.25, 64);
        assert!(
            (cached / marched - 1.0).abs() < 0.02,
            "{name}: {cached} with cached shadows, {marched} without"
        );
        let walked = radiance(&scene, 1_000_000, |_| ray);
        let error = walked.variance_of_mean().sqrt();
        assert!(error < 4e-3 * marched, "{name}: noise {error} of {marched}");
        assert!(
            (walked.mean() - marched).abs() < 3.5 * error + 2e-3 * marched,
            "{name}: {} +- {error} by paths, {marched} by marching",
            walked.mean()
        );
    }
}
