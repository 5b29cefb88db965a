//! The Henyey-Greenstein phase function \[HG41\].

use super::{PhaseError, drop_lanes};
use crate::math::Vec3;
use crate::scattering::deflect;
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// One lobe, set by its mean cosine `g` \[HG41\]:
/// `(1 - g^2) / (4 pi (1 + g^2 - 2 g cos_theta)^(3/2))`; g > 0 is forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    g: f32,
}

impl HenyeyGreenstein {
    /// From its mean cosine.
    ///
    /// # Errors
    /// [`PhaseError::MeanCosine`] unless `-1 < g < 1`; at +-1 the lobe is no longer a function.
    pub fn new(g: f32) -> Result<Self, PhaseError> {
        if -1.0 < g && g < 1.0 { Ok(Self { g }) } else { Err(PhaseError::MeanCosine(g)) }
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
        let g = self.g.abs();
        let gap = 1.0 - g;
        let d = drop_lanes(simd, w, self.side(), after) * (2.0 * g) + gap * gap;
        S::f32s::splat(simd, gap * (1.0 + g) / (4.0 * PI)) / (d * d.sqrt())
    }

    /// Density at `1 - cos` from the lobe's axis. In that form `1 + g^2 - 2 g cos` is a sum of positive terms.
    #[inline]
    fn at_drop(self, drop: f32) -> f32 {
        let g = self.g.abs();
        let gap = 1.0 - g;
        let d = gap * gap + 2.0 * g * drop.max(0.0);
        gap * (1.0 + g) / (4.0 * PI * d * d.sqrt())
    }

    /// +1 if the lobe is forward, -1 if backward.
    #[inline]
    fn side(self) -> f32 {
        1.0_f32.copysign(self.g)
    }

    /// Samples the direction after scattering from two uniform numbers in [0, 1).
    ///
    /// The textbook inverse of the distribution divides by `g`. Solved for `1 - cos_theta` it factors
    /// into `2 (1-g)^2 u (1 + g (1-u)) / (1-g + 2 g (1-u))^2`, which needs no special case for `g = 0` and
    /// loses no digits where the lobe is narrow.
    #[inline]
    #[must_use]
    pub fn sample(self, w: Vec3, u: [f32; 2]) -> Vec3 {
        let g = self.g.abs();
        let (gap, rest) = (1.0 - g, 1.0 - u[0]);
        let shrink = gap / (gap + 2.0 * g * rest);
        let drop = 2.0 * shrink * shrink * u[0] * (1.0 + g * rest);
        deflect(w * self.side(), drop, u[1])
    }

    /// Mean of `cos_theta`: `g`.
    #[must_use]
    pub fn mean_cosine(self) -> f32 {
        self.g
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scattering::trial;

    #[test]
    fn second_moment_is_the_known_one() {
        for g in [-0.95_f32, -0.3, 0.0, 0.6, 0.99] {
            let lobe = HenyeyGreenstein::new(g).unwrap();
            let [second] = trial::integrate(Vec3::Z * 1.0_f32.copysign(g), |w| {
                [f64::from(lobe.eval(w.z)) * f64::from(w.z).powi(2)]
            });
            let known = f64::from((1.0 + 2.0 * g * g) / 3.0);
            assert!((second - known).abs() < 1e-4, "g {g}: {second} not {known}");
        }
    }

    #[test]
    fn no_elongation_is_isotropic() {
        let lobe = HenyeyGreenstein::new(0.0).unwrap();
        assert!((lobe.eval(0.3) - 1.0 / (4.0 * PI)).abs() < 1e-8);
        let w = lobe.sample(Vec3::Z, [0.25, 0.0]);
        assert!((w.z - 0.5).abs() < 1e-6, "{w}");
    }
}
