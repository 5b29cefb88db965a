//! The medium's box as the target of light paths.

use super::triangle::{Corner, HalfAngle, SphericalTriangle};
use crate::math::{DMat3, DVec3, Ray, Vec3};
use crate::volume::Grid;

/// Distance in front of the box at which parallel rays start, in radii of the box, so that no rounding makes them start
/// behind a face.
const BEFORE: f64 = 0.01;

/// Distance from a face, as a share of an edge, within which a point counts as on it: far less than single precision
/// can resolve, and enough that the solid angle in double precision is not lost in rounding.
const HAIR: f64 = 1e-9;

/// Distance, in radii of the box, beyond which light from a point is parallel in single precision.
const FAR: f64 = 1e7;

/// The medium's box in the world: a parallelepiped, since grids may be rotated, sheared and left-handed.
///
/// In double precision, since lights need small differences: between a far light's rays, or a near light's height
/// above a face.
#[derive(Clone, Copy, Debug)]
pub struct Enclosure {
    /// Where the edges start.
    corner: DVec3,
    edges: [DVec3; 3],
    /// Per edge, the outward normal of the face at its end; its length is the face's area.
    normals: [DVec3; 3],
    volume: f64,
    center: DVec3,
    /// From the middle to the farthest corner.
    radius: f64,
}

/// A parallelogram of the border.
struct Face {
    corner: DVec3,
    sides: [DVec3; 2],
}

impl Face {
    #[inline]
    fn at(&self, u: f64, v: f64) -> DVec3 {
        self.corner + self.sides[0] * u + self.sides[1] * v
    }

    /// The two triangles of a face as seen from a point; `volume` is that of the parallelepiped of eye and face.
    #[inline]
    fn triangles(&self, from: DVec3, volume: f64) -> [SphericalTriangle; 2] {
        let corner = |u, v| Corner::new(self.at(u, v) - from);
        let (a, c) = (corner(0.0, 0.0), corner(1.0, 1.0));
        let half = |b| SphericalTriangle::new([a, b, c], volume);
        [half(corner(1.0, 0.0)), half(corner(0.0, 1.0))]
    }
}

impl Enclosure {
    /// The box of a grid, half a voxel past its outer voxel centres.
    #[must_use]
    pub fn new(grid: &Grid) -> Self {
        let axes = DMat3::from_cols_array_2d(&grid.direction()).transpose();
        let (dims, spacing) = (grid.dims(), grid.spacing());
        let edges = [0, 1, 2].map(|a| axes.col(a) * (dims[a] as f64 * spacing[a]));
        let [x, y, z] = edges;
        // The world's origin is the centre of the box.
        let (center, corner) = (DVec3::ZERO, (x + y + z) * -0.5);
        let determinant = x.cross(y).dot(z);
        let normals = [y.cross(z), z.cross(x), x.cross(y)].map(|n| n * determinant.signum());
        let radius =
            [x + y + z, x + y - z, x - y + z, y + z - x].map(DVec3::length).into_iter().fold(0.0, f64::max);
        Self { corner, edges, normals, volume: determinant.abs(), center, radius: 0.5 * radius }
    }

    /// Middle of the box and the distance from there to its farthest corner, world.
    pub(super) fn ball(&self) -> (DVec3, f64) {
        (self.center, self.radius)
    }

    /// Whether a world point is inside or on the border.
    pub(super) fn contains(&self, point: Vec3) -> bool {
        self.above(point.as_dvec3()) == [0.0; 3]
    }

    /// A ray along `travel` (unit), uniform over the silhouette that the box has in this direction, and the
    /// silhouette's area, [world units^2]. The ray starts in front of the box.
    pub(super) fn cross(&self, travel: DVec3, u: [f32; 2]) -> Option<(Ray, f64)> {
        // The light meets one face per axis, whose area in the silhouette follows from its normal.
        let along = self.normals.map(|n| n.dot(travel));
        let areas = along.map(f64::abs);
        let (axis, left) = choose(&areas, u[0])?;
        let point = self.face(axis, along[axis] < 0.0).at(left, f64::from(u[1]));
        let origin = point - travel * (BEFORE * self.radius);
        Some((Ray::new(origin.as_vec3(), travel.as_vec3()), areas.iter().sum()))
    }

    /// A ray from a point outside, uniform over the solid angle of the box, and this solid angle, [sr]. The ray starts
    /// at the point, or nearer to the box but in front of it. `None` from inside, and where rounding leaves no answer
    /// because the box has edges of extremely different lengths.
    pub(super) fn aim(&self, from: Vec3, u: [f32; 2]) -> Option<(Ray, f64)> {
        let from = from.as_dvec3();
        let to_center = self.center - from;
        let distance = to_center.length();
        if distance > FAR * self.radius {
            let (ray, area) = self.cross(to_center / distance, u)?;
            return Some((ray, area / (distance * distance)));
        }
        let above = self.above(from);
        let triangles = |axis: usize| self.face(axis, above[axis] > 0.0).triangles(from, above[axis].abs());
        // Two triangles per axis. The chosen one is recomputed: keeping them all costs more.
        let mut halves = [HalfAngle::ZERO; 6];
        let mut sum = HalfAngle::ZERO;
        for axis in (0..3).filter(|&axis| above[axis] != 0.0) {
            for (k, triangle) in triangles(axis).iter().enumerate() {
                halves[2 * axis + k] = triangle.half_angle();
                sum = sum.plus(triangle.half_angle());
            }
        }
        let whole = sum.radians();

        // The triangle in which the wanted share of the whole ends, and the part of it up to there.
        let mut part = HalfAngle::new(f64::from(u[0]) * whole);
        let mut chosen = None;
        for (i, &half) in halves.iter().enumerate().filter(|&(i, _)| above[i / 2] != 0.0) {
            chosen = Some((i, part));
            if part.is_below(half) {
                break;
            }
            part = part.minus(half);
        }
        let (i, part) = chosen?;
        let triangle = triangles(i / 2)[i % 2];
        let direction = triangle.sample(part, f64::from(u[1]));
        // A ray's direction is in single precision and would miss from far away.
        let origin = from + direction * (distance - (1.0 + BEFORE) * self.radius).max(0.0);
        let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
        direction.is_finite().then_some((ray, 2.0 * whole))
    }

    /// Per axis, how far a point is above the upper face (positive) or below the lower one (negative), times the area
    /// of that face; 0 in between.
    #[inline]
    fn above(&self, point: DVec3) -> [f64; 3] {
        self.normals.map(|n| {
            let height = n.dot(point - self.corner);
            let off = height.min(0.0) + (height - self.volume).max(0.0);
            if off.abs() > HAIR * self.volume { off } else { 0.0 }
        })
    }

    /// The face at the start or at the end of an edge.
    #[inline]
    fn face(&self, axis: usize, upper: bool) -> Face {
        let shift = if upper { self.edges[axis] } else { DVec3::ZERO };
        Face { corner: self.corner + shift, sides: [1, 2].map(|i| self.edges[(axis + i) % 3]) }
    }
}

/// One of several by share, and a uniform number left over from the choice; `None` if there is no positive share, or
/// one is not a number.
fn choose(shares: &[f64], u: f32) -> Option<(usize, f64)> {
    let total: f64 = shares.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut left = f64::from(u) * total;
    let mut chosen = None;
    for (i, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
        chosen = Some((i, (left / share).min(1.0)));
        left -= share;
        if left < 0.0 {
            break;
        }
    }
    chosen
}
