//! Axis-aligned boxes.

use super::{Interval, Ray, Vec3};

/// The box between two corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Bounds {
    /// The box with these corners.
    #[must_use]
    pub const fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    /// The smallest box around some points.
    ///
    /// # Panics
    /// If there are no points.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        let mut points = points.into_iter();
        let first = points.next().expect("a box needs a point");
        points.fold(Self::new(first, first), |b, p| Self::new(b.min.min(p), b.max.max(p)))
    }

    /// Middle.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths.
    #[must_use]
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
            Vec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// Whether a point is inside the box or on its border.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// The interval of a ray inside the box and ahead of the ray's origin (slab method).
    #[inline]
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Interval {
        let mut stretch = Interval::AHEAD;
        for axis in 0..3 {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            if d == 0.0 {
                // Parallel to the slab: 0 * infinity would be NaN, so compare positions instead.
                if o < self.min[axis] || o > self.max[axis] {
                    return Interval::up_to(0.0);
                }
                continue;
            }
            let inv = 1.0 / d;
            let (a, b) = ((self.min[axis] - o) * inv, (self.max[axis] - o) * inv);
            stretch = stretch.intersect(Interval { start: a.min(b), end: a.max(b) });
        }
        stretch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_along_a_face_and_one_beside_it() {
        let unit = Bounds::new(Vec3::ZERO, Vec3::ONE);
        let hit = unit.intersect(&Ray::new(Vec3::new(-1.0, 0.5, 0.5), Vec3::X));
        assert_eq!(hit, Interval { start: 1.0, end: 2.0 });
        assert!(unit.intersect(&Ray::new(Vec3::new(-1.0, 1.5, 0.5), Vec3::X)).is_empty());
        let from_inside = unit.intersect(&Ray::new(Vec3::splat(0.5), -Vec3::Z));
        assert_eq!(from_inside, Interval { start: 0.0, end: 0.5 });
    }
}
