//! Lights: samplers against their densities, irradiances against closed forms.

use crate::scenes::mean;
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::light::{
    Directional, Disk, Environment, Light, Map, PointLight, Rect, Softbox, SphereLight, Studio,
};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall_testing::ChiSquare;

fn lights_with_an_extent() -> Vec<(&'static str, Light)> {
    let at = Vec3::new(0.4, 1.2, -0.5);
    let texels =
        (0..32 * 16).map(|i| Rgb::splat(if i % 37 == 0 { 9.0 } else { (i % 5) as f32 * 0.1 })).collect();
    let map = Arc::new(Map::new(32, 16, texels).unwrap());
    vec![
        ("sun", Light::Directional(Directional::new(Vec3::new(0.3, -1.0, 0.2), Rgb::WHITE, 50.0))),
        ("rect", Light::Rect(Rect::new(at, -at, Vec3::X, [1.0, 0.5], Rgb::WHITE))),
        ("disk", Light::Disk(Disk::new(at, Vec3::new(-0.2, -1.0, 0.1), 0.7, Rgb::WHITE))),
        ("sphere", Light::Sphere(SphereLight { middle: at, radius: 0.6, radiance: Rgb::WHITE })),
        ("sky", Light::Environment(Environment::constant(Rgb::WHITE, true))),
        ("map", Light::Environment(Environment::map(map, Vec3::Y, Vec3::Z, 30.0, true))),
    ]
}

/// Sampled directions follow the pdf that [`Light::passed`] gives, which equals the pdf of the sample.
#[test]
fn directions_follow_their_density() {
    let from = Vec3::new(0.1, 0.0, 0.2);
    let lights = lights_with_an_extent();
    for (name, light) in &lights {
        let sample = |u: [f32; 2]| {
            let s = light.sample(from, u)?;
            let passed = light.passed(&Ray::new(from, s.direction));
            if let Some(passed) = passed {
                assert!((passed.pdf / s.pdf - 1.0).abs() < 2e-2, "{name}: {} and {}", passed.pdf, s.pdf);
            }
            Some(s.direction.to_array())
        };
        let pdf = |w: [f32; 3]| {
            light.passed(&Ray::new(from, Vec3::from_array(w))).map_or(0.0, |p| f64::from(p.pdf))
        };
        let fit =
            ChiSquare { rows: 32, columns: 64, ..ChiSquare::among(lights.len()) }.directions(sample, pdf);
        assert!(fit.passes(), "{name}: {fit}");
    }
}

/// Irradiance on a surface at the origin with this normal.
fn irradiance(light: &Light, normal: Vec3, paths: u32) -> tyndall_testing::Mean {
    mean(5, paths, |_, s| {
        let sample = light.sample(Vec3::ZERO, [s.uniform(), s.uniform()]);
        sample.map_or(0.0, |l| f64::from(l.radiance.g * l.direction.dot(normal).max(0.0)))
    })
}

#[test]
fn irradiances_have_closed_forms() {
    let up = Vec3::Z;
    let check = |light: Light, expected: f64| {
        irradiance(&light, up, 1_000_000).against(expected).assert_within(3.5, 2e-3);
    };
    // A facing disk: L pi r^2 / (r^2 + d^2). A sphere entirely above the horizon: L pi (r/d)^2 cos.
    let d = 2.0;
    check(Light::Disk(Disk::new(up * d, -up, 1.5, Rgb::splat(3.0))), 3.0 * PI * 2.25 / (2.25 + 4.0));
    let middle = Vec3::new(2.0, 0.0, 2.0);
    let sphere = SphereLight { middle, radius: 1.0, radiance: Rgb::splat(3.0) };
    check(Light::Sphere(sphere), 3.0 * PI / 8.0 * 0.5_f64.sqrt());
    check(Light::Point(PointLight { position: middle, intensity: Rgb::splat(8.0) }), 0.5_f64.sqrt());
    let slanted = Vec3::new(1.0, 0.0, -1.0);
    check(Light::Directional(Directional::new(slanted, Rgb::splat(2.0), 0.0)), 2.0 * 0.5_f64.sqrt());
    // A cone entirely above the horizon gives the irradiance of the sharp light, whatever its angle.
    check(Light::Directional(Directional::new(-up, Rgb::splat(2.0), 60.0)), 2.0);
    check(Light::Environment(Environment::constant(Rgb::splat(0.7), true)), 0.7 * PI);
    // A facing square: 4 F of one quarter of it, F = 1/pi a/sqrt(1+a^2) atan(b/sqrt(1+a^2)) with a = b.
    let a = 0.5_f64;
    let quarter = a / (1.0 + a * a).sqrt() * (a / (1.0 + a * a).sqrt()).atan() / PI;
    check(
        Light::Rect(Rect::new(up * 2.0, -up, Vec3::Y, [2.0, 2.0], Rgb::splat(3.0))),
        3.0 * PI * 4.0 * quarter,
    );
}

#[test]
fn dark_sides_stay_dark() {
    let up = Vec3::Z;
    let behind = [
        Light::Rect(Rect::new(up, up, Vec3::Y, [1.0, 1.0], Rgb::WHITE)),
        Light::Disk(Disk::new(up, up, 1.0, Rgb::WHITE)),
        Light::Sphere(SphereLight { middle: Vec3::ZERO, radius: 1.0, radiance: Rgb::WHITE }),
    ];
    for light in behind {
        assert!(light.sample(Vec3::new(0.1, 0.0, 0.0), [0.3, 0.6]).is_none(), "{light:?}");
        assert!(light.passed(&Ray::new(Vec3::new(0.1, 0.0, 0.0), up)).is_none(), "{light:?}");
    }
}

