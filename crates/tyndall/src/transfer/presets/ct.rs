//! Computed tomography, in Hounsfield units: air -1000, lung about -800, fat -100, water 0, muscle 50,
//! contrast agent 150 to 400, bone 250 and up.

use super::matter;
use crate::transfer::Point;

const BONE: [f32; 3] = [0.94, 0.89, 0.78];
const SKIN: [f32; 3] = [0.93, 0.76, 0.63];
const MUSCLE: [f32; 3] = [0.85, 0.42, 0.33];
const BLOOD: [f32; 3] = [0.86, 0.16, 0.12];
const LUNG: [f32; 3] = [0.80, 0.86, 0.95];
const AIRWAY: [f32; 3] = [0.95, 0.80, 0.72];

pub(super) fn bone() -> Vec<Point> {
    vec![matter(150.0, 0.0, BONE, 0.5), matter(300.0, 0.7, BONE, 0.7), matter(600.0, 1.0, BONE, 0.7)]
}

pub(super) fn skin_bone() -> Vec<Point> {
    vec![
        matter(-700.0, 0.0, SKIN, 0.3),
        matter(-300.0, 0.07, SKIN, 0.5),
        matter(-150.0, 0.015, SKIN, 0.3),
        matter(80.0, 0.006, MUSCLE, 0.2),
        matter(160.0, 0.02, MUSCLE, 0.3),
        matter(300.0, 0.7, BONE, 0.6),
        matter(600.0, 1.0, BONE, 0.7),
    ]
}

pub(super) fn lung() -> Vec<Point> {
    vec![
        matter(-980.0, 0.0, LUNG, 0.0),
        matter(-900.0, 0.015, LUNG, 0.1),
        matter(-700.0, 0.05, LUNG, 0.2),
        matter(-500.0, 0.25, AIRWAY, 0.5),
        matter(-350.0, 0.03, AIRWAY, 0.3),
        matter(-200.0, 0.0, AIRWAY, 0.0),
        matter(250.0, 0.0, BONE, 0.0),
        matter(500.0, 0.12, BONE, 0.4),
    ]
}

pub(super) fn muscle() -> Vec<Point> {
    vec![
        matter(-30.0, 0.0, MUSCLE, 0.3),
        matter(20.0, 0.4, MUSCLE, 0.5),
        matter(90.0, 0.6, MUSCLE, 0.5),
        matter(180.0, 0.8, BONE, 0.6),
        matter(400.0, 1.0, BONE, 0.7),
    ]
}

pub(super) fn vessels() -> Vec<Point> {
    vec![
        matter(90.0, 0.0, BLOOD, 0.4),
        matter(150.0, 0.35, BLOOD, 0.7),
        matter(260.0, 0.8, BLOOD, 0.7),
        matter(380.0, 0.9, BONE, 0.6),
        matter(700.0, 1.0, BONE, 0.7),
    ]
}
