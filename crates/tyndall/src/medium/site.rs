//! Where in a step a share of its matter has been met.

use super::Medium;
use crate::simd::Lanes;
use crate::transfer::OpacityLanes;
use fearless_simd::prelude::*;

/// Where shares of the matter of steps have been met.
#[derive(Clone, Copy)]
pub(super) struct Site<S: Lanes> {
    /// Share of the step.
    pub share: S::f32s,
    /// Data value there.
    pub value: S::f32s,
}

impl<S: Lanes> Site<S> {
    /// `self` in some lanes, `other` in the rest.
    #[inline(always)]
    pub fn or(self, lanes: S::mask32s, other: Self) -> Self {
        Self { share: lanes.select(self.share, other.share), value: lanes.select(self.value, other.value) }
    }
}

/// Pieces of steps along which values change linearly.
pub(super) struct Piece<S: Lanes> {
    /// The shares of the step at its ends.
    pub shares: [S::f32s; 2],
    pub values: [S::f32s; 2],
    pub opacities: [OpacityLanes<S>; 2],
    /// The share of its matter that is met.
    pub met: S::f32s,
}

impl<S: Lanes> Piece<S> {
    /// Where that is: Newton's method, which knows the derivative, the opacity; halvings where it would leave the interval.
    #[inline(always)]
    pub fn search(&self, simd: S, medium: &Medium) -> Site<S> {
        let [from, to] = self.opacities;
        let [first, second] = self.values;
        let zero = S::f32s::splat(simd, 0.0);
        let total = from.area_to(to);
        let bins = to.position - from.position;
        let sure = self.met.min(-self.met + 1.0) * SURE;
        let (mut lo, mut hi) = (zero, S::f32s::splat(simd, 1.0));
        let mut at = share_of_line(simd, [from.opacity, to.opacity], self.met);
        let mut open = !from.has_no_quotient(simd, to) & !total.simd_eq(zero);
        for _ in 0..MOST_TRIES {
            let here = medium.transfer.read_lanes(simd, between_values::<S>(first, second, at));
            // Both areas are negative where values fall.
            let missing = self.met - from.area_to(here) / total;
            open &= missing.abs().simd_ge(sure);
            if !open.any_true() {
                break;
            }
            let above = missing.simd_gt(zero);
            lo = (open & above).select(at, lo);
            hi = (open & !above).select(at, hi);
            let next = at + missing * total / (here.opacity * bins);
            let next = (next.simd_gt(lo) & next.simd_lt(hi)).select(next, (lo + hi) * 0.5);
            at = open.select(next, at);
        }
        let [start, end] = self.shares;
        Site { share: (end - start).mul_add(at, start), value: between_values::<S>(first, second, at) }
    }
}

/// Tries in the search, enough for halvings to find a site in single precision.
const MOST_TRIES: usize = 24;
/// The search ends when the share of matter that is met is wrong by less than this fraction of what is before the site, and of what is
/// behind it.
const SURE: f32 = 1e-2;

/// The share of the way on which a share of the opacity is met, where opacity changes linearly: the root of a quadratic.
#[inline(always)]
pub(super) fn share_of_line<S: Lanes>(simd: S, [a, b]: [S::f32s; 2], share: S::f32s) -> S::f32s {
    let root = (share * (b * b - a * a) + a * a).max(0.0).sqrt();
    let sum = a + root;
    sum.simd_gt(S::f32s::splat(simd, 0.0)).select((share * (a + b) / sum).min(1.0), share)
}

/// Without a difference that might overflow.
#[inline(always)]
pub(super) fn between_values<S: Lanes>(from: S::f32s, to: S::f32s, share: S::f32s) -> S::f32s {
    to.mul_add(share, from * (-share + 1.0))
}
