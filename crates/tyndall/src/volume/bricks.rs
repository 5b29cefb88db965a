//! The samples in bricks: small blocks, each with a copy of its neighbours' first samples, so that a trilinear
//! look-up reads one block and nearby positions share cache lines whatever the direction.

use super::voxels::with_voxels;
use super::{Interpolation, Voxel, Voxels};
use crate::math::{Vec3, cast};
use rayon::prelude::*;

/// Cells of the lattice along a full brick's edge; it holds one sample more.
pub const BRICK: usize = 8;

/// Samples after the last brick, so that a read of 32 bits at any sample stays inside.
const PADDING: usize = 4;

/// Samples on a lattice, cut into bricks. Brick `i` of an axis holds samples `8 i ..= 8 i + 8`, clamped to the last;
/// an axis of fewer than nine samples has one brick with all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    /// Brick by brick, x fastest, and inside each brick x fastest.
    samples: Voxels,
    /// Samples along each axis of the whole lattice.
    dims: [usize; 3],
    /// Bricks along each axis.
    counts: [usize; 3],
    /// Samples along each edge of a brick.
    edge: [usize; 3],
}

/// What a look-up needs to know of the layout, computed once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Index of the last sample along each axis.
    pub last: [f32; 3],
    /// Largest index of a cell's lower corner: the last sample but one.
    pub lower: [i32; 3],
    /// Memory offset from a sample to the next along each axis, inside a brick; 0 where the axis has only one sample.
    pub step: [usize; 3],
    /// Memory offset from a brick to the next along each axis.
    pub brick_step: [usize; 3],
    /// The steps by which lanes multiply, modulo 2^32: from a sample to the next, and from a brick to the next less
    /// eight of these.
    pub lane_steps: [[u32; 2]; 3],
}

impl Bricks {
    /// Cuts samples, x fastest, into bricks, in parallel on the current pool; also returns the smallest and the largest
    /// sample of each brick.
    pub(super) fn new(dims: [usize; 3], linear: &Voxels) -> (Self, Vec<[f64; 2]>) {
        let counts = counts(dims);
        let edge = dims.map(|n| n.min(BRICK + 1));
        macro_rules! cut {
            ($($kind:ident)*) => {
                match linear {$(
                    Voxels::$kind(data) => {
                        let (samples, ranges) = cut(data, dims, counts, edge);
                        (Voxels::$kind(samples), ranges)
                    }
                )*}
            };
        }
        let (samples, ranges) = cut!(U8 I8 U16 I16 U32 I32 F32 F64);
        (Self { samples, dims, counts, edge }, ranges)
    }

