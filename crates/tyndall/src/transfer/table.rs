//! The opacity as lines in bins: constant time for one value, a few gathers for many.
//!
//! A bin that a single point of the function divides keeps two lines, so jumps stay jumps and, up to rounding, the
//! table equals the function. A bin with several points, or one too steep for single precision, is *rough*: there the
//! function itself is evaluated.
//!
//! Each line also keeps the integral of the opacity up to where it begins, for the mean opacity between two values.

use super::Point;
use super::pre_integrated::{OpacityLanes, OpacityRead, UNITS_PER_BIN};
use crate::math::cast;
use crate::simd::Lanes;
use crate::volume::ValueBins;
use fearless_simd::prelude::*;

/// Slope in opacity per bin above which the rounding of a position, at most 2^-14 of a bin, would be visible.
const STEEPEST: f64 = 8.0;

/// Positions count as at most this far from the bins, so that no difference of positions overflows.
const FARTHEST: f32 = 1e9;

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OpacityTable {
    bins: ValueBins,
    /// Where in its bin the second line begins, from 0 to 1; larger where there is only one line, NaN in rough bins.
    splits: Vec<f32>,
    /// Two lines per bin, each as the opacity where it begins (the bin's lower end or the split) and its rise per bin.
    lines: Vec<f32>,
    /// Twice the integral of the opacity up to where each line begins, in [`UNITS_PER_BIN`]; the first line's is 1 more in bins that have
    /// a split or are rough, which spares other look-ups the split. Whole numbers, summed line by line: the difference of two is that of
    /// the lines between, to the last bit, whatever an edit changes elsewhere.
    areas: Vec<i32>,
    /// Position and opacity of the points, for rough bins.
    knots: Vec<[f64; 2]>,
    any_rough: bool,
}

impl OpacityTable {
    /// The table of points in ascending order, at least one.
    pub(super) fn new(points: &[Point], bins: ValueBins) -> Self {
        // Of several points at one position, the last holds from there on.
        let knots: Vec<[f64; 2]> =
            points.iter().map(|p| [bins.position_beyond(p.value), f64::from(p.optics.opacity)]).collect();
        let mut table = Self {
            bins,
            splits: Vec::new(),
            lines: Vec::new(),
            areas: Vec::new(),
            knots: Vec::new(),
            any_rough: false,
        };
        let mut area = 0;
        // The line after a knot, as one that begins at a position.
        let line = |after: usize, position: f64| -> [f64; 2] {
            let ([x, o], next) = (knots[after], knots.get(after + 1));
            let slope = next.filter(|n| n[0] > x).map_or(0.0, |n| (n[1] - o) / (n[0] - x));
            [o + slope * (position - x), slope]
        };
        for bin in 0..ValueBins::COUNT {
            let lower = bin as f64;
            let start = knots.partition_point(|k| k[0] <= lower);
            let end = knots.partition_point(|k| k[0] < lower + 1.0);
            let below = if start == 0 { [knots[0][1], 0.0] } else { line(start - 1, lower) };
            let after = if start == end { below } else { line(end - 1, lower) };
            // Points within a constant stretch are redundant, and must give the same row as no points.
            let level =
                below[1] == 0.0 && after == below && knots[start..end].iter().all(|k| k[1] == below[0]);
            let positions = if level { &[] } else { &knots[start..end] };
            let split = positions.first().map_or(2.0, |k| k[0] - lower);
            let above = if positions.is_empty() { below } else { line(end - 1, lower + split) };
            let one_place = positions.iter().all(|k| k[0] == positions[0][0]);
            let steep = [below, above].iter().any(|l| l[1].abs() > STEEPEST);
            // Look-ups beyond the outer ends are clamped to them.
            let beyond = match bin {
                0 => &knots[..knots.len().min(start + 1)],
                _ if bin + 1 == ValueBins::COUNT => &knots[start.saturating_sub(1)..],
                _ => &[],
            };
            let outside = if bin == 0 { knots[0][0] < lower } else { knots[knots.len() - 1][0] > lower };
            let varies = outside && beyond.iter().any(|k| k[1] != beyond[0][1]);
            let rough = !one_place || !bins.are_distinct() || steep || varies;
            table.splits.push(if rough { f32::NAN } else { cast::single(split) });
            table.lines.extend([below, above].as_flattened().iter().map(|&x| cast::single(x)));
            table.any_rough |= rough;
            let whole = |area: f64| cast::round_i32(area * f64::from(UNITS_PER_BIN));
            let of_line =
                |[start, slope]: [f64; 2], length: f64| whole(length * (start + 0.5 * slope * length));
            let shares = if rough {
                // Without room between two bins there are no positions to integrate over.
                [if bins.are_distinct() { whole(area_between(&knots, [lower, lower + 1.0])) } else { 0 }, 0]
            } else {
                let split = split.min(1.0);
                [of_line(below, split), of_line(above, 1.0 - split)]
            };
            let has_split = i32::from(rough || split <= 1.0);
            table.areas.extend([2 * area + has_split, 2 * (area + shares[0])]);
            area += shares[0] + shares[1];
        }
        table.knots = knots;
        table
    }

