//! Reading the field at a position per lane.

use super::bricks::{BRICK, Lattice};
use super::{Interpolation, Volume, Voxel, Voxels};
use crate::math::{Binade, Vec3};
use crate::simd::Lanes;
use fearless_simd::prelude::*;

impl Volume {
    /// [`Volume::value`] of a position per lane, each axis in a vector of its own.
    #[inline(always)]
    pub(crate) fn value_lanes<S: Lanes>(&self, simd: S, position: [S::f32s; 3]) -> S::f32s {
        let samples = self.bricks.samples();
        // Gathers take signed indices.
        if samples.len() > i32::MAX as usize {
            let at = |lane: usize| Vec3::from_array(position.map(|axis| axis.as_slice()[lane]));
            return S::f32s::from_fn(simd, |lane| self.value(at(lane)));
        }
        let stored = match samples {
            Voxels::U8(samples) => self.stored_lanes(simd, samples, position),
            Voxels::I8(samples) => self.stored_lanes(simd, samples, position),
            Voxels::U16(samples) => self.stored_lanes(simd, samples, position),
            Voxels::I16(samples) => self.stored_lanes(simd, samples, position),
            Voxels::U32(samples) => self.stored_lanes(simd, samples, position),
            Voxels::I32(samples) => self.stored_lanes(simd, samples, position),
            Voxels::F32(samples) => self.stored_lanes(simd, samples, position),
            Voxels::F64(samples) => self.stored_lanes(simd, samples, position),
        };
        stored * self.slope + self.intercept
    }

    /// [`Volume::gradient`] at a position per lane, along the world's axes, in values of `scale` per unit of length in which a voxel measures
    /// [`Grid::scaled_voxel_size`](super::Grid::scaled_voxel_size). Gradients far below the scale become 0.
    #[inline(always)]
    pub(crate) fn gradient_lanes<S: Lanes>(
        &self,
        simd: S,
        [x, y, z]: [S::f32s; 3],
        scale: Binade,
    ) -> [S::f32s; 3] {
        let inverse = scale.inverse();
        let ends = [
            [self.value_lanes(simd, [x + 0.5, y, z]), self.value_lanes(simd, [x - 0.5, y, z])],
            [self.value_lanes(simd, [x, y + 0.5, z]), self.value_lanes(simd, [x, y - 0.5, z])],
            [self.value_lanes(simd, [x, y, z + 0.5]), self.value_lanes(simd, [x, y, z - 0.5])],
        ];
        let [gx, gy, gz] = ends;
        self.grid.gradient_per_scaled_voxel_lanes::<S>([
            gx[0] * inverse - gx[1] * inverse,
            gy[0] * inverse - gy[1] * inverse,
            gz[0] * inverse - gz[1] * inverse,
        ])
    }

    #[inline(always)]
    fn stored_lanes<S: Lanes, T: Pair>(&self, simd: S, samples: &[T], [x, y, z]: [S::f32s; 3]) -> S::f32s {
        let lattice = &self.lattice;
        let [[sx, _], [sy, _], [sz, _]] = lattice.lane_steps;
        if self.interpolation == Interpolation::Nearest {
            let base = lattice.nearest_lanes(simd, 0, x)
                + lattice.nearest_lanes(simd, 1, y)
                + lattice.nearest_lanes(simd, 2, z);
            return T::pair(simd, samples, base, 0).0;
        }
        let (bx, fx) = lattice.cell_lanes(simd, 0, x);
        let (by, fy) = lattice.cell_lanes(simd, 1, y);
        let (bz, fz) = lattice.cell_lanes(simd, 2, z);
        let base = bx + by + bz;
        let (a, b) =
            (row::<S, T>(simd, samples, base, sx, fx), row::<S, T>(simd, samples, base + sy, sx, fx));
        let near = mix::<S>(a, b, fy);
        let base = base + sz;
        let (a, b) =
            (row::<S, T>(simd, samples, base, sx, fx), row::<S, T>(simd, samples, base + sy, sx, fx));
        mix::<S>(near, mix::<S>(a, b, fy), fz)
    }
}

impl Lattice {
    /// Memory offset along an axis of a sample, by number, that is the lower corner of a cell.
    #[inline(always)]
    fn memory_lanes<S: Lanes>(&self, a: usize, number: S::u32s) -> S::u32s {
        // Whole bricks, plus samples in the last of them, in fewer operations than written that way.
        let [step, per_brick] = self.lane_steps[a];
        (number >> BRICK.ilog2()) * per_brick + number * step
    }

    /// Memory offset of the lower corner of the cell along an axis, and the position inside the cell.
    #[inline(always)]
    fn cell_lanes<S: Lanes>(&self, simd: S, a: usize, x: S::f32s) -> (S::u32s, S::f32s) {
        let x = x.max(0.0).min(self.last[a]);
        let index: S::i32s = x.to_int();
        let cell = index.min(S::i32s::splat(simd, self.lower[a]));
        (self.memory_lanes::<S>(a, cell.bitcast()), x - cell.to_float::<S::f32s>())
    }

    /// Memory offset of the nearest sample along an axis, which may come after the last cell.
    #[inline(always)]
    fn nearest_lanes<S: Lanes>(&self, simd: S, a: usize, x: S::f32s) -> S::u32s {
        let index: S::i32s = (x.max(0.0).min(self.last[a]) + 0.5).to_int();
        let cell = index.min(S::i32s::splat(simd, self.lower[a]));
        let past: S::u32s = (index - cell).bitcast();
        self.memory_lanes::<S>(a, cell.bitcast()) + past * self.lane_steps[a][0]
    }
}

