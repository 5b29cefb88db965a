//! Light from one direction, or from a cone around it.

use super::{Emitted, Enclosure, LightSample, Passed};
use crate::math::{Frame, Ray, Rgb, Vec3};
use crate::sampling::warp;
use std::f32::consts::PI;

/// The sun: the same everywhere. With an angle it is a uniform disk in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directional {
    /// Frame about the direction *to* the light.
    frame: Frame,
    irradiance: Rgb,
    /// `1 - cos` of half the cone's angle; 0 is sharp.
    cap: f32,
}

/// Half the angle of the narrowest cone, in radians.
const NARROWEST: f32 = 1e-7;

impl Directional {
    /// `travel` is where the light goes (any nonzero length), `irradiance` what a surface facing it
    /// receives, `angle` the full cone in degrees, 0 (sharp) to 180.
    #[must_use]
    pub fn new(travel: Vec3, irradiance: Rgb, angle: f32) -> Self {
        let half = 0.5 * angle.to_radians();
        // 1 - cos without cancellation. In a narrower cone all directions are equal in single precision: treat it as
        // sharp.
        let cap = if half < NARROWEST { 0.0 } else { 2.0 * (0.5 * half).sin().powi(2) };
        Self { frame: Frame::around(-travel.normalize()), irradiance, cap }
    }

    pub(super) fn is_sharp(&self) -> bool {
        self.cap == 0.0
    }

    /// Radiance inside the cone: `E = L pi sin^2(half)`.
    fn radiance(&self) -> Rgb {
        self.irradiance / (PI * self.cap * (2.0 - self.cap))
    }

    fn pdf(&self) -> f32 {
        1.0 / (2.0 * PI * self.cap)
    }

    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let distance = f32::INFINITY;
        let direction = self.toward(u);
        if self.is_sharp() {
            return Some(LightSample { direction, distance, radiance: self.irradiance, pdf: distance });
        }
        Some(LightSample { direction, distance, radiance: self.radiance() / self.pdf(), pdf: self.pdf() })
    }

    /// Direction to the light, uniform in its cone.
    #[inline]
    fn toward(&self, u: [f32; 2]) -> Vec3 {
        if self.is_sharp() {
            return self.frame.w;
        }
        let drop = u[0] * self.cap;
        let sin = (drop * (2.0 - drop)).sqrt();
        let turn = warp::around_z(0.0, u[1]) * sin;
        self.frame.to_world(turn.with_z(1.0 - drop)).normalize()
    }

    /// Uniform over the silhouette of the box.
    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let travel = -self.toward([u[2], u[3]]);
        let (ray, area) = into.cross(travel.as_dvec3(), [u[0], u[1]])?;
        // Radiance over pdf, per unit of irradiance; 1 when sharp.
        let share = 2.0 / (2.0 - f64::from(self.cap));
        Some(Emitted::evenly(ray, share * area))
    }

    pub(super) fn color(&self) -> Rgb {
        self.irradiance
    }

    pub(super) fn colored(self, irradiance: Rgb) -> Self {
        Self { irradiance, ..self }
    }

    #[inline]
    pub(super) fn passed(&self, ray: &Ray) -> Option<Passed> {
        // |w - d|^2 = 2 (1 - cos), exact where the cosine itself has lost its bits.
        let drop = 0.5 * (ray.direction - self.frame.w).length_squared();
        let inside = !self.is_sharp() && drop <= self.cap;
        inside.then(|| Passed { distance: f32::INFINITY, radiance: self.radiance(), pdf: self.pdf() })
    }

    pub(super) fn strength(&self) -> f64 {
        f64::from(self.irradiance.luminance())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_too_narrow_for_single_precision_is_sharp() {
        let sun = |angle| Directional::new(-Vec3::Y, Rgb::splat(3.0), angle);
        assert!(!sun(1e-4).is_sharp());
        for angle in [1e-6, 1e-20, 1e-38, 1e-45] {
            let sample = sun(angle).sample([0.3, 0.6]);
            assert!(
                sample.is_some_and(|s| s.radiance == Rgb::splat(3.0) && s.pdf.is_infinite()),
                "{angle:e}"
            );
        }
    }
}
