//! A camera placed automatically so that the volume fits into the picture.

use super::{Camera, Lens, upright};
use crate::math::{Vec3, cast};
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

/// The default viewpoint, and the front and up directions that it and the default lights use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoFront {
    /// The view.
    pub view: AutoView,
    /// Unit vector from the volume to what counts as its front.
    pub front: Vec3,
    /// Unit vector that counts as up, across the front.
    pub up: Vec3,
}

impl AutoFront {
    /// A volume in the shape of a sheet is seen along its thin axis, on which it would otherwise be a line; others as
    /// [`AutoView::default_for`] says, with the front and up of their space.
    #[must_use]
    pub fn of(grid: &Grid) -> Self {
        let (up, front) = (grid.space().up(), grid.space().front());
        let Some(across) = thin_axis(grid) else {
            return Self { view: AutoView::default_for(grid.space()), front, up };
        };
        // From the front if the sheet faces it at all, else from the side that is shown usually: images across the body from the feet,
        // along it from the patient's left, others from above and from the right.
        let right = up.cross(front);
        let side = match grid.space() {
            Space::Anatomical => right - up,
            Space::Plain => right + up,
        };
        let facing = across.dot(front);
        let facing = if facing.abs() > 0.1 { facing } else { across.dot(side) };
        let across = if facing < 0.0 { -across } else { across };
        let elevation = across.dot(up).clamp(-1.0, 1.0).asin().to_degrees();
        // Straight from above or below, the azimuth turns the picture: 0 keeps the front at its bottom or top.
        let level = elevation.abs() > 89.9;
        let azimuth = if level { 0.0 } else { across.dot(right).atan2(across.dot(front)).to_degrees() };
        let up_in_picture = if level { -front * elevation.signum() } else { up };
        let up = (up_in_picture - across * up_in_picture.dot(across)).normalize();
        Self { view: AutoView { azimuth, elevation, zoom: 1.0 }, front: across, up }
    }
}

/// The direction, a unit vector, across a volume that is a sheet: of one voxel along one axis alone, or far thinner along it than along
/// both others.
fn thin_axis(grid: &Grid) -> Option<Vec3> {
    /// From this ratio of edges on a volume is a sheet; a stack of a few slices is a body.
    const THIN: f64 = 16.0;

    let (dims, spacing) = (grid.dims(), grid.spacing());
    let extents: [f64; 3] = std::array::from_fn(|a| dims[a] as f64 * spacing[a]);
    let is_thin = |a: usize| {
        let mut others = [(a + 1) % 3, (a + 2) % 3].into_iter();
        others.all(|b| {
            (dims[a] == 1 && dims[b] > 1 && extents[b] > extents[a]) || extents[b] > THIN * extents[a]
        })
    };
    let axis = (0..3).find(|&axis| is_thin(axis))?;
    // Across the other two, which need not be at right angles to it.
    let edge = |a: usize| Vec3::from_array(grid.direction().map(|row| cast::single(row[a])));
    edge((axis + 1) % 3).cross(edge((axis + 2) % 3)).try_normalize()
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
    let front = grid.space().front();
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
    fn a_sheet_is_seen_from_its_front_whichever_axis_is_thin() {
        let turned = {
            let (s, c) = 0.3_f64.sin_cos();
            [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
        };
        let flipped = [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        for space in [Space::Plain, Space::Anatomical] {
            for direction in [IDENTITY, turned, flipped] {
                for thin in 0..3 {
                    for [dims, spacing] in [[[128.0; 3], [1.0; 3]], [[64.0; 3], [0.7, 0.9, 0.8]]] {
                        let mut dims = dims.map(|n| cast::index(cast::single(n)));
                        dims[thin] = 1;
                        let grid = Grid::new(dims, spacing, direction, [3.0, -9.0, 400.0], space).unwrap();
                        let AutoFront { view, front, up } = AutoFront::of(&grid);
                        let camera = fit(&grid, view, None, PERSPECTIVE, [100, 100]);
                        let across = Vec3::from_array(direction.map(|row| cast::single(row[thin])));
                        let cos = camera.view().dot(across).abs();
                        assert!(cos > 0.9999, "axis {thin} of {direction:?} in {space:?}: {cos}");
                        assert!((camera.view() + front).length() < 1e-3, "{front} and {}", camera.view());
                        assert!((camera.frame.v - up).length() < 1e-3, "{up} and {}", camera.frame.v);
                    }
                }
            }
        }
        // As radiologists look at slices: from the feet, the front up and the patient's left on the right.
        let slice = Grid::new([128, 128, 1], [1.0, 1.0, 5.0], IDENTITY, [0.0; 3], Space::Anatomical).unwrap();
        let camera = fit(&slice, AutoFront::of(&slice).view, None, PERSPECTIVE, [100, 100]);
        assert!((camera.frame.u - Vec3::X).length() < 1e-3 && (camera.frame.v + Vec3::Y).length() < 1e-3);
    }

    #[test]
    fn a_body_is_no_sheet() {
        for (dims, spacing) in [
            ([128, 128, 20], [1.0, 1.0, 5.0]),
            ([1, 1, 1], [1.0; 3]),
            ([9, 1, 1], [1.0; 3]),
            ([2, 2, 1], [1.0, 1.0, 3.0]),
        ] {
            let grid = Grid::new(dims, spacing, IDENTITY, [0.0; 3], Space::Plain).unwrap();
            assert_eq!(AutoFront::of(&grid).view, AutoView::default_for(Space::Plain), "{dims:?}");
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
