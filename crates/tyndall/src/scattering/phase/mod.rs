//! Phase functions: how matter without a surface scatters light.
//!
//! Directions follow the light: `cos_theta = w . w'` is +1 when it goes straight on. Values are
//! densities over solid angle, \[1/sr\], and integrate to 1 over the sphere. All kinds depend only on the
//! cosine, so they are the same for both directions of a walk.

mod henyey_greenstein;
mod schlick;

pub use henyey_greenstein::HenyeyGreenstein;
pub use schlick::Schlick;

use crate::math::Vec3;
use crate::sampling::warp;
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// Why a phase function is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PhaseError {
    /// The mean cosine is out of range.
    #[error("henyey-greenstein: g is {0}, expected -1 < g < 1; for nearly straight on, use 0.999")]
    MeanCosine(f32),
    /// The elongation is out of range.
    #[error("schlick: k is {0}, expected -1 < k < 1; for nearly straight on, use 0.999")]
    Elongation(f32),
}

/// One of the phase functions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Phase {
    /// The same in every direction, `1 / (4 pi)`.
    #[default]
    Isotropic,
    /// One lobe, set by its mean cosine.
    HenyeyGreenstein(HenyeyGreenstein),
    /// The rational approximation of it.
    Schlick(Schlick),
}

impl Phase {
    /// Density of scattering at `cos_theta`, \[1/sr\]; also the exact pdf of [`Self::sample`].
    #[inline]
    #[must_use]
    pub fn eval(&self, cos_theta: f32) -> f32 {
        match self {
            Self::Isotropic => 1.0 / (4.0 * PI),
            Self::HenyeyGreenstein(lobe) => lobe.eval(cos_theta),
            Self::Schlick(lobe) => lobe.eval(cos_theta),
        }
    }

    /// [`Self::eval`] of two unit vectors, `w` before and `after` scattering.
    ///
    /// Near the peak of a narrow lobe (|g| above 0.99) a single-precision cosine is off by a few percent of
    /// the lobe's width; the difference of the vectors is not.
    #[inline]
    #[must_use]
    pub fn eval_between(&self, w: Vec3, after: Vec3) -> f32 {
        match self {
            Self::Isotropic => 1.0 / (4.0 * PI),
            Self::HenyeyGreenstein(lobe) => lobe.eval_between(w, after),
            Self::Schlick(lobe) => lobe.eval_between(w, after),
        }
    }

    /// [`Self::eval_between`] of a direction before scattering per lane.
    #[inline(always)]
    pub(crate) fn eval_between_lanes<S: Lanes>(&self, simd: S, w: [S::f32s; 3], after: Vec3) -> S::f32s {
        match self {
            Self::Isotropic => S::f32s::splat(simd, 1.0 / (4.0 * PI)),
            Self::HenyeyGreenstein(lobe) => lobe.eval_between_lanes(simd, w, after),
            Self::Schlick(lobe) => lobe.eval_between_lanes(simd, w, after),
        }
    }

    /// Samples the direction after scattering of light that travels along the unit vector `w`,
    /// from two uniform numbers in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, w: Vec3, u: [f32; 2]) -> Vec3 {
        match self {
            Self::Isotropic => warp::sphere(u),
            Self::HenyeyGreenstein(lobe) => lobe.sample(w, u),
            Self::Schlick(lobe) => lobe.sample(w, u),
        }
    }

    /// Mean of `cos_theta`, in (-1, 1); what similarity relations call g.
    #[must_use]
    pub fn mean_cosine(&self) -> f32 {
        match self {
            Self::Isotropic => 0.0,
            Self::HenyeyGreenstein(lobe) => lobe.mean_cosine(),
            Self::Schlick(lobe) => lobe.mean_cosine(),
        }
    }
}

/// `1 - cos` between each lane's direction times `side` and `after`: half their squared distance, without a cosine's
/// rounding.
#[inline(always)]
fn drop_lanes<S: Lanes>(simd: S, [x, y, z]: [S::f32s; 3], side: f32, after: Vec3) -> S::f32s {
    let splat = |x: f32| S::f32s::splat(simd, x);
    let (dx, dy, dz) = (x * side - splat(after.x), y * side - splat(after.y), z * side - splat(after.z));
    (dx * dx + dy * dy + dz * dz) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scattering::trial;
    use tyndall_testing::ChiSquare;

    const ELONGATIONS: [f32; 11] = [-0.999, -0.9, -0.5, -0.1, -1e-4, 0.0, 1e-4, 0.1, 0.5, 0.9, 0.999];

    fn all_kinds() -> Vec<Phase> {
        let mut kinds = vec![Phase::Isotropic];
        for x in ELONGATIONS {
            kinds.push(Phase::HenyeyGreenstein(HenyeyGreenstein::new(x).unwrap()));
            kinds.push(Phase::Schlick(Schlick::new(x).unwrap()));
        }
        kinds
    }

    #[test]
    fn they_integrate_to_one_and_to_their_mean_cosine() {
        for phase in all_kinds() {
            // The lobe's own axis as pole: the grid is finest there.
            let pole = Vec3::Z * 1.0_f32.copysign(phase.mean_cosine());
            let [between, by_cosine, mean] = trial::integrate(pole, |w| {
                let density = f64::from(phase.eval_between(Vec3::Z, w));
                [density, f64::from(phase.eval(w.z)), density * f64::from(w.z)]
            });
            assert!((between - 1.0).abs() < 1e-4, "{phase:?} integrates to {between}");
            if phase.mean_cosine().abs() < 0.99 {
                assert!((by_cosine - 1.0).abs() < 1e-4, "{phase:?} by its cosine integrates to {by_cosine}");
            }
            let claimed = f64::from(phase.mean_cosine());
            assert!((mean - claimed).abs() < 1e-4, "{phase:?}: mean cosine {mean}, claimed {claimed}");
        }
    }

    #[test]
    fn samplers_follow_their_densities() {
        let kinds = all_kinds();
        for phase in &kinds {
            // Lobes about the pole of the cells, then about a direction that is not an axis.
            for (w, least) in [(Vec3::Z, 0.0), (Vec3::new(0.48, -0.6, 0.64), 0.2)] {
                if phase.eval(0.0) * 4.0 * PI < least {
                    continue;
                }
                let test = ChiSquare { samples: 200_000, ..ChiSquare::among(2 * kinds.len()) };
                let fit = test.directions(
                    |u| Some(phase.sample(w, u).to_array()),
                    |after| f64::from(phase.eval_between(w, Vec3::from_array(after))),
                );
                assert!(fit.passes(), "{phase:?} about {w}: {fit}");
            }
        }
    }

    #[test]
    fn schlick_mean_cosine_is_continuous_at_its_series() {
        let mean = |k: f32| Schlick::new(k).unwrap().mean_cosine();
        for k in [0.0, 1e-7, 1e-3, 9.9e-3, 1.01e-2, 3e-2] {
            let leading = 2.0 * k / 3.0 + 2.0 * k * k * k / 15.0;
            assert!((mean(k) - leading).abs() <= 1e-6 * leading, "k {k}: {} not {leading}", mean(k));
        }
    }

    #[test]
    fn bad_elongations_are_refused_by_name() {
        for x in [-1.0, 1.0, 1.5, f32::NAN, f32::INFINITY] {
            let message = HenyeyGreenstein::new(x).unwrap_err().to_string();
            assert!(message.contains("g is") && message.contains(&x.to_string()), "{message}");
            let message = Schlick::new(x).unwrap_err().to_string();
            assert!(message.contains("k is") && message.contains(&x.to_string()), "{message}");
        }
    }
}
