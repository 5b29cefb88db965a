//! The integral of opacity over data values, for matter between two samples.

use super::Point;
use crate::math::cast;
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Tabulated integral of a function's opacity over data values. Where values change linearly, the mean opacity between two of them is the
/// difference of their integrals over their distance, however narrow the function's peaks are \[Engel01\].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OpacityIntegral {
    first: f32,
    per_value: f32,
    /// The integral up to each entry, in units of the distance between entries.
    table: Vec<f32>,
}

/// Intervals of the table.
const INTERVALS: usize = 4096;

impl OpacityIntegral {
    /// Over a range of values; beyond it the opacity counts as that at its ends.
    pub fn new(points: &[Point], [first, last]: [f32; 2], opacity: impl Fn(f32) -> f32) -> Self {
        let span = f64::from(last) - f64::from(first);
        let width = if span > 0.0 { span / INTERVALS as f64 } else { 1.0 };
        let value = |i: usize| f64::from(first) + width * i as f64;
        let mut table = vec![0.0];
        let mut sum = 0.0;
        for i in 0..INTERVALS {
            // Piecewise linear: trapezoids between the interval's ends and the points inside it.
            let (from, to) = (value(i), value(i + 1));
            let inside = points.iter().filter(|p| (from..to).contains(&f64::from(p.value)) && f64::from(p.value) > from);
            let knots = inside.map(|p| (f64::from(p.value), f64::from(p.optics.opacity)));
            let mut last = (from, f64::from(opacity(cast::single(from))));
            for knot in knots.chain([(to, f64::from(opacity(cast::single(to).next_down())))]) {
                sum += 0.5 * (knot.0 - last.0) * (knot.1 + last.1) / width;
                last = knot;
            }
            table.push(cast::single(sum));
        }
        Self { first, per_value: cast::single(1.0 / width), table }
    }

    /// Data values per unit of the integral.
    pub fn unit(&self) -> f64 {
        1.0 / f64::from(self.per_value)
    }

    /// The integral up to a value.
    #[inline(always)]
    pub fn up_to(&self, value: f32) -> f32 {
        let position = ((value - self.first) * self.per_value).clamp(0.0, INTERVALS as f32);
        let entry = cast::index(position).min(INTERVALS - 1);
        let (a, b) = (self.table[entry], self.table[entry + 1]);
        a + (b - a) * (position - entry as f32)
    }

    /// The position of a value per lane, and the integral up to it.
    #[inline(always)]
    pub fn at<S: Lanes>(&self, simd: S, values: S::f32s) -> IntegralLanes<S> {
        let position = ((values - self.first) * self.per_value).max(0.0).min(INTERVALS as f32);
        let entry: S::i32s = position.min(INTERVALS as f32 - 0.5).to_int();
        let share = position - entry.to_float::<S::f32s>();
        let entry: S::u32s = entry.bitcast();
        let (a, b) = (simd.numbers(&self.table, entry), simd.numbers(&self.table, entry + 1));
        IntegralLanes { position, integral: (b - a).mul_add(share, a), opacity: b - a }
    }
}

/// A value and the integral up to it, per lane, in units of the table's intervals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntegralLanes<S: Lanes> {
    pub position: S::f32s,
    pub integral: S::f32s,
    /// Mean over the interval of the table that the value is in.
    opacity: S::f32s,
}

impl<S: Lanes> IntegralLanes<S> {
    /// Mean opacity between this value and that of another position and integral; that at this value where the other position is NaN.
    #[inline(always)]
    pub fn mean_since(self, simd: S, [position, integral]: [S::f32s; 2]) -> S::f32s {
        let apart = self.position - position;
        // False for NaN.
        let is_far = apart.abs().simd_gt(S::f32s::splat(simd, 1.0));
        let mean = (self.integral - integral) / is_far.select(apart, S::f32s::splat(simd, 1.0));
        is_far.select(mean, self.opacity).max(0.0).min(1.0)
    }
}
