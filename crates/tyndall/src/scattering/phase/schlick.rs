//! Schlick's rational phase function \[Blasi93\].

use super::{PhaseError, drop_lanes};
use crate::math::{Vec3, cast};
use crate::scattering::deflect;
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// A lobe without a square root, close to Henyey-Greenstein's \[Blasi93\]:
/// `(1 - k^2) / (4 pi (1 - k cos_theta)^2)`; k > 0 is forward.
///
/// Texts that write `1 + k cos_theta` take both directions as leaving the point; here they follow the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schlick {
    k: f32,
}

impl Schlick {
    /// From its elongation.
    ///
    /// # Errors
    /// [`PhaseError::Elongation`] unless `-1 < k < 1`; at +-1 the lobe is no longer a function.
    pub fn new(k: f32) -> Result<Self, PhaseError> {
        if -1.0 < k && k < 1.0 { Ok(Self { k }) } else { Err(PhaseError::Elongation(k)) }
    }

    /// Density of scattering at `cos_theta`, \[1/sr\]; also the exact pdf of [`Self::sample`].
    #[inline]
    #[must_use]
    pub fn eval(self, cos_theta: f32) -> f32 {
        self.at_drop(1.0 - cos_theta * self.side())
    }

    /// [`Self::eval`] of two unit vectors, `w` before and `after` scattering, without the rounding of a cosine.
    #[inline]
    #[must_use]
    pub fn eval_between(self, w: Vec3, after: Vec3) -> f32 {
        self.at_drop(0.5 * (w * self.side() - after).length_squared())
    }

    /// [`Self::eval_between`] of a direction before scattering per lane.
    #[inline(always)]
    pub(super) fn eval_between_lanes<S: Lanes>(self, simd: S, w: [S::f32s; 3], after: Vec3) -> S::f32s {
        let k = self.k.abs();
        let gap = 1.0 - k;
        let d = drop_lanes(simd, w, self.side(), after) * k + gap;
        S::f32s::splat(simd, gap * (1.0 + k) / (4.0 * PI)) / (d * d)
    }

    /// Density at `1 - cos` from the lobe's axis. In that form `1 - k cos` is a sum of positive terms.
    #[inline]
    fn at_drop(self, drop: f32) -> f32 {
        let k = self.k.abs();
        let gap = 1.0 - k;
        let d = gap + k * drop.max(0.0);
        gap * (1.0 + k) / (4.0 * PI * d * d)
    }

    /// +1 if the lobe is forward, -1 if backward.
    #[inline]
    fn side(self) -> f32 {
        1.0_f32.copysign(self.k)
    }

    /// Samples the direction after scattering from two uniform numbers in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(self, w: Vec3, u: [f32; 2]) -> Vec3 {
        let k = self.k.abs();
        let gap = 1.0 - k;
        let drop = 2.0 * gap * u[0] / (gap + 2.0 * k * (1.0 - u[0]));
        deflect(w * self.side(), drop, u[1])
    }

    /// Mean of `cos_theta`: `1/k - (1 - k^2) artanh(k) / k^2`.
    #[must_use]
    pub fn mean_cosine(self) -> f32 {
        let k = f64::from(self.k);
        // The two terms cancel for small k; their series does not.
        cast::single(if k.abs() < 1e-2 {
            k * (2.0 / 3.0 + k * k * (2.0 / 15.0 + k * k * 2.0 / 35.0))
        } else {
            1.0 / k - (1.0 - k * k) * k.atanh() / (k * k)
        })
    }
}
