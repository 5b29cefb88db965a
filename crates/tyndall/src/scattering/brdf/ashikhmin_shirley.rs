//! The gloss of Ashikhmin and Shirley's anisotropic Phong model, used isotropically \[Ashikhmin00\].

use super::coat::Half;
use std::f32::consts::TAU;

/// Below this roughness a lobe is narrower than single precision can resolve.
const LEAST_ROUGHNESS: f32 = 0.02;

/// A Phong lobe about the normal, over half vectors: `(n . h)^exponent`.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminShirley {
    exponent: f32,
}

impl AshikhminShirley {
    /// Exponent `2/roughness^4 - 2` in both tangent directions, finite and at least 0.
    #[inline]
    pub fn of_roughness(roughness: f32) -> Self {
        let r2 = roughness.clamp(LEAST_ROUGHNESS, 1.0).powi(2);
        Self { exponent: 2.0 / (r2 * r2) - 2.0 }
    }

    /// The specular term without its Fresnel factor, both exponents equal \[Ashikhmin00, eq. 4\]:
    /// `(exponent + 1) / (8 pi) (n . h)^exponent / ((k . h) max(cos_in, cos_out))`.
    #[inline]
    pub fn eval(self, half: Half, larger_cos: f32) -> f32 {
        self.pdf(half) / larger_cos
    }

    /// Samples `1 - n . h` of a facet \[Ashikhmin00, eq. 10\].
    #[inline]
    pub fn draw_drop(self, u: f32) -> f32 {
        -((-u).ln_1p() / (self.exponent + 1.0)).exp_m1()
    }

    /// Density of the mirrored direction, \[1/sr\] \[Ashikhmin00, eq. 8\].
    #[inline]
    pub fn pdf(self, half: Half) -> f32 {
        (self.exponent + 1.0) / TAU * self.phong(half.drop) / (4.0 * half.cos)
    }

    /// `(1 - drop)^exponent`, by a logarithm that is accurate for small drops.
    #[inline]
    fn phong(self, drop: f32) -> f32 {
        (self.exponent * (-drop).ln_1p()).exp()
    }
}
