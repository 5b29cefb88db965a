//! Photon mapping against closed forms, and against `path`, which is unbiased.
//!
//! Gathering blurs; the bias is below a percent in matter that varies little and is optically thin across the radius.

use crate::scenes::{Setup, blocks, henyey_greenstein, matter, volume};
use crate::seeds::{BLOCK, Estimate, PIXELS, estimate};
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::camera::{Camera, Lens};
use tyndall::integrator::Method;
use tyndall::integrator::path::PathTracer;
use tyndall::integrator::photon::{
    self, Histories, HistoryBins, PhotonMapper, Settings as PhotonSettings, SpatialHistory,
};
use tyndall::light::{Directional, Disk, Environment, Light, Map, PointLight, Rect, SphereLight};
use tyndall::math::{Rgb, Vec3};
use tyndall::medium::ClipShape;
use tyndall::scattering::{Abc, Brdf};
use tyndall::scene::{Background, Scene};
use tyndall::transfer::{Optics, Point};
use tyndall::volume::{Grid, Space, ValueMap, Volume, Voxels};
use tyndall_testing::Mean;

/// Samples per pixel of a `path` picture.
const SAMPLES: u32 = 32;
/// Relative change that blur may cause in a picture's mean. The RMS change of blocks, which blur mixes, may be twice.
const BIAS: f64 = 0.01;

/// Settings of most tests.
pub const PHOTONS: PhotonSettings = PhotonSettings {
    photons: 200_000,
    radius: 1.0,
    segments: 7,
    steps_per_voxel: 2.0,
    gather_spacing: 1.5,
    estimate: photon::Estimate::Point,
    nearest: 24,
    histories: Histories::Interactions,
    history_bits: 64,
    bins: HistoryBins::Quantile,
    spatial: SpatialHistory::Cells,
};

fn photons(scene: &Scene, settings: PhotonSettings) -> Estimate {
    estimate(scene, &PhotonMapper::choose(settings), 1)
}

fn path(scene: &Scene) -> Estimate {
    estimate(scene, &PathTracer::usual(), SAMPLES)
}

/// A cloud in [-1, 1]^3, without edges.
fn cloud(p: [f32; 3]) -> f32 {
    (-2.5 * (Vec3::from_array(p) - Vec3::new(0.1, -0.05, 0.15)).length_squared()).exp()
}

/// The value of a voxel, one of 32 along each axis, by its position in [-1, 1]^3.
fn of_32(value: impl Fn([f32; 3]) -> f32) -> impl Fn([usize; 3]) -> f32 {
    move |p| value(p.map(|i| (i as f32 + 0.5) / 16.0 - 1.0))
}

/// Opacity rises with the value from zero at 0 to its full value at 1.
fn ramp(optics: Optics) -> Vec<Point> {
    let clear = Point { value: 0.0, optics: Optics { opacity: 0.0, ..optics } };
    vec![clear, Point { value: 1.0, optics }]
}

fn sun() -> Light {
    Light::Directional(Directional::new(Vec3::new(0.3, 0.5, -1.0), Rgb::WHITE, 0.0))
}

/// The cloud in sunlight, with the given albedo.
fn sunny(albedo: f32) -> Setup {
    let optics = Optics { albedo: Rgb::splat(albedo), ..Optics::default() };
    let volume = volume([32; 3], [2.0; 3], of_32(cloud));
    Setup { lights: vec![sun()], max_scatter: 20, ..Setup::new(volume, ramp(optics), 2.0) }
}

/// The scene seen by an orthographic camera looking at a position.
fn seen(setup: Setup, from: Vec3, to: Vec3, height: f32) -> Scene {
    let mut scene = setup.scene();
    scene.camera = Camera::new(from, to, Vec3::Z, Lens::Orthographic { height });
    scene.size = [u32::try_from(PIXELS).unwrap(); 2];
    scene
}

const ASIDE: Vec3 = Vec3::new(2.0, -4.0, 1.0);

#[track_caller]
fn assert_as_path(name: &str, scene: &Scene) {
    assert_as_path_with(PHOTONS, name, scene);
}

#[track_caller]
fn assert_as_path_with(settings: PhotonSettings, name: &str, scene: &Scene) {
    photons(scene, settings).assert_near(&path(scene), BIAS, name);
}

