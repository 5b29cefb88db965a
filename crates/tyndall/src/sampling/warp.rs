//! Maps from the unit square to spheres, disks and cones; each keeps strata together.

use crate::math::Vec3;
use std::f32::consts::{PI, TAU};

/// Uniform direction on the whole sphere; density `1 / (4 pi)`.
#[inline]
#[must_use]
pub fn sphere(u: [f32; 2]) -> Vec3 {
    around_z(1.0 - 2.0 * u[0], u[1])
}

/// Cosine-weighted direction on the hemisphere about +z; density `z / pi`.
#[inline]
#[must_use]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk(u);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Uniform direction in the cone about +z whose half angle has cosine `cos_max`;
/// density `1 / (2 pi (1 - cos_max))`.
#[inline]
#[must_use]
pub fn cone(u: [f32; 2], cos_max: f32) -> Vec3 {
    around_z(1.0 - u[0] * (1.0 - cos_max), u[1])
}

/// Uniform point on the unit disk, by the concentric map \[Shirley97\]; density `1 / pi`.
#[inline]
#[must_use]
pub fn disk(u: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let (r, phi) =
        if a.abs() > b.abs() { (a, PI / 4.0 * (b / a)) } else { (b, PI / 2.0 - PI / 4.0 * (a / b)) };
    let (sin, cos) = phi.sin_cos();
    [r * cos, r * sin]
}

/// Direction with the given z and an azimuth of `u` turns.
#[inline]
#[must_use]
pub fn around_z(z: f32, u: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}
