//! What the glossy BRDFs share: half vectors, Fresnel reflectance, and the diffuse base under the gloss.

use super::Surface;
use crate::math::{Rgb, Vec3};
use std::f32::consts::PI;

/// The facet normal that mirrors two directions into each other.
#[derive(Clone, Copy, Debug)]
pub struct Half {
    /// `1 - n . h`, in [0, 1].
    pub drop: f32,
    /// Cosine of the angle between it and either direction.
    pub cos: f32,
}

impl Half {
    /// Between two unit directions on the side of the unit normal `n`.
    #[inline]
    pub fn between(n: Vec3, a: Vec3, b: Vec3) -> Self {
        let sum = a + b;
        // Opposite directions have no half vector; the smallest length makes it perpendicular to both.
        let length = sum.length().max(f32::EPSILON);
        // |n - h|^2 / 2 is 1 - n . h with all its digits, which a narrow lobe needs.
        let drop = 0.5 * (n - sum / length).length_squared();
        Self { drop: drop.min(1.0), cos: 0.5 * length }
    }
}

/// Reflectance of a facet seen at a given cosine, from its reflectance at normal incidence \[Schlick94\].
#[inline]
pub fn fresnel(at_normal: Rgb, cos: f32) -> Rgb {
    let rise = fifth(1.0 - cos);
    at_normal.map(|r| r + (1.0 - r) * rise)
}

/// The diffuse term under a glossy coat \[Ashikhmin00, eq. 5\]:
/// `28 Rd / (23 pi) (1 - Rs) (1 - (1 - cos_in/2)^5) (1 - (1 - cos_out/2)^5)`.
/// It fades towards grazing, where the coat reflects everything, so that the sum stays within 1.
#[inline]
pub fn base(surface: &Surface, cos_in: f32, cos_out: f32) -> Rgb {
    base_reflectance(surface, cos_in) * (28.0 / (23.0 * PI) * passed(cos_out))
}

/// Total reflectance of [`base`] for light at a given cosine: its cosine-weighted integral over the
/// other direction.
#[inline]
pub fn base_reflectance(surface: &Surface, cos: f32) -> Rgb {
    surface.albedo * surface.specular.map(|r| 1.0 - r) * passed(cos)
}

/// The share that a coat with no reflectance at normal incidence lets through.
#[inline]
fn passed(cos: f32) -> f32 {
    1.0 - fifth(1.0 - 0.5 * cos)
}

#[inline]
fn fifth(x: f32) -> f32 {
    let x2 = x * x;
    x2 * x2 * x
}