/// A cube under a sun that shines straight down, seen along y: `albedo p E exp(-sigma (1 - z)) (1 - exp(-2 sigma))`;
/// also seen from above.
#[test]
fn single_scattering_in_a_cube() {
    // With coarser steps all rays would sample the cube's boundary layer at the same depths, and the error that the
    // few points of the kernel make there would not average out: a percent.
    let fine = PhotonSettings { photons: 50_000, steps_per_voxel: 8.0, ..PHOTONS };
    let sigma = 0.8_f64;
    let albedo = Rgb::new(0.5, 1.0, 0.2);
    for g in [0.0, 0.6, -0.5] {
        let mut points = matter(0.0);
        points[0].optics.albedo = albedo;
        let setup = || Setup {
            phase: henyey_greenstein(g),
            lights: vec![Light::Directional(Directional::new(-Vec3::Z, Rgb::WHITE, 0.0))],
            max_scatter: 1,
            ..Setup::new(volume([32; 3], [2.0; 3], |_| 0.0), points.clone(), sigma as f32)
        };
        let g = f64::from(g);
        let phase = |cos: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
        let colored = |x: f64| albedo.to_array().map(|a| f64::from(a) * x);
        // The middle of the cube, in rows of blocks from the top.
        let aside = seen(setup(), -Vec3::Y * 5.0, Vec3::ZERO, 1.2);
        let edge = |row: usize| 0.6 - 1.2 * (row * BLOCK) as f64 / PIXELS as f64;
        let light = |[_, row]: [usize; 2]| {
            let through = |z: f64| (-sigma * (1.0 - z)).exp() / sigma;
            let mean = (through(edge(row)) - through(edge(row + 1))) / (edge(row) - edge(row + 1));
            colored(phase(0.0) * mean * (1.0 - (-2.0 * sigma).exp()))
        };
        photons(&aside, fine).assert_near(&Estimate::exactly(light), BIAS, &format!("aside, g = {g}"));
        let mut above = seen(setup(), Vec3::X * 5.0, Vec3::ZERO, 1.2);
        above.camera = Camera::new(Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y, Lens::Orthographic { height: 1.2 });
        let back = phase(-1.0) * (1.0 - (-4.0 * sigma).exp()) / 2.0;
        photons(&above, fine).assert_near(
            &Estimate::exactly(|_| colored(back)),
            BIAS,
            &format!("above, g = {g}"),
        );
    }
}

/// With albedo 1 under a uniform sky every pixel is as bright as the sky.
#[test]
fn white_furnace() {
    let lumps =
        |p: [f32; 3]| 0.5 + 0.5 * (p[0] * 4.0).sin() * (p[1] * 5.0 + 1.0).sin() * (p[2] * 4.0 + 0.5).sin();
    for (name, g, density) in
        [("isotropic", 0.0, 2.0), ("forward", 0.6, 3.0), ("backward", -0.5, 2.0), ("thick", 0.0, 5.0)]
    {
        let white = Optics { albedo: Rgb::WHITE, ..Optics::default() };
        let setup = Setup {
            phase: henyey_greenstein(g),
            lights: vec![Light::Environment(Environment::constant(Rgb::WHITE, true))],
            max_scatter: 1000,
            ..Setup::new(volume([32; 3], [2.0; 3], of_32(lumps)), ramp(white), density)
        };
        let scene = seen(setup, ASIDE, Vec3::ZERO, 2.0);
        photons(&scene, PHOTONS).assert_near(&Estimate::exactly(|_| [1.0; 3]), BIAS, name);
    }
}

/// At surfaces, light is weighted by the cosine of the direction that it arrives from, on light paths too.
#[test]
fn surfaces() {
    let abc = Brdf::Abc(Abc::new(20.0, 1.2).unwrap());
    for (name, brdf) in [("lambert", Brdf::Lambert), ("glossy", Brdf::AshikhminShirley), ("abc", abc)] {
        let optics = Optics {
            albedo: Rgb::splat(0.9),
            surface: 1.0,
            specular: Rgb::splat(0.5),
            roughness: 0.6,
            ..Optics::default()
        };
        let setup = Setup { brdf, max_scatter: 2, points: ramp(optics), ..sunny(0.9) };
        assert_as_path(name, &seen(setup, ASIDE, Vec3::ZERO, 1.6));
    }
}

