//! The gradient of the field.

use super::Volume;
use crate::math::{Binade, Vec3};

/// A gradient of the field at any scale of values and voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScaledGradient {
    /// Its direction, a unit vector.
    pub normal: Vec3,
    /// Its length, in values of `scale` per unit of length in which a voxel measures [`Grid::scaled_voxel_size`].
    pub length: f32,
    /// The unit of values.
    pub scale: Binade,
}

impl Volume {
    /// Gradient of the field by central differences between points one voxel apart (half a voxel to each side along every index axis), in
    /// parts that no scale of values or voxels takes out of single precision; `None` where it vanishes.
    ///
    /// All scales are powers of two, by which products are exact: the parts have the bits that the whole would have.
    #[inline]
    pub(crate) fn gradient(&self, p: Vec3) -> Option<ScaledGradient> {
        // Halves, since the difference of two values may be larger than either.
        let along = |axis: Vec3| 0.5 * self.value(p + axis * 0.5) - 0.5 * self.value(p - axis * 0.5);
        let slope = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
        let scale = Binade::of(slope.abs().max_element());
        let gradient = self.grid.gradient_per_scaled_voxel(slope * scale.inverse());
        let length = gradient.length();
        (length > 0.0).then(|| ScaledGradient { normal: gradient / length, length, scale: scale.doubled() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, Space, ValueMap, Voxels};

    /// Per world unit.
    fn gradient(volume: &Volume, p: Vec3) -> Vec3 {
        let unit = volume.grid().voxel_size() / volume.grid().scaled_voxel_size();
        volume.gradient(p).map_or(Vec3::ZERO, |g| g.normal * (g.length * g.scale.size() / unit))
    }

    #[test]
    fn the_gradient_of_an_even_slope_is_that_slope_in_the_world() {
        let (s, c) = 0.4_f64.sin_cos();
        let direction = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let grid = Grid::new([6, 5, 4], [0.5, 1.0, 2.0], direction, [1.0, 2.0, 3.0], Space::Plain).unwrap();
        let slope = Vec3::new(3.0, -1.0, 0.5);
        let position = |i: u8| Vec3::new(f32::from(i % 6), f32::from(i / 6 % 5), f32::from(i / 30));
        let data = (0..120).map(|i| slope.dot(grid.index_to_world(position(i)))).collect();
        let values = ValueMap { slope: 2.0, intercept: -7.0 };
        let volume = Volume::new(grid, Voxels::F32(data), values).unwrap();
        for p in [Vec3::new(2.0, 2.0, 1.0), Vec3::new(1.3, 3.4, 2.5)] {
            let found = gradient(&volume, p);
            assert!((found - slope * 2.0).length() < 1e-4, "{found} at {p}");
        }
    }

    #[test]
    fn the_gradient_sees_one_voxel_and_no_further() {
        let grid = Grid::centred([6, 1, 1], [0.5, 1.0, 1.0]).unwrap();
        let volume = Volume::new(grid, Voxels::U8(vec![0, 0, 0, 1, 1, 1]), ValueMap::IDENTITY).unwrap();
        // Per world unit, with voxels half a unit wide: the whole jump midway, half of it at a centre.
        let found = [1.5, 2.0, 2.5, 3.5].map(|x| gradient(&volume, Vec3::X * x));
        assert_eq!(found, [0.0, 1.0, 2.0, 0.0].map(|g| Vec3::X * g));
    }
}
