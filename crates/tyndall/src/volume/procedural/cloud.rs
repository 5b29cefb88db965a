//! A cloud: fractal value noise that thins out towards the border of a ball.

use crate::math::{Vec3, cast};

const OCTAVES: u32 = 5;
/// Lattice cells across the box in the first octave.
const BASE: f32 = 4.0;
/// Weight of each octave relative to the one before.
const GAIN: f32 = 0.55;

pub(super) fn value(p: Vec3, seed: u32) -> f32 {
    let mut noise = 0.0;
    let mut total = 0.0;
    for octave in 0..OCTAVES {
        let weight = GAIN.powi(octave.cast_signed());
        let frequency = BASE * 2.0_f32.powi(octave.cast_signed());
        noise += weight * value_noise((p + 1.0) * 0.5 * frequency, seed.wrapping_add(octave * 0x9e37));
        total += weight;
    }
    // Centred noise with its contrast raised to fill 0..1, plus a ball of radius about 0.9.
    let noise = (noise / total - 0.5) * 3.0;
    (0.35 * noise + 1.15 * (1.0 - p.length() / 0.9)).clamp(0.0, 0.5) * 2.0
}

/// Smoothly interpolated random numbers on the integer lattice, in 0..1.
fn value_noise(p: Vec3, seed: u32) -> f32 {
    let cell = p.floor();
    let t = p - cell;
    let t = t * t * (Vec3::splat(3.0) - 2.0 * t);
    let corner = |i: u32| {
        let pick = |bit: u32, x: f32| cast::floor_i32(x).wrapping_add((i >> bit & 1).cast_signed());
        lattice(pick(0, cell.x), pick(1, cell.y), pick(2, cell.z), seed)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |i: u32| mix(corner(i), corner(i + 1), t.x);
    let plane = |i: u32| mix(row(i), row(i + 2), t.y);
    mix(plane(0), plane(4), t.z)
}

/// A random number in 0..1 for a lattice point, by integer mixing.
fn lattice(x: i32, y: i32, z: i32, seed: u32) -> f32 {
    let mut h = seed ^ 0x27d4_eb2d;
    for c in [x, y, z] {
        h = (h ^ c.cast_unsigned()).wrapping_mul(0x85eb_ca6b);
        h ^= h >> 13;
        h = h.wrapping_mul(0xc2b2_ae35);
        h ^= h >> 16;
    }
    (h >> 8) as f32 / (1 << 24) as f32
}
