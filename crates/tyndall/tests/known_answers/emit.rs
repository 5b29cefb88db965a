//! Light paths from every kind of light: the power they carry into the box, and where they enter it.

use crate::scenes::mean;
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::light::{Directional, Disk, Enclosure, Environment, Light, Map, PointLight, Rect, SphereLight};
use tyndall::math::{Bounds, Ray, Rgb, Vec3};
use tyndall::sampling::Stream;
use tyndall::volume::{Grid, Space};
use tyndall_testing::{ChiSquare, Mean};

const UNIT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Boxes of unequal edges: axis-aligned; rotated; sheared and left-handed. All have the same centre.
pub fn grids() -> [(&'static str, Grid); 3] {
    let (s, c) = 0.6_f64.sin_cos();
    let (p, q) = 0.9_f64.sin_cos();
    let turned = [[c, -s * q, s * p], [s, c * q, -c * p], [0.0, p, q]];
    let sheared = [[1.0, 0.28, -0.3], [0.0, 0.96, 0.2], [0.0, 0.0, -0.87_f64.sqrt()]];
    [("straight", UNIT), ("turned", turned), ("sheared", sheared)].map(|(name, direction)| {
        let (dims, spacing) = ([10, 12, 8], [0.2, 0.15, 0.3]);
        let from_middle = |row: [f64; 3]| -> f64 {
            (0..3).map(|a| row[a] * 0.5 * (dims[a] as f64 - 1.0) * spacing[a]).sum()
        };
        let origin = direction.map(|row| 0.1 - from_middle(row));
        (name, Grid::new(dims, spacing, direction, origin, Space::Plain).unwrap())
    })
}

/// A sphere inside the box of every grid.
pub const PROBE: (Vec3, f32) = (Vec3::new(0.3, 0.2, -0.1), 0.35);

/// Middle of the grids, wherever their files place them: the origin of the renderer's world.
const MIDDLE: Vec3 = Vec3::ZERO;

/// Area vectors of the three pairs of faces.
fn normals(grid: &Grid) -> [Vec3; 3] {
    let c = grid.world_corners();
    let [x, y, z] = [c[1] - c[0], c[2] - c[0], c[4] - c[0]];
    [y.cross(z), z.cross(x), x.cross(y)]
}

fn silhouette(grid: &Grid, direction: Vec3) -> f64 {
    normals(grid).iter().map(|n| f64::from(n.dot(direction).abs())).sum()
}

fn hits(grid: &Grid, ray: &Ray) -> bool {
    // Rounding may make a ray miss an edge.
    let b = grid.index_bounds();
    let loose = Bounds::new(b.min - 1e-4, b.max + 1e-4);
    !loose.intersect(&grid.ray_to_index(ray)).is_empty()
}

/// The random numbers that a light path starts with.
pub fn uniforms(stream: &mut Stream) -> [f32; 4] {
    std::array::from_fn(|_| stream.uniform())
}

/// Power per unit of the light's colour, in the green channel.
fn power(light: &Light, grid: &Grid, paths: u32) -> Mean {
    let box_ = Enclosure::new(grid);
    mean(3, paths, |_, stream| light.emit(&box_, uniforms(stream)).map_or(0.0, |e| f64::from(e.flux.g)))
}

fn point(position: Vec3) -> Light {
    Light::Point(PointLight { position, intensity: Rgb::WHITE })
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected}");
}

#[test]
fn parallel_light_falls_on_the_silhouette() {
    for (_, grid) in grids() {
        for travel in [Vec3::X, Vec3::new(0.3, -1.0, 0.2), Vec3::new(-2.0, 0.1, 1.0)] {
            let sharp = Light::Directional(Directional::new(travel, Rgb::WHITE, 0.0));
            near(power(&sharp, &grid, 100).mean(), silhouette(&grid, travel.normalize()), 1e-6);
        }
    }
}

