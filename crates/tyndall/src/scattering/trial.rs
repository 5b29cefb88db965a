//! What the tests of this module share: quadrature over directions and ready-made surfaces.

use super::{Surface, deflect};
use crate::math::{Rgb, Vec3, cast};
use std::f64::consts::PI;

/// Integrals of `f` over all directions, on a grid that is dense about `pole` and coarser away from it.
///
/// Polar angles grow with the third power of the row, so a lobe of a thousandth of a radian about the pole
/// still spans tens of rows.
pub fn integrate<const N: usize>(pole: Vec3, f: impl Fn(Vec3) -> [f64; N]) -> [f64; N] {
    const ROWS: i32 = 500;
    const COLUMNS: i32 = 256;
    let mut sums = [0.0; N];
    for row in 0..ROWS {
        let t = (f64::from(row) + 0.5) / f64::from(ROWS);
        let theta = PI * t.powi(3);
        let area = 2.0 * PI / f64::from(COLUMNS) * theta.sin() * 3.0 * PI * t * t / f64::from(ROWS);
        let drop = cast::single(2.0 * (0.5 * theta).sin().powi(2));
        for column in 0..COLUMNS {
            let turn = cast::single((f64::from(column) + 0.5) / f64::from(COLUMNS));
            let values = f(deflect(pole, drop, turn));
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += area * value;
            }
        }
    }
    sums
}

/// A unit normal that is not an axis.
pub fn normal() -> Vec3 {
    Vec3::new(0.36, -0.48, 0.8)
}

/// A direction at `degrees` from the normal.
pub fn tilted(degrees: f32) -> Vec3 {
    deflect(normal(), 1.0 - degrees.to_radians().cos(), 0.2)
}

/// Where a mirror sends a direction.
pub fn mirrored(w: Vec3) -> Vec3 {
    (normal() * (2.0 * w.dot(normal())) - w).normalize()
}

/// A surface equal in all channels.
pub fn grey(albedo: f32, specular: f32, roughness: f32) -> Surface {
    Surface { albedo: Rgb::splat(albedo), specular: Rgb::splat(specular), roughness }
}
