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

/// Trilinear value at index coordinates `p`, before slope and intercept.
#[inline]
pub(super) fn linear<T: Voxel>(data: &[T], dims: [usize; 3], p: Vec3) -> f32 {
    let [nx, ny, nz] = dims;
    let (x, y, z) = (Axis::new(p.x, nx, 1), Axis::new(p.y, ny, nx), Axis::new(p.z, nz, nx * ny));
    // One slice, one bounds check that covers the eight corners.
    let base = x.base + y.base + z.base;
    let corners = &data[base..=base + x.step + y.step + z.step];
    let at = |offset: usize| corners[offset].to_f32();
    let row = |offset: usize| mix(at(offset), at(offset + x.step), x.fraction);
    let plane = |offset: usize| mix(row(offset), row(offset + y.step), y.fraction);
    mix(plane(0), plane(z.step), z.fraction)
}

/// Value of the nearest centre, before slope and intercept.
#[inline]
pub(super) fn nearest<T: Voxel>(data: &[T], dims: [usize; 3], p: Vec3) -> f32 {
    let pick = |x: f32, n: usize| cast::index(x + 0.5).min(n - 1);
    let (x, y, z) = (pick(p.x, dims[0]), pick(p.y, dims[1]), pick(p.z, dims[2]));
    data[x + dims[0] * (y + dims[1] * z)].to_f32()
}

#[inline]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// One axis of a cell: the memory offset of its lower corner, the step to its upper one, the place between.
struct Axis {
    base: usize,
    step: usize,
    fraction: f32,
}

impl Axis {
    #[inline]
    fn new(x: f32, n: usize, stride: usize) -> Self {
        // `max` first: it also turns NaN into 0.
        let x = x.max(0.0).min((n - 1) as f32);
        let lower = cast::index(x).min(n.saturating_sub(2));
        let step = if n > 1 { stride } else { 0 };
        Self { base: lower * stride, step, fraction: x - lower as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_is_reproduced_and_clamped_at_the_edge() {
        let dims = [3, 4, 5];
        let f = |x: f32, y: f32, z: f32| 2.0 * x - 3.0 * y + 0.5 * z + 7.0;
        let data: Vec<f32> =
            (0..60).map(|i| f((i % 3) as f32, (i / 3 % 4) as f32, (i / 12) as f32)).collect();
        for (x, y, z) in [(0.25, 1.5, 3.9), (2.0, 3.0, 4.0), (1.0, 0.0, 2.5)] {
            let v = linear(&data, dims, Vec3::new(x, y, z));
            assert!((v - f(x, y, z)).abs() < 1e-5, "{v} at {x} {y} {z}");
        }
        assert_eq!(linear(&data, dims, Vec3::new(-0.5, 3.4, 9.0)), f(0.0, 3.0, 4.0));
        assert_eq!(nearest(&data, dims, Vec3::new(0.6, 1.4, 3.5)), f(1.0, 1.0, 4.0));
        assert_eq!(nearest(&data, dims, Vec3::new(-0.5, 3.49, 4.5)), f(0.0, 3.0, 4.0));
    }

    #[test]
    fn a_single_voxel_is_constant() {
        assert_eq!(linear(&[9_u8], [1, 1, 1], Vec3::new(0.3, -0.4, 0.49)), 9.0);
        assert_eq!(linear(&[9_u8], [1, 1, 1], Vec3::splat(f32::NAN)), 9.0);
    }
}
