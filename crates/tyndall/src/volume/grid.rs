//! Where the voxels are: dimensions and the map between index space and the world.

use crate::math::{Affine3A, Binade, Bounds, DMat3, DVec3, Mat3, Ray, Vec3, cast};
use crate::simd::Lanes;

/// Which way is up, and what the axes mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// LPS millimetres: +x to the patient's left, +y to the back, +z up to the head.
    Anatomical,
    /// No meaning beyond the file's own axes; +y is up.
    Plain,
}

impl Space {
    /// Unit vector that points up.
    #[must_use]
    pub fn up(self) -> Vec3 {
        match self {
            Self::Anatomical => Vec3::Z,
            Self::Plain => Vec3::Y,
        }
    }

    /// The direction towards whoever looks at its front, a unit vector: out of the patient's face (LPS), or +z.
    #[must_use]
    pub fn front(self) -> Vec3 {
        match self {
            Self::Anatomical => -Vec3::Y,
            Self::Plain => Vec3::Z,
        }
    }
}

/// A regular grid of voxels: index space has integer coordinates at voxel centres, and
/// `origin + direction * (spacing * index)` are the coordinates of the file and of documents, in double precision.
///
/// The renderer's world has the same axes and units, but its origin is the centre of the volume's box: single precision is spent
/// on the volume, however far from the file's origin it is. [`Self::to_world`] leads there.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    dims: [usize; 3],
    spacing: [f64; 3],
    direction: [[f64; 3]; 3],
    origin: [f64; 3],
    center: [f64; 3],
    space: Space,
    index_to_world: Affine3A,
    world_to_index: Affine3A,
    voxel_size: f32,
    /// For gradients, and the voxel size, both in a unit of length, a power of two, in which a voxel measures 1 to 2.
    gradient_per_scaled_voxel: Mat3,
    scaled_voxel_size: f32,
}

