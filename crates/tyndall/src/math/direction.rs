//! Directions in four bytes: octahedral encoding \[Cigolle14\].

use super::Vec3;

/// A unit vector in two 16-bit numbers, with an error of at most 7e-5 radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct PackedDirection(u32);

/// Steps from the middle of the square to its border.
pub(crate) const HALF: f32 = 32767.0;

impl PackedDirection {
    /// The nearest encoded direction to a unit vector, up to rounding.
    #[inline]
    #[must_use]
    pub fn new(v: Vec3) -> Self {
        let scale = 1.0 / (v.x.abs() + v.y.abs() + v.z.abs());
        let (mut x, mut y) = (v.x * scale, v.y * scale);
        if v.z < 0.0 {
            (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
        }
        // From 1 to 65535, with 32768 in the middle.
        let step = |c: f32| super::cast::truncate(c * HALF + HALF + 1.5).cast_unsigned() & 0xffff;
        Self(step(x) | step(y) << 16)
    }

    /// The unit vector.
    #[inline]
    #[must_use]
    pub fn unpack(self) -> Vec3 {
        let [x, y] = [self.0 & 0xffff, self.0 >> 16].map(|step| (step as f32 - (HALF + 1.0)) * (1.0 / HALF));
        let z = 1.0 - x.abs() - y.abs();
        let fold = (-z).max(0.0);
        let v = Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z);
        v * (1.0 / v.length())
    }

    /// Both numbers, x in the low half; for SIMD kernels, which unpack the same way.
    #[inline]
    pub(crate) fn word(self) -> u32 {
        self.0
    }

    /// From the result of [`Self::word`].
    #[inline]
    pub(crate) fn from_word(word: u32) -> Self {
        Self(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_survive_packing() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        for v in axes.into_iter().flat_map(|v| [v, -v]) {
            assert_eq!(PackedDirection::new(v).unpack(), v);
        }
        for i in 0..100_000 {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 100_000.0;
            let (s, c) = (i as f32 * 2.4).sin_cos();
            let v = Vec3::new((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z);
            let back = PackedDirection::new(v).unpack();
            assert!((back - v).length() < 7e-5 && (back.length() - 1.0).abs() < 3e-7, "{v}: {back}");
            // A decoded vector encodes to the same word again.
            let again = PackedDirection::new(back);
            assert_eq!(again, PackedDirection::new(v));
        }
    }
}
