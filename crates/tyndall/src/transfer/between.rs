//! What lies between two data values: pre-integrated classification \[Engel01\].
//!
//! Where values change linearly from one sample to the next, the mean opacity between the two is the difference of the
//! opacity's integrals over the difference of the values, however narrow the function's peaks are.

use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Values nearer to each other than this share of a bin have the mean of their opacities, since a quotient of such small
/// differences would be rounding error.
const NEAR: f32 = 0.25;

/// Values more bins apart than this, a thousand times the data's range, are an edge: of data without a value, or of what
/// a program filled in. Nothing that can be seen lies between.
const EDGE: f32 = 1e6;

/// From `area`, of which a bin of opacity 1 has a million, to bins.
const BINS_PER_UNIT: f32 = 1e-6;

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

    /// Mean opacity of all values between `self` and `to`.
    #[inline(always)]
    pub fn mean(self, simd: S, to: Self) -> S::f32s {
        let apart = to.position - self.position;
        let far = apart.abs();
        let pass = far.simd_ge(S::f32s::splat(simd, NEAR)) & far.simd_le(S::f32s::splat(simd, EDGE));
        let area = (to.area - self.area).to_float::<S::f32s>() * BINS_PER_UNIT + (to.part - self.part);
        let mean = area / pass.select(apart, S::f32s::splat(simd, 1.0));
        pass.select(mean.max(0.0).min(1.0), (self.opacity + to.opacity) * 0.5)
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
    /// Whether the values between are too few, or the values are an edge.
    fn is_abrupt(self, to: Self) -> [bool; 2] {
        let far = (to.position - self.position).abs();
        [far < NEAR, far > EDGE]
    }

    /// The integral from here.
    fn area_to(self, to: Self) -> f32 {
        (to.area - self.area) as f32 * BINS_PER_UNIT + (to.part - self.part)
    }

    /// Mean opacity of all values between `self` and `to`.
    pub fn mean(self, to: Self) -> f32 {
        match self.is_abrupt(to) {
            [false, false] => (self.area_to(to) / (to.position - self.position)).clamp(0.0, 1.0),
            _ => 0.5 * (self.opacity + to.opacity),
        }
    }
}

/// A place on the way from one value to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Between {
    /// Share of the way.
    pub share: f32,
    /// Data value there.
    pub value: f32,
}

impl Between {
    /// Where a share of the opacity met on the way has been met.
    pub(super) fn of_share(values: [f32; 2], share: f32, read: impl Fn(f32) -> OpacityRead) -> Self {
        let [from, to] = values.map(&read);
        match from.is_abrupt(to) {
            [_, true] => Self::beside(values, [from.opacity, to.opacity], 0.5, share),
            [true, _] => Self::on_the_way(values, share_of_line([from.opacity, to.opacity], share)),
            _ => Self::on_the_way(values, search(values, [from, to], share, read)),
        }
    }

    /// Where that is if the first value holds up to `border`, a share of the way, and the second after it.
    pub fn beside([from, to]: [f32; 2], opacities: [f32; 2], border: f32, share: f32) -> Self {
        let [first, second] = [opacities[0] * border, opacities[1] * (1.0 - border)];
        let wanted = share * (first + second);
        if wanted < first || second <= 0.0 {
            Self { share: if first > 0.0 { border * (wanted / first) } else { share }, value: from }
        } else {
            Self { share: border + (1.0 - border) * ((wanted - first) / second), value: to }
        }
    }

    fn on_the_way([from, to]: [f32; 2], share: f32) -> Self {
        // Without a difference that might overflow.
        Self { share, value: from * (1.0 - share) + to * share }
    }
}

/// The share of the way on which a share of the opacity is met, where opacity changes linearly: the root of a quadratic.
#[inline]
fn share_of_line([a, b]: [f32; 2], share: f32) -> f32 {
    let root = (a * a + share * (b * b - a * a)).max(0.0).sqrt();
    let sum = a + root;
    if sum > 0.0 { (share * (a + b) / sum).min(1.0) } else { share }
}

/// The share of the way on which a share of the opacity is met: Newton's method, which knows the derivative, the opacity;
/// halvings where it would leave the interval.
#[inline]
fn search(
    values: [f32; 2],
    [from, to]: [OpacityRead; 2],
    share: f32,
    read: impl Fn(f32) -> OpacityRead,
) -> f32 {
    let total = from.area_to(to);
    let bins = to.position - from.position;
    let (mut lo, mut hi) = (0.0, 1.0);
    let mut at = share_of_line([from.opacity, to.opacity], share);
    for _ in 0..MOST_TRIES {
        let here = read(Between::on_the_way(values, at).value);
        // Both areas are negative where values fall.
        let missing = share - from.area_to(here) / total;
        if missing.abs() < SURE * share.min(1.0 - share) {
            break;
        }
        if missing > 0.0 {
            lo = at;
        } else {
            hi = at;
        }
        let next = at + missing * total / (here.opacity * bins);
        at = if next > lo && next < hi { next } else { 0.5 * (lo + hi) };
    }
    at
}

/// Tries in the search, enough for halvings to find a place in single precision, and when a place is near enough: within
/// this part of the opacity before or behind it.
const MOST_TRIES: usize = 24;
const SURE: f32 = 2e-3;

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

    #[test]
    fn a_share_of_the_opacity_is_met_where_it_is_said() {
        for (number, function) in functions().iter().enumerate() {
            for [from, to] in pairs() {
                let whole = function.mean_opacity([from, to]) * (to - from);
                if (to - from).abs() < 1.0 || whole.abs() < 1e-2 {
                    continue;
                }
                for share in [0.01, 0.5, 0.9] {
                    let place = function.between([from, to], share);
                    let met = function.mean_opacity([from, place.value]) * (place.value - from) / whole;
                    let near = if (place.value - from).abs() < 0.25 { 0.1 } else { 5e-3 };
                    assert!((met - share).abs() < near, "{met} for {share} from {from} to {to} of {number}");
                }
            }
        }
    }
}