/// Cauchy: the mean silhouette of a convex body is a quarter of its surface.
#[test]
fn a_constant_sky_falls_on_the_surface() {
    for (_, grid) in grids() {
        let sky = Light::Environment(Environment::constant(Rgb::WHITE, true));
        let surface: f64 = normals(&grid).iter().map(|n| 2.0 * f64::from(n.length())).sum();
        power(&sky, &grid, 1_000_000).against(PI * surface).assert_within(3.5, 1e-3);
    }
}

#[test]
fn points_fill_the_solid_angle_of_the_box() {
    let [(_, straight), ..] = grids();
    for (_, grid) in grids() {
        let inside = [MIDDLE, grid.index_to_world(Vec3::splat(0.1))];
        for at in inside {
            near(power(&point(at), &grid, 100).mean(), 4.0 * PI, 1e-6);
        }
        // From far away only the silhouette counts: below and beyond the distance at which rays become parallel.
        for distance in [1e4, 1e6, 1.99e7, 2.3e7, 1e12] {
            let way = Vec3::new(0.5, 0.7, -0.3).normalize();
            let expected = silhouette(&grid, way) / f64::from(distance).powi(2);
            near(
                power(&point(MIDDLE + way * distance), &grid, 100).mean(),
                expected,
                5.0 / f64::from(distance) + 3e-6,
            );
        }
    }
    // Above the centre of one face; [vanOosterom83] for the four rectangles from the centre to each corner.
    let size = straight.world_bounds().size().as_dvec3();
    for height in [1e-6, 1e-2, 1.0, 30.0] {
        let at = MIDDLE + Vec3::Z * (0.5 * size.z + height) as f32;
        let height = f64::from(at.z - MIDDLE.z) - 0.5 * size.z;
        let (a, b) = (0.5 * size.x, 0.5 * size.y);
        let expected = 4.0 * (a * b).atan2(height * (a * a + b * b + height * height).sqrt());
        near(power(&point(at), &straight, 100).mean(), expected, 1e-6);
    }
}

#[test]
fn surfaces_inside_shine_whole() {
    let [(_, grid), ..] = grids();
    let up = Vec3::new(0.2, 0.3, 1.0);
    let rect = Light::Rect(Rect::new(MIDDLE, up, Vec3::X, [0.5, 0.3], Rgb::WHITE));
    near(power(&rect, &grid, 100).mean(), PI * 0.15, 1e-6);
    let disk = Light::Disk(Disk::new(MIDDLE, up, 0.3, Rgb::WHITE));
    near(power(&disk, &grid, 100).mean(), PI * PI * 0.09, 1e-6);
    let sphere = Light::Sphere(SphereLight { middle: MIDDLE, radius: 0.3, radiance: Rgb::WHITE });
    near(power(&sphere, &grid, 100).mean(), PI * 4.0 * PI * 0.09, 1e-6);
    let around = Light::Sphere(SphereLight { middle: MIDDLE, radius: 3.0, radiance: Rgb::WHITE });
    assert_eq!(power(&around, &grid, 100).mean(), 0.0);
}

/// Beside a face, an edge and a corner, near and far: the pdf is one over the flux, which is constant.
#[test]
fn directions_from_outside_are_uniform_over_the_box() {
    let positions = [[0.5, 0.4, 1.05], [-0.3, 0.2, 1.4], [1.3, -0.2, -0.6], [0.3, 1.6, 3.0]];
    for (name, grid) in grids() {
        let box_ = Enclosure::new(&grid);
        let b = grid.index_bounds();
        for position in positions {
            let from = grid.index_to_world(b.min + b.size() * Vec3::from_array(position));
            let light = point(from);
            let flux = light.emit(&box_, [0.5; 4]).unwrap().flux.g;
            let sample = |u: [f32; 2]| {
                let emitted = light.emit(&box_, [u[0], u[1], 0.5, 0.5])?;
                assert_eq!(emitted.flux.g, flux);
                Some(emitted.ray.direction.to_array())
            };
            let pdf = |w: [f32; 3]| {
                let ray = Ray::new(from, Vec3::from_array(w));
                if hits(&grid, &ray) { 1.0 / f64::from(flux) } else { 0.0 }
            };
            let test = ChiSquare { rows: 32, columns: 64, ..ChiSquare::among(3 * positions.len()) };
            let fit = test.directions(sample, pdf);
            assert!(fit.passes(), "{name}, from {position:?}: {fit}");
        }
    }
}