#[test]
fn lights_of_every_kind() {
    let away = Vec3::new(1.2, -0.9, 1.5);
    let white = Rgb::WHITE;
    let texel =
        |i: usize| if i % 32 < 8 { Rgb::new(3.0, 1.0, 0.2) } else { Rgb::splat((i / 64) as f32 * 0.1) };
    let map = Arc::new(Map::new(32, 16, (0..32 * 16).map(texel).collect()).unwrap());
    let sky = |environment| Light::Environment(environment);
    let lights = [
        ("sun", sun()),
        ("wide sun", Light::Directional(Directional::new(-away, white, 40.0))),
        ("point", Light::Point(PointLight { position: away, intensity: white })),
        // Outside the picture, where no view ray comes near.
        ("point inside", Light::Point(PointLight { position: Vec3::new(0.95, 0.9, -0.9), intensity: white })),
        ("rect", Light::Rect(Rect::new(away, -away, Vec3::Z, [1.0, 0.5], white))),
        ("rect inside", Light::Rect(Rect::new(Vec3::Z * 0.9, -Vec3::Z, Vec3::X, [1.0, 0.5], white))),
        ("disk", Light::Disk(Disk::new(away, Vec3::new(-1.0, 0.2, -1.0), 0.6, white))),
        ("sphere", Light::Sphere(SphereLight { middle: away, radius: 0.5, radiance: white })),
        ("sky", sky(Environment::constant(white, false))),
        ("map", sky(Environment::map(map, Vec3::Y, Vec3::Z, 30.0, true))),
    ];
    for (name, light) in lights {
        let scene = seen(Setup { lights: vec![light], ..sunny(0.7) }, ASIDE, Vec3::ZERO, 1.6);
        // Paths that end beside a point light are rare and bright: eight seeds do not tell how noisy few of them are.
        let samples = if name == "point inside" { 16 * SAMPLES } else { SAMPLES };
        let paths = estimate(&scene, &PathTracer::usual(), samples);
        photons(&scene, PHOTONS).assert_near(&paths, BIAS, name);
    }
}

/// A channel that is black in the light or the matter does not affect the others, and lights add up.
#[test]
fn black_channels_and_several_lights() {
    let green = Optics { albedo: Rgb::new(0.0, 1.0, 0.6), ..Optics::default() };
    let red = Directional::new(Vec3::new(0.3, 0.5, -1.0), Rgb::new(1.0, 0.5, 0.0), 0.0);
    let lights = vec![
        Light::Directional(red),
        Light::Environment(Environment::constant(Rgb::new(0.0, 0.1, 0.3), false)),
    ];
    let setup = Setup { lights: lights[..1].to_vec(), points: ramp(green), ..sunny(0.0) };
    assert_as_path("one light", &seen(setup, ASIDE, Vec3::ZERO, 1.6));
    let setup = Setup { lights, points: ramp(green), ..sunny(0.0) };
    assert_as_path("two lights", &seen(setup, ASIDE, Vec3::ZERO, 1.6));
}

/// Each path carries its share of the light, even one that misses: more paths do not change the mean.
#[test]
fn brightness_does_not_depend_on_the_number_of_photons() {
    let setup = Setup { density: 0.3, ..sunny(0.9) };
    let scene = seen(setup, ASIDE, Vec3::ZERO, 1.6);
    let with = |count| photons(&scene, PhotonSettings { photons: count, ..PHOTONS });
    // Not a power of two, and far from a multiple of the blocks in which numbers are stratified.
    with(200_001).assert_near(&with(1_000_000), BIAS, "photons");
}

/// The nearest-photon and beam estimates.
#[test]
fn the_other_estimates() {
    use photon::Estimate::{Beam, Nearest};
    let optics = Optics { surface: 0.5, ..Optics::default() };
    let setup = Setup { points: ramp(optics), phase: henyey_greenstein(0.4), ..sunny(0.0) };
    let scene = seen(setup, ASIDE, Vec3::ZERO, 1.6);
    let exact = path(&scene);
    for (name, estimate_by, radius) in [("nearest", Nearest, 3.0), ("beam", Beam, 1.0)] {
        let settings = PhotonSettings { estimate: estimate_by, radius, ..PHOTONS };
        estimate(&scene, &PhotonMapper::choose(settings), 1).assert_near(&exact, BIAS, name);
    }
}

