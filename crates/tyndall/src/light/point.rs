//! A point source.

use super::{LightSample, Target};
use crate::math::{Rgb, Vec3};

/// Shines equally to all sides from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where, world.
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

    pub(super) fn strength(&self, target: &Target) -> f64 {
        let distance = f64::from(self.position.distance(target.center).max(target.radius));
        f64::from(self.intensity.luminance()) / (distance * distance)
    }
}
