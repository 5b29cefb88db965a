//! The Cornell box of \[Jonsson12, fig. 4\]: one data value per material, so that an edit of one is local.

use crate::math::Vec3;

/// A material of the Cornell box and its data value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// What it is.
    pub name: &'static str,
    /// Its data value, in eighths.
    pub value: f32,
}

const AIR: u8 = 1;
const WHITE: u8 = 2;
const LEFT: u8 = 3;
const RIGHT: u8 = 4;
const SPHERE: u8 = 5;
const BLOCK: u8 = 6;
const GLASS: u8 = 7;

/// What the box is made of.
pub const MATERIALS: [Material; 7] = [
    Material { name: "thin medium in the air", value: AIR as f32 / 8.0 },
    Material { name: "white wall, floor and ceiling", value: WHITE as f32 / 8.0 },
    Material { name: "left wall", value: LEFT as f32 / 8.0 },
    Material { name: "right wall", value: RIGHT as f32 / 8.0 },
    Material { name: "sphere", value: SPHERE as f32 / 8.0 },
    Material { name: "block", value: BLOCK as f32 / 8.0 },
    Material { name: "transparent box", value: GLASS as f32 / 8.0 },
];

pub(super) fn range() -> [f32; 2] {
    [MATERIALS[0].value, MATERIALS[6].value]
}

/// Thickness of the walls of a room from -1 to 1.
const WALL: f32 = 0.06;

/// The material at a position of `[-1, 1]^3`: +y is up, the open side faces +z.
pub(super) fn material(p: Vec3) -> u8 {
    let floor = -1.0 + WALL;
    if p.x < -1.0 + WALL {
        return LEFT;
    }
    if p.x > 1.0 - WALL {
        return RIGHT;
    }
    if p.y < floor || p.y > 1.0 - WALL || p.z < -1.0 + WALL {
        return WHITE;
    }
    if in_box(p, Vec3::new(-0.36, floor + 0.58, -0.36), Vec3::new(0.27, 0.58, 0.27), 0.3) {
        return BLOCK;
    }
    if p.distance(Vec3::new(0.36, floor + 0.34, -0.3)) < 0.34 {
        return SPHERE;
    }
    if in_box(p, Vec3::new(0.44, floor + 0.22, 0.5), Vec3::new(0.2, 0.22, 0.2), -0.2) {
        return GLASS;
    }
    AIR
}

/// Whether a position is inside a box turned by `angle` radians about the vertical axis through its middle.
fn in_box(p: Vec3, middle: Vec3, half: Vec3, angle: f32) -> bool {
    let d = p - middle;
    let (sin, cos) = angle.sin_cos();
    let turned = Vec3::new(cos * d.x - sin * d.z, d.y, sin * d.x + cos * d.z);
    turned.abs().cmple(half).all()
}
