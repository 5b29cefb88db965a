//! Clipping: half spaces, whose intersection is what is kept.

use crate::math::{Bounds, Interval, Ray, Vec3};
use crate::simd::Lanes;
use crate::volume::Grid;
use fearless_simd::prelude::*;

/// A cut in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClipShape {
    /// The side that the normal points to is cut away.
    Plane {
        /// A point of the plane.
        point: Vec3,
        /// Points to what is cut away; any nonzero length.
        normal: Vec3,
    },
    /// The outside is cut away.
    Box(Bounds),
}

/// All cuts together, in index space. What is kept is convex, so a ray crosses it in one segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    half_spaces: Vec<HalfSpace>,
}

/// Keeps the points with `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfSpace {
    pub normal: Vec3,
    pub offset: f32,
}

impl Clip {
    /// Transforms world-space cuts to a grid's index space.
    #[must_use]
    pub fn new(grid: &Grid, shapes: &[ClipShape]) -> Self {
        let mut half_spaces = Vec::new();
        let mut cut = |point: Vec3, normal: Vec3| {
            // A plane's normal pulls back through the transpose of the index-to-world map.
            let origin = grid.index_to_world(Vec3::ZERO);
            let along = |axis: Vec3| normal.dot(grid.index_to_world(axis) - origin);
            let pulled = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
            half_spaces.push(HalfSpace { normal: pulled, offset: normal.dot(point - origin) });
        };
        for shape in shapes {
            match *shape {
                ClipShape::Plane { point, normal } => cut(point, normal),
                ClipShape::Box(b) => {
                    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                        cut(b.max, axis);
                        cut(b.min, -axis);
                    }
                }
            }
        }
        Self { half_spaces }
    }

    /// What is kept is in all of these, in index space.
    pub(crate) fn half_spaces(&self) -> &[HalfSpace] {
        &self.half_spaces
    }

    /// Whether each lane's index-space position is kept.
    #[inline(always)]
    pub(super) fn keeps_lanes<S: Lanes>(
        &self,
        simd: S,
        [x, y, z]: [S::f32s; 3],
        mut kept: S::mask32s,
    ) -> S::mask32s {
        for HalfSpace { normal, offset } in &self.half_spaces {
            let along = x * normal.x + y * normal.y + z * normal.z;
            kept &= along.simd_le(S::f32s::splat(simd, *offset));
        }
        kept
    }

    /// The part of an index-space ray segment that is kept.
    #[inline]
    pub(super) fn cut(&self, ray: &Ray, mut stretch: Interval) -> Interval {
        for half in &self.half_spaces {
            let towards = half.normal.dot(ray.direction);
            let room = half.offset - half.normal.dot(ray.origin);
            if towards > 0.0 {
                stretch.end = stretch.end.min(room / towards);
            } else if towards < 0.0 {
                stretch.start = stretch.start.max(room / towards);
            } else if room < 0.0 {
                return Interval::up_to(0.0);
            }
        }
        stretch
    }

    /// Whether a single plane cuts away all of an index-space box.
    #[must_use]
    pub fn cuts_all(&self, bounds: &Bounds) -> bool {
        let beyond =
            |half: &HalfSpace| bounds.corners().into_iter().all(|p| half.normal.dot(p) > half.offset);
        self.half_spaces.iter().any(beyond)
    }

    /// Whether an index-space point is kept.
    pub(super) fn keeps(&self, p: Vec3) -> bool {
        self.half_spaces.iter().all(|half| half.normal.dot(p) <= half.offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Space;

    #[test]
    fn cuts_act_in_the_world_whatever_the_grid() {
        let (s, c) = 0.4_f64.sin_cos();
        let direction = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let grid =
            Grid::new([10, 10, 10], [0.5, 1.0, 2.0], direction, [1.0, 2.0, 3.0], Space::Plain).unwrap();
        let b = Bounds::new(grid.to_world([0.0, 2.5, 4.0]), grid.to_world([3.0, 8.0, 20.1]));
        let point = grid.to_world([1.0, 5.0, 9.0]);
        let normal = Vec3::new(1.0, -0.5, 0.25);
        let clip = Clip::new(&grid, &[ClipShape::Box(b), ClipShape::Plane { point, normal }]);
        let (mut kept, mut cut) = (0, 0);
        for i in 0..1000 {
            let p = Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
            let world = grid.index_to_world(p);
            let expected = b.contains(world) && normal.dot(world - point) <= 0.0;
            assert_eq!(clip.keeps(p), expected, "{world}");
            *(if expected { &mut kept } else { &mut cut }) += 1;
        }
        assert!(kept > 50 && cut > 50, "{kept} kept, {cut} cut");
        // The ends of a ray's segment are on the border, and its inside is kept.
        let ray = Ray::new(Vec3::new(-5.0, 4.0, 3.0), Vec3::new(1.0, 0.1, 0.05));
        let stretch = clip.cut(&ray, Interval::AHEAD);
        assert!(!stretch.is_empty());
        for i in 1..100 {
            let t = stretch.start + (stretch.end - stretch.start) * i as f32 / 100.0;
            assert!(clip.keeps(ray.at(t)));
        }
        assert!(!clip.keeps(ray.at(stretch.start - 0.1)) && !clip.keeps(ray.at(stretch.end + 0.1)));
    }
}
