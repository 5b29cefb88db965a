//! Orthonormal frames.

use super::Vec3;

/// A right-handed orthonormal frame around an axis `w`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub u: Vec3,
    /// Second tangent.
    pub v: Vec3,
    /// The axis.
    pub w: Vec3,
}

impl Frame {
    /// Builds a frame around a unit vector, without branching \[Duff17\].
    #[inline]
    #[must_use]
    pub fn around(w: Vec3) -> Self {
        let sign = 1.0_f32.copysign(w.z);
        let a = -1.0 / (sign + w.z);
        let b = w.x * w.y * a;
        Self {
            u: Vec3::new(1.0 + sign * w.x * w.x * a, sign * b, -sign * w.x),
            v: Vec3::new(b, sign + w.y * w.y * a, -w.y),
            w,
        }
    }

    /// The frame rotated about its axis by an angle given by its sine and cosine.
    #[inline]
    #[must_use]
    pub fn turned(&self, (sin, cos): (f32, f32)) -> Self {
        let Self { u, v, w } = *self;
        Self { u: u * cos + v * sin, v: v * cos - u * sin, w }
    }

    /// From frame coordinates to the space in which the axis is given.
    #[inline]
    #[must_use]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.u * v.x + self.v * v.y + self.w * v.z
    }

    /// From the space in which the axis is given to frame coordinates.
    #[inline]
    #[must_use]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.u), v.dot(self.v), v.dot(self.w))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed_everywhere() {
        for i in 0..200 {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 200.0;
            let (s, c) = (i as f32 * 2.4).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let f = Frame::around(Vec3::new(r * c, r * s, z)).turned((i as f32).sin_cos());
            assert!((f.u.cross(f.v) - f.w).length() < 1e-5, "{f:?}");
            assert!(f.u.dot(f.w).abs() < 1e-5 && (f.u.length() - 1.0).abs() < 1e-5, "{f:?}");
        }
        assert_eq!(Frame::around(-Vec3::Z).w, -Vec3::Z);
    }
}
