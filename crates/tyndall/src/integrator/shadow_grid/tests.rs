use super::*;
use crate::math::{Ray, cast};
use crate::medium::{ClipShape, MediumSettings};
use crate::scattering::{Brdf, Phase};
use crate::transfer::{Optics, Point, TransferFunction};
use crate::volume::{Grid, ValueMap, Volume, Voxels};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tyndall_testing::SplitMix;

/// Three balls in a box of this many voxels, with skins two voxels wide.
fn balls(dims: [usize; 3], spacing: [f64; 3], density: f32, clip: Vec<ClipShape>) -> Medium {
    let grid = Grid::centred(dims, spacing).unwrap();
    let [nx, ny, nz] = dims.map(|n| n as f32);
    let centres = [
        (Vec3::new(0.35 * nx, 0.4 * ny, 0.4 * nz), 0.2 * nx),
        (Vec3::new(0.7 * nx, 0.6 * ny, 0.35 * nz), 0.15 * nx),
        (Vec3::new(0.5 * nx, 0.6 * ny, 0.8 * nz), 0.12 * nx),
    ];
    let value = |i: usize| {
        let p = Vec3::new((i % dims[0]) as f32, (i / dims[0] % dims[1]) as f32, (i / (dims[0] * dims[1])) as f32);
        let deepest = centres.iter().map(|(c, r)| r - p.distance(*c)).fold(f32::NEG_INFINITY, f32::max);
        cast::low_u8(cast::truncate((deepest * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0))
    };
    let voxels = Voxels::U8((0..dims.iter().product()).map(value).collect());
    let volume = Arc::new(Volume::new(grid, voxels, ValueMap::IDENTITY).unwrap());
    let point = |value: f32, opacity: f32| Point { value, optics: Optics { opacity, ..Optics::default() } };
    let transfer = TransferFunction::new(vec![point(60.0, 0.0), point(150.0, 1.0)]).unwrap();
    let settings = MediumSettings {
        density,
        phase: Phase::Isotropic,
        brdf: Brdf::Lambert,
        gradient_factor: 3.0,
        gradient_range: None,
        clip,
        majorant_cell: 8,
    };
    Medium::new(volume, Arc::new(transfer), &settings)
}

#[test]
fn study() {
    for (name, spacing, density) in [("cubes", [1.0; 3], 0.6), ("slabs", [0.957, 0.957, 1.5], 0.52)] {
        let medium = balls([48, 48, 48], spacing, density, Vec::new());
        let grid = medium.volume().grid();
        let lattice = Lattice::within(grid, 16, 1 << 30).unwrap();
        let directions = [Vec3::Z, Vec3::new(0.7, 0.8, 0.6), Vec3::new(-0.2, 0.3, -0.9), Vec3::new(1.0, 0.45, 0.1)].map(Vec3::normalize);
        let aims = directions.map(|d| Aim::Distant(grid.direction_to_index(d) / Vec3::from_array(lattice.spacing())));
        let mut shadows = ShadowGrid::new(lattice, aims.to_vec());
        let never = AtomicBool::new(false);
        assert!(shadows.complete(&medium, Level::best(), &Limits { cancel: &never, deadline: None }));
        for (i, d) in directions.iter().enumerate() {
            for at_texels in [true, false] {
                let mut random = SplitMix::new(3);
                let mut bins = [[0.0_f64; 6]; 12];
                for _ in 0..200_000 {
                    let u: [f32; 3] = random.uniforms();
                    let mut p = Vec3::from_array(u.map(|u| u * 47.0));
                    if at_texels {
                        p = p.floor();
                    }
                    if medium.sigma_t(p) == 0.0 { continue; }
                    let track = medium.track(&Ray::new(grid.index_to_world(p), *d), f32::INFINITY);
                    let exact = (-medium.optical_thickness(Level::best(), &track, 0.05, 20.0)).exp();
                    let found = one(&shadows, p, i, *d, &medium);
                    let bin = &mut bins[cast::index(exact * 11.99)];
                    bin[0] += 1.0; bin[3] += f64::from(exact);
                    bin[1] += f64::from(found[2] - exact); bin[2] += f64::from((found[2] - exact).abs());
                    bin[4] += f64::from(found[0] - exact); bin[5] += f64::from(found[1] - exact);
                }
                println!("{name} direction {i} at texels {at_texels}");
                for b in bins { if b[0] > 0.0 { println!("  n {} exact {:.3} bias {:+.4} abs {:.4}   linear {:+.4} moved {:+.4}", b[0], b[3] / b[0], b[1] / b[0], b[2] / b[0], b[4] / b[0], b[5] / b[0]); } }
            }
        }
    }
}

fn one(shadows: &ShadowGrid, p: Vec3, i: usize, d: Vec3, medium: &Medium) -> [f32; 3] {
    struct One<'a>(Corners<'a>, usize, Vec3, f32, &'a Medium, Vec3);
    impl crate::simd::Kernel for One<'_> {
        type Output = [f32; 3];
        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> [f32; 3] {
            let Self(corners, i, d, thickness, medium, p) = self;
            let at = p.to_array().map(|x| S::f32s::splat(simd, x));
            let g = medium.gradient_lanes(simd, at).map(|x| x.as_slice()[0]);
            let d = d.to_array().map(|x| S::f32s::splat(simd, x));
            let mut out = [0.0; 3];
            for (out, gradient) in out.iter_mut().zip([Vec3::splat(1e30), Vec3::splat(1e30), Vec3::from_array(g)]) {
                let s = crate::integrator::raymarch::PositionShadows { corners, gradient, thickness };
                *out = s.transmittance(simd, 0, d).as_slice()[i];
            }
            out
        }
    }
    let per_value = f64::from(medium.density()) / medium.gradient_unit();
    let thickness = cast::single(per_value * shadows.integral_unit().unwrap_or(0.0));
    Level::best().run(One(shadows.around(p, medium.volume().value(p)), i, d, thickness, medium, p))
}
