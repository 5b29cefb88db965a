//! Transmittance and free flight through constant, linear and Gaussian density, and through clips.

use crate::scenes::{Setup, matter, mean, volume};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::{ClipShape, Medium};
use tyndall::sampling::Stream;
use tyndall::scene::Scene;
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point};
use tyndall_testing::ChiSquare;

/// Opacity in proportion to the value.
fn ramp() -> Vec<Point> {
    [0.0, 1.0]
        .map(|v| Point { value: v, optics: Optics { opacity: v, albedo: Rgb::WHITE, ..Optics::default() } })
        .to_vec()
}

/// `exp(-integral)` of the trilinear field along a ray, by steps much finer than the spacing of its kinks.
fn exact(medium: &Medium, ray: &Ray, upto: f32) -> f64 {
    let track = medium.track(ray, upto);
    let n = 200_000;
    let dt = f64::from(track.length()) / f64::from(n);
    let sigma = |i: i32| f64::from(medium.sigma_t(track.at(((f64::from(i) + 0.5) * dt) as f32)));
    (-(0..n).map(sigma).sum::<f64>() * dt).exp()
}

fn assert_agree(scene: &Scene, ray: &Ray, expected: f64) {
    let medium = &*scene.medium;
    let track = medium.track(ray, f32::INFINITY);
    let ratio = mean(3, 2_000_000, |_, s| f64::from(medium.transmittance(Level::best(), &track, s)));
    ratio.against(expected).assert_within(3.5, 4e-3);
    let passes =
        mean(4, 2_000_000, |_, s| f64::from(medium.free_flight(&track, s.exponential(), s).is_none()));
    passes.against(expected).assert_within(3.5, 2e-2);
    let step = track.length() / 2000.0;
    let marched = (-f64::from(medium.optical_thickness(Level::best(), &track, step, f32::INFINITY))).exp();
    assert!((marched / expected - 1.0).abs() < 1e-3, "marching {marched}, expected {expected}");
}

#[test]
fn constant_density() {
    let scene = Setup::new(volume([5, 9, 20], [1.0, 2.0, 4.0], |_| 0.5), ramp(), 1.5).scene();
    let ray = Ray::new(Vec3::new(0.2, 0.3, 9.0), -Vec3::Z);
    assert_agree(&scene, &ray, (-0.5 * 1.5 * 4.0_f64).exp());
}

/// Uniform and dense in many cells: the control's optical depth alone reaches the threshold of Russian roulette.
#[test]
fn constant_density_in_many_cells() {
    let scene = Setup::new(volume([6, 6, 64], [1.0, 1.0, 4.0], |_| 1.0), ramp(), 1.0).scene();
    // Eight cells of half an optical depth each.
    assert_agree(&scene, &Ray::new(Vec3::new(0.2, 0.3, 9.0), -Vec3::Z), (-4.0_f64).exp());
}

#[test]
fn linear_density_along_every_axis_and_aslant() {
    let n = 40;
    let field = |axis: usize| move |p: [usize; 3]| (p[axis] as f32 + 0.5) / n as f32;
    for axis in 0..3 {
        let scene = Setup::new(volume([n; 3], [2.0; 3], field(axis)), ramp(), 2.0).scene();
        let mut from = Vec3::splat(0.11);
        from[axis] = 5.0;
        let mut direction = Vec3::ZERO;
        direction[axis] = -1.0;
        // The field is clamped in the outer half voxels, which does not change the integral.
        assert_agree(&scene, &Ray::new(from, direction), (-2.0_f64).exp());
        let aslant = Ray::new(Vec3::new(-3.0, -2.0, -2.5), Vec3::new(1.0, 0.7, 0.9).normalize());
        assert_agree(&scene, &aslant, exact(&scene.medium, &aslant, f32::INFINITY));
    }
}

/// A ball of Gaussian density: dense cells, thin cells and empty ones on the same ray.
fn gaussian() -> Scene {
    let n = 64;
    let value = |p: [usize; 3]| {
        let d = p.map(|i| (i as f32 + 0.5) / n as f32 * 2.0 - 1.0);
        let squared = d.iter().map(|x| x * x).sum::<f32>();
        let v = (-squared / 0.08).exp();
        if v < 0.01 { 0.0 } else { v }
    };
    Setup::new(volume([n; 3], [2.0; 3], value), ramp(), 8.0).scene()
}