    /// The bins that the table is kept in.
    pub(super) fn bins(&self) -> ValueBins {
        self.bins
    }

    /// Whether look-ups in a bin differ in any bit from those of another table over the same bins, or only one of the
    /// two evaluates the function there.
    pub(super) fn differs(&self, other: &Self, bin: usize) -> bool {
        let row = |table: &Self| {
            let split = table.splits[bin];
            let lines = [0, 1, 2, 3].map(|i| table.lines[4 * bin + i].to_bits());
            (!split.is_nan()).then_some((split.to_bits(), lines))
        };
        row(self) != row(other)
    }

    /// Whether two values, and all values between them, have the same position in the table.
    pub(super) fn confuses(&self, a: f32, b: f32) -> bool {
        let position = self.bins.position(a);
        position == self.bins.position(b) && !self.splits[cast::index(position)].is_nan()
    }

    /// Opacity at a value; `None` in a rough bin.
    #[inline]
    pub(super) fn opacity(&self, value: f32) -> Option<f32> {
        let position = self.bins.position(value);
        let bin = cast::index(position);
        let within = position - bin as f32;
        let split = self.splits[bin];
        if split.is_nan() {
            return None;
        }
        let (line, along) = if within >= split { (4 * bin + 2, within - split) } else { (4 * bin, within) };
        Some((self.lines[line] + self.lines[line + 1] * along).clamp(0.0, 1.0))
    }

    /// A value with its opacity and the integral up to it; `exact` gives the opacity in rough bins.
    #[inline]
    pub(super) fn read(&self, value: f32, exact: impl Fn(f32) -> f32) -> OpacityRead {
        let [half_first, per_half] = self.bins.numbers();
        let position = ((value * 0.5 - half_first) * per_half + 1.0).max(-FARTHEST);
        let position = position.min(FARTHEST);
        let within_bins = self.bins.position(value);
        let bin = cast::index(within_bins);
        let split = self.splits[bin];
        if split.is_nan() {
            let (opacity, part) = (exact(value), self.rough_part(bin, position));
            return OpacityRead { position, opacity, area: self.areas[2 * bin] >> 1, part };
        }
        let within = within_bins - bin as f32;
        let (line, along) = if within >= split { (2 * bin + 1, within - split) } else { (2 * bin, within) };
        let [start, slope] = [self.lines[2 * line], self.lines[2 * line + 1]];
        let opacity = (start + slope * along).clamp(0.0, 1.0);
        let part = along * (start + slope * (0.5 * along)) + opacity * (position - within_bins);
        OpacityRead { position, opacity, area: self.areas[line] >> 1, part }
    }

    /// The integral from where a rough bin begins.
    #[cold]
    fn rough_part(&self, bin: usize, position: f32) -> f32 {
        let [from, to] = [bin as f64, f64::from(position)];
        let area = if to < from {
            -area_between(&self.knots, [to, from])
        } else {
            area_between(&self.knots, [from, to])
        };
        cast::single(area)
    }