/// Why a grid is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// An axis has no voxel, or more than 2^24, beyond which single precision cannot tell voxels apart.
    #[error("dimensions {0:?}: expected 1 to 16777216 voxels along each axis")]
    Dims([usize; 3]),
    /// The number of voxels overflows the address space.
    #[error("dimensions {0:?}: their product overflows")]
    Overflow([usize; 3]),
    /// A spacing is not a positive number of usable size.
    #[error("spacing {0:?}: expected positive finite numbers between 1e-15 and 1e15")]
    Spacing([f64; 3]),
    /// The origin is not finite.
    #[error("origin {0:?}: expected finite numbers of at most 1e15")]
    Origin([f64; 3]),
    /// The axes do not span space.
    #[error("direction {0:?} is singular: its columns must be three independent unit vectors")]
    Direction([[f64; 3]; 3]),
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Grid {
    /// A grid with unit directions, unit spacing and its box centred on the world origin.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn centred(dims: [usize; 3], spacing: [f64; 3]) -> Result<Self, GridError> {
        let origin = std::array::from_fn(|a| -0.5 * (dims[a] as f64 - 1.0) * spacing[a]);
        Self::new(dims, spacing, IDENTITY, origin, Space::Plain)
    }

    /// From what a file states: `direction` as rows of a 3x3 matrix whose column `j` is the world
    /// direction of index axis `j` (unit length; a left-handed matrix is fine).
    ///
    /// # Errors
    /// [`GridError`] names the part that is invalid.
    pub fn new(
        dims: [usize; 3],
        spacing: [f64; 3],
        direction: [[f64; 3]; 3],
        origin: [f64; 3],
        space: Space,
    ) -> Result<Self, GridError> {
        if dims.iter().any(|&n| n == 0 || n > 1 << 24) {
            return Err(GridError::Dims(dims));
        }
        if dims.iter().try_fold(1_usize, |a, &n| a.checked_mul(n)).is_none() {
            return Err(GridError::Overflow(dims));
        }
        // The comparison is false for NaN, which is then refused too.
        if !spacing.iter().all(|&s| (1e-15..=1e15).contains(&s)) {
            return Err(GridError::Spacing(spacing));
        }
        if !origin.iter().all(|o| o.abs() <= 1e15) {
            return Err(GridError::Origin(origin));
        }
        let axes = DMat3::from_cols_array_2d(&direction).transpose();
        if !axes.is_finite() || axes.determinant().abs() < 1e-6 {
            return Err(GridError::Direction(direction));
        }
        let linear = axes * DMat3::from_diagonal(DVec3::from_array(spacing));
        let inverse = linear.inverse();
        let middle = DVec3::from_array(dims.map(|n| 0.5 * (n as f64 - 1.0)));
        let center = (DVec3::from_array(origin) + linear * middle).to_array();
        let voxel_size = cast::single(linear.determinant().abs().cbrt());
        let scale = Binade::of(voxel_size);
        let single = |m: DMat3, t: DVec3| Affine3A::from_mat3_translation(m.as_mat3(), t.as_vec3());
        Ok(Self {
            dims,
            spacing,
            direction,
            origin,
            center,
            space,
            index_to_world: single(linear, -(linear * middle)),
            world_to_index: single(inverse, middle),
            voxel_size,
            gradient_per_scaled_voxel: inverse.transpose().as_mat3() * scale.size(),
            scaled_voxel_size: voxel_size * scale.inverse(),
        })
    }

    /// Voxels along x, y, z; x is fastest in memory.
    #[must_use]
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Number of voxels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Always false: a grid has at least one voxel.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Distance between voxel centres along each axis, world units.
    #[must_use]
    pub fn spacing(&self) -> [f64; 3] {
        self.spacing
    }

    /// Rows of the direction matrix.
    #[must_use]
    pub fn direction(&self) -> [[f64; 3]; 3] {
        self.direction
    }

    /// Position of the centre of voxel (0, 0, 0), in the file's coordinates.
    #[must_use]
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// The centre of the medium's box, in the file's coordinates: the origin of the renderer's world.
    #[must_use]
    pub fn center(&self) -> [f64; 3] {
        self.center
    }

    /// A position in the file's coordinates as one of the renderer's world.
    #[must_use]
    pub fn to_world(&self, position: [f64; 3]) -> Vec3 {
        (DVec3::from_array(position) - DVec3::from_array(self.center)).as_vec3()
    }

    /// Lowest and highest corner of the smallest box around the medium that is parallel to the file's axes, in the file's
    /// coordinates.
    #[must_use]
    pub fn file_bounds(&self) -> [[f64; 3]; 2] {
        let extent = self.file_extent();
        [-0.5, 0.5].map(|side| std::array::from_fn(|axis| self.center[axis] + side * extent[axis]))
    }

    /// Edges of that box: not the difference of its corners, which far from the origin are rounded.
    #[must_use]
    pub fn file_extent(&self) -> [f64; 3] {
        // What the three edges of the medium's box contribute along an axis.
        let edge = |axis: usize, a: usize| self.direction[axis][a] * self.spacing[a] * self.dims[a] as f64;
        std::array::from_fn(|axis| (0..3).map(|a| edge(axis, a).abs()).sum())
    }

    /// What the axes mean.
    #[must_use]
    pub fn space(&self) -> Space {
        self.space
    }

    /// Cube root of the voxel volume, world units: the `h` of the scattering function and of step sizes.
    #[must_use]
    pub fn voxel_size(&self) -> f32 {
        self.voxel_size
    }

    /// The medium's box in index space, half a voxel past the outer centres.
    #[must_use]
    pub fn index_bounds(&self) -> Bounds {
        let last = Vec3::from_array(self.dims.map(|n| n as f32 - 0.5));
        Bounds::new(Vec3::splat(-0.5), last)
    }

    /// The eight corners of the medium's box in the world.
    #[must_use]
    pub fn world_corners(&self) -> [Vec3; 8] {
        self.index_bounds().corners().map(|p| self.index_to_world(p))
    }

    /// The smallest axis-aligned world box around the medium.
    #[must_use]
    pub fn world_bounds(&self) -> Bounds {
        Bounds::around(self.world_corners())
    }

    /// The length of the medium box's diagonal, world units.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        let c = self.world_corners();
        [(0, 7), (1, 6), (2, 5), (4, 3)].iter().map(|&(a, b)| c[a].distance(c[b])).fold(0.0, f32::max)
    }

    /// Index coordinates to world.
    #[inline]
    #[must_use]
    pub fn index_to_world(&self, p: Vec3) -> Vec3 {
        self.index_to_world.transform_point3(p)
    }

    /// World coordinates to index.
    #[inline]
    #[must_use]
    pub fn world_to_index(&self, p: Vec3) -> Vec3 {
        self.world_to_index.transform_point3(p)
    }

    /// A world ray in index space; its parameter stays the world distance.
    #[inline]
    #[must_use]
    pub fn ray_to_index(&self, ray: &Ray) -> Ray {
        Ray::new(
            self.world_to_index.transform_point3(ray.origin),
            self.world_to_index.transform_vector3(ray.direction),
        )
    }

    /// A world direction in index space, scaled so that distances along it are those of the world.
    #[inline]
    #[must_use]
    pub fn direction_to_index(&self, direction: Vec3) -> Vec3 {
        self.world_to_index.transform_vector3(direction)
    }

    /// The voxel size divided by the power of two below it: 1 to 2.
    #[inline]
    pub(crate) fn scaled_voxel_size(&self) -> f32 {
        self.scaled_voxel_size
    }

    /// A gradient per index unit turned into one along the world's axes (inverse transpose), per unit of [`Self::scaled_voxel_size`].
    #[inline]
    pub(crate) fn gradient_per_scaled_voxel(&self, g: Vec3) -> Vec3 {
        self.gradient_per_scaled_voxel * g
    }

    /// [`Self::gradient_per_scaled_voxel`] of a gradient per lane.
    #[inline(always)]
    pub(super) fn gradient_per_scaled_voxel_lanes<S: Lanes>(&self, [x, y, z]: [S::f32s; 3]) -> [S::f32s; 3] {
        let Mat3 { x_axis: a, y_axis: b, z_axis: c } = self.gradient_per_scaled_voxel;
        [x * a.x + y * b.x + z * c.x, x * a.y + y * b.y + z * c.y, x * a.z + y * b.z + z * c.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skewed_grid_maps_there_and_back() {
        let (s, c) = 0.3_f64.sin_cos();
        let direction = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, -1.0]];
        let grid =
            Grid::new([4, 5, 6], [0.5, 2.0, 3.0], direction, [10.0, -20.0, 5.0], Space::Anatomical).unwrap();
        let p = Vec3::new(1.0, 2.5, 3.0);
        let world = grid.index_to_world(p);
        let in_file = [10.0 + c * 0.5 - s * 5.0, -20.0 + s * 0.5 + c * 5.0, 5.0 - 9.0];
        assert!((grid.to_world(in_file) - world).length() < 1e-5, "{world}");
        assert!(grid.world_bounds().center().length() < 1e-5);
        assert!((grid.world_to_index(world) - p).length() < 1e-4);
        assert!((grid.voxel_size() - 3.0_f32.cbrt()).abs() < 1e-6);
        // A field v = i (index x) grows by 1 per 0.5 world units along the first axis.
        let g = grid.gradient_per_scaled_voxel(Vec3::X) * grid.scaled_voxel_size() / grid.voxel_size();
        assert!((g.length() - 2.0).abs() < 1e-5 && (f64::from(g.x) - 2.0 * c).abs() < 1e-5, "{g}");
    }

    #[test]
    fn a_grid_far_from_the_origin_keeps_its_precision() {
        let far = [8e7, 4.5e6, -1e9];
        let near = Grid::new([4, 5, 6], [0.25; 3], IDENTITY, [0.0; 3], Space::Plain).unwrap();
        let grid = Grid::new([4, 5, 6], [0.25; 3], IDENTITY, far, Space::Plain).unwrap();
        let p = Vec3::new(0.3, 4.0, 2.5);
        assert_eq!(grid.index_to_world(p), near.index_to_world(p));
        assert_eq!(grid.to_world([far[0] + 0.25, far[1], far[2] - 0.5]), near.to_world([0.25, 0.0, -0.5]));
        assert_eq!(grid.file_extent(), [1.0, 1.25, 1.5]);
        assert_eq!(grid.file_bounds(), [far.map(|x| x - 0.125), [8e7 + 0.875, 4.5e6 + 1.125, -1e9 + 1.375]]);
    }

    #[test]
    fn impossible_grids_are_refused() {
        let new = |dims, spacing| Grid::new(dims, spacing, IDENTITY, [0.0; 3], Space::Plain);
        assert!(matches!(new([0, 1, 1], [1.0; 3]), Err(GridError::Dims(_))));
        assert!(matches!(new([1, 1, 1], [1.0, -1.0, 1.0]), Err(GridError::Spacing(_))));
        assert!(matches!(new([1, 1, 1], [f64::NAN; 3]), Err(GridError::Spacing(_))));
        let flat = [[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let flat = Grid::new([2, 2, 2], [1.0; 3], flat, [0.0; 3], Space::Plain);
        assert!(matches!(flat, Err(GridError::Direction(_))));
    }
}
