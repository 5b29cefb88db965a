//! Generated fields with values in 0..1, many with an exact formula: for tests, tables and experiments.
//!
//! A field is sampled at voxel centres. Distances are in voxels from the middle of the box; the
//! Marschner-Lobb signal and the cloud are defined on `[-1, 1]^3`, stretched over the box.

mod cloud;
mod cornell_box;
mod marschner_lobb;

pub use cornell_box::{MATERIALS, Material};

use super::{Grid, GridError, ValueMap, Volume, Voxels};
use crate::math::{Vec3, cast};
use rayon::prelude::*;

/// Which field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 1 everywhere.
    Constant,
    /// 1 within 0.4 of the shortest side around the middle, 0 outside.
    Sphere,
    /// Eight shells of equal width inside the largest ball: 1/8 in the outermost, 1 in the innermost, 0 outside.
    Shells,
    /// The test signal of \[Marschner94\] with f_M = 6 and alpha = 0.25.
    MarschnerLobb,
    /// Seeded fractal noise with a spherical fall-off.
    Cloud,
    /// A room with coloured walls, a sphere, a block, a transparent box and thin matter in the air
    /// \[Jonsson12, fig. 4\]; one value per material, see [`MATERIALS`].
    CornellBox,
}

impl Kind {
    /// All of them with their names in the scene document.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Constant, "constant"),
        (Self::Sphere, "sphere"),
        (Self::Shells, "shells"),
        (Self::MarschnerLobb, "marschner-lobb"),
        (Self::Cloud, "cloud"),
        (Self::CornellBox, "cornell-box"),
    ];

    /// The name in the scene document.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }
}

/// A field over a box of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    kind: Kind,
    size: [usize; 3],
    seed: u64,
}

impl Field {
    /// A field over `size` voxels; `seed` affects only the cloud.
    #[must_use]
    pub fn new(kind: Kind, size: [usize; 3], seed: u64) -> Self {
        Self { kind, size, seed }
    }

    /// From the middle of the box, in voxels.
    fn centred(&self, p: Vec3) -> Vec3 {
        p - (Vec3::from_array(self.size.map(|n| n as f32)) - 1.0) * 0.5
    }

    /// From -1 to 1 over the box along each axis.
    fn stretched(&self, p: Vec3) -> Vec3 {
        2.0 * self.centred(p) / Vec3::from_array(self.size.map(|n| n as f32))
    }

    fn shortest_side(&self) -> f32 {
        self.size.into_iter().min().unwrap_or(1) as f32
    }

    /// The exact value at index coordinates.
    #[must_use]
    pub fn value(&self, p: Vec3) -> f32 {
        match self.kind {
            Kind::Constant => 1.0,
            Kind::Sphere => f32::from(self.centred(p).length() <= 0.4 * self.shortest_side()),
            Kind::Shells => f32::from(self.shell(p)) / 8.0,
            Kind::MarschnerLobb => marschner_lobb::value(self.stretched(p)),
            Kind::Cloud => cloud::value(self.stretched(p), cast::low_u32(self.seed ^ (self.seed >> 32))),
            Kind::CornellBox => f32::from(cornell_box::material(self.stretched(p))) / 8.0,
        }
    }

    /// The exact gradient per voxel at index coordinates, where the field has one: `None` for the
    /// cloud, and zero inside the constant pieces of the fields that jump.
    #[must_use]
    pub fn gradient(&self, p: Vec3) -> Option<Vec3> {
        match self.kind {
            Kind::Cloud => None,
            Kind::MarschnerLobb => {
                let per_voxel = 2.0 / Vec3::from_array(self.size.map(|n| n as f32));
                Some(marschner_lobb::gradient(self.stretched(p)) * per_voxel)
            }
            Kind::Constant | Kind::Sphere | Kind::Shells | Kind::CornellBox => Some(Vec3::ZERO),
        }
    }