    /// [`Self::read`] of a value per lane.
    #[inline(always)]
    pub(super) fn read_lanes<S: Lanes>(
        &self,
        simd: S,
        values: S::f32s,
        exact: impl Fn(f32) -> f32,
    ) -> OpacityLanes<S> {
        let top = S::f32s::splat(simd, (ValueBins::COUNT - 1) as f32);
        let [half_first, per_half] = self.bins.numbers();
        // Without fused operations, so that a value falls on the same side of a jump as in `read`.
        let position: S::f32s = ((values * 0.5 - half_first) * per_half + 1.0).max(-FARTHEST).min(FARTHEST);
        let within_bins: S::f32s = position.max(0.0).min(top);
        let bin: S::i32s = within_bins.to_int();
        let within = within_bins - bin.to_float::<S::f32s>();
        let bin: S::u32s = bin.bitcast();
        let (mut line, mut along) = (bin << 1, within);
        let mut area: S::i32s = simd.words(&self.areas, line).bitcast();
        let mut split = S::f32s::splat(simd, 2.0);
        let is_split = (area & 1).simd_gt(S::i32s::splat(simd, 0));
        if is_split.any_true() {
            split = is_split.select(simd.numbers(&self.splits, bin), split);
            let above = within.simd_ge(split);
            line = above.select(line + 1, line);
            along = above.select(within - split, within);
            area = simd.words(&self.areas, line).bitcast();
        }
        let start = simd.numbers(&self.lines, line << 1);
        let slope = simd.numbers(&self.lines, (line << 1) + 1);
        let opacity = (start + slope * along).max(0.0).min(1.0);
        let part = along * (start + slope * (along * 0.5)) + opacity * (position - within_bins);
        let mut read: OpacityLanes<S> = OpacityLanes { position, opacity, area: area >> 1, part };
        if self.any_rough && split.is_nan().any_true() {
            for lane in 0..S::WIDTH {
                if split.as_slice()[lane].is_nan() {
                    let bin = bin.as_slice()[lane] as usize;
                    read.opacity.as_mut_slice()[lane] = exact(values.as_slice()[lane]);
                    read.part.as_mut_slice()[lane] = self.rough_part(bin, position.as_slice()[lane]);
                }
            }
        }
        read
    }

    /// Opacity at a value per lane; `exact` gives it in rough bins.
    #[inline(always)]
    pub(super) fn opacities<S: Lanes>(
        &self,
        simd: S,
        values: S::f32s,
        exact: impl Fn(f32) -> f32,
    ) -> S::f32s {
        let top = S::f32s::splat(simd, (ValueBins::COUNT - 1) as f32);
        let [half_first, per_half] = self.bins.numbers();
        // Without fused operations, so that a value falls on the same side of a jump as in `position`.
        let position = ((values * 0.5 - half_first) * per_half + 1.0).max(0.0).min(top);
        let bin: S::i32s = position.to_int();
        let within = position - bin.to_float::<S::f32s>();
        let bin: S::u32s = bin.bitcast();
        let split = simd.numbers(&self.splits, bin);
        let above = within.simd_ge(split);
        let line = (bin << 2) + above.select(S::u32s::splat(simd, 2), S::u32s::splat(simd, 0));
        let along = above.select(within - split, within);
        let start = simd.numbers(&self.lines, line);
        let slope = simd.numbers(&self.lines, line + 1);
        let mut opacities = (start + slope * along).max(0.0).min(1.0);
        if self.any_rough && split.is_nan().any_true() {
            for lane in 0..S::WIDTH {
                if split.as_slice()[lane].is_nan() {
                    opacities.as_mut_slice()[lane] = exact(values.as_slice()[lane]);
                }
            }
        }
        opacities
    }
}

/// The integral of the piecewise linear function through knots, constant beyond their ends, between two positions that ascend.
fn area_between(knots: &[[f64; 2]], [from, to]: [f64; 2]) -> f64 {
    let opacity = |position: f64| -> f64 {
        let after = knots.partition_point(|k| k[0] <= position);
        match (after.checked_sub(1).map(|i| knots[i]), knots.get(after)) {
            (Some([x, o]), Some(&[y, p])) => o + (p - o) * (position - x) / (y - x),
            (Some([_, o]), None) | (None, Some(&[_, o])) => o,
            (None, None) => 0.0,
        }
    };
    let inside = knots.iter().copied().filter(|k| from < k[0] && k[0] < to);
    // The end itself, should a jump be there, as it is just below it.
    let before = knots.partition_point(|k| k[0] < to);
    let at_end = match (before.checked_sub(1).map(|i| knots[i]), knots.get(before)) {
        (Some([x, o]), Some(&[y, p])) => o + (p - o) * (to - x) / (y - x),
        _ => opacity(to),
    };
    let mut area = 0.0;
    let mut last = [from, opacity(from)];
    for knot in inside.chain([[to, at_end]]) {
        area += 0.5 * (knot[0] - last[0]) * (knot[1] + last[1]);
        last = knot;
    }
    area
}

#[cfg(test)]
mod tests {
    use super::super::{Optics, TransferFunction};
    use super::*;
    use crate::simd::{Kernel, Level};
    use tyndall_testing::SplitMix;

    fn function(points: &[(f32, f32)]) -> TransferFunction {
        let point = |&(value, opacity)| Point { value, optics: Optics { opacity, ..Optics::default() } };
        TransferFunction::new(points.iter().map(point).collect()).unwrap()
    }

    fn over(range: [f32; 2], points: &[(f32, f32)]) -> TransferFunction {
        TransferFunction::over(ValueBins::new(range), function(points).points().to_vec()).unwrap()
    }

