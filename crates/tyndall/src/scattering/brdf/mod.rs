//! BRDFs: how a surface in the data reflects light.
//!
//! `w_in` points to where the light comes from and `w_out` to where it goes; both leave the surface.
//! The normal is two-sided: it only matters whether both directions are on the same side. Values of
//! `eval` are `f_r` alone, \[1/sr\], without a cosine.

mod abc;
mod ashikhmin_shirley;
mod coat;

pub use abc::{Abc, BrdfError};

use crate::math::{Frame, Rgb, Vec3};
use crate::sampling::warp;
use crate::scattering::{TransportMode, deflect};
use ashikhmin_shirley::AshikhminShirley;
use coat::Half;
use std::f32::consts::{FRAC_1_PI, TAU};

/// The optics of a surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Diffuse reflectance, in [0, 1].
    pub albedo: Rgb,
    /// Mirror reflectance along the normal, in [0, 1]; Lambert has none.
    pub specular: Rgb,
    /// From 0 (sharp) to 1; read by Ashikhmin-Shirley, whose exponent is `2/roughness^4 - 2`.
    pub roughness: f32,
}

/// One of the BRDFs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Brdf {
    /// `albedo / pi`.
    #[default]
    Lambert,
    /// Phong lobes that keep reciprocity and energy over a matching diffuse base \[Ashikhmin00\].
    AshikhminShirley,
    /// Microfacets whose distribution fits measured glossy surfaces \[Low12\].
    Abc(Abc),
}

/// Roughly how much light each lobe of a BRDF reflects: the weights by which sampling chooses a lobe.
#[derive(Clone, Copy, Default)]
struct Lobes {
    diffuse: f32,
    specular: f32,
}

impl Lobes {
    #[inline]
    fn total(self) -> f32 {
        self.diffuse + self.specular
    }
}

/// Smallest weight of a specular lobe: away from the mirror direction facets reflect even where the
/// estimate, which considers only the normal, is 0.
const LEAST_SPECULAR: f32 = 0.01;

impl Brdf {
    /// `f_r`, \[1/sr\]: 0 unless both unit directions are strictly on the same side of the unit normal `n`.
    ///
    /// Reciprocal: exchanging `w_in` and `w_out` changes nothing.
    #[inline]
    #[must_use]
    pub fn eval(&self, n: Vec3, w_in: Vec3, w_out: Vec3, surface: &Surface) -> Rgb {
        let Some((n, cos_in, cos_out)) = one_side(n, w_in, w_out) else {
            return Rgb::BLACK;
        };
        let half = Half::between(n, w_in, w_out);
        let gloss = match self {
            Self::Lambert => return surface.albedo * FRAC_1_PI,
            Self::AshikhminShirley => {
                AshikhminShirley::of_roughness(surface.roughness).eval(half, cos_in.max(cos_out))
            }
            Self::Abc(lobe) => lobe.eval(half, cos_in, cos_out),
        };
        coat::base(surface, cos_in, cos_out) + coat::fresnel(surface.specular, half.cos) * gloss
    }

    /// Samples the direction that a walk does not know yet; `None` where it would go below the surface:
    /// that light is lost.
    ///
    /// `known` is `w_out` of a camera path, which samples `w_in` roughly by `f_r cos_in`, or `w_in` of a light
    /// path, which samples `w_out` roughly by `f_r`. `u` are uniform numbers in [0, 1]; the last one chooses the lobe.
    #[inline]
    #[must_use]
    pub fn sample(
        &self,
        walk: TransportMode,
        n: Vec3,
        known: Vec3,
        surface: &Surface,
        u: [f32; 3],
    ) -> Option<Vec3> {
        let n = n * 1.0_f32.copysign(n.dot(known));
        let lobes = self.lobes(walk, n.dot(known), surface);
        if lobes.total() <= 0.0 {
            None
        } else if u[2] * lobes.total() < lobes.specular {
            self.draw_specular(n, known, surface, [u[0], u[1]])
        } else {
            Some(draw_diffuse(walk, n, [u[0], u[1]]))
        }
    }