/// Lights on faces, edges and corners, in their planes and lines, a hair away from them, and far away: paths start at
/// finite positions with finite flux, and those of point lights outside hit the box.
#[test]
fn light_positions_that_are_hard_are_handled() {
    let mut started = 0;
    for (name, grid) in grids() {
        let box_ = Enclosure::new(&grid);
        let b = grid.index_bounds();
        let along = [-1e30, -1e7, -3.0, -1e-6, 0.0, 1e-6, 0.5, 1.0, 1.000_001, 2.0, 1e4, 1e12];
        for position in (0..12_usize.pow(3)).map(|i| [along[i % 12], along[i / 12 % 12], along[i / 144]]) {
            let position = Vec3::from_array(position);
            let from = grid.index_to_world(b.min + b.size() * position);
            let back = (0.4 - position).clamp(Vec3::splat(-1e9), Vec3::splat(1e9));
            let sphere = SphereLight { middle: from, radius: 0.1, radiance: Rgb::WHITE };
            let rect = Rect::new(from, back, Vec3::X, [0.1, 0.2], Rgb::WHITE);
            for (kind, light) in [point(from), Light::Rect(rect), Light::Sphere(sphere)].iter().enumerate() {
                for u in [[0.0; 4], [0.3, 0.6, 0.5, 0.5], [1.0_f32.next_down(); 4]] {
                    let Some(emitted) = light.emit(&box_, u) else { continue };
                    let what = format!("{name}, {position}, {kind}: {emitted:?}");
                    assert!(emitted.ray.origin.is_finite() && emitted.flux.is_finite(), "{what}");
                    assert!((emitted.ray.direction.length() - 1.0).abs() < 1e-5, "{what}");
                    let outside = position.cmplt(Vec3::splat(-1e-5)).any()
                        || position.cmpgt(Vec3::splat(1.000_01)).any();
                    assert!(kind != 0 || !outside || hits(&grid, &emitted.ray), "{what}");
                    started += 1;
                }
            }
        }
    }
    assert!(started > 6000, "{started}");
}

/// A face's diagonals cross at its centre. Seen from just off it, both triangles of the face are almost flat: the box
/// fills half the sphere of directions, or the light counts as being on the border.
#[test]
fn a_hair_above_a_face_is_on_it() {
    let grid = Grid::new([4; 3], [0.25; 3], UNIT, [-0.375, -0.375, 0.125], Space::Plain).unwrap();
    for exponent in 4..40 {
        let at = point(Vec3::Z * -(10.0_f32.powi(-exponent)));
        let flux = power(&at, &grid, 100).mean() / PI;
        assert!((flux - 2.0).abs() < 1e-3 || (flux - 4.0).abs() < 1e-6, "1e-{exponent}: {flux} pi");
    }
}

/// A box so flat that the corners of its faces coincide in double precision.
#[test]
fn no_box_is_too_flat() {
    let grid = Grid::new([1; 3], [1e-15, 1e15, 1.0], UNIT, [0.0; 3], Space::Plain).unwrap();
    let box_ = Enclosure::new(&grid);
    let along = [-1e16, -1.0, -1e-6, 0.0, 1e-10, 1.0, 1e13];
    for position in (0..7_usize.pow(3)).map(|i| [along[i % 7], along[i / 7 % 7], along[i / 49]]) {
        for u in [[0.0; 4], [0.3, 0.6, 0.5, 0.5], [1.0_f32.next_down(); 4]] {
            let Some(emitted) = point(Vec3::from_array(position)).emit(&box_, u) else { continue };
            let finite = emitted.ray.origin.is_finite() && emitted.ray.direction.is_finite();
            assert!(finite && emitted.flux.is_finite(), "{position:?}: {emitted:?}");
        }
    }
}

