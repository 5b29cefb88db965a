//! The regions over which a gather collects photons; lengths in units of the map's radius.

use crate::math::{Frame, Mat3, Vec3};
use crate::simd::Lanes;
use crate::simd::MOST_LANES;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// A region of metric space around a position.
pub(super) trait GatherRegion: Copy {
    /// Radius before flattening, of a ball or about a ray.
    fn radius(&self) -> f32;

    /// Half-extent along each coordinate axis.
    fn reach(&self) -> Vec3;

    /// Symmetric matrix whose eigenvalues are the squared half-extents along the region's own axes.
    fn squared_reach(&self) -> Mat3;

    /// Volume, in units of the radius cubed.
    fn volume(&self) -> f32;

    /// The same region, compressed along an axis to a share of the radius.
    fn flattened(self, axis: Vec3, share: f32) -> Self;

    /// Whether it contains a point at the offset `apart` from the position.
    fn holds<S: Lanes>(&self, simd: S, apart: [S::f32s; 3]) -> S::mask32s;

    /// Evenly distributed points in the region, from the `first` on, relative to the position; opposite points form
    /// pairs.
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3];
}

/// A ball: the point estimate \[Jensen98\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball<'a> {
    radius: f32,
    flat: Flat,
    /// A frame whose axis is that of flattening.
    frame: Frame,
    /// Selects the rotation of the points.
    number: usize,
    points: &'a Points,
}

impl<'a> Ball<'a> {
    /// `number` selects a rotation of the points, so that their sampling error has no preferred direction.
    pub fn new(radius: f32, number: usize, points: &'a Points) -> Self {
        Self { radius, flat: Flat::ROUND, frame: points.turns[number % TURNS], number, points }
    }

    /// A ball of radius 1 that is compressed along an axis already; its points are not those of [`Self::flattened`].
    pub fn flat(axis: Vec3, share: f32, points: &'a Points) -> Self {
        Self { flat: Flat { axis, share }, ..Self::new(1.0, 0, points) }
    }

    /// The axis along which it is compressed, zero if there is none, and the share of its radius there.
    pub fn flattening(&self) -> (Vec3, f32) {
        (self.flat.axis, self.flat.share)
    }
}

impl GatherRegion for Ball<'_> {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn reach(&self) -> Vec3 {
        Vec3::splat(self.radius)
    }

    fn squared_reach(&self) -> Mat3 {
        (Mat3::IDENTITY - self.flat.lost()) * self.radius.powi(2)
    }

    fn volume(&self) -> f32 {
        4.0 / 3.0 * PI * self.radius.powi(3) * self.flat.share
    }

    #[inline(always)]
    fn flattened(self, axis: Vec3, share: f32) -> Self {
        Self { flat: Flat { axis, share }, frame: self.points.turned(axis, self.number), ..self }
    }

    #[inline(always)]
    fn holds<S: Lanes>(&self, simd: S, apart: [S::f32s; 3]) -> S::mask32s {
        let [x, y, z] = apart;
        let squared = x * x + y * y + z * z + self.flat.lost_squared(simd, apart);
        squared.simd_lt(S::f32s::splat(simd, self.radius * self.radius))
    }

    #[inline(always)]
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3] {
        let Frame { u, v, w } = self.frame;
        let axes = [u * self.radius, v * self.radius, w * (self.radius * self.flat.share)];
        placed(simd, &self.points.ball, first, axes)
    }
}

/// A cylinder about a piece of a ray: the beam radiance estimate \[Jarosz08\], piece by piece. Together the pieces form
/// one beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice<'a> {
    /// Length along the ray.
    width: f32,
    flat: Flat,
    /// A frame about the ray's direction; its first tangent is the axis along which the slice is flattened.
    frame: Frame,
    points: &'a Points,
}

impl<'a> Slice<'a> {
    /// `number` selects a rotation of the points.
    pub fn new(width: f32, direction: Vec3, number: usize, points: &'a Points) -> Self {
        Self { width, flat: Flat::ROUND, frame: points.turned(direction, number), points }
    }

    /// Maximum half-extent along an axis of a slice of this width, whatever its ray's direction: the distance to the
    /// rim of its ends.
    pub fn reach_of(width: f32) -> f32 {
        (1.0 + 0.25 * width.powi(2)).sqrt()
    }
}

