//! Reading the field at a small block of positions, with each sample read once.

use super::Voxel;
use super::bricks::{Lattice, mix};
use crate::math::cast;

/// One axis of a block of positions, see [`Lattice::linear_block`].
struct BlockAxis {
    /// Number of positions.
    count: usize,
    /// Of each the sample below, among those read, and the fraction to the next; entries past `count` repeat the last.
    positions: [(usize, f32); 4],
    /// Number of samples read, and their memory offsets along the axis; entries past that number repeat the last.
    samples: usize,
    offsets: [usize; 5],
}

impl BlockAxis {
    fn new(lattice: &Lattice, a: usize, at: &[f32]) -> Self {
        let lower_and_fraction = |x: f32| {
            let x = x.max(0.0).min(lattice.last[a]);
            let lower = cast::truncate(x).min(lattice.lower[a]);
            (lower, x - lower as f32)
        };
        let last = at.len() - 1;
        let lowers = [0, 1, 2, 3].map(|i| lower_and_fraction(at[i.min(last)]));
        let first = lowers[0].0;
        let positions = lowers.map(|(lower, f)| ((lower - first).cast_unsigned() as usize, f));
        let samples = positions[3].0 + 2;
        let offset = |i: usize| {
            let sample = first + cast::fit_u32(i.min(samples - 1)).cast_signed();
            let lower = sample.min(lattice.lower[a]);
            lattice.along(a, lower) + if sample > lower { lattice.step[a] } else { 0 }
        };
        Self { count: at.len(), positions, samples, offsets: [0, 1, 2, 3, 4].map(offset) }
    }
}

impl Lattice {
    /// The field at all combinations of up to four ascending coordinates per axis, at most 1 apart, x fastest: equal to
    /// [`Self::linear`] at each, to the last bit, with each sample read once.
    pub(super) fn linear_block<T: Voxel>(&self, samples: &[T], axes: [&[f32]; 3], out: &mut [f32]) {
        let axes = [0, 1, 2].map(|a| BlockAxis::new(self, a, axes[a]));
        let [x, y, z] = &axes;
        // Interpolated along x, then y, then z, as for single positions.
        let mut rows = [[[0.0_f32; 4]; 5]; 5];
        for (k, &z) in z.offsets[..z.samples].iter().enumerate() {
            for (j, &y) in y.offsets[..y.samples].iter().enumerate() {
                let row = x.offsets.map(|x| samples[x + y + z].to_f32());
                rows[k][j] = x.positions.map(|(i, f)| mix(row[i], row[i + 1], f));
            }
        }
        let mut planes = [[[0.0_f32; 4]; 4]; 5];
        for (plane, rows) in planes.iter_mut().zip(&rows).take(z.samples) {
            for (row, &(j, f)) in plane.iter_mut().zip(&y.positions) {
                for (value, (&a, &b)) in row.iter_mut().zip(rows[j].iter().zip(&rows[j + 1])) {
                    *value = mix(a, b, f);
                }
            }
        }
        let mut out = out.iter_mut();
        for &(k, f) in &z.positions[..z.count] {
            let pairs = planes[k].iter().zip(&planes[k + 1]).take(y.count);
            for (near, far) in pairs {
                let values = near.iter().zip(far).take(x.count).map(|(&near, &far)| mix(near, far, f));
                // In this order: a `zip` that ends has taken one more item from its first iterator.
                values.zip(out.by_ref()).for_each(|(value, out)| *out = value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::math::{Vec3, cast};
    use crate::volume::voxels::with_voxels;
    use crate::volume::{Bricks, Interpolation, Voxels};

    #[test]
    fn a_block_reads_what_single_positions_read() {
        for dims in [[3, 4, 5], [9, 8, 10], [17, 1, 25], [1, 1, 1], [1, 30, 2], [26, 9, 16]] {
            let count = cast::fit_u32(dims.iter().product());
            let numbered = Voxels::U32((0..count).map(|i| i.wrapping_mul(2_654_435_761) >> 20).collect());
            let (bricks, _) = Bricks::new(dims, &numbered);
            let read = |p: Vec3| with_voxels!(bricks.samples(), data => bricks.lattice().read(data, p, Interpolation::Linear));
            let starts = |n: usize| (0..n).map(|i| i as f32).chain([-0.5, 0.25, n as f32 - 2.5]);
            for (x, y, z) in
                starts(dims[0]).flat_map(|x| starts(dims[1]).map(move |y| (x, y, x * 0.5 + y * 0.3)))
            {
                for count in [1, 3, 4] {
                    let along = |start: f32| (0..count).map(|i| start + 0.5 + i as f32).collect::<Vec<_>>();
                    let [xs, ys, zs] = [along(x), along(y), along(z)];
                    let mut found = vec![0.0; count * count * count];
                    with_voxels!(bricks.samples(), data => {
                        bricks.lattice().linear_block(data, [&xs, &ys, &zs], &mut found);
                    });
                    let mut found = found.iter();
                    for &z in &zs {
                        for &y in &ys {
                            for &x in &xs {
                                let expected = read(Vec3::new(x, y, z));
                                assert_eq!(found.next(), Some(&expected), "{x} {y} {z} of {dims:?}");
                            }
                        }
                    }
                }
            }
        }
    }
}
