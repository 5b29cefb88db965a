//! Reading the field between voxel centres, clamped to the edge.

use super::Voxel;
use crate::math::{Vec3, cast};

/// How the field is read between voxel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Trilinear.
    #[default]
    Linear,
    /// The value of the nearest centre.
    Nearest,
}

/// What reading needs to know of the dimensions, worked out once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Index of the last voxel.
    last: Vec3,
    /// Largest lower corner of a cell: the last voxel but one.
    lower: [i32; 3],
    /// Memory between voxels along each axis.
    stride: [usize; 3],
    /// The same, or 0 where the axis has one voxel alone.
    step: [usize; 3],
}

impl Lattice {
    /// Dimensions of 1 to 2^24, as a grid makes sure.
    pub(super) fn new(dims: [usize; 3]) -> Self {
        let stride = [1, dims[0], dims[0] * dims[1]];
        Self {
            last: Vec3::from_array(dims.map(|n| (n - 1) as f32)),
            lower: dims.map(|n| cast::fit_u32(n.saturating_sub(2)).cast_signed()),
            stride,
            step: std::array::from_fn(|a| if dims[a] > 1 { stride[a] } else { 0 }),
        }
    }

    /// Clamps to the centres of the border; NaN becomes 0.
    #[inline]
    fn clamp(&self, p: Vec3) -> [f32; 3] {
        let along = |a: usize| p[a].max(0.0).min(self.last[a]);
        [along(0), along(1), along(2)]
    }

    /// Trilinear value at index coordinates `p`, before slope and intercept.
    #[inline]
    pub(super) fn linear<T: Voxel>(&self, data: &[T], p: Vec3) -> f32 {
        let mut base = 0;
        let fraction = {
            let p = self.clamp(p);
            let mut along = |a: usize| {
                let lower = cast::truncate(p[a]).min(self.lower[a]);
                base += lower.cast_unsigned() as usize * self.stride[a];
                p[a] - lower as f32
            };
            [along(0), along(1), along(2)]
        };
        let [x, y, z] = self.step;
        // One slice, one bounds check that covers the eight corners.
        let corners = &data[base..=base + x + y + z];
        let at = |offset: usize| corners[offset].to_f32();
        let row = |offset: usize| mix(at(offset), at(offset + x), fraction[0]);
        let plane = |offset: usize| mix(row(offset), row(offset + y), fraction[1]);
        mix(plane(0), plane(z), fraction[2])
    }

    /// Value of the nearest centre, before slope and intercept.
    #[inline]
    pub(super) fn nearest<T: Voxel>(&self, data: &[T], p: Vec3) -> f32 {
        let [x, y, z] = self.clamp(p).map(|x| cast::truncate(x + 0.5).cast_unsigned() as usize);
        data[x + y * self.stride[1] + z * self.stride[2]].to_f32()
    }
}

#[inline]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_is_reproduced_and_clamped_at_the_edge() {
        let lattice = Lattice::new([3, 4, 5]);
        let f = |x: f32, y: f32, z: f32| 2.0 * x - 3.0 * y + 0.5 * z + 7.0;
        let data: Vec<f32> =
            (0..60).map(|i| f((i % 3) as f32, (i / 3 % 4) as f32, (i / 12) as f32)).collect();
        for (x, y, z) in [(0.25, 1.5, 3.9), (2.0, 3.0, 4.0), (1.0, 0.0, 2.5)] {
            let v = lattice.linear(&data, Vec3::new(x, y, z));
            assert!((v - f(x, y, z)).abs() < 1e-5, "{v} at {x} {y} {z}");
        }
        assert_eq!(lattice.linear(&data, Vec3::new(-0.5, 3.4, 9.0)), f(0.0, 3.0, 4.0));
        assert_eq!(lattice.nearest(&data, Vec3::new(0.6, 1.4, 3.5)), f(1.0, 1.0, 4.0));
        assert_eq!(lattice.nearest(&data, Vec3::new(-0.5, 3.49, 4.5)), f(0.0, 3.0, 4.0));
    }

    #[test]
    fn a_single_voxel_is_constant() {
        assert_eq!(Lattice::new([1, 1, 1]).linear(&[9_u8], Vec3::new(0.3, -0.4, 0.49)), 9.0);
        assert_eq!(Lattice::new([1, 1, 1]).linear(&[9_u8], Vec3::splat(f32::NAN)), 9.0);
    }
}