#[test]
fn gaussian_density() {
    let scene = gaussian();
    for (from, to) in [
        (Vec3::new(0.05, 0.1, 3.0), Vec3::new(0.0, 0.1, 0.0)),
        (Vec3::new(3.0, -2.0, 1.0), Vec3::new(0.2, 0.1, -0.1)),
        (Vec3::new(0.1, 0.1, 0.1), Vec3::new(-1.0, -2.0, 0.3)),
    ] {
        let ray = Ray::new(from, (to - from).normalize());
        assert_agree(&scene, &ray, exact(&scene.medium, &ray, f32::INFINITY));
    }
}

/// Tests where flights end, not only whether they do.
#[test]
fn collisions_are_distributed_as_the_optical_depth_says() {
    let scene = gaussian();
    let medium = &*scene.medium;
    let ray = Ray::new(Vec3::new(0.03, 0.0, 2.0), Vec3::new(0.02, 0.05, -1.0).normalize());
    let track = medium.track(&ray, f32::INFINITY);
    let through = exact(medium, &ray, f32::INFINITY);
    // Optical depth tabulated at equal steps, so that the distribution function is cheap.
    let n = 20_000;
    let dt = f64::from(track.length()) / f64::from(n);
    let mut depths = vec![0.0_f64];
    for i in 0..n {
        let sigma = medium.sigma_t(track.at(((f64::from(i) + 0.5) * dt) as f32));
        depths.push(depths[depths.len() - 1] + f64::from(sigma) * dt);
    }
    let cdf = |t: f64| {
        let x = (t / dt).clamp(0.0, f64::from(n) - 1e-9);
        let i = x as usize;
        let depth = depths[i] + (depths[i + 1] - depths[i]) * (x - i as f64);
        (1.0 - (-depth).exp()) / (1.0 - through)
    };
    let flights = (0..1_000_000).filter_map(|i| {
        let mut s = Stream::new(9, [i, 0, 0]);
        medium.free_flight(&track, s.exponential(), &mut s).map(|c| f64::from(c.t))
    });
    ChiSquare::default().against_cdf(flights, cdf, 200).assert();
}

/// Distances sampled by inverting a march follow its distribution, and each collision reports the pdf of its distance.
#[test]
fn marched_distances_have_the_density_that_they_report() {
    let scene = gaussian();
    let medium = &*scene.medium;
    let ray = Ray::new(Vec3::new(0.03, 0.0, 2.0), Vec3::new(0.02, 0.05, -1.0).normalize());
    let track = medium.track(&ray, f32::INFINITY);
    // So coarse that the march is far from the exact integral; the last step is a partial one.
    let step = track.length() / 13.7;
    let borders: Vec<f32> = (0..=14_u8).map(|k| (f32::from(k) * step).min(track.length())).collect();
    let mut depths = vec![0.0_f64];
    for pair in borders.windows(2) {
        let sigma_t = medium.mean_sigma_t([track.at(pair[0]), track.at(pair[1])]);
        depths.push(depths[depths.len() - 1] + f64::from(sigma_t) * f64::from(pair[1] - pair[0]));
    }
    let through = (-depths[14]).exp();
    let cdf = |t: f64| {
        let k = ((t / f64::from(step)) as usize).min(13);
        let [start, end] = [borders[k], borders[k + 1]].map(f64::from);
        let share = ((t - start) / (end - start)).clamp(0.0, 1.0);
        let depth = depths[k] + (depths[k + 1] - depths[k]) * share;
        (1.0 - (-depth).exp()) / (1.0 - through)
    };
    let mut passed = 0;
    let mut told = 0;
    let flights = (0..1_000_000).filter_map(|i| {
        let collision = medium.marched_flight(&track, Stream::new(9, [i, 0, 0]).exponential(), step);
        passed += i32::from(collision.is_none());
        let collision = collision?;
        let t = f64::from(collision.t);
        // The slope of the distribution function, away from step boundaries.
        let around = [t - 1e-3 * f64::from(step), t + 1e-3 * f64::from(step)];
        if around.map(|t| (t / f64::from(step)) as usize)[0]
            == around.map(|t| (t / f64::from(step)) as usize)[1]
        {
            let slope = (cdf(around[1]) - cdf(around[0])) / (around[1] - around[0]) * (1.0 - through);
            let pdf = f64::from(collision.pdf());
            assert!((pdf - slope).abs() < 1e-3 * slope + 1e-6, "{pdf}, the slope is {slope} at {t}");
            told += 1;
        }
        Some(t)
    });
    ChiSquare::default().against_cdf(flights, cdf, 200).assert();
    assert!(told > 100_000, "{told}");
    let share = f64::from(passed) / 1e6;
    assert!((share - through).abs() < 4.0 * (through / 1e6).sqrt(), "{share} passed, expected {through}");
}

