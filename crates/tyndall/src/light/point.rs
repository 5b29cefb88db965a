//! A point source.

use super::{Emitted, Enclosure, LightSample, Target};
use crate::math::{Ray, Rgb, Vec3};
use crate::sampling::warp;
use std::f64::consts::PI;

/// Emits equally in all directions from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// World position.
    pub position: Vec3,
    /// Radiant intensity, W/sr.
    pub intensity: Rgb,
}

impl PointLight {
    #[inline]
    pub(super) fn sample(&self, from: Vec3) -> Option<LightSample> {
        let to_light = self.position - from;
        let squared = to_light.length_squared();
        if squared == 0.0 {
            return None;
        }
        let distance = squared.sqrt();
        let radiance = self.intensity / squared;
        Some(LightSample { direction: to_light / distance, distance, radiance, pdf: f32::INFINITY })
    }

    /// From outside into the solid angle of the box, from inside in all directions.
    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let toward = [u[0], u[1]];
        if into.contains(self.position) {
            return Some(Emitted::evenly(Ray::new(self.position, warp::sphere(toward)), 4.0 * PI));
        }
        let (ray, solid_angle) = into.aim(self.position, toward)?;
        Some(Emitted::evenly(ray, solid_angle))
    }

    pub(super) fn strength(&self, target: &Target) -> f64 {
        let distance = f64::from(self.position.distance(target.center).max(target.radius));
        f64::from(self.intensity.luminance()) / (distance * distance)
    }
}
