//! Glowing matter is a light: seen directly, and as it illuminates other matter.

use crate::scenes::{Setup, blocks, radiance};
use std::f64::consts::PI;
use tyndall::integrator::raymarch::{RayMarch, Settings};
use tyndall::light::{Environment, Light};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::ClipShape;
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point};
use tyndall_testing::{Mean, ZTest};

/// Vacuum at value 0, glowing black matter at 1, dark scattering matter at 2; constant within 0.5 of each value.
fn three_materials(glow: f32, glow_opacity: f32, slab_opacity: f32, slab_albedo: f32) -> Vec<Point> {
    let look = |optics: Optics, at: f32| [-0.5, 0.5].map(|d| Point { value: at + d, optics });
    let nothing = Optics { opacity: 0.0, ..Optics::default() };
    let black = Optics { albedo: Rgb::BLACK, emission: Rgb::splat(glow), opacity: glow_opacity, ..nothing };
    let dark = Optics { albedo: Rgb::splat(slab_albedo), opacity: slab_opacity, ..nothing };
    [look(nothing, 0.0), look(black, 1.0), look(dark, 2.0)].concat()
}

#[test]
fn a_glowing_block_shows_its_radiance_times_its_opacity() {
    let volume = blocks([4, 4, 4], [2.0; 3], |_| 1.0);
    let scene = Setup::new(volume, three_materials(3.0, 0.4, 0.0, 0.0), 1.0).scene();
    let ray = Ray::new(Vec3::new(0.1, 0.2, 5.0), -Vec3::Z);
    let expected = 3.0 * (1.0 - (-0.8_f64).exp());
    radiance(&scene, 2_000_000, |_| ray).against(expected).assert_within(3.0, 1e-3);
    let march = RayMarch::of_scene(
        &scene,
        &Settings { step: 0.1, light_samples: 1, ..Settings::default() },
        Level::best(),
    );
    assert!((f64::from(march.march(&scene, &ray).radiance.g) / expected - 1.0).abs() < 1e-4);
}

/// Nodes and weights of the ten-point Gauss rule on [0, 1].
fn gauss() -> Vec<(f64, f64)> {
    const HALF: [(f64, f64); 5] = [
        (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    HALF.iter().flat_map(|&(x, w)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)]).collect()
}

const GLOW: f64 = 5.0;
const GLOW_SIGMA: f64 = 3.0;
const SLAB_SIGMA: f64 = 2.0;
const SLAB_ALBEDO: f64 = 0.6;

/// Radiance along a ray down into the slab, lit by the glowing cube, with one scattering:
/// the cube [-1/8, 1/8]^3 glows, the slab fills z from -1 to -1/2, and the ray goes straight down at (x, 0).
fn by_quadrature(x: f64, near: f64, far: f64) -> f64 {
    let gauss = gauss();
    let half = 0.125;
    let mut sum = 0.0;
    for &(s, ws) in &gauss {
        let depth = 0.5 * s;
        let position = [x, 0.0, -0.5 - depth];
        let mut lit = 0.0;
        for &(a, wa) in &gauss {
            for &(b, wb) in &gauss {
                for &(c, wc) in &gauss {
                    let y = [a, b, c].map(|t| half * (2.0 * t - 1.0));
                    let to = [0, 1, 2].map(|i| y[i] - position[i]);
                    let distance = to.iter().map(|d| d * d).sum::<f64>().sqrt();
                    let way = to.map(|d| d / distance);
                    // From y away from the slab point: the distance to leave the cube, then the depth in the slab.
                    let leave = (0..3)
                        .map(|i| {
                            if way[i] == 0.0 {
                                f64::INFINITY
                            } else {
                                (half + y[i] * way[i].signum()) / way[i].abs()
                            }
                        })
                        .fold(f64::INFINITY, f64::min);
                    let through = GLOW_SIGMA * leave + SLAB_SIGMA * depth / way[2];
                    let weight = wa * wb * wc * (2.0 * half).powi(3);
                    lit += weight * GLOW_SIGMA * GLOW * (-through).exp() / (distance * distance);
                }
            }
        }
        let seen = (-SLAB_SIGMA * depth).exp() * SLAB_SIGMA * SLAB_ALBEDO / (4.0 * PI);
        sum += 0.5 * ws * seen * lit;
    }
    assert!(near < x && x < far, "the ray misses the cube and hits the slab");
    sum
}

