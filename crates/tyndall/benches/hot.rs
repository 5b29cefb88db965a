//! Benchmarks of the functions that rendering spends its time in: `cargo bench -p tyndall`.

use divan::{Bencher, black_box};
use std::sync::Arc;
use tyndall::light::{Directional, Enclosure, Environment, Light, PointLight, Rect, SphereLight};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::{Medium, MediumSettings, Track};
use tyndall::sampling::{PathSampler, Stream};
use tyndall::scattering::{Brdf, Phase};
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point, TransferFunction};
use tyndall::volume::Grid;
use tyndall::volume::procedural::{Field, Kind};

fn main() {
    divan::main();
}

fn medium(kind: Kind) -> Medium {
    let volume = Field::new(kind, [128; 3], 0).volume().expect("a plain size");
    let point = |value, opacity| Point { value, optics: Optics { opacity, ..Optics::default() } };
    let transfer = TransferFunction::new(vec![point(0.1, 0.0), point(1.0, 1.0)]).expect("ascending");
    let settings = MediumSettings {
        density: 0.3,
        phase: Phase::Isotropic,
        brdf: Brdf::Lambert,
        gradient_factor: 10.0,
        gradient_range: None,
        clip: Vec::new(),
        majorant_cell: 8,
    };
    Medium::new(Arc::new(volume), Arc::new(transfer), &settings)
}

/// Volumes with different voxel types: floats, and bytes in eighths.
const KINDS: [Kind; 2] = [Kind::Cloud, Kind::Shells];

/// Positions all over the box.
fn positions() -> impl Iterator<Item = Vec3> {
    let mut stream = Stream::new(1, [2, 3, 4]);
    std::iter::repeat_with(move || Vec3::new(stream.uniform(), stream.uniform(), stream.uniform()) * 127.0)
}

fn track(medium: &Medium, [from, to]: [Vec3; 2]) -> Track {
    let grid = medium.volume().grid();
    let (from, to) = (grid.index_to_world(from), grid.index_to_world(to));
    medium.track(&Ray::new(from, (to - from).normalize()), f32::INFINITY)
}

#[divan::bench(args = KINDS)]
fn value(bencher: Bencher, kind: Kind) {
    let medium = medium(kind);
    let mut positions = positions();
    let next = move || positions.next().expect("endless");
    bencher.with_inputs(next).bench_local_values(|position| medium.volume().value(position));
}

#[divan::bench]
fn opacity(bencher: Bencher) {
    let medium = medium(Kind::Cloud);
    let mut positions = positions();
    let next = move || positions.next().expect("endless").x / 127.0;
    bencher.with_inputs(next).bench_local_values(|value| medium.transfer().opacity(value));
}

#[divan::bench]
fn numbers_of_a_bounce() -> f32 {
    PathSampler::new(1, black_box(5), black_box(7)).bounce(black_box(2)).flight
}

#[divan::bench(args = KINDS)]
fn free_flight(bencher: Bencher, kind: Kind) {
    let medium = medium(kind);
    let mut positions = positions();
    let mut stream = Stream::new(9, [0, 0, 0]);
    let next = || track(&medium, [(); 2].map(|()| positions.next().expect("endless")));
    bencher.with_inputs(next).bench_local_values(|track| {
        let first = stream.exponential();
        medium.free_flight(&track, first, &mut stream)
    });
}

#[divan::bench(args = Level::available())]
fn transmittance(bencher: Bencher, level: Level) {
    let medium = medium(Kind::Cloud);
    let mut positions = positions();
    let mut stream = Stream::new(9, [0, 0, 0]);
    let next = || track(&medium, [(); 2].map(|()| positions.next().expect("endless")));
    bencher.with_inputs(next).bench_local_values(|track| medium.transmittance(level, &track, &mut stream));
}

#[divan::bench(args = Level::available())]
fn optical_thickness(bencher: Bencher, level: Level) {
    let medium = medium(Kind::Shells);
    let mut positions = positions();
    let next = || track(&medium, [(); 2].map(|()| positions.next().expect("endless")));
    bencher
        .with_inputs(next)
        .bench_local_values(|track| medium.optical_thickness(level, &track, 0.5, f32::INFINITY));
}

#[divan::bench(args = ["point", "sun", "rect", "sphere", "sky"])]
fn emit(bencher: Bencher, kind: &str) {
    let grid = Grid::centred([128; 3], [1.0; 3]).expect("a plain size");
    let box_ = Enclosure::new(&grid);
    let at = Vec3::new(150.0, 200.0, 90.0);
    let light = match kind {
        "point" => Light::Point(PointLight { position: at, intensity: Rgb::WHITE }),
        "sun" => Light::Directional(Directional::new(-at, Rgb::WHITE, 0.0)),
        "rect" => Light::Rect(Rect::new(at, -at, Vec3::X, [50.0, 20.0], Rgb::WHITE)),
        "sphere" => Light::Sphere(SphereLight { middle: at, radius: 30.0, radiance: Rgb::WHITE }),
        _ => Light::Environment(Environment::constant(Rgb::WHITE, true)),
    };
    let mut stream = Stream::new(9, [0, 0, 1]);
    let numbers = || [(); 4].map(|()| stream.uniform());
    bencher.with_inputs(numbers).bench_local_values(|u| light.emit(&box_, u));
}