impl GatherRegion for Slice<'_> {
    fn radius(&self) -> f32 {
        1.0
    }

    fn reach(&self) -> Vec3 {
        let along = self.frame.w.abs();
        (Vec3::ONE - along * along).max(Vec3::ZERO).map(f32::sqrt) + along * (0.5 * self.width)
    }

    fn squared_reach(&self) -> Mat3 {
        let along = square(self.frame.w) * (1.0 - 0.25 * self.width.powi(2));
        Mat3::IDENTITY - along - self.flat.lost()
    }

    fn volume(&self) -> f32 {
        PI * self.width * self.flat.share
    }

    #[inline(always)]
    fn flattened(self, axis: Vec3, share: f32) -> Self {
        // The cross-section of an ellipsoid perpendicular to the ray.
        let w = self.frame.w;
        let across = axis - w * axis.dot(w);
        let Some(u) = across.try_normalize() else { return self };
        let share = (1.0 + (share.powi(-2) - 1.0) * across.length_squared()).sqrt().recip();
        Self { flat: Flat { axis: u, share }, frame: Frame { u, v: w.cross(u), w }, ..self }
    }

    #[inline(always)]
    fn holds<S: Lanes>(&self, simd: S, apart: [S::f32s; 3]) -> S::mask32s {
        let ([x, y, z], d) = (apart, self.frame.w);
        let along = x * d.x + y * d.y + z * d.z;
        let aside = x * x + y * y + z * z - along * along + self.flat.lost_squared(simd, apart);
        // Half-open, so that no photon counts in two pieces.
        let half = 0.5 * self.width;
        aside.simd_lt(S::f32s::splat(simd, 1.0))
            & along.simd_ge(S::f32s::splat(simd, -half))
            & along.simd_lt(S::f32s::splat(simd, half))
    }

    #[inline(always)]
    fn points<S: Lanes>(&self, simd: S, first: usize) -> [S::f32s; 3] {
        let Frame { u, v, w } = self.frame;
        placed(simd, &self.points.cylinder, first, [u * self.flat.share, v, w * (0.5 * self.width)])
    }
}

/// How a region is compressed along an axis.
#[derive(Clone, Copy, Debug)]
struct Flat {
    /// Of length 1, or zero if nothing is compressed.
    axis: Vec3,
    /// Extent along the axis divided by extent across it.
    share: f32,
}

impl Flat {
    const ROUND: Self = Self { axis: Vec3::ZERO, share: 1.0 };

    /// The reduction of the squared reach of a region of radius 1.
    fn lost(&self) -> Mat3 {
        square(self.axis) * (1.0 - self.share.powi(2))
    }

    /// The amount to add to a vector's squared length to get its squared length before compression.
    #[inline(always)]
    fn lost_squared<S: Lanes>(&self, simd: S, [x, y, z]: [S::f32s; 3]) -> S::f32s {
        let along = x * self.axis.x + y * self.axis.y + z * self.axis.z;
        along * along * S::f32s::splat(simd, self.share.powi(-2) - 1.0)
    }
}

/// Outer product of a vector with itself.
fn square(v: Vec3) -> Mat3 {
    Mat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Points, from the `first` on, transformed to the given axes.
#[inline(always)]
fn placed<S: Lanes>(
    simd: S,
    [a, b, c]: &[[f32; MOST_LANES]; 3],
    first: usize,
    [u, v, w]: [Vec3; 3],
) -> [S::f32s; 3] {
    let a = S::f32s::from_slice(simd, &a[first..first + S::WIDTH]);
    let b = S::f32s::from_slice(simd, &b[first..first + S::WIDTH]);
    let c = S::f32s::from_slice(simd, &c[first..first + S::WIDTH]);
    [a * u.x + b * v.x + c * w.x, a * u.y + b * v.y + c * w.y, a * u.z + b * v.z + c * w.z]
}

/// Points in the unit ball, and in the cylinder of radius 1 from -1 to 1. For planes perpendicular to the last axis of
/// the ball, or to the first or last axis of the cylinder, the number of points on each side is proportional to the
/// volume there, to within half a point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Points {
    ball: [[f32; MOST_LANES]; 3],
    cylinder: [[f32; MOST_LANES]; 3],
    /// Evenly distributed rotations.
    turns: [Frame; TURNS],
    /// Sines and cosines of rotation angles about an axis.
    angles: [(f32, f32); TURNS],
}

/// Number of rotations of the points.
const TURNS: usize = 64;

