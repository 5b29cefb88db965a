//! Rays and intervals along them.

use super::Vec3;

/// A half-line. `direction` has unit length in world space; in index space it is scaled so that
/// `t` remains a world distance.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ray {
    /// Origin.
    pub origin: Vec3,
    /// Direction.
    pub direction: Vec3,
}

impl Ray {
    /// From its origin and direction.
    #[inline]
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction }
    }

    /// The point at distance `t`.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// A closed interval `[start, end]` of a ray; empty when `start >= end`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Nearest distance.
    pub start: f32,
    /// Farthest distance; may be infinite.
    pub end: f32,
}

impl Interval {
    /// From 0 to infinity.
    pub const AHEAD: Self = Self { start: 0.0, end: f32::INFINITY };

    /// From 0 to `end`.
    #[inline]
    #[must_use]
    pub const fn up_to(end: f32) -> Self {
        Self { start: 0.0, end }
    }

    /// Whether it is empty.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.start >= self.end || self.start.is_nan() || self.end.is_nan()
    }

    /// The intersection of both.
    #[inline]
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        Self { start: self.start.max(other.start), end: self.end.min(other.end) }
    }
}
