//! Rays and the stretch of a ray that matters.

use super::Vec3;

/// A half line. `direction` has unit length in world space; in index space it is scaled so that
/// `t` stays a world distance.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes.
    pub direction: Vec3,
}

impl Ray {
    /// From its parts.
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

/// A closed stretch `[start, end]` of a ray; empty when `start >= end`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Nearest distance.
    pub start: f32,
    /// Farthest distance; may be infinite.
    pub end: f32,
}

impl Interval {
    /// All that lies ahead.
    pub const AHEAD: Self = Self { start: 0.0, end: f32::INFINITY };

    /// From nothing to `end`.
    #[inline]
    #[must_use]
    pub const fn up_to(end: f32) -> Self {
        Self { start: 0.0, end }
    }

    /// Whether no point lies in it.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.start >= self.end || self.start.is_nan() || self.end.is_nan()
    }

    /// The common part of both.
    #[inline]
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        Self { start: self.start.max(other.start), end: self.end.min(other.end) }
    }
}