    /// The samples as they are stored, brick by brick.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        with_voxels!(&self.samples, data => bytemuck::cast_slice(data))
    }

    /// Bytes that the bricks of a grid take; `None` where the number overflows.
    #[must_use]
    pub fn bytes(dims: [usize; 3], sample: usize) -> Option<u64> {
        let along = |a: usize| counts(dims)[a].checked_mul(dims[a].min(BRICK + 1));
        let samples = along(0)?.checked_mul(along(1)?)?.checked_mul(along(2)?)?.checked_add(PADDING)?;
        samples.checked_mul(sample).map(|bytes| bytes as u64)
    }

    /// The samples brick by brick, with padding at the end.
    pub(crate) fn samples(&self) -> &Voxels {
        &self.samples
    }

    /// Bricks along each axis.
    pub(super) fn counts(&self) -> [usize; 3] {
        self.counts
    }

    pub(super) fn lattice(&self) -> Lattice {
        let [x, y, z] = self.edge;
        let stride = [1, x, x * y];
        let brick = x * y * z;
        let [nx, ny, _] = self.counts;
        let step: [usize; 3] = std::array::from_fn(|a| if self.dims[a] > 1 { stride[a] } else { 0 });
        let brick_step = [brick, brick * nx, brick * nx * ny];
        let low = |n: usize| cast::low_u32(n as u64);
        Lattice {
            last: self.dims.map(|n| (n - 1) as f32),
            lower: self.dims.map(|n| cast::fit_u32(n.saturating_sub(2)).cast_signed()),
            lane_steps: std::array::from_fn(|a| {
                [low(step[a]), low(brick_step[a].wrapping_sub(BRICK * step[a]))]
            }),
            step,
            brick_step,
        }
    }

    /// Memory offset of a sample.
    fn offset(&self, sample: [usize; 3]) -> usize {
        let [x, y, z] = self.edge;
        let brick: [usize; 3] = std::array::from_fn(|a| (sample[a] / BRICK).min(self.counts[a] - 1));
        let local: [usize; 3] = std::array::from_fn(|a| sample[a] - brick[a] * BRICK);
        let [nx, ny, _] = self.counts;
        let number = brick[0] + nx * (brick[1] + ny * brick[2]);
        number * x * y * z + local[0] + x * (local[1] + y * local[2])
    }

    /// The stored sample at `[x, y, z]`, before slope and intercept.
    ///
    /// # Panics
    /// If it is outside.
    pub(super) fn get(&self, sample: [usize; 3]) -> f64 {
        let [nx, ny, nz] = self.dims;
        let [x, y, z] = sample;
        assert!(x < nx && y < ny && z < nz, "voxel ({x}, {y}, {z}) outside {nx} x {ny} x {nz}");
        with_voxels!(&self.samples, data => data[self.offset(sample)].to_f64())
    }

    /// A copy of the samples in file order, x fastest.
    pub(super) fn to_linear(&self) -> Voxels {
        let [nx, ny, nz] = self.dims;
        let samples = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / (nx * ny)]);
        macro_rules! gather {
            ($($kind:ident)*) => {
                match &self.samples {$(
                    Voxels::$kind(data) => Voxels::$kind(samples.map(|s| data[self.offset(s)]).collect()),
                )*}
            };
        }
        gather!(U8 I8 U16 I16 U32 I32 F32 F64)
    }

    /// Folds over all stored samples, each once, with layers of bricks in parallel on the current pool.
    pub(super) fn fold<A: Send>(
        &self,
        start: impl Fn() -> A + Sync + Send,
        take: impl Fn(&mut A, f64) + Sync + Send,
        merge: impl Fn(A, A) -> A + Sync + Send,
    ) -> A {
        let own = |brick: usize, a: usize| {
            let end = if brick + 1 == self.counts[a] { self.dims[a] } else { (brick + 1) * BRICK };
            brick * BRICK..end
        };
        let layer = |k: usize| {
            let mut sum = start();
            with_voxels!(&self.samples, data => {
                for z in own(k, 2) {
                    for y in 0..self.dims[1] {
                        for i in 0..self.counts[0] {
                            let row = own(i, 0);
                            let first = self.offset([row.start, y, z]);
                            // By index, the last sample of a row may belong to another brick, but it is in this one
                            // too.
                            data[first..first + row.len()].iter().for_each(|v| take(&mut sum, v.to_f64()));
                        }
                    }
                }
            });
            sum
        };
        (0..self.counts[2]).into_par_iter().map(layer).reduce(&start, merge)
    }

    /// Smallest and largest stored sample within `first ..= last`.
    pub(super) fn extremes(&self, first: [usize; 3], last: [usize; 3]) -> [f64; 2] {
        with_voxels!(&self.samples, data => {
            let mut range = [data[self.offset(first)]; 2];
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        let v = data[self.offset([x, y, z])];
                        range = wider(range, v);
                    }
                }
            }
            range.map(Voxel::to_f64)
        })
    }
}

fn counts(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| n.saturating_sub(1).div_ceil(BRICK).max(1))
}

#[inline]
fn wider<T: Voxel>([lo, hi]: [T; 2], v: T) -> [T; 2] {
    [if v < lo { v } else { lo }, if v > hi { v } else { hi }]
}

fn cut<T: Voxel>(
    linear: &[T],
    dims: [usize; 3],
    counts: [usize; 3],
    edge: [usize; 3],
) -> (Vec<T>, Vec<[f64; 2]>) {
    let brick = edge.iter().product::<usize>();
    let bricks = counts.iter().product::<usize>();
    let mut samples = vec![T::default(); bricks * brick + PADDING];
    let fill = |(number, out): (usize, &mut [T])| {
        let first = [number % counts[0], number / counts[0] % counts[1], number / (counts[0] * counts[1])]
            .map(|i| i * BRICK);
        let width = edge[0].min(dims[0] - first[0]);
        for (row, out) in out.chunks_exact_mut(edge[0]).enumerate() {
            let y = (first[1] + row % edge[1]).min(dims[1] - 1);
            let z = (first[2] + row / edge[1]).min(dims[2] - 1);
            let from = first[0] + dims[0] * (y + dims[1] * z);
            let (own, past) = out.split_at_mut(width);
            own.copy_from_slice(&linear[from..from + width]);
            past.fill(linear[from + width - 1]);
        }
        out.iter().fold([out[0]; 2], |range, &v| wider(range, v)).map(Voxel::to_f64)
    };
    let ranges =
        samples[..bricks * brick].par_chunks_mut(brick).with_min_len(64).enumerate().map(fill).collect();
    (samples, ranges)
}

impl Lattice {
    /// The field at index coordinates `p`, before slope and intercept, clamped to the border; NaN reads as 0.
    #[inline]
    pub(super) fn read<T: Voxel>(&self, samples: &[T], p: Vec3, interpolation: Interpolation) -> f32 {
        match interpolation {
            Interpolation::Linear => self.linear(samples, p),
            Interpolation::Nearest => self.nearest(samples, p),
        }
    }

    /// Memory offset along an axis of a sample that is the lower corner of a cell.
    #[inline]
    pub(super) fn along(&self, a: usize, i: i32) -> usize {
        let i = i.cast_unsigned() as usize;
        (i / BRICK) * self.brick_step[a] + (i % BRICK) * self.step[a]
    }