/// Most gathers in thin matter can be skipped: the same photons give the same picture.
#[test]
fn gathers_far_apart() {
    for estimate in [photon::Estimate::Point, photon::Estimate::Beam] {
        let at_each_step = PhotonSettings { estimate, gather_spacing: 0.0, ..PHOTONS };
        let exact = photons(&seen(sunny(0.8), ASIDE, Vec3::ZERO, 1.6), at_each_step);
        for gather_spacing in [0.5, 1.5, 4.0] {
            let settings = PhotonSettings { gather_spacing, ..at_each_step };
            let found = photons(&seen(sunny(0.8), ASIDE, Vec3::ZERO, 1.6), settings);
            found.assert_within(
                &exact,
                [0.008, 0.02],
                &format!("{estimate:?}, {gather_spacing} radii apart"),
            );
        }
    }
}

/// A glowing ball lights a layer below it; the picture shows only the layer.
#[test]
fn glowing_matter_lights_other_matter() {
    let value = |p: [f32; 3]| {
        let [ball, layer] = [(Vec3::from_array(p) - Vec3::Z * 0.5).length() / 0.45, (p[2] + 0.6) / 0.4];
        let bump = |x: f32| (1.0 - x * x).max(0.0).powi(2);
        bump(ball) - bump(layer)
    };
    let dark = Optics { albedo: Rgb::new(0.8, 0.8, 0.5), ..Optics::default() };
    let glow = Optics { albedo: Rgb::BLACK, emission: Rgb::new(3.0, 1.0, 0.0), ..Optics::default() };
    let clear = |optics| Optics { opacity: 0.0, ..optics };
    let points = [(-1.0, dark), (0.0, clear(dark)), (0.0, clear(glow)), (1.0, glow)];
    let points = points.map(|(value, optics)| Point { value, optics }).to_vec();
    let setup = Setup { max_scatter: 20, ..Setup::new(volume([32; 3], [2.0; 3], of_32(value)), points, 2.0) };
    // Many photons, because most of them miss the layer; blocks are off by the blur of the radius alone, which falls with its square.
    let many = PhotonSettings { photons: 2_000_000, radius: 1.3, ..PHOTONS };
    assert_as_path_with(many, "glow", &seen(setup, Vec3::new(0.0, -5.0, -0.6), -Vec3::Z * 0.6, 0.7));
}

/// Voxels of unequal edges, rotated, sheared and left-handed.
#[test]
fn grids_of_any_shape() {
    let (s, c) = (0.6, 0.8);
    let direction = [[c, -s, 0.28], [s, c, 0.0], [0.0, 0.0, -0.96]];
    let (dims, spacing) = ([40, 32, 20], [0.05, 0.0625, 0.1]);
    let values: Vec<f32> = (0..dims.iter().product())
        .map(|i| [i % 40, i / 40 % 32, i / (40 * 32)])
        .map(|p| cloud([0, 1, 2].map(|a| (p[a] as f32 + 0.5) / dims[a] as f32 * 2.0 - 1.0)))
        .collect();
    let half = [0, 1, 2].map(|a| 0.5 * (dims[a] as f64 - 1.0) * spacing[a]);
    let origin = direction.map(|row| -(0..3).map(|a| row[a] * half[a]).sum::<f64>());
    let grid = Grid::new(dims, spacing, direction, origin, Space::Plain).unwrap();
    let volume = Volume::new(grid, Voxels::F32(values), ValueMap::IDENTITY).unwrap();
    let optics = Optics { surface: 0.5, ..Optics::default() };
    let setup = Setup { volume, points: ramp(optics), phase: henyey_greenstein(0.4), ..sunny(0.0) };
    assert_as_path("sheared", &seen(setup, ASIDE, Vec3::ZERO, 1.6));
}