    /// Smallest and largest value that the formula can give, over all of space.
    #[must_use]
    pub fn range(&self) -> [f32; 2] {
        match self.kind {
            Kind::Constant => [1.0, 1.0],
            Kind::CornellBox => cornell_box::range(),
            Kind::Sphere | Kind::Shells | Kind::MarschnerLobb | Kind::Cloud => [0.0, 1.0],
        }
    }

    fn shell(&self, p: Vec3) -> u8 {
        let from_outside = 1.0 - self.centred(p).length() / (0.5 * self.shortest_side());
        u8::try_from(cast::floor_i32(8.0 * from_outside) + 1).unwrap_or(0).min(8)
    }

    /// Samples the field at the voxel centres; spacing 1, centred on the world origin.
    ///
    /// # Errors
    /// [`GridError`] if a grid of that size is not possible.
    pub fn volume(&self) -> Result<Volume, GridError> {
        let grid = Grid::centred(self.size, [1.0; 3])?;
        let [nx, ny, _] = self.size;
        let point = |i: usize| Vec3::from_array([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as f32));
        let all = || (0..grid.len()).into_par_iter().map(point);
        let eighths = ValueMap { slope: 0.125, intercept: 0.0 };
        let (voxels, values) = match self.kind {
            Kind::Constant | Kind::Sphere => {
                (Voxels::U8(all().map(|p| u8::from(self.value(p) > 0.5)).collect()), ValueMap::IDENTITY)
            }
            Kind::Shells => (Voxels::U8(all().map(|p| self.shell(p)).collect()), eighths),
            Kind::CornellBox => {
                (Voxels::U8(all().map(|p| cornell_box::material(self.stretched(p))).collect()), eighths)
            }
            Kind::MarschnerLobb | Kind::Cloud => {
                (Voxels::F32(all().map(|p| self.value(p)).collect()), ValueMap::IDENTITY)
            }
        };
        Ok(Volume::new(grid, voxels, values).expect("as many samples as the grid has, and a plain value map"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn middle(size: [usize; 3]) -> Vec3 {
        (Vec3::from_array(size.map(|n| n as f32)) - 1.0) * 0.5
    }

    #[test]
    fn every_field_keeps_its_range_and_is_sampled_at_centres() {
        for (kind, name) in Kind::ALL {
            let field = Field::new(kind, [24, 20, 28], 3);
            let volume = field.volume().unwrap();
            let [lo, hi] = volume.value_range();
            let [least, most] = field.range().map(f64::from);
            assert!(least <= lo && hi <= most, "{name}: [{lo}, {hi}] outside [{least}, {most}]");
            assert!(kind == Kind::Constant || hi - lo > 0.3, "{name} is flat: [{lo}, {hi}]");
            for v in [[0, 0, 0], [12, 10, 14], [5, 17, 9]] {
                let exact = field.value(Vec3::from_array(v.map(|i| i as f32)));
                assert_eq!(cast::single(volume.voxel(v)), exact, "{name} at {v:?}");
            }
        }
    }

    #[test]
    fn shells_have_equal_width() {
        let field = Field::new(Kind::Shells, [64; 3], 0);
        for k in 0..8_u8 {
            let r = 32.0 * (f32::from(k) + 0.5) / 8.0;
            assert_eq!(field.value(middle([64; 3]) + Vec3::X * r), f32::from(8 - k) / 8.0);
        }
        assert_eq!(field.value(Vec3::ZERO), 0.0);
    }

    #[test]
    fn the_exact_gradient_is_the_limit_of_differences() {
        let field = Field::new(Kind::MarschnerLobb, [41, 37, 45], 0);
        for p in [Vec3::new(12.0, 20.0, 30.0), Vec3::new(5.5, 9.25, 22.0), Vec3::new(30.0, 3.0, 8.0)] {
            let h = 1e-2;
            let along = |a: Vec3| (field.value(p + a * h) - field.value(p - a * h)) / (2.0 * h);
            let numeric = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
            let exact = field.gradient(p).unwrap();
            assert!((numeric - exact).length() < 1e-3 * (1.0 + exact.length()), "{numeric} {exact}");
        }
    }
}