/// A silhouette of 1e44 square units under an irradiance of 1 receives more power than single precision can represent.
#[test]
fn power_past_single_precision_is_not_sent() {
    let grid = Grid::new([1 << 24, 1 << 24, 1], [1e15; 3], UNIT, [0.0; 3], Space::Plain).unwrap();
    let sun = |travel| Light::Directional(Directional::new(travel, Rgb::WHITE, 0.0));
    assert!(sun(Vec3::Z).emit(&Enclosure::new(&grid), [0.5; 4]).is_none());
    assert!(sun(Vec3::X).emit(&Enclosure::new(&grid), [0.5; 4]).is_some());
}

/// Rays start outside the box, so that the face they enter is ahead of them.
#[test]
fn rays_enter_the_box_ahead() {
    for (name, grid) in grids() {
        let box_ = Enclosure::new(&grid);
        for (kind, light) in lights().iter().filter(|(kind, _)| !kind.ends_with("inside")) {
            let mut stream = Stream::new(1, [0; 3]);
            for _ in 0..10_000 {
                let Some(emitted) = light.emit(&box_, uniforms(&mut stream)) else { continue };
                let stretch = grid.index_bounds().intersect(&grid.ray_to_index(&emitted.ray));
                assert!(stretch.start > 0.0, "{name}, {kind}: {emitted:?}");
            }
        }
    }
}

/// Some of each kind, close to the box, aside and inside, in one colour.
pub fn lights() -> Vec<(&'static str, Light)> {
    let color = Rgb::new(0.7, 2.0, 0.3);
    let texels = |i: usize| {
        Rgb::new(0.1, if i.is_multiple_of(37) { 9.0 } else { 0.2 }, (i % 5) as f32 * 0.1 + (i / 256) as f32)
    };
    let map = Arc::new(Map::new(32, 16, (0..32 * 16).map(texels).collect()).unwrap());
    let travel = Vec3::new(0.3, -1.0, 0.2);
    let (close, wide, inner) =
        (Vec3::new(0.4, 2.3, -0.5), Vec3::new(-3.0, 2.5, 4.0), Vec3::new(-0.3, 0.1, 0.5));
    let sphere = |middle, radius| Light::Sphere(SphereLight { middle, radius, radiance: color });
    let rect = |at: Vec3, size| Light::Rect(Rect::new(at, PROBE.0 - at, Vec3::X, size, color));
    let disk = |at: Vec3, radius| Light::Disk(Disk::new(at, PROBE.0 - at + Vec3::X * 0.3, radius, color));
    let point = |position| Light::Point(PointLight { position, intensity: color });
    vec![
        ("sharp sun", Light::Directional(Directional::new(travel, color, 0.0))),
        ("sun", Light::Directional(Directional::new(travel, color, 10.0))),
        ("half the sky", Light::Directional(Directional::new(travel, color, 180.0))),
        ("point close", point(close)),
        ("point aside", point(wide)),
        ("point inside", point(inner)),
        ("rect close", rect(close, [1.0, 0.5])),
        ("rect aside", rect(wide, [2.0, 2.5])),
        ("rect inside", rect(inner, [0.2, 0.1])),
        ("rect half inside", rect(Vec3::new(0.3, 0.9, -0.3), [0.3, 1.5])),
        ("disk close", disk(close, 0.7)),
        ("disk aside", disk(wide, 1.5)),
        ("disk inside", disk(inner, 0.1)),
        ("sphere close", sphere(close, 0.6)),
        ("sphere aside", sphere(wide, 2.0)),
        ("sphere inside", sphere(inner, 0.1)),
        ("sphere half inside", sphere(Vec3::new(0.4, 0.9, -0.4), 0.2)),
        ("sky", Light::Environment(Environment::constant(color, true))),
        ("map", Light::Environment(Environment::map(map, Vec3::Y, Vec3::Z, 30.0, true))),
    ]
}