/// The camera is inside the matter, before a background that emits no light into the scene.
#[test]
fn a_camera_inside() {
    let mut scene = seen(sunny(0.8), ASIDE, Vec3::ZERO, 1.6);
    let lens = Lens::Perspective { fov: 80.0, aperture: 0.0, focus: 1.0 };
    scene.camera = Camera::new(Vec3::new(0.2, -0.6, 0.0), Vec3::new(0.0, 1.0, 0.2), Vec3::Z, lens);
    scene.background = Background::Color(Rgb::new(0.02, 0.0, 0.05));
    // Near the camera all rays pass the same few photons.
    let many = PhotonSettings { photons: 600_000, radius: 1.5, ..PHOTONS };
    assert_as_path_with(many, "inside", &scene);
}

/// Behind a clip plane there is no matter, and no light is lost.
#[test]
fn a_cut_cloud() {
    let clip = vec![ClipShape::Plane { point: Vec3::ZERO, normal: Vec3::new(0.5, -1.0, 0.8) }];
    assert_as_path("cut", &seen(Setup { clip, ..sunny(0.8) }, ASIDE, Vec3::ZERO, 1.6));
}

#[test]
fn voxels_without_interpolation() {
    let volume = blocks([32; 3], [2.0; 3], of_32(cloud));
    assert_as_path("blocks", &seen(Setup { volume, ..sunny(0.8) }, ASIDE, Vec3::ZERO, 1.6));
}

/// A ball so dense that the gather radius is four mean free paths, in fog two hundred times as thin. Gathers at the
/// ball reach far deeper than light does, and so do those in the fog beside it. Checks the whole picture, and the fog
/// beside the ball where no ray hits it.
#[test]
fn a_dense_ball_in_fog() {
    let ball = |p: [f32; 3]| if Vec3::from_array(p).length() < 0.5 { 1.0 } else { 0.0 };
    let fog = Optics { opacity: 0.005, albedo: Rgb::new(0.2, 0.5, 1.0), ..Optics::default() };
    let dense = Optics { opacity: 1.0, albedo: Rgb::new(1.0, 0.5, 0.2), ..Optics::default() };
    let points = [(0.0, fog), (1.0, dense)].map(|(value, optics)| Point { value, optics }).to_vec();
    let volume = blocks([32; 3], [2.0; 3], of_32(ball));
    let lights = vec![Light::Environment(Environment::constant(Rgb::WHITE, false))];
    let setup = || Setup {
        lights: lights.clone(),
        max_scatter: 8,
        ..Setup::new(volume.clone(), points.clone(), 40.0)
    };
    let settings = PhotonSettings { photons: 400_000, radius: 1.5, ..PHOTONS };
    let around = seen(setup(), -Vec3::Y * 5.0, Vec3::ZERO, 1.6);
    let beside = Vec3::X * 0.56;
    let beside = seen(setup(), beside - Vec3::Y * 5.0, beside, 0.09);
    // At the voxel steps of the ball's surface, gathers see less light than there is.
    photons(&around, settings).assert_within(&path(&around), [0.02, 0.12], "ball");
    photons(&beside, settings).assert_within(&path(&beside), [0.04, 0.05], "fog beside it");
}

/// Later passes gather within a smaller radius, with new photons: blur and noise both decrease.
#[test]
fn refinement_converges() {
    const PASSES: u32 = 16;
    let scene = seen(sunny(0.8), ASIDE, Vec3::ZERO, 1.6);
    let settings = PhotonSettings { photons: 15_000, radius: 5.5, ..PHOTONS };
    let after = |passes| estimate(&scene, &PhotonMapper::choose(settings), passes);
    let (exact, first, last) = (path(&scene), after(1), after(PASSES));
    let noise = |of: &Estimate| of.blocks.iter().map(Mean::variance_of_mean).sum::<f64>();
    let off = [first.blocks_off(&exact, 1), last.blocks_off(&exact, 1)];
    assert!(off[0] > 0.02 && off[1] < 0.85 * off[0], "blocks off by {off:?} after first and last pass");
    assert!(noise(&last) < noise(&first) / 8.0, "noise {} after {}", noise(&last), noise(&first));
    last.assert_near(&exact, 2.0 * BIAS, "refined");
}