/// Order of the points' distances from the axis, chosen so that the points' second moments match those of the region.
const ORDER_IN_BALL: [u8; MOST_LANES / 2] = [7, 1, 3, 5, 0, 2, 6, 4];
const ORDER_IN_DISK: [u8; MOST_LANES / 2] = [1, 4, 7, 5, 3, 0, 6, 2];

/// Order of the cylinder's points along its axis.
const ORDER_ALONG: [u8; MOST_LANES / 2] = [0, 6, 4, 2, 5, 7, 3, 1];

impl Points {
    pub fn new() -> Self {
        let angle = |turn: f32| (2.0 * PI * turn).sin_cos();
        let mut points = Self {
            ball: [[0.0; MOST_LANES]; 3],
            cylinder: [[0.0; MOST_LANES]; 3],
            turns: std::array::from_fn(|i| {
                // An axis on a spiral and an angle about it, both from low-discrepancy sequences.
                let z = 1.0 - (2 * i + 1) as f32 / TURNS as f32;
                let (sin, cos) = angle(0.618_034 * i as f32);
                let across = (1.0 - z * z).sqrt();
                Frame::around(Vec3::new(across * cos, across * sin, z)).turned(angle(0.754_877_7 * i as f32))
            }),
            angles: std::array::from_fn(|i| angle(i as f32 / TURNS as f32)),
        };
        let pairs = MOST_LANES / 2;
        for pair in 0..pairs {
            let share = |i: usize| (i as f32 + 0.5) / pairs as f32;
            let within = |order: [u8; MOST_LANES / 2]| share(usize::from(order[pair]));
            // The fraction of a ball between -c and c is (3 c - c^3) / 2; this is the root in trigonometric form.
            let c = 2.0 * (share(pair).asin() / 3.0).sin();
            let (sin, cos) = (pair as f32 * PI * (3.0 - 5.0_f32.sqrt())).sin_cos();
            let aside = ((1.0 - c * c) * within(ORDER_IN_BALL)).sqrt();
            // The fraction of a disk between -sin(t) and sin(t) is (2 t + sin(2 t)) / pi, which has no closed-form
            // root: Newton's method.
            let mut t = 0.5 * PI * share(pair);
            for _ in 0..8 {
                t -= (2.0 * t + (2.0 * t).sin() - PI * share(pair)) / (2.0 + 2.0 * (2.0 * t).cos());
            }
            let across = t.cos() * (2.0 * within(ORDER_IN_DISK) - 1.0);
            let in_cylinder = [t.sin(), across, 2.0 * within(ORDER_ALONG) - 1.0];
            for (point, sign) in [(2 * pair, 1.0), (2 * pair + 1, -1.0)] {
                for (axis, x) in points.ball.iter_mut().zip([aside * cos, aside * sin, c]) {
                    axis[point] = sign * x;
                }
                for (axis, x) in points.cylinder.iter_mut().zip(in_cylinder) {
                    axis[point] = sign * x;
                }
            }
        }
        points
    }

    /// A frame about an axis, rotated by one of several angles.
    fn turned(&self, axis: Vec3, number: usize) -> Frame {
        Frame::around(axis).turned(self.angles[number % TURNS])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_reach_as_far_as_their_rims() {
        let points = Points::new();
        for width in [0.1, 1.5, 4.0] {
            let along = |turn: usize| {
                let slice = Slice::new(width, points.turns[turn].w, turn, &points);
                slice.reach().max_element()
            };
            let most = (0..TURNS).map(along).fold(0.0, f32::max);
            let bound = Slice::reach_of(width);
            assert!((0.98 * bound..=bound * (1.0 + 1e-6)).contains(&most), "{width}: {most}, {bound}");
        }
    }

    #[test]
    fn points_stand_for_ball_and_cylinder() {
        let Points { ball, cylinder, .. } = Points::new();
        // Mean squares along each axis of the whole region; mixed products have mean 0.
        for (name, points, squares) in
            [("ball", ball, [0.2; 3]), ("cylinder", cylinder, [0.25, 0.25, 1.0 / 3.0])]
        {
            for a in 0..3 {
                assert!(points[a].iter().sum::<f32>().abs() < 1e-6, "{name} {a}");
                for b in 0..3 {
                    let found =
                        (0..MOST_LANES).map(|i| points[a][i] * points[b][i]).sum::<f32>() / MOST_LANES as f32;
                    let expected = if a == b { squares[a] } else { 0.0 };
                    assert!((found - expected).abs() < 0.01, "{name} {a} {b}: {found}");
                }
            }
        }
    }
}
