//! A camera that fits a volume into the picture by itself.

use super::{Camera, Lens};
use crate::math::Vec3;
use crate::volume::{Grid, Space};

/// From where an automatic camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoView {
    /// Degrees about the up axis, from the front to the camera's right hand.
    pub azimuth: f32,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f32,
    /// How much larger than fitting; positive.
    pub zoom: f32,
}

impl AutoView {
    /// An anatomical volume is seen from the patient's front; others a little from the side and above.
    #[must_use]
    pub fn default_for(space: Space) -> Self {
        match space {
            Space::Anatomical => Self { azimuth: 0.0, elevation: 0.0, zoom: 1.0 },
            Space::Plain => Self { azimuth: 30.0, elevation: 20.0, zoom: 1.0 },
        }
    }
}

/// Vertical field of view of automatic cameras, degrees.
const FOV: f32 = 35.0;

/// Share of the picture left free around the volume.
const MARGIN: f32 = 0.04;

/// Looks at the middle of a volume from where all its corners just fit a film of the given shape.
///
/// The front is -y for anatomical volumes (LPS: the patient's face) and +z for others.
#[must_use]
pub fn fit(grid: &Grid, view: AutoView, size: [u32; 2]) -> Camera {
    let up = grid.space().up();
    let front = match grid.space() {
        Space::Anatomical => -Vec3::Y,
        Space::Plain => Vec3::Z,
    };
    let right = up.cross(front);
    let (sin_a, cos_a) = view.azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = view.elevation.to_radians().sin_cos();
    let outwards = (front * cos_a + right * sin_a) * cos_e + up * sin_e;
    // Straight from above or below, up is what was ahead.
    let up = if cos_e.abs() < 1e-3 { -(front * cos_a + right * sin_a) * sin_e.signum() } else { up };

    let middle = grid.world_bounds().center();
    let probe = Camera::new(middle + outwards, middle, up, Lens::Orthographic { height: 1.0 });
    let tan_y = (0.5 * FOV).to_radians().tan() * (1.0 - MARGIN);
    let tan_x = tan_y * size[0] as f32 / size[1] as f32;
    let distance = grid.world_corners().iter().fold(0.0_f32, |most, corner| {
        let local = probe.frame.to_local(*corner - middle);
        most.max((local.x.abs() / tan_x).max(local.y.abs() / tan_y) - local.z)
    });
    // Zooming narrows the view and keeps the place, so that the perspective stays and the camera
    // never enters the volume.
    let fov = 2.0 * ((0.5 * FOV).to_radians().tan() / view.zoom).atan().to_degrees();
    let lens = Lens::Perspective { fov, aperture: 0.0, focus: distance };
    Camera::new(middle + outwards * distance, middle, up, lens)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Film coordinates of a world point, from -1 to 1 over the picture.
    fn project(camera: &Camera, p: Vec3, aspect: f32) -> [f32; 2] {
        let Lens::Perspective { fov, .. } = camera.lens else { panic!("automatic cameras are perspective") };
        let local = camera.frame.to_local(p - camera.position);
        let tan = (0.5 * fov.to_radians()).tan();
        [local.x / local.z / tan / aspect, local.y / local.z / tan]
    }

    #[test]
    fn all_corners_fit_and_one_touches_the_margin() {
        for (space, azimuth, elevation, size) in [
            (Space::Plain, 30.0, 20.0, [512, 512]),
            (Space::Anatomical, 0.0, 0.0, [300, 900]),
            (Space::Anatomical, 200.0, 90.0, [900, 300]),
            (Space::Plain, -70.0, -90.0, [64, 64]),
        ] {
            let grid = Grid::new([40, 80, 20], [1.0, 0.7, 2.0], IDENTITY, [5.0, -60.0, 9.0], space).unwrap();
            let camera = fit(&grid, AutoView { azimuth, elevation, zoom: 1.0 }, size);
            let aspect = size[0] as f32 / size[1] as f32;
            let reach = grid.world_corners().iter().fold(0.0_f32, |m, &c| {
                let [x, y] = project(&camera, c, aspect);
                m.max(x.abs()).max(y.abs())
            });
            assert!((reach - (1.0 - MARGIN)).abs() < 1e-3, "reach {reach} from {azimuth}, {elevation}");
        }
    }

    #[test]
    fn a_patient_is_seen_from_the_front_with_the_head_up() {
        let grid = Grid::new([10; 3], [1.0; 3], IDENTITY, [0.0; 3], Space::Anatomical).unwrap();
        let camera = fit(&grid, AutoView::default_for(Space::Anatomical), [100, 100]);
        assert!((camera.view() - Vec3::Y).length() < 1e-6);
        assert!((camera.frame.v - Vec3::Z).length() < 1e-6);
        // The patient's left, +x, is to the right of the picture.
        assert!((camera.frame.u - Vec3::X).length() < 1e-6);
    }
}
