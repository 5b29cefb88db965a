//! Computed tomography, in Hounsfield units: air -1000, lung about -800, fat -100, water 0, muscle 50,
//! contrast agent 150 to 400, bone 250 and up.

use super::glossy;
use crate::transfer::Point;

// Albedos. Where bone begins it is marrow and cartilage, and shares its values with blood that holds contrast agent: all are red.
const IVORY: [f32; 3] = [0.95, 0.91, 0.83];
const BONE: [f32; 3] = [0.90, 0.82, 0.68];
const SPONGY: [f32; 3] = [0.84, 0.60, 0.42];
const MARROW: [f32; 3] = [0.70, 0.26, 0.16];
const BLOOD: [f32; 3] = [0.72, 0.04, 0.03];
const MUSCLE: [f32; 3] = [0.76, 0.26, 0.18];
const FLESH: [f32; 3] = [0.92, 0.62, 0.48];
const SKIN: [f32; 3] = [0.94, 0.74, 0.62];
const LUNG: [f32; 3] = [0.50, 0.66, 0.92];
const LUNG_VESSEL: [f32; 3] = [0.92, 0.50, 0.42];

// Roughness.
const WET: f32 = 0.2;
const MOIST: f32 = 0.3;
const DRY: f32 = 0.4;

pub(super) fn bone() -> Vec<Point> {
    vec![
        glossy(140.0, 0.0, MARROW, 0.6, MOIST),
        glossy(210.0, 0.35, MARROW, 0.8, MOIST),
        glossy(320.0, 0.8, SPONGY, 0.8, DRY),
        glossy(480.0, 1.0, BONE, 0.85, DRY),
        glossy(1200.0, 1.0, IVORY, 0.9, DRY),
    ]
}

pub(super) fn skin() -> Vec<Point> {
    vec![
        glossy(-600.0, 0.0, SKIN, 0.6, DRY),
        glossy(-300.0, 0.4, SKIN, 0.7, DRY),
        glossy(-50.0, 0.7, FLESH, 0.7, DRY),
        glossy(100.0, 0.8, MUSCLE, 0.7, MOIST),
        glossy(300.0, 1.0, BONE, 0.8, DRY),
    ]
}

pub(super) fn skin_bone() -> Vec<Point> {
    vec![
        glossy(-700.0, 0.0, SKIN, 0.3, MOIST),
        glossy(-300.0, 0.06, SKIN, 0.7, MOIST),
        glossy(-150.0, 0.012, SKIN, 0.3, MOIST),
        glossy(80.0, 0.005, MUSCLE, 0.2, MOIST),
        glossy(160.0, 0.02, MARROW, 0.4, MOIST),
        glossy(320.0, 0.7, SPONGY, 0.8, DRY),
        glossy(480.0, 1.0, BONE, 0.85, DRY),
    ]
}

/// The body's own surface passes through the values of lungs too: it stays a veil, since it is thin and they are deep.
pub(super) fn lung() -> Vec<Point> {
    vec![
        glossy(-950.0, 0.0, LUNG, 0.0, MOIST),
        glossy(-870.0, 0.03, LUNG, 0.3, MOIST),
        glossy(-780.0, 0.1, [0.72, 0.70, 0.86], 0.6, MOIST),
        glossy(-600.0, 0.14, LUNG_VESSEL, 0.8, WET),
        glossy(-420.0, 0.02, LUNG_VESSEL, 0.6, WET),
        glossy(-300.0, 0.0, LUNG_VESSEL, 0.0, WET),
    ]
}

pub(super) fn muscle() -> Vec<Point> {
    vec![
        glossy(-20.0, 0.0, MUSCLE, 0.5, MOIST),
        glossy(30.0, 0.5, MUSCLE, 0.7, MOIST),
        glossy(100.0, 0.8, MUSCLE, 0.7, MOIST),
        glossy(200.0, 0.9, SPONGY, 0.8, DRY),
        glossy(480.0, 1.0, BONE, 0.9, DRY),
    ]
}

pub(super) fn vessels() -> Vec<Point> {
    vec![
        glossy(120.0, 0.0, BLOOD, 0.6, WET),
        glossy(165.0, 0.5, BLOOD, 0.9, WET),
        glossy(300.0, 1.0, BLOOD, 0.9, WET),
        glossy(380.0, 1.0, SPONGY, 0.85, MOIST),
        glossy(600.0, 1.0, BONE, 0.85, DRY),
    ]
}
