//! Over which part of space a gather takes photons together; lengths in units of the map's radius.

use crate::math::{Frame, Vec3};
use crate::medium::MOST_LANES;
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// A part of metric space about a place.
pub(super) trait Kernel: Copy {
    /// How far it reaches along each axis.
    fn reach(&self) -> Vec3;

    /// In units of the radius cubed.
    fn volume(&self) -> f32;

    /// Whether it holds what lies so far from the place.
    fn holds<S: Lanes>(&self, simd: S, apart: [S::f32s; 3]) -> S::mask32s;

    /// Points spread evenly through it, opposite ones in pairs, from a number on: relative to the place.
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3];
}

/// All within a radius: the point estimate \[Jensen98\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball<'a> {
    pub radius: f32,
    pub points: &'a Points,
}

impl Kernel for Ball<'_> {
    fn reach(&self) -> Vec3 {
        Vec3::splat(self.radius)
    }

    fn volume(&self) -> f32 {
        4.0 / 3.0 * PI * self.radius.powi(3)
    }

    #[inline(always)]
    fn holds<S: Lanes>(&self, simd: S, [x, y, z]: [S::f32s; 3]) -> S::mask32s {
        (x * x + y * y + z * z).simd_lt(S::f32s::splat(simd, self.radius * self.radius))
    }

    #[inline(always)]
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3] {
        let Points { ball: [x, y, z], .. } = self.points;
        let range = first..first + S::WIDTH;
        [
            S::f32s::from_slice(simd, &x[range.clone()]) * self.radius,
            S::f32s::from_slice(simd, &y[range.clone()]) * self.radius,
            S::f32s::from_slice(simd, &z[range]) * self.radius,
        ]
    }
}

/// All that a step of a ray passes within a radius: the beam radiance estimate \[Jarosz08\], step by step. Together the steps
/// make one beam, along which nothing is blurred.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice<'a> {
    /// Along the ray.
    pub width: f32,
    /// About the ray's direction.
    pub frame: Frame,
    pub points: &'a Points,
}

impl Kernel for Slice<'_> {
    fn reach(&self) -> Vec3 {
        let along = self.frame.w.abs();
        (Vec3::ONE - along * along).max(Vec3::ZERO).map(f32::sqrt) + along * (0.5 * self.width)
    }

    fn volume(&self) -> f32 {
        PI * self.width
    }

    #[inline(always)]
    fn holds<S: Lanes>(&self, simd: S, [x, y, z]: [S::f32s; 3]) -> S::mask32s {
        let d = self.frame.w;
        let along = x * d.x + y * d.y + z * d.z;
        let aside = x * x + y * y + z * z - along * along;
        // Half open, so that no photon counts in two steps.
        let half = 0.5 * self.width;
        aside.simd_lt(S::f32s::splat(simd, 1.0))
            & along.simd_ge(S::f32s::splat(simd, -half))
            & along.simd_lt(S::f32s::splat(simd, half))
    }

    #[inline(always)]
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3] {
        let Points { disk: [a, b], .. } = self.points;
        let a = S::f32s::from_slice(simd, &a[first..first + S::WIDTH]);
        let b = S::f32s::from_slice(simd, &b[first..first + S::WIDTH]);
        let Frame { u, v, .. } = self.frame;
        [a * u.x + b * v.x, a * u.y + b * v.y, a * u.z + b * v.z]
    }
}

/// Points of the unit ball and of the unit disk.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Points {
    ball: [[f32; MOST_LANES]; 3],
    disk: [[f32; MOST_LANES]; 2],
}

/// The shares of the volume within which the points on a spiral lie, by which their second moments are those of the whole.
const SHARES_OF_BALL: [u8; MOST_LANES / 2] = [0, 2, 4, 7, 6, 5, 3, 1];
const SHARES_OF_DISK: [u8; MOST_LANES / 2] = [0, 3, 6, 2, 5, 1, 4, 7];

impl Points {
    pub fn new() -> Self {
        let mut points = Self { ball: [[0.0; MOST_LANES]; 3], disk: [[0.0; MOST_LANES]; 2] };
        let pairs = MOST_LANES / 2;
        for pair in 0..pairs {
            let share = |i: f32| (i + 0.5) / pairs as f32;
            // A golden-angle spiral over one half of the sphere of directions.
            let (sin, cos) = (pair as f32 * PI * (3.0 - 5.0_f32.sqrt())).sin_cos();
            let (height, within) = (share(pair as f32), share(f32::from(SHARES_OF_BALL[pair])));
            let across = (1.0 - height * height).sqrt();
            let in_ball = Vec3::new(across * cos, across * sin, height) * within.cbrt();
            let (sin, cos) = (PI * share(pair as f32)).sin_cos();
            let within = share(f32::from(SHARES_OF_DISK[pair]));
            let in_disk = [cos, sin].map(|x| x * within.sqrt());
            for (point, sign) in [(2 * pair, 1.0), (2 * pair + 1, -1.0)] {
                for (axis, x) in points.ball.iter_mut().zip(in_ball.to_array()) {
                    axis[point] = sign * x;
                }
                for (axis, x) in points.disk.iter_mut().zip(in_disk) {
                    axis[point] = sign * x;
                }
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean products of the coordinates of points.
    fn moments<const N: usize>(points: &[[f32; MOST_LANES]; N]) -> [[f32; N]; N] {
        let mean = |a: usize, b: usize| (0..MOST_LANES).map(|i| points[a][i] * points[b][i]).sum::<f32>();
        std::array::from_fn(|a| std::array::from_fn(|b| mean(a, b) / MOST_LANES as f32))
    }

    #[test]
    fn points_stand_for_ball_and_disk() {
        let points = Points::new();
        for axis in points.ball.iter().chain(&points.disk) {
            assert!(axis.iter().sum::<f32>().abs() < 1e-6);
        }
        // Of the whole ball 1/5 and of the whole disk 1/4 along each axis, nothing across.
        for (a, row) in moments(&points.ball).iter().enumerate() {
            for (b, &found) in row.iter().enumerate() {
                let expected = if a == b { 0.2 } else { 0.0 };
                assert!((found - expected).abs() < 0.01, "ball {a} {b}: {found}");
            }
        }
        for (a, row) in moments(&points.disk).iter().enumerate() {
            for (b, &found) in row.iter().enumerate() {
                let expected = if a == b { 0.25 } else { 0.0 };
                assert!((found - expected).abs() < 0.01, "disk {a} {b}: {found}");
            }
        }
    }
}
