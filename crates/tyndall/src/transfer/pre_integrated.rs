//! What lies between two data values: pre-integrated classification \[Engel01\].
//!
//! Where values change linearly from one sample to the next, the mean opacity between the two is the difference of the
//! opacity's integrals over the difference of the values, however narrow the function's peaks are.

use super::{Point, TransferFunction};
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Values nearer to each other than this share of a bin have the mean of their opacities, since a quotient of such small
/// differences would be rounding error.
const NEAR: f32 = 0.25;

/// Values more bins apart than this, a thousand times the data's range, are an edge: of data without a value, or of what
/// a program filled in. Nothing that can be seen lies between.
const EDGE: f32 = 1e6;

/// From units of `area` to bins of opacity 1.
const BINS_PER_UNIT: f32 = 1.0 / UNITS_PER_BIN;

/// Units of area in a bin of opacity 1: all bins together, twice, fit 32 bits with a sign.
pub(super) const UNITS_PER_BIN: f32 = 1e6;

/// A value per lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OpacityLanes<S: Lanes> {
    /// In bins, also far beyond them.
    pub position: S::f32s,
    pub opacity: S::f32s,
    /// The integral up to the beginning of the value's line in the table, and from there.
    pub area: S::i32s,
    pub part: S::f32s,
}

impl<S: Lanes> OpacityLanes<S> {
    /// Of the value 0 with no opacity, to be replaced.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        Self { position: zero, opacity: zero, area: S::i32s::splat(simd, 0), part: zero }
    }

    /// `self` in some lanes, `other` in the rest.
    #[inline(always)]
    pub fn or(self, lanes: S::mask32s, other: Self) -> Self {
        Self {
            position: lanes.select(self.position, other.position),
            opacity: lanes.select(self.opacity, other.opacity),
            area: lanes.select(self.area, other.area),
            part: lanes.select(self.part, other.part),
        }
    }

    /// Each lane's successor; that of the last is the first of `other`.
    #[inline(always)]
    pub fn successors(self, other: Self) -> Self {
        Self {
            position: self.position.slide::<1>(other.position),
            opacity: self.opacity.slide::<1>(other.opacity),
            area: self.area.slide::<1>(other.area),
            part: self.part.slide::<1>(other.part),
        }
    }

    /// Whether the two are an edge, between which nothing lies.
    #[inline(always)]
    pub fn is_edge(self, simd: S, to: Self) -> S::mask32s {
        (to.position - self.position).abs().simd_gt(S::f32s::splat(simd, EDGE))
    }

    /// Whether the mean of all values between `self` and `to` is that of the two: they are too near to each other for a quotient of
    /// differences, or an edge.
    #[inline(always)]
    pub fn has_no_quotient(self, simd: S, to: Self) -> S::mask32s {
        let far = (to.position - self.position).abs();
        far.simd_lt(S::f32s::splat(simd, NEAR)) | far.simd_gt(S::f32s::splat(simd, EDGE))
    }

    /// The integral of the opacity from `self` to `to`, in bins.
    #[inline(always)]
    pub fn area_to(self, to: Self) -> S::f32s {
        (to.area - self.area).to_float::<S::f32s>() * BINS_PER_UNIT + (to.part - self.part)
    }

    /// Mean opacity of all values between `self` and `to`.
    #[inline(always)]
    pub fn mean(self, simd: S, to: Self) -> S::f32s {
        let alone = self.has_no_quotient(simd, to);
        let apart = alone.select(S::f32s::splat(simd, 1.0), to.position - self.position);
        let mean = self.area_to(to) / apart;
        alone.select((self.opacity + to.opacity) * 0.5, mean.max(0.0).min(1.0))
    }
}

/// One value; see [`OpacityLanes`].
#[derive(Clone, Copy, Debug)]
pub(super) struct OpacityRead {
    pub position: f32,
    pub opacity: f32,
    pub area: i32,
    pub part: f32,
}

impl OpacityRead {
    /// Whether the two are an edge, between which nothing lies.
    pub fn is_edge(self, to: Self) -> bool {
        (to.position - self.position).abs() > EDGE
    }

    /// Whether they are too near to each other for a quotient of differences.
    fn is_near(self, to: Self) -> bool {
        (to.position - self.position).abs() < NEAR
    }

    /// The integral from here.
    fn area_to(self, to: Self) -> f32 {
        (to.area - self.area) as f32 * BINS_PER_UNIT + (to.part - self.part)
    }

    /// Mean opacity of all values between `self` and `to`.
    pub fn mean(self, to: Self) -> f32 {
        if self.is_edge(to) || self.is_near(to) {
            return 0.5 * (self.opacity + to.opacity);
        }
        (self.area_to(to) / (to.position - self.position)).clamp(0.0, 1.0)
    }
}

/// See [`TransferFunction::narrowest_peak`].
pub(super) fn narrowest_peak(points: &[Point]) -> f32 {
    let mut narrowest = f32::INFINITY;
    let mut last_rise = None;
    for pair in points.windows(2) {
        let (from, to) = (pair[0].optics.opacity, pair[1].optics.opacity);
        if to > from {
            last_rise = Some(pair[0].value);
        } else if to < from
            && let Some(start) = last_rise.take()
        {
            narrowest = narrowest.min(pair[1].value - start);
        }
    }
    narrowest
}

