//! Fluxes of plane-parallel slabs: van de Hulst's tables and adding-doubling.

use crate::scenes::{henyey_greenstein, radiance, slab};
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::light::{Directional, Environment, Light, Map};
use tyndall::math::{Ray, Rgb, Vec3};
use tyndall::sampling::{Stream, warp};
use tyndall::scene::Scene;

/// A ray towards the slab from above (`side` = 1) or below (-1), with a cosine-weighted direction,
/// so that pi times the mean radiance is the flux that leaves the slab on that side.
fn towards_slab(side: f32) -> impl Fn(&mut Stream) -> Ray + Sync {
    move |stream| {
        let out = warp::cosine_hemisphere([stream.uniform(), stream.uniform()]);
        let out = Vec3::new(out.x, out.y, out.z.max(1e-4) * side);
        Ray::new(Vec3::new(0.0, 0.0, 0.5 * side) + out * 1e-3, -out.normalize())
    }
}

/// Flux through a side, per incident flux.
fn assert_flux(scene: &Scene, side: f32, incident: f64, unscattered: f64, expected: f64, paths: u32) {
    let flux = radiance(scene, paths, towards_slab(side));
    // `expected` covers all light that leaves, but only the scattered part is estimated.
    let scattered = (expected - unscattered) * incident / PI;
    flux.against(scattered).assert_within(3.0, 1e-3);
}

fn beam(albedo: f32, g: f32, thickness: f32, reflected: f64, transmitted: f64, paths: u32) {
    let mut setup = slab(thickness, albedo, henyey_greenstein(g));
    setup.lights = vec![Light::Directional(Directional::new(-Vec3::Z, Rgb::WHITE, 0.0))];
    let scene = setup.scene();
    assert_flux(&scene, 1.0, 1.0, 0.0, reflected, paths);
    // The unscattered beam itself is not seen, only scattered light.
    assert_flux(&scene, -1.0, 1.0, (-f64::from(thickness)).exp(), transmitted, paths);
}

#[test]
fn van_de_hulst_forward_scattering() {
    beam(0.9, 0.75, 2.0, 0.09739, 0.66096, 11_000_000);
}

#[test]
fn van_de_hulst_conservative_isotropic() {
    beam(1.0, 0.0, 1.0, 0.34133, 0.65867, 2_000_000);
}

#[test]
fn van_de_hulst_conservative_forward() {
    beam(1.0, 0.5, 1.0, 0.17611, 0.82389, 4_000_000);
}

#[test]
fn adding_doubling_half_absorbing() {
    beam(0.5, 0.0, 1.0, 0.09912, 0.44606, 4_000_000);
}

#[test]
fn adding_doubling_thick_forward() {
    beam(0.99, 0.75, 8.0, 0.43305, 0.41634, 6_000_000);
}

/// Isotropic light from above alone: a map whose lower half is black.
#[test]
fn adding_doubling_diffuse() {
    let rows = 1024;
    let texels = (0..rows).map(|y| if y < rows / 2 { Rgb::WHITE } else { Rgb::BLACK }).collect();
    let map = Arc::new(Map::new(1, rows, texels).unwrap());
    let mut setup = slab(4.0, 0.9, henyey_greenstein(0.0));
    setup.lights = vec![Light::Environment(Environment::map(map, Vec3::Y, Vec3::Z, 0.0, false))];
    let scene = setup.scene();
    assert_flux(&scene, 1.0, PI, 0.0, 0.47319, 2_000_000);
    // Unscattered light, 2 E3(4), is not seen either: the map is invisible.
    let unscattered = tyndall_testing::quadrature::integrate(|mu| 2.0 * mu * (-4.0 / mu).exp(), [1e-9, 1.0]);
    assert_flux(&scene, -1.0, PI, unscattered, 0.09056, 6_000_000);
}