    #[inline]
    fn linear<T: Voxel>(&self, samples: &[T], p: Vec3) -> f32 {
        let mut base = 0;
        let mut axis = |a: usize| {
            let x = p[a].max(0.0).min(self.last[a]);
            let lower = cast::truncate(x).min(self.lower[a]);
            base += self.along(a, lower);
            x - lower as f32
        };
        let [fx, fy, fz] = [axis(0), axis(1), axis(2)];
        let [x, y, z] = self.step;
        // One slice, one bounds check that covers the eight corners.
        let corners = &samples[base..=base + x + y + z];
        let at = |offset: usize| corners[offset].to_f32();
        let row = |offset: usize| mix(at(offset), at(offset + x), fx);
        let plane = |offset: usize| mix(row(offset), row(offset + y), fy);
        mix(plane(0), plane(z), fz)
    }

    #[inline]
    fn nearest<T: Voxel>(&self, samples: &[T], p: Vec3) -> f32 {
        let position = |a: usize| {
            let i = cast::truncate(p[a].max(0.0).min(self.last[a]) + 0.5);
            // The last sample of an axis may come after the last cell of the last brick.
            let lower = i.min(self.lower[a]);
            self.along(a, lower) + usize::from(i > lower) * self.step[a]
        };
        samples[position(0) + position(1) + position(2)].to_f32()
    }
}

#[inline]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [[usize; 3]; 7] =
        [[3, 4, 5], [9, 8, 10], [17, 1, 25], [1, 1, 1], [1, 30, 2], [26, 9, 16], [33, 18, 7]];

    fn numbered(dims: [usize; 3]) -> Voxels {
        Voxels::U32(
            (0..cast::fit_u32(dims.iter().product())).map(|i| i.wrapping_mul(2_654_435_761) >> 20).collect(),
        )
    }

    fn read(bricks: &Bricks, p: Vec3, interpolation: Interpolation) -> f32 {
        with_voxels!(bricks.samples(), data => bricks.lattice().read(data, p, interpolation))
    }

    #[test]
    fn bricks_hold_the_same_samples() {
        for dims in SHAPES {
            let linear = numbered(dims);
            let (bricks, ranges) = Bricks::new(dims, &linear);
            assert_eq!(bricks.to_linear(), linear, "{dims:?}");
            let count = bricks.fold(
                || (0_usize, 0.0),
                |sum, v| *sum = (sum.0 + 1, sum.1 + v),
                |a, b| (a.0 + b.0, a.1 + b.1),
            );
            let total: f64 = (0..linear.len()).map(|i| linear.get(i)).sum();
            assert_eq!(count, (linear.len(), total), "{dims:?}");
            assert_eq!(ranges.len(), bricks.counts().iter().product::<usize>());
            assert_eq!(Bricks::bytes(dims, 4), Some(bricks.samples().len() as u64 * 4));
            let [nx, ny, _] = bricks.counts();
            for (i, range) in ranges.into_iter().enumerate() {
                let first = [i % nx, i / nx % ny, i / (nx * ny)].map(|b| b * BRICK);
                let last = std::array::from_fn(|a| (first[a] + BRICK).min(dims[a] - 1));
                assert_eq!(range, bricks.extremes(first, last), "brick {i} of {dims:?}");
            }
        }
    }

    #[test]
    fn the_field_is_trilinear_and_clamped_at_the_edge() {
        for dims in SHAPES {
            let linear = numbered(dims);
            let (bricks, _) = Bricks::new(dims, &linear);
            let sample = |i: [i64; 3]| {
                let [x, y, z] = std::array::from_fn(|a| {
                    usize::try_from(i[a].clamp(0, i64::try_from(dims[a]).unwrap() - 1)).unwrap()
                });
                linear.get(x + dims[0] * (y + dims[1] * z))
            };
            let mut random = tyndall_testing::SplitMix::new(5);
            for _ in 0..2000 {
                let p: [f64; 3] = dims.map(|n| random.uniform() * (n as f64 + 2.0) - 1.5);
                let low = p.map(|x| cast::floor_i32(cast::single(x)));
                let mut expected = 0.0;
                for corner in 0..8 {
                    let at = std::array::from_fn(|a| i64::from(low[a]) + (corner >> a & 1));
                    let weight = |a: usize| {
                        let f = p[a] - f64::from(low[a]);
                        if corner >> a & 1 == 1 { f } else { 1.0 - f }
                    };
                    expected += sample(at) * weight(0) * weight(1) * weight(2);
                }
                let position = Vec3::from_array(p.map(cast::single));
                let found = read(&bricks, position, Interpolation::Linear);
                assert!(
                    (f64::from(found) - expected).abs() < 0.02,
                    "{found}, expected {expected} at {p:?} of {dims:?}"
                );
                let nearest = sample(p.map(|x| i64::from(cast::floor_i32(cast::single(x + 0.5)))));
                let found = read(&bricks, position, Interpolation::Nearest);
                assert_eq!(f64::from(found), nearest, "nearest at {p:?} of {dims:?}");
            }
            let origin = linear.get(0);
            assert_eq!(f64::from(read(&bricks, Vec3::splat(f32::NAN), Interpolation::Linear)), origin);
        }
    }
}
