//! The Marschner-Lobb test signal \[Marschner94\]: most of its energy just below the Nyquist limit of a 40^3 grid.

use crate::math::Vec3;
use std::f32::consts::PI;

const F_M: f32 = 6.0;
const ALPHA: f32 = 0.25;

pub(super) fn value(p: Vec3) -> f32 {
    let rings = (2.0 * PI * F_M * (0.5 * PI * p.x.hypot(p.y)).cos()).cos();
    (1.0 - (0.5 * PI * p.z).sin() + ALPHA * (1.0 + rings)) / (2.0 * (1.0 + ALPHA))
}

pub(super) fn gradient(p: Vec3) -> Vec3 {
    let r = p.x.hypot(p.y);
    let (sin, cos) = (0.5 * PI * r).sin_cos();
    let slope = (2.0 * PI * F_M * cos).sin() * PI * PI * F_M * sin;
    let outwards = if r > 0.0 { Vec3::new(p.x, p.y, 0.0) / r } else { Vec3::ZERO };
    let along_z = -0.5 * PI * (0.5 * PI * p.z).cos();
    (outwards * (ALPHA * slope) + Vec3::Z * along_z) / (2.0 * (1.0 + ALPHA))
}
