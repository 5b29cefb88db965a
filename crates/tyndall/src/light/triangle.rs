//! Triangles on the sphere of directions.

use crate::math::DVec3;
use std::f64::consts::TAU;

/// Half a solid angle, from 0 to pi, as a complex number of any magnitude with that argument: sums become products
/// and need no trigonometric functions.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfAngle {
    re: f64,
    im: f64,
}

impl HalfAngle {
    pub(super) const ZERO: Self = Self { re: 1.0, im: 0.0 };

    pub(super) fn new(radians: f64) -> Self {
        let (im, re) = radians.sin_cos();
        Self { re, im }
    }

    #[inline]
    pub(super) fn plus(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.im * other.re + self.re * other.im }
    }

    #[inline]
    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(Self { re: other.re, im: -other.im })
    }

    #[inline]
    pub(super) fn is_below(self, other: Self) -> bool {
        other.minus(self).im > 0.0
    }

    pub(super) fn radians(self) -> f64 {
        let radians = self.im.atan2(self.re);
        // Rounding can take a half sphere past pi.
        if radians < 0.0 { radians + TAU } else { radians }
    }
}

/// A corner of a triangle as seen from the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Unit vector to it.
    direction: DVec3,
    /// One over its distance.
    nearness: f64,
}

impl Corner {
    #[inline]
    pub(super) fn new(from_eye: DVec3) -> Self {
        let nearness = from_eye.length().recip();
        Self { direction: from_eye * nearness, nearness }
    }
}

/// The directions in which a plane triangle is seen.
///
/// In double precision, using differences of directions instead of 1 minus their cosine, so that
/// triangles of 1e-7 radians and those that the eye almost touches keep their shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalTriangle {
    /// Unit vectors to the corners.
    corners: [DVec3; 3],
    /// Volume that the three unit vectors span: six times that of their tetrahedron.
    volume: f64,
}

impl SphericalTriangle {
    /// `volume` is that spanned by the three vectors to the corners, not negative: the caller knows it from
    /// the height of the eye above the triangle's plane, which a determinant of small differences would lose.
    #[inline]
    pub(super) fn new([a, b, c]: [Corner; 3], volume: f64) -> Self {
        let volume = volume * (a.nearness * b.nearness * c.nearness);
        Self { corners: [a.direction, b.direction, c.direction], volume }
    }

    /// Half the solid angle \[vanOosterom83\].
    #[inline]
    pub(super) fn half_angle(&self) -> HalfAngle {
        let [a, b, c] = self.corners;
        HalfAngle { re: 1.0 + a.dot(b) + b.dot(c) + c.dot(a), im: self.volume }
    }

    /// A direction uniform over the triangle; not finite if the triangle has no extent.
    ///
    /// As \[Arvo95\]: cuts off a triangle `a b d`, `d` between `a` and `c`, whose half angle is `part` (uniform); then
    /// goes the share `way` (uniform) from `b` to `d`, evenly in the cosine. The paper finds `d` by spherical
    /// trigonometry; here the formula for the solid angle is solved for the tangent of half the arc from `a` to `d`.
    pub(super) fn sample(&self, part: HalfAngle, way: f64) -> DVec3 {
        let [a, b, c] = self.corners;
        // The component of c perpendicular to a; its length is the sine of their arc.
        let across = (c - a) + a * drop(a, c);
        let length = across.length();
        let one_and_cos = 0.5 * (a + b).length_squared();
        // The tangent is p / q.
        let (p, q) = (part.im * one_and_cos * length, part.re * self.volume - part.im * b.dot(across));
        let squared = p * p + q * q;
        let d = a * ((q * q - p * p) / squared) + across * (2.0 * p * q / (squared * length));

        let fall = way * drop(b, d);
        let tangent = ((d - b) + b * drop(b, d)).normalize();
        b * (1.0 - fall) + tangent * (fall * (2.0 - fall)).sqrt()
    }
}

/// 1 minus the cosine between two unit vectors.
fn drop(a: DVec3, b: DVec3) -> f64 {
    0.5 * (a - b).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use tyndall_testing::{ChiSquare, SplitMix};

    fn triangle(corners: [DVec3; 3]) -> SphericalTriangle {
        let volume = corners[0].dot(corners[1].cross(corners[2])).abs();
        SphericalTriangle::new(corners.map(Corner::new), volume)
    }

    /// An octant, a sliver, one that fills nearly half the sphere, and one of a thousandth of a radian.
    fn triangles() -> [[DVec3; 3]; 4] {
        let v = DVec3::new;
        let small = v(0.6, -0.5, 0.7);
        [
            [DVec3::X, DVec3::Y * 3.0, DVec3::Z * 0.5],
            [v(1.0, 0.0, 0.2), v(-1.0, 0.1, 0.3), v(-1.0, 0.3, 0.2)],
            [v(1.0, 0.0, -0.02), v(-0.5, 0.9, -0.02), v(-0.6, -0.8, -0.02)],
            [small, small + DVec3::X * 1e-3, small + DVec3::Y * 2e-3],
        ]
    }

    #[test]
    fn half_angles_add_up_to_a_half_sphere() {
        let sum = [0.3, 1.2, 0.9].map(HalfAngle::new).into_iter().fold(HalfAngle::ZERO, HalfAngle::plus);
        assert!((sum.radians() - 2.4).abs() < 1e-15);
        assert!((sum.minus(HalfAngle::new(0.3)).radians() - 2.1).abs() < 1e-15);
        assert!(HalfAngle::new(2.3).is_below(sum) && !HalfAngle::new(2.5).is_below(sum));
        let half_sphere = HalfAngle::new(1.2).plus(HalfAngle::new(PI - 1.2 + 1e-15));
        assert!((half_sphere.radians() - PI).abs() < 1e-14);
    }

    #[test]
    fn solid_angles_of_known_triangles() {
        let [octant, _, _, small] = triangles();
        assert!((2.0 * triangle(octant).half_angle().radians() - PI / 2.0).abs() < 1e-15);
        let area = 0.5 * (small[1] - small[0]).cross(small[2] - small[0]).dot(small[0]).abs();
        let expected = area / small[0].length().powi(3);
        assert!((2.0 * triangle(small).half_angle().radians() / expected - 1.0).abs() < 5e-3);
    }

    /// The share of samples within a part of the triangle is the ratio of the solid angles.
    #[test]
    fn any_triangle_is_filled_evenly() {
        let mut random = SplitMix::new(3);
        for corners in triangles() {
            let whole = triangle(corners);
            let inside = |[a, b, c]: [DVec3; 3], w: DVec3| {
                let side = |a: DVec3, b: DVec3| a.cross(b).dot(w);
                let sides = [side(a, b), side(b, c), side(c, a)];
                sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
            };
            let [a, b, c] = corners;
            for part in [[a, b, a.lerp(c, 0.4)], [b, c, b.lerp(a, 0.7)], [c, a, c.lerp(b, 0.2)]] {
                let half = whole.half_angle().radians();
                let share = triangle(part).half_angle().radians() / half;
                let mut hits = [0_u64; 2];
                for _ in 0..200_000 {
                    let w = whole.sample(HalfAngle::new(half * random.uniform()), random.uniform());
                    assert!((w.length() - 1.0).abs() < 1e-12, "{w}");
                    hits[usize::from(inside(part, w))] += 1;
                }
                let fit = ChiSquare::among(12).discrete(&[1.0 - share, share], &hits);
                assert!(fit.passes(), "{corners:?}, {share}: {fit}");
            }
        }
    }
}
