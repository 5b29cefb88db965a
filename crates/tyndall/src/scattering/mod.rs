//! What happens to light where it scatters: phase functions inside matter, BRDFs on the surfaces
//! that the data show, and the mix of both.
//!
//! **Directions.** A phase function takes directions that *follow the light*: `w` is how it travels
//! before and `w'` how it travels after, and `cos_theta = w . w' = +1` means that it went straight on.
//! BRDFs and the mix take the two directions that *leave the point*: `w_in` points to where the light
//! comes from and `w_out` to where it goes. They are related by `w = -w_in` and `w' = w_out`, so that
//! `cos_theta = -(w_in . w_out)`.
//!
//! A walk from the camera along `d` knows `w_out = -d` and samples `w_in`, its next direction; a walk
//! from a light along `d` knows `w_in = -d` and samples `w_out`, its next direction. See [`TransportMode`].

pub mod brdf;
pub mod mix;
pub mod phase;
#[cfg(test)]
mod trial;

pub use brdf::{Abc, Brdf, BrdfError, Surface};
pub use mix::{Event, Sample, surface_share};
pub use phase::{HenyeyGreenstein, Phase, PhaseError, Schlick};

use crate::math::{Frame, Vec3};
use std::f32::consts::TAU;

/// Where a walk began, and thus which of the two directions at a scattering event it knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// From the camera, against the light: knows `w_out`, samples `w_in`.
    Camera,
    /// From a light, with the light: knows `w_in`, samples `w_out`.
    Light,
}

/// The unit vector at an angle with `1 - cos = drop` from `axis` and `turn` turns about it.
///
/// Narrow lobes need this small difference, which a single-precision cosine near 1 has lost.
#[inline]
fn deflect(axis: Vec3, drop: f32, turn: f32) -> Vec3 {
    let sin_theta = (drop * (2.0 - drop)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * turn).sin_cos();
    let turned = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - drop);
    let v = Frame::around(axis).to_world(turned);
    // One Newton step towards unit length keeps rounding from adding up over a million scatterings.
    v * (1.5 - 0.5 * v.length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use tyndall_testing::SplitMix;

    /// The convention of the whole module: positive g scatters forward, the way the light travels.
    #[test]
    fn positive_g_goes_forward() {
        let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.95).unwrap());
        assert!(phase.eval(1.0) > 1000.0 * phase.eval(-1.0));
        let travels = Vec3::new(2.0, -1.0, 0.5).normalize();
        let surface = Surface { albedo: Rgb::WHITE, specular: Rgb::BLACK, roughness: 1.0 };
        let event = Event { phase, brdf: Brdf::Lambert, surface, normal: None, q: 0.0 };
        let (mut along_light, mut camera_walk, mut light_walk) = (0.0, 0.0, 0.0);
        let n = 64;
        for i in 0..n {
            for j in 0..n {
                let u = [(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32];
                along_light += phase.sample(travels, u).dot(travels);
                let u = [u[0], u[1], 0.5];
                camera_walk += event.sample(-travels, u).unwrap().direction.dot(travels);
                light_walk += event.sample_adjoint(-travels, u).unwrap().direction.dot(travels);
            }
        }
        for sum in [along_light, camera_walk, light_walk] {
            let mean = sum / (n * n) as f32;
            assert!((mean - 0.95).abs() < 2e-3, "mean cosine {mean}");
        }
    }

    #[test]
    fn directions_stay_normalised_over_a_million_scatterings() {
        let phase = Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.999).unwrap());
        let mut w = Vec3::Z;
        let mut random = SplitMix::new(1);
        for _ in 0..1_000_000 {
            w = phase.sample(w, random.uniforms());
        }
        assert!((w.length() - 1.0).abs() < 1e-6, "length {}", w.length());
    }
}