/// Lights of each kind, in another colour, and with each other property changed.
#[test]
fn a_colour_changes_no_path_and_anything_else_does() {
    let at = Vec3::new(0.4, 2.3, -0.5);
    let (x, y) = (Vec3::X, Vec3::Y);
    let texels = |bright: f32| Arc::new(Map::new(2, 1, vec![Rgb::splat(bright), Rgb::WHITE]).unwrap());
    let map = texels(2.0);
    let sun = |travel, color, angle| Light::Directional(Directional::new(travel, color, angle));
    let point = |position, intensity| Light::Point(PointLight { position, intensity });
    let rect = |at, to, up, size, color| Light::Rect(Rect::new(at, to, up, size, color));
    let disk = |at, to, radius, color| Light::Disk(Disk::new(at, to, radius, color));
    let sphere = |middle, radius, radiance| Light::Sphere(SphereLight { middle, radius, radiance });
    let sky = |color| Light::Environment(Environment::constant(color, true));
    let maps = |map: &Arc<Map>, up, turn| {
        Light::Environment(Environment::map(Arc::clone(map), -Vec3::Z, up, turn, true))
    };
    let (red, white) = (Rgb::new(3.0, 0.0, 0.1), Rgb::WHITE);
    // For each kind a light, the same one in another colour, and different ones.
    let kinds = [
        [sun(-y, red, 5.0), sun(-y, white, 5.0), sun(-y, red, 5.1), sun(x - y, red, 5.0)].to_vec(),
        [point(at, red), point(at, white), point(at + x, red)].to_vec(),
        vec![
            rect(at, -y, x, [1.0, 2.0], red),
            rect(at, -y, x, [1.0, 2.0], white),
            rect(at + x, -y, x, [1.0, 2.0], red),
            rect(at, -y - x, x, [1.0, 2.0], red),
            rect(at, -y, Vec3::Z, [1.0, 2.0], red),
            rect(at, -y, x, [1.1, 2.0], red),
            rect(at, -y, x, [1.0, 2.1], red),
        ],
        vec![
            disk(at, -y, 1.0, red),
            disk(at, -y, 1.0, white),
            disk(at + x, -y, 1.0, red),
            disk(at, -y - x, 1.0, red),
            disk(at, -y, 1.1, red),
        ],
        [sphere(at, 1.0, red), sphere(at, 1.0, white), sphere(at + x, 1.0, red), sphere(at, 1.1, red)]
            .to_vec(),
        [sky(red), sky(white)].to_vec(),
        [maps(&map, y, 0.0), maps(&texels(2.0), y, 0.0), maps(&map, y, 1.0), maps(&texels(3.0), y, 0.0)]
            .to_vec(),
    ];
    let [(_, grid), ..] = grids();
    let box_ = Enclosure::new(&grid);
    for (i, lights) in kinds.iter().enumerate() {
        let (light, recoloured) = (&lights[0], &lights[1]);
        assert!(light.same_paths(recoloured), "{light:?}");
        let mut stream = Stream::new(1, [0; 3]);
        for _ in 0..100 {
            let u = uniforms(&mut stream);
            assert_eq!(light.emit(&box_, u), recoloured.emit(&box_, u), "{light:?}");
        }
        let strangers = kinds.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, lights)| &lights[0]);
        for other in lights[2..].iter().chain(strangers) {
            assert!(!light.same_paths(other) && !other.same_paths(light), "{light:?} and {other:?}");
        }
        let is_map = i == 6;
        let expected = if is_map { [white, white] } else { [red, white] };
        assert_eq!([light.color(), recoloured.color()], expected);
    }
    let hidden = Light::Environment(Environment::constant(red, false));
    assert!(sky(red).same_paths(&hidden), "visibility to the camera does not affect light paths");
}
