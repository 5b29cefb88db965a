//! The optics of matter.

use crate::math::Rgb;

/// The optics of matter at one data value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// Multiplies the medium's density to give extinction; 0 to 1.
    pub opacity: f32,
    /// Share of the extinguished light that is scattered, per channel; 0 to 1.
    pub albedo: Rgb,
    /// Emitted radiance of matter in thermal equilibrium, `Le`; at least 0.
    pub emission: Rgb,
    /// Share of the scattering that is surface reflection where the gradient is strong; 0 to 1.
    pub surface: f32,
    /// Reflectance at normal incidence of glossy BRDFs; 0 to 1.
    pub specular: Rgb,
    /// Roughness of glossy BRDFs; 0 to 1.
    pub roughness: f32,
    /// Refractive index; read only by `refractive`.
    pub ior: f32,
}

impl Default for Optics {
    /// The scene document's defaults; opaque.
    fn default() -> Self {
        Self {
            opacity: 1.0,
            albedo: Rgb::splat(0.8),
            emission: Rgb::BLACK,
            surface: 0.0,
            specular: Rgb::splat(0.04),
            roughness: 0.3,
            ior: 1.0,
        }
    }
}

impl Optics {
    /// Radiance that matter adds per unit of extinction on a path, `(1 - albedo) Le`.
    #[inline]
    #[must_use]
    pub fn emitted(&self) -> Rgb {
        (Rgb::WHITE - self.albedo) * self.emission
    }

    /// From `self` (t = 0) to `other` (t = 1), each quantity separately.
    #[inline]
    #[must_use]
    pub fn lerp(&self, other: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * t;
        Self {
            opacity: mix(self.opacity, other.opacity),
            albedo: self.albedo.lerp(other.albedo, t),
            emission: self.emission.lerp(other.emission, t),
            surface: mix(self.surface, other.surface),
            specular: self.specular.lerp(other.specular, t),
            roughness: mix(self.roughness, other.roughness),
            ior: mix(self.ior, other.ior),
        }
    }
}
