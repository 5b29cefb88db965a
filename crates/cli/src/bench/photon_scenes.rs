//! The scenes whose edits are measured: stand-ins, all generated, for those of \[Jonsson12\].

use super::scenes::Bench;
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use tyndall::volume::procedural::MATERIALS;

/// Two threads render: the sessions take all that a small machine has.
const THREADS: usize = 2;

/// Albedo of the edited layer or object before the edit, and after it.
pub const WARM: [f64; 3] = [0.85, 0.2, 0.15];
pub const COLD: [f64; 3] = [0.2, 0.35, 0.9];

fn point(value: f64, opacity: f64, albedo: [f64; 3]) -> Value {
    json!({ "value": value, "opacity": opacity, "albedo": albedo })
}

/// The volume's side in voxels: that of the paper's Cornell box, or less for a quick run.
pub fn side(effort: &Effort) -> u32 {
    effort.pick(256, 64)
}

/// The Cornell box of \[Jonsson12, fig. 4 and 7\], one world unit per voxel.
pub fn cornell_box(effort: &Effort) -> Result<Bench, Failure> {
    let voxels = side(effort);
    let size = f64::from(voxels) / 256.0;
    let value = json!({
        "version": 1,
        "volume": { "interpolation": "nearest", "procedural": { "kind": "cornell-box", "size": [voxels, voxels, voxels] } },
        "transfer_function": sphere(WARM),
        // The densest that a march of two samples per voxel resolves.
        "medium": { "density": 1.0 },
        "lights": [{
            "type": "rect", "position": [0.0, 116.0 * size, 12.0 * size], "target": [0.0, 0.0, 12.0 * size],
            "up": [0, 0, 1], "size": [88.0 * size, 72.0 * size], "radiance": [16, 14.5, 12],
        }],
        "camera": { "position": [0.0, 0.0, 500.0 * size], "target": [0, 0, 0], "fov": 35.0 },
        "film": { "size": film(effort) },
        "render": { "integrator": "photon", "max_scatter": 1 },
    });
    Bench::new(value, THREADS)
}

/// The Cornell box's transfer function with its sphere in a colour.
pub fn sphere(color: [f64; 3]) -> Value {
    let albedo = |name: &str| match name {
        "sphere" => color,
        "left wall" => [0.8, 0.1, 0.08],
        "right wall" => [0.12, 0.62, 0.14],
        _ => [0.85; 3],
    };
    let opacity = |name: &str| match name {
        "thin medium in the air" => 0.0008,
        "transparent box" => 0.025,
        _ => 1.0,
    };
    let piece = |material: &tyndall::volume::procedural::Material| {
        let (name, value) = (material.name, f64::from(material.value));
        // Constant for half an eighth to either side; there it jumps to its neighbour.
        [-0.0625, 0.0625].map(|to| point(value + to, opacity(name), albedo(name)))
    };
    json!({ "points": MATERIALS.iter().flat_map(piece).collect::<Vec<_>>() })
}

/// What the layers of the CT-like volume are made of.
#[derive(Clone, Copy)]
pub struct Tissue {
    /// Opacity of the outermost layer.
    pub skin: f64,
    /// The shell around the vessels.
    pub bone: Layer,
    /// Albedo of the innermost matter.
    pub vessels: [f64; 3],
    /// Roughness of the vessels' surface; `None` where they have no surface, like the rest.
    pub roughness: Option<f64>,
}

/// A band of the transfer function.
#[derive(Clone, Copy)]
pub struct Layer {
    pub albedo: [f64; 3],
    pub opacity: f64,
}

impl Tissue {
    /// Thin skin and bone, with the vessels visible through them.
    pub const USUAL: Self = Self {
        skin: 0.01,
        bone: Layer { albedo: [0.95, 0.92, 0.85], opacity: 0.06 },
        vessels: WARM,
        roughness: None,
    };

    /// The transfer function: a band around each value of the shells, which are multiples of an eighth; clear in between.
    pub fn transfer(&self) -> Value {
        let skin = [0.9, 0.7, 0.6];
        let Layer { albedo: bone, opacity: dense } = self.bone;
        let mut points = vec![
            point(0.02, 0.0, skin),
            point(0.1, self.skin, skin),
            point(0.15, self.skin, skin),
            point(0.2, 0.0, skin),
            point(0.53, 0.0, bone),
            point(0.6, dense, bone),
            point(0.65, dense, bone),
            point(0.72, 0.0, bone),
            point(0.78, 0.0, self.vessels),
            point(0.85, 1.0, self.vessels),
            point(1.0, 1.0, self.vessels),
        ];
        if let Some(roughness) = self.roughness {
            for vessels in &mut points[8..] {
                vessels["surface"] = 1.0.into();
                vessels["roughness"] = roughness.into();
            }
        }
        json!({ "points": points })
    }
}

/// Nested layers with much empty space between them, instead of the paper's CT scans: skin, bone, and the vessels at the core.
pub fn ct(effort: &Effort) -> Result<Bench, Failure> {
    let voxels = side(effort);
    let value = json!({
        "version": 1,
        "volume": { "procedural": { "kind": "shells", "size": [voxels, voxels, voxels] } },
        "transfer_function": Tissue::USUAL.transfer(),
        "medium": { "density": 60.0 / f64::from(voxels) },
        "lights": [key([1.0, -1.0, -1.0])],
        "film": { "size": film(effort) },
        "render": { "integrator": "photon" },
    });
    Bench::new(value, THREADS)
}

/// A directional light.
pub fn key(direction: [f64; 3]) -> Value {
    json!({ "type": "directional", "direction": direction, "irradiance": [3, 3, 3] })
}

fn film(effort: &Effort) -> [u32; 2] {
    [effort.pick(512, 128); 2]
}
