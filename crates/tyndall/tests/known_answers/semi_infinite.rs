//! Radiances reflected by a semi-infinite, isotropically scattering medium \[Chandrasekhar60\].

use crate::scenes::{henyey_greenstein, radiance, slab};
use std::f64::consts::PI;
use tyndall::light::{Directional, Light};
use tyndall::math::{Ray, Rgb, Vec3};

/// Cosines of incidence and view, at which the H function is tabulated.
const MU: [f64; 3] = [0.1, 0.5, 1.0];

fn assert_reflection(albedo: f32, thickness: f32, h: [f64; 3], paths: u32) {
    for (i, j) in [(2, 1), (1, 2), (1, 0), (0, 1)] {
        let (mu_in, mu_out) = (MU[i], MU[j]);
        let mut reflection = f64::from(albedo) / 4.0 * h[i] * h[j] / (mu_in + mu_out);
        if albedo == 1.0 {
            // A conservative slab of thickness b transmits what a semi-infinite one would return
            // [vandeHulst80, sec. 5.3.2]: T = 4/3 K(mu) K(mu0) / (b + 2 q), K = sqrt(3)/4 H.
            let k = |h: f64| 0.75_f64.sqrt() / 2.0 * h;
            reflection -= 4.0 / 3.0 * k(h[i]) * k(h[j]) / (f64::from(thickness) + 2.0 * 0.710_446);
        }
        let slanted = |mu: f64| Vec3::new((1.0 - mu * mu).sqrt() as f32, 0.0, mu as f32);
        let mut setup = slab(thickness, albedo, henyey_greenstein(0.0));
        let travels = slanted(mu_in) * Vec3::new(1.0, 1.0, -1.0);
        setup.lights = vec![Light::Directional(Directional::new(travels, Rgb::WHITE, 0.0))];
        let scene = setup.scene();
        let out = slanted(mu_out);
        let seen = radiance(&scene, paths, |_| Ray::new(Vec3::Z * 0.5 + out, -out));
        seen.against(reflection * mu_in / PI).assert_within(3.0, 1e-3);
    }
}

#[test]
fn albedo_four_fifths() {
    assert_reflection(0.8, 60.0, [1.138_808, 1.413_263, 1.598_220], 3_000_000);
}

#[test]
fn conservative() {
    assert_reflection(1.0, 12.0, [1.247_350, 2.012_779, 2.907_811], 2_000_000);
}
