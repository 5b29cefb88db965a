//! Views from around the volume, for films of it on a turntable.

use crate::session::LiveSession;
use serde_json::{Value, json};
use tyndall::camera::Lens;
use tyndall::math::DVec3;

/// Where a camera is while it goes round its target. The axis is the camera's `up`, or that of the space if it has none, and the distance stays
/// as it is, also that of a camera that was fitted to the volume.
#[derive(Clone, Copy, Debug)]
pub struct Orbit {
    /// In the file's coordinates.
    target: DVec3,
    /// From the target to the camera.
    arm: DVec3,
    /// What is upward in the picture.
    up: DVec3,
    axis: DVec3,
    lens: Lens,
}

impl Orbit {
    /// The orbit on which the session's camera is.
    #[must_use]
    pub fn of(session: &LiveSession) -> Self {
        let (scene, given) = (session.scene(), session.document().camera.clone().unwrap_or_default());
        let grid = scene.medium.volume().grid();
        let center = DVec3::from_array(grid.center());
        // The renderer's world is centred on the volume, as is a camera that was fitted to it.
        let position =
            given.position().map_or(center + scene.camera.position().as_dvec3(), DVec3::from_array);
        let target = match given.position() {
            Some(_) => given.target().map_or(center, DVec3::from_array),
            None => center,
        };
        let axis = given.up().map_or(grid.space().up().as_dvec3(), |up| DVec3::from_array(up.map(f64::from)));
        let up = scene.camera.frame().v.as_dvec3();
        Self { target, arm: position - target, up, axis: axis.normalize(), lens: scene.camera.lens() }
    }

    /// The merge patch that moves the camera, counter-clockwise as seen from above, by a share of a full turn from where it was.
    #[must_use]
    pub fn patch(&self, share: f64) -> Value {
        let turned = |v: DVec3| turn(v, self.axis, share * std::f64::consts::TAU);
        let mut camera = json!({
            "position": (self.target + turned(self.arm)).to_array(),
            "target": self.target.to_array(),
            "up": turned(self.up).as_vec3().to_array(),
        });
        match self.lens {
            // The zoom of an automatic camera narrows its field of view.
            Lens::Perspective { fov, focus, .. } => {
                (camera["fov"], camera["focus"]) = (json!(fov), json!(focus));
            }
            Lens::Orthographic { height } => camera["height"] = json!(height),
        }
        json!({ "camera": camera })
    }
}

/// A vector turned about a unit axis by an angle in radians \[Rodrigues 1840\].
fn turn(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_keeps_length_and_height_and_comes_back() {
        let (v, axis) = (DVec3::new(3.0, -1.0, 2.0), DVec3::new(1.0, 2.0, -2.0) / 3.0);
        let mut turned = v;
        for _ in 0..12 {
            let next = turn(turned, axis, std::f64::consts::TAU / 12.0);
            assert!(
                (next.length() - v.length()).abs() < 1e-12 && (next.dot(axis) - v.dot(axis)).abs() < 1e-12
            );
            assert!((next - turned).length() > 1.0);
            turned = next;
        }
        assert!((turned - v).length() < 1e-12, "{turned}");
        // Counter-clockwise as seen from the tip of the axis.
        let quarter = turn(DVec3::X, DVec3::Z, std::f64::consts::FRAC_PI_2);
        assert!((quarter - DVec3::Y).length() < 1e-12, "{quarter}");
    }
}
