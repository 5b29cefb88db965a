//! How the time of `path` grows with the size of the problem.

use super::Row;
use super::scenes::{Bench, cloud};
use super::timing::Effort;
use crate::Failure;
use serde_json::{Value, json};
use tyndall::simd::Level;

/// Seconds of `path` on a cloud as one size grows.
pub fn curves(effort: &Effort, level: Level) -> Result<Vec<Row>, Failure> {
    const TABLE: &str =
        "growth: path on a cloud, two threads, 128 x 128, 4 samples, 8 scatterings unless stated";
    let bench = Bench::new(cloud(effort.pick(128, 32)), 2)?;
    let usual = json!({ "film": { "size": [128, 128] }, "render": { "max_scatter": 8 } });
    let mut rows = Vec::new();
    let mut measure = |bench: &Bench, row: String, patch: &Value, samples: u32| -> Result<(), Failure> {
        let scene = bench.scene(&tyndall_live::document::apply(&usual, patch))?;
        let seconds = effort.seconds(&mut || drop(bench.render(&scene, level, samples)));
        rows.push(Row::new(TABLE, row, "time", "s", seconds));
        Ok(())
    };
    for side in effort.pick(&[64, 128, 256, 512, 1024][..], &[64]) {
        measure(&bench, format!("pixels {side}^2"), &json!({ "film": { "size": [side, side] } }), 4)?;
    }
    for &samples in effort.pick(&[1, 4, 16, 64][..], &[1]) {
        measure(&bench, format!("samples {samples}"), &json!({}), samples)?;
    }
    for &lights in effort.pick(&[1, 10, 100, 1000][..], &[10]) {
        let lamp = |i: u32| {
            let angle = f64::from(i) * 2.399_963;
            let position = [100.0 * angle.cos(), 60.0, 100.0 * angle.sin()];
            json!({ "type": "sphere", "position": position, "radius": 2, "radiance": [500.0 / f64::from(lights), 0, 0] })
        };
        let lights: Vec<Value> = (0..lights).map(lamp).collect();
        measure(&bench, format!("lights {}", lights.len()), &json!({ "lights": lights }), 4)?;
    }
    for albedo in effort.pick(&[0.0, 0.5, 0.9, 0.99, 1.0][..], &[0.5]) {
        let point = |v: f64| json!({ "value": v, "opacity": v, "albedo": [albedo, albedo, albedo] });
        let patch = json!({ "transfer_function": { "points": [point(0.0), point(1.0)] }, "render": { "max_scatter": 1000 } });
        measure(&bench, format!("albedo {albedo}, 1000 scatterings"), &patch, 4)?;
    }
    for thickness in effort.pick(&[1.0, 4.0, 16.0, 64.0, 256.0][..], &[4.0]) {
        let patch = json!({ "medium": { "density": thickness / 128.0 } });
        measure(&bench, format!("thickness of the box {thickness}"), &patch, 4)?;
    }
    for &voxels in effort.pick(&[64, 128, 256, 512, 1024][..], &[32]) {
        // 8-bit, so that the largest fits; a full cloud of floats of that size would not.
        let mut value = cloud(voxels);
        value["volume"]["procedural"]["kind"] = "sphere".into();
        let bench = Bench::new(value, 2)?;
        measure(&bench, format!("voxels {voxels}^3 (a sphere)"), &json!({}), 4)?;
    }
    Ok(rows)
}
