//! A camera placed automatically so that the volume fits into the picture.

use super::{Camera, Lens, upright};
use crate::math::Vec3;
use crate::volume::{Grid, Space};

/// The viewpoint of an automatic camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoView {
    /// Degrees about the up axis, from the front towards the camera's right.
    pub azimuth: f32,
    /// Degrees above the horizon, -90 to 90.
    pub elevation: f32,
    /// Magnification relative to the fit; positive.
    pub zoom: f32,
}

impl AutoView {
    /// Anatomical volumes are seen from the patient's front, others from slightly to the side and above.
    #[must_use]
    pub fn default_for(space: Space) -> Self {
        match space {
            Space::Anatomical => Self { azimuth: 0.0, elevation: 0.0, zoom: 1.0 },
            Space::Plain => Self { azimuth: 30.0, elevation: 20.0, zoom: 1.0 },
        }
    }
}

/// The lens of an automatic camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FitLens {
    /// Perspective; focused on the volume's middle unless a focus distance is given.
    Perspective {
        /// Vertical field of view at zoom 1, degrees.
        fov: f32,
        /// As [`Lens::Perspective`].
        aperture: f32,
        /// As [`Lens::Perspective`].
        focus: Option<f32>,
    },
    /// Parallel rays; as high as the volume needs unless a height is given.
    Orthographic {
        /// As [`Lens::Orthographic`], at zoom 1.
        height: Option<f32>,
    },
}

/// Share of the picture left free around the volume.
const MARGIN: f32 = 0.04;

/// Looks at the middle of a volume, the world's origin, from where all its corners just fit on a film of the given shape.
///
/// The front is -y for anatomical volumes (LPS: the patient's face) and +z for others.
#[must_use]
pub fn fit(grid: &Grid, view: AutoView, up: Option<Vec3>, lens: FitLens, size: [u32; 2]) -> Camera {
    let chosen_up = up;
    let up = grid.space().up();
    let front = match grid.space() {
        Space::Anatomical => -Vec3::Y,
        Space::Plain => Vec3::Z,
    };
    let right = up.cross(front);
    let (sin_a, cos_a) = view.azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = view.elevation.to_radians().sin_cos();
    let outwards = (front * cos_a + right * sin_a) * cos_e + up * sin_e;
    // Straight from above or below: the limit of the picture's up as the elevation approaches 90 or -90 degrees.
    let up = if cos_e.abs() < 1e-3 { -(front * cos_a + right * sin_a) * sin_e.signum() } else { up };
    let up = chosen_up.filter(|up| up.cross(outwards).length() > 1e-3 * up.length()).unwrap_or(up);

    // Computed from directions alone: far from the volume, differences of positions lose precision.
    let frame = upright(-outwards, up);
    let corners = grid.world_corners().map(|corner| frame.to_local(corner));
    let aspect = size[0] as f32 / size[1] as f32;
    // Half the picture height that a corner needs at its distance.
    let needed = |corner: &Vec3| (corner.x.abs() / aspect).max(corner.y.abs()) / (1.0 - MARGIN);
    let most = |f: &dyn Fn(&Vec3) -> f32| corners.iter().map(f).fold(0.0, f32::max);
    let (distance, lens) = match lens {
        FitLens::Perspective { fov, aperture, focus } => {
            let tan = (0.5 * fov.to_radians()).tan();
            let distance = most(&|corner| needed(corner) / tan - corner.z);
            // Zooming narrows the view but keeps the position, so that the perspective stays the same and
            // the camera never enters the volume.
            let fov = 2.0 * (tan / view.zoom).atan().to_degrees();
            (distance, Lens::Perspective { fov, aperture, focus: focus.unwrap_or(distance) })
        }
        FitLens::Orthographic { height } => {
            let height = height.unwrap_or_else(|| 2.0 * most(&needed)) / view.zoom;
            (2.0 * most(&|corner| corner.length()), Lens::Orthographic { height })
        }
    };
    Camera { position: outwards * distance, frame, lens }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    const PERSPECTIVE: FitLens = FitLens::Perspective { fov: 35.0, aperture: 0.0, focus: None };

    /// Film coordinates of a world position, from -1 to 1 across the picture.
    fn project(camera: &Camera, p: Vec3, aspect: f32) -> [f32; 2] {
        let local = camera.frame.to_local(p - camera.position);
        let half = match camera.lens {
            Lens::Perspective { fov, .. } => (0.5 * fov.to_radians()).tan() * local.z,
            Lens::Orthographic { height } => 0.5 * height,
        };
        [local.x / half / aspect, local.y / half]
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
            let aspect = size[0] as f32 / size[1] as f32;
            for lens in [PERSPECTIVE, FitLens::Orthographic { height: None }] {
                let camera = fit(&grid, AutoView { azimuth, elevation, zoom: 1.0 }, None, lens, size);
                let reach = grid.world_corners().iter().fold(0.0_f32, |m, &c| {
                    let [x, y] = project(&camera, c, aspect);
                    m.max(x.abs()).max(y.abs())
                });
                assert!((reach - (1.0 - MARGIN)).abs() < 1e-3, "reach {reach} from {azimuth}, {elevation}");
            }
        }
    }

    #[test]
    fn a_patient_is_seen_from_the_front_with_the_head_up() {
        let grid = Grid::new([10; 3], [1.0; 3], IDENTITY, [0.0; 3], Space::Anatomical).unwrap();
        let camera = fit(&grid, AutoView::default_for(Space::Anatomical), None, PERSPECTIVE, [100, 100]);
        assert!((camera.view() - Vec3::Y).length() < 1e-6);
        assert!((camera.frame.v - Vec3::Z).length() < 1e-6);
        // The patient's left, +x, is on the right of the picture.
        assert!((camera.frame.u - Vec3::X).length() < 1e-6);
    }
}