#[inline(always)]
fn mix<S: Lanes>(a: S::f32s, b: S::f32s, t: S::f32s) -> S::f32s {
    (b - a).mul_add(t, a)
}

/// Interpolates between a pair along x.
#[inline(always)]
fn row<S: Lanes, T: Pair>(simd: S, samples: &[T], index: S::u32s, step: u32, t: S::f32s) -> S::f32s {
    let (a, b) = T::pair(simd, samples, index, step);
    mix::<S>(a, b, t)
}

/// Samples that can be read two at a time.
trait Pair: Voxel {
    /// The sample at an index per lane and the one `step` (0 or 1) after it; where `step` is 0 the second may be
    /// anything finite.
    fn pair<S: Lanes>(simd: S, samples: &[Self], index: S::u32s, step: u32) -> (S::f32s, S::f32s);
}

/// Both samples of a pair from one word: each is shifted up to its end and down again, with or without the sign.
macro_rules! pair_in_a_word {
    ($($type:ty: $words:ident)*) => {$(
        impl Pair for $type {
            #[inline(always)]
            fn pair<S: Lanes>(simd: S, samples: &[Self], index: S::u32s, _: u32) -> (S::f32s, S::f32s) {
                let words: S::$words = simd.words(samples, index).bitcast();
                let first: S::i32s = ((words << (32 - Self::BITS)) >> (32 - Self::BITS)).bitcast();
                let second: S::i32s = ((words << (32 - 2 * Self::BITS)) >> (32 - Self::BITS)).bitcast();
                (first.to_float(), second.to_float())
            }
        }
    )*};
}
pair_in_a_word!(u8: u32s i8: i32s u16: u32s i16: i32s);

impl Pair for f32 {
    #[inline(always)]
    fn pair<S: Lanes>(simd: S, samples: &[Self], index: S::u32s, step: u32) -> (S::f32s, S::f32s) {
        (simd.numbers(samples, index), simd.numbers(samples, index + step))
    }
}

/// Wide types are rare, and are read one by one.
macro_rules! pair_one_by_one {
    ($($type:ty)*) => {$(
        impl Pair for $type {
            #[inline(always)]
            fn pair<S: Lanes>(simd: S, samples: &[Self], index: S::u32s, step: u32) -> (S::f32s, S::f32s) {
                let read = |after: usize| {
                    S::f32s::from_fn(simd, |lane| {
                        let index = index.as_slice()[lane] as usize + after;
                        samples[index.min(samples.len() - 1)].to_f32()
                    })
                };
                (read(0), read(step as usize))
            }
        }
    )*};
}
pair_one_by_one!(u32 i32 f64);

#[cfg(test)]
mod tests {
    use super::super::{Grid, ValueMap};
    use super::*;
    use crate::math::cast;
    use crate::simd::{Kernel, Level};
    use tyndall_testing::SplitMix;

    struct Values<'a>(&'a Volume, &'a [[f32; 3]]);

    impl Kernel for Values<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<f32> {
            let read = |positions: &[[f32; 3]]| {
                let position = [0, 1, 2].map(|a| S::f32s::from_fn(simd, |lane| positions[lane][a]));
                self.0.value_lanes(simd, position).as_slice().to_vec()
            };
            self.1.chunks_exact(S::WIDTH).flat_map(read).collect()
        }
    }

    fn voxels(kind: usize, count: usize) -> Voxels {
        let mut random = SplitMix::new(17);
        let mut bits = || cast::low_u32(random.bits());
        macro_rules! all {
            ($($number:literal $kind:ident $type:ty,)*) => {
                #[expect(clippy::cast_possible_truncation, reason = "any bits will do")]
                match kind {
                    $($number => Voxels::$kind((0..count).map(|_| bits() as $type).collect()),)*
                    6 => Voxels::F32((0..count).map(|_| (bits() >> 8) as f32 - 1e6).collect()),
                    _ => Voxels::F64((0..count).map(|_| f64::from(bits()) - 1e6).collect()),
                }
            };
        }
        all!(0 U8 u8, 1 I8 i8, 2 U16 u16, 3 I16 i16, 4 U32 u32, 5 I32 i32,)
    }

    #[test]
    fn every_level_reads_the_scalar_value() {
        let mut random = SplitMix::new(23);
        for dims in [[20, 11, 9], [1, 12, 3], [30, 1, 1], [2, 2, 2], [1, 1, 1]] {
            let positions: Vec<[f32; 3]> = (0..960)
                .map(|_| dims.map(|n| cast::single(random.uniform() * (n as f64 + 1.0)) - 1.0))
                .collect();
            for kind in 0..8 {
                let grid = Grid::centred(dims, [1.0; 3]).unwrap();
                let values = ValueMap { slope: -0.5, intercept: 10.0 };
                let volume = Volume::new(grid, voxels(kind, dims.iter().product()), values).unwrap();
                for interpolation in [Interpolation::Linear, Interpolation::Nearest] {
                    let volume = volume.clone().with_interpolation(interpolation);
                    let [lo, hi] = volume.value_range();
                    for level in Level::available() {
                        let found = level.run(Values(&volume, &positions));
                        for (position, found) in positions.iter().zip(found) {
                            let expected = volume.value(Vec3::from_array(*position));
                            let apart = f64::from(found - expected).abs();
                            assert!(
                                apart <= 1e-6 * (hi - lo),
                                "{found}, expected {expected} at {position:?} of {dims:?} {} {interpolation:?} {level:?}",
                                volume.type_name()
                            );
                        }
                    }
                }
            }
        }
    }
}