    /// Density over solid angle with which [`Self::sample`] samples a direction, \[1/sr\]; its integral falls
    /// short of 1 by the probability of `None`.
    #[inline]
    #[must_use]
    pub fn pdf(&self, walk: TransportMode, n: Vec3, known: Vec3, drawn: Vec3, surface: &Surface) -> f32 {
        let Some((n, cos_known, cos_drawn)) = one_side(n, known, drawn) else {
            return 0.0;
        };
        let lobes = self.lobes(walk, cos_known, surface);
        let specular = match self {
            Self::Lambert => 0.0,
            Self::AshikhminShirley => {
                AshikhminShirley::of_roughness(surface.roughness).pdf(Half::between(n, known, drawn))
            }
            Self::Abc(lobe) => lobe.pdf(Half::between(n, known, drawn)),
        };
        let mixed = lobes.diffuse * diffuse_density(walk, cos_drawn) + lobes.specular * specular;
        mixed / lobes.total().max(f32::MIN_POSITIVE)
    }

    /// Rough mean weight of [`Self::sample`], for choosing between this BRDF and other lobes: never 0 where
    /// [`Self::eval`] is not.
    #[inline]
    #[must_use]
    pub fn reflectance_estimate(&self, walk: TransportMode, cos_known: f32, surface: &Surface) -> f32 {
        self.lobes(walk, cos_known, surface).total()
    }

    /// Rough reflectance of each lobe seen from the known direction: the largest channel, so that no
    /// colour is sampled too rarely.
    #[inline]
    fn lobes(&self, walk: TransportMode, cos_known: f32, surface: &Surface) -> Lobes {
        if cos_known <= 0.0 {
            return Lobes::default();
        }
        // A light path keeps the known cosine, a camera path integrates over the other one.
        let kept = if walk == TransportMode::Light { 2.0 * cos_known } else { 1.0 };
        match self {
            Self::Lambert => Lobes { diffuse: kept * surface.albedo.max_component(), specular: 0.0 },
            Self::AshikhminShirley | Self::Abc(_) => Lobes {
                diffuse: kept * coat::base_reflectance(surface, cos_known).max_component(),
                specular: coat::fresnel(surface.specular, cos_known).max_component().max(LEAST_SPECULAR),
            },
        }
    }

    /// Mirrors the known direction at a facet sampled about `n`, which is on that direction's side.
    #[inline]
    fn draw_specular(&self, n: Vec3, known: Vec3, surface: &Surface, u: [f32; 2]) -> Option<Vec3> {
        let drop = match self {
            Self::Lambert => return None,
            Self::AshikhminShirley => AshikhminShirley::of_roughness(surface.roughness).draw_drop(u[0]),
            Self::Abc(lobe) => lobe.draw_drop(u[0]),
        };
        let facet = deflect(n, drop, u[1]);
        let mirrored = (facet * (2.0 * known.dot(facet)) - known).normalize();
        (mirrored.dot(n) > 0.0).then_some(mirrored)
    }
}

/// Samples the diffuse lobe about `n`. In a camera path the cosine is that of the sampled direction and
/// is sampled with it; in a light path it is that of the known one, and the sampled one is uniform:
/// dividing by a sampled cosine would make weights unbounded.
#[inline]
fn draw_diffuse(walk: TransportMode, n: Vec3, u: [f32; 2]) -> Vec3 {
    let local = match walk {
        TransportMode::Camera => warp::cosine_hemisphere(u),
        TransportMode::Light => warp::around_z(1.0 - u[0], u[1]),
    };
    Frame::around(n).to_world(local)
}

/// Density of [`draw_diffuse`], \[1/sr\].
#[inline]
fn diffuse_density(walk: TransportMode, cos_drawn: f32) -> f32 {
    match walk {
        TransportMode::Camera => cos_drawn * FRAC_1_PI,
        TransportMode::Light => 1.0 / TAU,
    }
}

/// The normal flipped to the side of two directions, and their cosines; `None` unless they share a side.
#[inline]
fn one_side(n: Vec3, a: Vec3, b: Vec3) -> Option<(Vec3, f32, f32)> {
    let side = 1.0_f32.copysign(n.dot(a));
    let (cos_a, cos_b) = (side * n.dot(a), side * n.dot(b));
    (cos_a > 0.0 && cos_b > 0.0).then_some((n * side, cos_a, cos_b))
}

#[cfg(test)]
mod tests;