#[test]
fn a_glowing_block_lights_a_dark_slab() {
    // 64 voxels over [-1, 1]: the cube is the middle eight, the slab the lower sixteen.
    let value = |p: [usize; 3]| {
        let middle = |i: usize| (28..36).contains(&i);
        if p[2] < 16 {
            2.0
        } else if p.iter().all(|&i| middle(i)) {
            1.0
        } else {
            0.0
        }
    };
    let volume = blocks([64; 3], [2.0; 3], value);
    let points =
        three_materials(GLOW as f32, GLOW_SIGMA as f32 / 4.0, SLAB_SIGMA as f32 / 4.0, SLAB_ALBEDO as f32);
    for x in [0.2, 0.6] {
        let mut setup = Setup::new(volume.clone(), points.clone(), 4.0);
        setup.max_scatter = 1;
        let scene = setup.scene();
        let ray = Ray::new(Vec3::new(x, 0.0, 3.0), -Vec3::Z);
        let expected = by_quadrature(f64::from(x), 0.125, 1.0);
        radiance(&scene, 32_000_000, |_| ray).against(expected).assert_within(3.0, 1e-3);
    }
}

/// Glowing matter that is clipped away lights nothing.
#[test]
fn a_clipped_block_lights_nothing() {
    let value = |p: [usize; 3]| if p[2] < 4 { 2.0 } else { 1.0 };
    let seen = |clip| {
        let volume = blocks([16; 3], [2.0; 3], value);
        let setup = Setup::new(volume, three_materials(5.0, 0.1, 0.5, 0.6), 4.0);
        let scene = Setup { clip, max_scatter: 1, ..setup }.scene();
        radiance(&scene, 10_000, |_| Ray::new(Vec3::new(0.1, 0.2, -3.0), Vec3::Z)).mean()
    };
    // The clip leaves only part of the dark quarter below z = -1/2.
    let cut = ClipShape::Plane { point: Vec3::Z * -0.6, normal: Vec3::Z };
    assert!(seen(Vec::new()) > 0.01);
    assert_eq!(seen(vec![cut]), 0.0);
}

/// Light from glowing matter and from lights together is the sum of both alone.
#[test]
fn glow_and_lamps_add_up() {
    let value = |p: [usize; 3]| if p[2] < 8 { 2.0 } else { 1.0 };
    let seen = |seed, glow, sky: f32| {
        let points = three_materials(glow, 0.25, 0.25, 0.9);
        let setup = Setup::new(blocks([16; 3], [2.0; 3], value), points, 4.0);
        let lights = vec![Light::Environment(Environment::constant(Rgb::splat(sky), false))];
        let scene = Setup { seed, lights, max_scatter: 2, ..setup }.scene();
        radiance(&scene, 4_000_000, |_| Ray::new(Vec3::new(0.1, 0.2, -3.0), Vec3::Z))
    };
    let (glow, lamp, both) = (seen(1, 2.0, 0.0), seen(2, 0.0, 0.5), seen(3, 2.0, 0.5));
    let variance = [glow, lamp, both].iter().map(Mean::variance_of_mean).sum::<f64>();
    assert!(variance.sqrt() < 1e-3 * both.mean(), "noise {} of {}", variance.sqrt(), both.mean());
    ZTest::new(both.mean(), variance, glow.mean() + lamp.mean()).assert();
}

/// Where matter both glows and scatters, a point may be lit by its own neighbourhood; the balance heuristic
/// over both sampling strategies keeps the estimate finite. In thermal equilibrium inside an infinite medium
/// the radiance is Le everywhere: a thick block shows it, whatever its albedo.
#[test]
fn a_thick_glowing_block_is_a_black_body() {
    let glowing = Optics { emission: Rgb::splat(2.0), albedo: Rgb::splat(0.3), ..Optics::default() };
    let volume = blocks([16; 3], [2.0; 3], |_| 0.0);
    let setup = Setup::new(volume, vec![Point { value: 0.0, optics: glowing }], 60.0);
    let scene = setup.scene();
    // Seen from its middle, at least 60 mean free paths from any border.
    radiance(&scene, 2_000_000, |_| Ray::new(Vec3::ZERO, Vec3::X)).against(2.0).assert_within(3.0, 1e-3);
}
