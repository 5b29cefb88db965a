//! Statistics of all samples: ranges and histogram.

use super::voxels::with_voxels;
use super::{Bricks, ValueMap, Voxel, Voxels};
use crate::math::cast;
use rayon::prelude::*;

/// Samples per parallel piece: large enough to hide the cost of handing it out.
const PIECE: usize = 1 << 18;

/// Counts of data values in equal bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Lower end of the first bin, upper end of the last.
    pub range: [f64; 2],
    /// Samples per bin; they add up to the number of voxels with data.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// # Panics
    /// If `bins` is zero.
    ///
    /// Samples that are `filler` stand for no data and are not counted.
    pub(super) fn new(
        bricks: &Bricks,
        values: ValueMap,
        filler: Option<f64>,
        range: [f64; 2],
        bins: usize,
    ) -> Self {
        assert!(bins > 0, "a histogram needs a bin");
        let scale = if range[1] > range[0] { bins as f64 / (range[1] - range[0]) } else { 0.0 };
        let bin = |stored: f64| {
            let x = (values.apply(stored) - range[0]) * scale;
            cast::index(cast::single(x.clamp(0.0, bins as f64))).min(bins - 1)
        };
        let count = |counts: &mut Vec<u64>, stored: f64| {
            if filler != Some(stored) {
                counts[bin(stored)] += 1;
            }
        };
        let counts = bricks.fold(|| vec![0_u64; bins], count, add);
        Self { range, counts }
    }

    /// The value below which a share `q` of the samples lies, linear within its bin.
    #[must_use]
    pub fn quantile(&self, q: f64) -> f64 {
        let total: u64 = self.counts.iter().sum();
        let wanted = q.clamp(0.0, 1.0) * total as f64;
        let width = (self.range[1] - self.range[0]) / self.counts.len() as f64;
        let mut below = 0.0;
        for (i, &n) in self.counts.iter().enumerate() {
            let n = n as f64;
            if n > 0.0 && below + n >= wanted {
                return self.range[0] + width * (i as f64 + (wanted - below) / n);
            }
            below += n;
        }
        self.range[1]
    }
}

fn add(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    for (x, y) in a.iter_mut().zip(b) {
        *x += y;
    }
    a
}

/// Exact smallest and largest data value of samples that are not `filler`; zeros if there are none.
pub(super) fn value_range(voxels: &Voxels, values: ValueMap, filler: Option<f64>) -> [f64; 2] {
    fn extremes<T: Voxel>(data: &[T], filler: Option<f64>) -> Option<[f64; 2]> {
        let pair = |[a, b]: [T; 2], [c, d]: [T; 2]| [if c < a { c } else { a }, if d > b { d } else { b }];
        let piece = |p: &[T]| {
            let first = p.iter().copied().find(|v| filler != Some(v.to_f64()))?;
            // What is no data is below all data, or above with a negative slope, so it may not take part.
            let own = |&v: &T| if filler == Some(v.to_f64()) { first } else { v };
            Some(p.iter().map(own).fold([first; 2], |range, v| pair(range, [v, v])))
        };
        let pieces = data.par_chunks(PIECE).filter_map(piece);
        pieces.reduce_with(pair).map(|range| range.map(Voxel::to_f64))
    }
    let Some(range) = with_voxels!(voxels, data => extremes(data, filler)) else { return [0.0; 2] };
    let [a, b] = range.map(|v| values.apply(v));
    [a.min(b), a.max(b)]
}

/// Share of the samples cut off at each end of the robust range.
const OUTLIERS: f64 = 0.001;

/// At most twice this many samples, evenly strided, decide the robust range: their quantiles are within
/// 0.01 % of the share, and sorting them takes negligible time compared to loading.
const SURVEYED: usize = 1 << 20;

/// Quantiles [`OUTLIERS`] and 1 - [`OUTLIERS`]; the exact range where they coincide.
pub(super) fn robust_range(
    voxels: &Voxels,
    values: ValueMap,
    filler: Option<f64>,
    exact: [f64; 2],
) -> [f64; 2] {
    // An odd stride does not stay in step with rows of even length.
    let stride = (voxels.len() / SURVEYED).max(1) | 1;
    let mut surveyed: Vec<f64> =
        with_voxels!(voxels, data => data.iter().step_by(stride).map(|v| v.to_f64()).collect());
    surveyed.retain(|&stored| filler != Some(stored));
    surveyed.iter_mut().for_each(|stored| *stored = values.apply(*stored));
    let Some(last) = surveyed.len().checked_sub(1) else { return exact };
    let cut = cast::index(cast::single(OUTLIERS * surveyed.len() as f64)).min(last / 2);
    let mut at = |i: usize| *surveyed.select_nth_unstable_by(i, f64::total_cmp).1;
    let range = [at(cut), at(last - cut)];
    if range[0] < range[1] { range } else { exact }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_ruins_the_exact_range_only() {
        let mut data: Vec<f32> = (0..10_000).map(|i| (i % 100) as f32).collect();
        data[77] = 1e9;
        let voxels = Voxels::F32(data);
        let exact = value_range(&voxels, ValueMap::IDENTITY, None);
        assert_eq!(exact, [0.0, 1e9]);
        assert_eq!(robust_range(&voxels, ValueMap::IDENTITY, None, exact), [0.0, 99.0]);
    }

    #[test]
    fn a_negative_slope_turns_the_range_around() {
        let voxels = Voxels::U8(vec![1, 2, 5]);
        assert_eq!(value_range(&voxels, ValueMap { slope: -2.0, intercept: 1.0 }, None), [-9.0, -1.0]);
    }

    #[test]
    fn counts_add_up_and_quantiles_follow() {
        let (thousand, _) = Bricks::new([1000, 1, 1], &Voxels::U16((0..1000).collect()));
        let h = Histogram::new(&thousand, ValueMap::IDENTITY, None, [0.0, 1000.0], 10);
        assert_eq!(h.counts, vec![100; 10]);
        assert!((h.quantile(0.25) - 250.0).abs() < 1e-9);
        let (three, _) = Bricks::new([1, 3, 1], &Voxels::U8(vec![4; 3]));
        let flat = Histogram::new(&three, ValueMap::IDENTITY, None, [4.0, 4.0], 4);
        assert_eq!(flat.counts, vec![3, 0, 0, 0]);
    }
}