#[test]
fn one_global_majorant_gives_the_same_answer() {
    let n = 48;
    let value = |p: [usize; 3]| if p[0] < 24 { 0.05 } else { 0.9 };
    let scene = |cell| {
        let setup = Setup::new(volume([n; 3], [2.0; 3], value), ramp(), 3.0);
        Setup { majorant_cell: cell, ..setup }.scene()
    };
    let ray = Ray::new(Vec3::new(-3.0, 0.2, 0.1), Vec3::X);
    for cell in [0, 4, 16] {
        let scene = scene(cell);
        assert_agree(&scene, &ray, exact(&scene.medium, &ray, f32::INFINITY));
    }
}

#[test]
fn what_is_clipped_is_vacuum() {
    let mut setup = Setup::new(volume([10; 3], [2.0; 3], |_| 1.0), matter(1.0), 1.0);
    setup.clip =
        vec![ClipShape::Plane { point: Vec3::new(0.0, 0.0, 0.25), normal: Vec3::new(0.0, 1.0, 1.0) }];
    let scene = setup.scene();
    // Down the middle: z from 1 to 1/4 is clipped, and from 1/4 to -1 is left.
    assert_agree(&scene, &Ray::new(Vec3::Z * 7.0, -Vec3::Z), (-1.25_f64).exp());
    // At y = 1/4 the clipped part reaches down to z = 0.
    assert_agree(&scene, &Ray::new(Vec3::new(0.0, 0.25, 7.0), -Vec3::Z), (-1.0_f64).exp());
    // Upwards from inside the clipped part there is nothing.
    let up = scene.medium.track(&Ray::new(Vec3::new(0.0, 0.0, 0.5), Vec3::Z), f32::INFINITY);
    assert_eq!(up.length(), 0.0);
}

/// A ray close to something dense has many tentative collisions, none of which is real.
#[test]
fn thousands_of_tentative_collisions_take_nothing() {
    let spike = volume([9; 3], [9.0; 3], |p| if p == [0; 3] { 1.0 } else { 0.0 });
    let scene = Setup::new(spike, ramp(), 1000.0).scene();
    let track = scene.medium.track(&Ray::new(Vec3::new(3.0, 3.0, 9.0), -Vec3::Z), f32::INFINITY);
    for level in Level::available() {
        let mut stream = Stream::new(5, [0, 0, 0]);
        assert_eq!(scene.medium.transmittance(level, &track, &mut stream), 1.0, "{level:?}");
    }
}

/// Skipping empty cells changes nothing: marching with cells equals marching with one cell around everything.
#[test]
fn skipping_changes_nothing() {
    let n = 50;
    let value = |p: [usize; 3]| if (p[0] / 11 + p[1] / 7 + p[2] / 13).is_multiple_of(3) { 0.7 } else { 0.0 };
    let scene = |cell| {
        let setup = Setup::new(volume([n; 3], [2.0; 3], value), ramp(), 3.0);
        Setup { majorant_cell: cell, ..setup }.scene()
    };
    let (fine, whole) = (scene(8), scene(0));
    for i in 0..200 {
        let mut s = Stream::new(2, [i, 0, 0]);
        let mut point = || Vec3::new(s.uniform() - 0.5, s.uniform() - 0.5, s.uniform() - 0.5);
        let (from, to) = (point().normalize() * 4.0, point());
        let ray = Ray::new(from, (to - from).normalize());
        // The long step exceeds the one-voxel margin of its neighbours that every cell includes.
        for step in [0.013, 0.11] {
            let thickness = |scene: &Scene| {
                let track = scene.medium.track(&ray, f32::INFINITY);
                scene.medium.optical_thickness(Level::best(), &track, step, f32::INFINITY)
            };
            let (skipped, plain) = (thickness(&fine), thickness(&whole));
            assert!((skipped - plain).abs() <= 1e-6 * plain, "{skipped} {plain} on ray {i}, step {step}");
        }
    }
}