    fn functions() -> Vec<TransferFunction> {
        let mut random = SplitMix::new(9);
        // Steps of 1/8 as in 8-bit data, jumps at data values, and points too near each other for the bins.
        let close: Vec<_> = (0..60_u8).map(|i| (1.0 + f32::from(i) * 1e-5, f32::from(i % 5) / 4.0)).collect();
        let mut many: Vec<_> =
            (0..300).map(|_| (cast::single(random.uniform()), cast::single(random.uniform()))).collect();
        many.sort_by(|a, b| a.0.total_cmp(&b.0));
        vec![
            function(&[(5.0, 0.3)]),
            function(&[(0.0, 0.0), (255.0, 1.0)]),
            function(&[(0.5, 0.2), (0.5, 0.9)]),
            function(&[(-1000.0, 0.0), (150.0, 0.0), (150.0, 0.7), (151.0, 0.1), (3000.0, 1.0)]),
            function(&[&[(-3.0, 0.5)], &close[..], &[(7.0, 0.5)]].concat()),
            function(&many),
            function(&[(-3e38, 0.0), (0.0, 1.0), (3e38, 0.5)]),
            // Over bins of data that the points extend past on both sides, on one, or miss altogether.
            over([0.25, 0.75], &[(-1.0, 0.9), (0.3, 0.1), (0.5, 0.6), (2.0, 0.2), (3.0, 1.0)]),
            over([0.25, 0.75], &[(0.5, 0.0), (0.7, 0.5), (9.0, 0.5)]),
            over([0.25, 0.75], &[(1.0, 0.2), (1.5, 0.8), (1.5, 0.1)]),
            over([0.25, 0.75], &[(-1.0, 0.2), (-0.5, 0.8)]),
            over([1.0, 1.0], &[(0.0, 0.2), (2.0, 0.8)]),
        ]
    }

    /// Values at the points, and across their range and beyond.
    fn values(function: &TransferFunction) -> Vec<f32> {
        let ends = [0, function.points().len() - 1].map(|i| function.points()[i].value);
        let middle = 0.5 * ends[0] + 0.5 * ends[1];
        let reach = (0.6 * ends[1] - 0.6 * ends[0]).max(1.0);
        let across = (0..20_000).map(|i| middle + reach * (i as f32 / 10_000.0 - 1.0));
        function.points().iter().map(|p| p.value).chain(across).filter(|v| v.is_finite()).collect()
    }

    #[test]
    fn the_table_is_the_function_but_for_rounding() {
        for (number, function) in functions().iter().enumerate() {
            for v in values(function) {
                let (found, exact) = (function.opacity(v), function.optics(v).opacity);
                assert!((found - exact).abs() < 1e-3, "{found}, exactly {exact} at {v} of function {number}");
            }
        }
    }

    #[test]
    fn no_value_of_a_range_leaves_its_bounds() {
        let mut random = SplitMix::new(3);
        for function in functions() {
            let values = values(&function);
            for _ in 0..2000 {
                let mut pick = || {
                    values[cast::index(cast::single(random.uniform() * values.len() as f64))
                        .min(values.len() - 1)]
                };
                let (a, b, t) = (pick(), pick(), cast::single(random.uniform()));
                let [lo, hi] = [a.min(b), a.max(b)];
                let [least, most] = function.opacity_range([lo, hi]);
                for v in [lo, hi, (lo * (1.0 - t) + hi * t).clamp(lo, hi)] {
                    let o = function.opacity(v);
                    assert!(
                        least - 1e-6 <= o && o <= most + 1e-6,
                        "{o} at {v} outside [{least}, {most}] of [{lo}, {hi}]"
                    );
                }
            }
        }
    }

    struct Opacities<'a>(&'a TransferFunction, &'a [f32]);

    impl Kernel for Opacities<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<f32> {
            let of = |values: &[f32]| self.0.opacity_lanes(simd, S::f32s::from_slice(simd, values));
            self.1.chunks_exact(S::WIDTH).flat_map(|values| of(values).as_slice().to_vec()).collect()
        }
    }

    #[test]
    fn every_level_gives_the_scalar_opacity() {
        for function in functions() {
            let mut values = values(&function);
            values.truncate(values.len() / 16 * 16);
            for level in Level::available() {
                let found = level.run(Opacities(&function, &values));
                for (&v, found) in values.iter().zip(found) {
                    let expected = function.opacity(v);
                    assert!(
                        (found - expected).abs() < 1e-6,
                        "{found}, expected {expected} at {v} with {level:?}"
                    );
                }
            }
        }
    }
}