/// A bright texel appears where the documentation says: the middle column ahead, the right half to the right.
#[test]
fn a_map_is_oriented_as_documented() {
    let texel_at = |x: usize, y: usize| {
        let texels =
            (0..64 * 32).map(|i| if i == y * 64 + x { Rgb::splat(100.0) } else { Rgb::BLACK }).collect();
        Arc::new(Map::new(64, 32, texels).unwrap())
    };
    let brightest = |map, up: Vec3, rotation| {
        let ahead = if up == Vec3::Z { Vec3::Y } else { -Vec3::Z };
        let sky = Light::Environment(Environment::map(map, ahead, up, rotation, true));
        sky.sample(Vec3::ZERO, [0.5, 0.5]).unwrap().direction
    };
    let near = |found: Vec3, expected: Vec3| {
        assert!(found.dot(expected.normalize()) > 0.98, "{found}, expected {expected}");
    };
    near(brightest(texel_at(32, 16), Vec3::Y, 0.0), -Vec3::Z);
    near(brightest(texel_at(48, 16), Vec3::Y, 0.0), Vec3::X);
    near(brightest(texel_at(32, 0), Vec3::Y, 0.0), Vec3::Y);
    near(brightest(texel_at(32, 16), Vec3::Y, 90.0), -Vec3::X);
    near(brightest(texel_at(32, 16), Vec3::Z, 0.0), Vec3::Y);
    near(brightest(texel_at(48, 16), Vec3::Z, 0.0), Vec3::X);
}

/// Lamps of a studio shine from where the documentation says, as wide and as bright as they are.
#[test]
fn a_studio_is_lit_as_described() {
    let lamp = |azimuth, elevation| Softbox {
        azimuth,
        elevation,
        size: [20.0, 10.0],
        softness: 0.0,
        radiance: Rgb::splat(50.0),
    };
    let sky = |lamps: &[Softbox], ahead, up| {
        let (zenith, horizon, ground) = (Rgb::splat(3.0), Rgb::splat(2.0), Rgb::splat(1.0));
        let studio = Studio { zenith, horizon, ground, softboxes: lamps.to_vec() };
        Environment::map(Arc::new(studio.map().unwrap()), ahead, up, 0.0, true)
    };
    for (ahead, up) in [(Vec3::Y, Vec3::Z), (-Vec3::Z, Vec3::Y)] {
        let right = ahead.cross(up);
        let s = 0.5_f32.sqrt();
        for (azimuth, elevation, expected) in [
            (0.0, 0.0, -ahead),
            (90.0, 0.0, right),
            (180.0, 0.0, ahead),
            (-90.0, 0.0, -right),
            (0.0, 45.0, (up - ahead) * s),
            (90.0, -45.0, (right - up) * s),
            (37.0, 90.0, up),
        ] {
            let sky = sky(&[lamp(azimuth, elevation)], ahead, up);
            let found = sky.radiance(expected).g;
            assert!((50.0..54.0).contains(&found), "{found} from {azimuth}, {elevation}");
            assert!(sky.radiance(-expected).g <= 3.0, "behind {azimuth}, {elevation}");
        }
        let sky = sky(&[lamp(0.0, 0.0)], ahead, up);
        // Half of 20 degrees across and of 10 upwards, to within a texel.
        for (axis, half) in [(right, 10.0_f32), (up, 5.0)] {
            for (angle, lit) in [(half - 1.0, true), (half + 1.0, false)] {
                let (sin, cos) = angle.to_radians().sin_cos();
                let found = sky.radiance(axis * sin - ahead * cos).g;
                assert!((found > 30.0) == lit, "{found} at {angle} along {axis}");
            }
        }
        for (direction, expected) in [(up, 3.0), (ahead, 2.0), (-up, 1.0), ((up + ahead) * s, 2.0 + s)] {
            let found = sky.radiance(direction).g;
            assert!((found - expected).abs() < 0.02, "{found} for {expected} from {direction}");
        }
    }
}

/// The irradiance of a soft lamp straight above: of radiance times cosine over its solid angle, and of a gradient.
#[test]
fn a_studio_has_the_irradiance_of_its_lamps() {
    let lamp = Softbox {
        azimuth: 0.0,
        elevation: 90.0,
        size: [40.0, 24.0],
        softness: 0.6,
        radiance: Rgb::splat(10.0),
    };
    let studio =
        Studio { zenith: Rgb::WHITE, horizon: Rgb::BLACK, ground: Rgb::BLACK, softboxes: vec![lamp] };
    let sky = Environment::map(Arc::new(studio.map().unwrap()), Vec3::Y, Vec3::Z, 0.0, true);
    let ramp = |angle: f64, half: f64| {
        let t = (0.5 - (angle.to_degrees().abs() / half - 1.0) / 0.6).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    // Over the plane above, where both angles are those to the axes: cos^4 dx dy.
    let (steps, most) = (600, 0.6);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(steps) * 2.0 * most - most;
    let mut of_lamp = 0.0;
    for (x, y) in (0..steps).flat_map(|i| (0..steps).map(move |k| (at(i), at(k)))) {
        of_lamp += 10.0 * ramp(x.atan(), 20.0) * ramp(y.atan(), 12.0) / (1.0 + x * x + y * y).powi(2);
    }
    of_lamp *= (2.0 * most / f64::from(steps)).powi(2);
    // The gradient is the cosine: 2 pi integral cos^2 d cos = 2 pi / 3.
    let expected = of_lamp + 2.0 * PI / 3.0;
    irradiance(&Light::Environment(sky), Vec3::Z, 1_000_000).against(expected).assert_within(3.5, 3e-3);
}