impl TransferFunction {
    /// Opacity and its integral at a value per lane.
    #[inline(always)]
    pub(crate) fn read_lanes<S: Lanes>(&self, simd: S, values: S::f32s) -> OpacityLanes<S> {
        self.opacities.read_lanes(simd, values, |value| self.exact_opacity(value))
    }

    /// Mean opacity of all data values between two.
    #[must_use]
    pub fn mean_opacity(&self, values: [f32; 2]) -> f32 {
        let [from, to] = values.map(|value| self.read(value));
        from.mean(to)
    }

    /// Whether two data values are so far apart that nothing lies between: an edge.
    pub(crate) fn is_edge(&self, values: [f32; 2]) -> bool {
        let [from, to] = values.map(|value| self.read(value));
        from.is_edge(to)
    }

    fn read(&self, value: f32) -> OpacityRead {
        self.opacities.read(value, |value| self.exact_opacity(value))
    }

    /// Width, in data values, of the narrowest stretch in which opacity rises and falls, from point to point; infinite if it does so
    /// nowhere.
    pub(crate) fn narrowest_peak(&self) -> f32 {
        self.narrowest_peak
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Optics, Point, TransferFunction};
    use crate::math::cast;
    use crate::simd::{Kernel, Lanes, Level};
    use crate::volume::ValueBins;
    use fearless_simd::prelude::*;
    use tyndall_testing::SplitMix;

    /// Ramps, jumps, peaks narrower than a bin, and points crowded in one.
    fn functions() -> Vec<TransferFunction> {
        let mut random = SplitMix::new(31);
        let function = |points: &[(f32, f32)]| {
            let point = |&(value, opacity)| Point { value, optics: Optics { opacity, ..Optics::default() } };
            TransferFunction::over(ValueBins::new([0.0, 1024.0]), points.iter().map(point).collect()).unwrap()
        };
        let mut many: Vec<(f32, f32)> = (0..300)
            .map(|_| (1100.0 * cast::single(random.uniform()) - 40.0, cast::single(random.uniform())))
            .collect();
        many.sort_by(|a, b| a.0.total_cmp(&b.0));
        vec![
            function(&[(0.0, 0.0), (1024.0, 1.0)]),
            function(&[(100.0, 0.0), (300.5, 0.0), (300.5, 0.7), (310.0, 0.2), (310.0, 0.0)]),
            function(&[(500.1, 0.0), (500.2, 1.0), (500.3, 0.0)]),
            function(&[(200.0, 0.001), (400.0, 0.002)]),
            function(&many),
        ]
    }

    fn pairs() -> Vec<[f32; 2]> {
        let mut random = SplitMix::new(32);
        let mut uniform = || cast::single(random.uniform());
        (0..1600)
            .map(|i| {
                let from = 1100.0 * uniform() - 40.0;
                let reach = [0.1, 1.0, 10.0, 300.0][i % 4];
                [from, from + reach * (2.0 * uniform() - 1.0)]
            })
            .collect()
    }

    /// The mean by a sum over many values between.
    fn by_definition(function: &TransferFunction, [from, to]: [f32; 2]) -> f64 {
        const VALUES: u16 = 20_000;
        let [from, to] = [f64::from(from), f64::from(to)];
        let value = |i: u16| cast::single(from + (to - from) * (f64::from(i) + 0.5) / f64::from(VALUES));
        (0..VALUES).map(|i| f64::from(function.exact_opacity(value(i)))).sum::<f64>() / f64::from(VALUES)
    }

    struct Means<'a>(&'a TransferFunction, &'a [[f32; 2]]);

    impl Kernel for Means<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Vec<f32> {
            let Self(function, pairs) = self;
            let of = |pairs: &[[f32; 2]], end: usize| {
                function.read_lanes(simd, S::f32s::from_fn(simd, |lane| pairs[lane][end]))
            };
            let means = |pairs: &[[f32; 2]]| of(pairs, 0).mean(simd, of(pairs, 1)).as_slice().to_vec();
            pairs.chunks_exact(S::WIDTH).flat_map(means).collect()
        }
    }

    #[test]
    fn the_mean_is_that_of_all_values_between() {
        let pairs = pairs();
        for (number, function) in functions().iter().enumerate() {
            let scalar: Vec<f32> = pairs.iter().map(|&values| function.mean_opacity(values)).collect();
            for (&[from, to], &found) in pairs.iter().zip(&scalar) {
                let expected = by_definition(function, [from, to]);
                // Nearer values have the mean of their opacities, which misses what a jump or a peak between adds.
                let tolerance =
                    if (to - from).abs() < 0.26 { 1.0 } else { 2e-4 / f64::from((to - from).abs()).min(1.0) };
                let off = (f64::from(found) - expected).abs();
                assert!(
                    off < tolerance,
                    "{found}, expected {expected} from {from} to {to} of function {number}"
                );
            }
            for level in Level::available() {
                for (lanes, scalar) in level.run(Means(function, &pairs)).iter().zip(&scalar) {
                    assert!(
                        (lanes - scalar).abs() < 1e-5,
                        "{lanes}, {scalar} of function {number}, {level:?}"
                    );
                }
            }
        }
    }
}
