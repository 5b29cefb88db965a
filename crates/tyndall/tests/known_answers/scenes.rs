//! Small scenes built by hand, and means over many paths.

use rayon::prelude::*;
use std::sync::Arc;
use tyndall::camera::{Camera, Lens};
use tyndall::film::PixelSample;
use tyndall::integrator::Method;
use tyndall::integrator::path::PathTracer;
use tyndall::light::{Light, LightSet};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::medium::{ClipShape, Medium, MediumSettings};
use tyndall::sampling::{PathSampler, Stream};
use tyndall::scattering::{Brdf, HenyeyGreenstein, Phase};
use tyndall::scene::{Background, RenderSettings, Scene};
use tyndall::simd::Level;
use tyndall::transfer::{Optics, Point, TransferFunction};
use tyndall::volume::{Grid, Interpolation, ValueMap, Volume, Voxels};
use tyndall_testing::Mean;

/// A volume, the matter of its values, lights, and the other parts of a scene.
pub struct Setup {
    pub volume: Volume,
    pub points: Vec<Point>,
    pub density: f32,
    pub phase: Phase,
    pub brdf: Brdf,
    pub clip: Vec<ClipShape>,
    pub lights: Vec<Light>,
    pub max_scatter: u32,
    pub majorant_cell: usize,
    pub seed: u64,
}

impl Setup {
    pub fn new(volume: Volume, points: Vec<Point>, density: f32) -> Self {
        Self {
            volume,
            points,
            density,
            phase: Phase::Isotropic,
            brdf: Brdf::Lambert,
            clip: Vec::new(),
            lights: Vec::new(),
            max_scatter: 100_000,
            majorant_cell: 8,
            seed: 1,
        }
    }

    pub fn scene(self) -> Scene {
        let transfer = Arc::new(TransferFunction::new(self.points).unwrap());
        let settings = MediumSettings {
            density: self.density,
            phase: self.phase,
            brdf: self.brdf,
            gradient_factor: 10.0,
            gradient_range: None,
            clip: self.clip,
            majorant_cell: self.majorant_cell,
        };
        let medium = Medium::new(Arc::new(self.volume), transfer, &settings);
        let lens = Lens::Orthographic { height: 1.0 };
        Scene {
            light_names: vec![None; self.lights.len()],
            lights: Arc::new(LightSet::new(self.lights, &medium)),
            medium: Arc::new(medium),
            camera: Camera::new(Vec3::Z * 10.0, Vec3::ZERO, Vec3::Y, lens),
            size: [1, 1],
            background: Background::Environment,
            render: RenderSettings {
                method: PathTracer::usual(),
                max_scatter: self.max_scatter,
                seed: self.seed,
            },
        }
    }
}

/// A volume with the given values, in a box of the given size around the origin.
pub fn volume(dims: [usize; 3], size: [f64; 3], values: impl Fn([usize; 3]) -> f32) -> Volume {
    let grid = Grid::centred(dims, [0, 1, 2].map(|a| size[a] / dims[a] as f64)).unwrap();
    let [nx, ny, _] = dims;
    let data = (0..grid.len()).map(|i| values([i % nx, i / nx % ny, i / (nx * ny)])).collect();
    Volume::new(grid, Voxels::F32(data), ValueMap::IDENTITY).unwrap()
}

/// The same, without interpolation.
pub fn blocks(dims: [usize; 3], size: [f64; 3], values: impl Fn([usize; 3]) -> f32) -> Volume {
    volume(dims, size, values).with_interpolation(Interpolation::Nearest)
}

/// Matter of full opacity and one albedo at every value.
pub fn matter(albedo: f32) -> Vec<Point> {
    vec![Point { value: 0.0, optics: Optics { albedo: Rgb::splat(albedo), ..Optics::default() } }]
}

/// A slab of unit thickness from z = -1/2 to 1/2, so wide that no path reaches its sides.
pub fn slab(optical_thickness: f32, albedo: f32, phase: Phase) -> Setup {
    let wide = 1e5;
    let volume = volume([1, 1, 1], [wide, wide, 1.0], |_| 0.0);
    Setup { phase, ..Setup::new(volume, matter(albedo), optical_thickness) }
}

pub fn henyey_greenstein(g: f32) -> Phase {
    if g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).unwrap()) }
}

/// Paths per parallel piece; the pieces are merged in order, so that the result does not depend on the threads.
const PIECE: u32 = 4096;

/// The mean of `sample` over independent paths: it gets the path's random numbers and a separate stream of others.
pub fn mean(seed: u64, paths: u32, sample: impl Fn(&mut PathSampler, &mut Stream) -> f64 + Sync) -> Mean {
    let piece = |i: u32| {
        let mut mean = Mean::default();
        for path in i * PIECE..((i + 1) * PIECE).min(paths) {
            // Each path has its own pixel, so its numbers are independent of the others'.
            let mut numbers = PathSampler::new(seed, path, 0);
            mean.push(sample(&mut numbers, &mut Stream::new(seed, [path, 0, 77])));
        }
        mean
    };
    let pieces: Vec<Mean> = (0..paths.div_ceil(PIECE)).into_par_iter().map(piece).collect();
    pieces.iter().fold(Mean::default(), |mut all, piece| {
        all.merge(piece);
        all
    })
}

/// Mean radiance (green) along rays that `ray` samples.
pub fn radiance(scene: &Scene, paths: u32, ray: impl Fn(&mut Stream) -> Ray + Sync) -> Mean {
    mean(scene.render.seed, paths, |numbers, stream| f64::from(trace(scene, ray(stream), numbers).radiance.g))
}

pub fn trace(scene: &Scene, ray: Ray, numbers: &mut PathSampler) -> PixelSample {
    PathTracer::with_level(Level::best()).trace(scene, ray, numbers.clone())
}
