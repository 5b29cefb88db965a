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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cast;
    use tyndall_testing::{ChiSquare, SplitMix};

    #[test]
    fn directions_follow_their_densities() {
        let check = |warp: &dyn Fn([f32; 2]) -> Vec3, pdf: &dyn Fn([f32; 3]) -> f32| {
            let sample = |u: [f32; 2]| Some(warp(u).to_array());
            ChiSquare::among(4).directions(sample, |w| f64::from(pdf(w))).assert();
        };
        check(&sphere, &|_| 0.25 / PI);
        check(&cosine_hemisphere, &|w| w[2].max(0.0) / PI);
        for cos_max in [0.9, -0.3] {
            let inside = 1.0 / (TAU * (1.0 - cos_max));
            check(&|u| cone(u, cos_max), &|w| if w[2] >= cos_max { inside } else { 0.0 });
        }
    }

    /// Equal areas: rings between radii sqrt(i / 8), each cut into 8 sectors.
    #[test]
    fn points_fill_the_disk_evenly() {
        let mut counts = [0_u64; 64];
        let mut random = SplitMix::new(5);
        for _ in 0..1_000_000 {
            let [x, y] = disk(random.uniforms());
            let ring = cast::index((x * x + y * y) * 8.0).min(7);
            let sector = cast::index((y.atan2(x) / TAU + 0.5) * 8.0).min(7);
            counts[ring * 8 + sector] += 1;
        }
        let even = [1.0 / 64.0; 64];
        ChiSquare::default().discrete(&even, &counts).assert();
    }
}
