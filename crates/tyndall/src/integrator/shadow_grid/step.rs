//! The ways of rays between two planes of a lattice, and how much of them is inside the medium.

use super::Surroundings;
use super::course::{Axes, Course};
use crate::math::{Mat3, cast};
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::ops::Range;

/// Where rays cross a plane: at `first + apart i`, along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossings {
    pub first: f32,
    pub apart: f32,
    /// 1 over `apart`.
    pub inverse: f32,
}

impl Crossings {
    #[inline(always)]
    pub fn new(first: f32, apart: f32) -> Self {
        Self { first, apart, inverse: 1.0 / apart }
    }

    #[inline(always)]
    pub fn of(self, i: usize) -> f32 {
        self.first + self.apart * i as f32
    }

    /// The rays, of so many, that cross between two coordinates, or next to that.
    #[inline(always)]
    pub fn rays_within(self, range: &Range<usize>, count: usize) -> Range<usize> {
        if range.is_empty() {
            return 0..0;
        }
        let ray = |at: f32| (at - self.first) * self.inverse;
        let (from, to) = (ray(range.start as f32 - 1.0), ray(range.end as f32));
        let first = cast::index(from.floor()).min(count);
        first..cast::index(to.ceil() + 1.0).clamp(first, count)
    }
}

/// Where a row of rays reaches a plane, and how far it came from the plane before.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowWay {
    /// Where they end along u.
    pub at_u: Crossings,
    /// From there to where they began.
    pub back_u: Crossings,
    /// The same along v.
    pub at_v: f32,
    pub back_v: f32,
    /// How much of the way there is, from its end.
    pub reach: f32,
}

/// The ways of a row of rays from the plane before to a plane.
pub(super) struct Step<'a> {
    around: &'a Surroundings,
    axes: Axes,
    way: RowWay,
    at_w: f32,
    back_w: f32,
    /// Last texel along u.
    last_u: f32,
    /// The part of the way, from its end, that is in the box, if faces along u are left aside.
    begin: f32,
    end: f32,
    /// The square of a whole way's length: a polynomial in how far it goes along u.
    squared: [f32; 3],
    /// The length of all ways of parallel rays that meet neither faces along u nor cuts.
    even: Option<f32>,
}

impl<'a> Step<'a> {
    /// To the `n`-th plane of a course.
    #[inline(always)]
    pub fn new(around: &'a Surroundings, course: &Course, n: usize, way: RowWay) -> Self {
        let Course { axes, texels: [nu, nv, _], ascending } = *course;
        let RowWay { back_u, at_v, back_v, reach, .. } = way;
        let mut step = Self {
            around,
            axes,
            way,
            at_w: course.plane(n) as f32,
            back_w: if ascending { -1.0 } else { 1.0 },
            last_u: (nu - 1) as f32,
            begin: 0.0,
            end: reach,
            squared: [0.0; 3],
            even: None,
        };
        let (Axes { u, v, w }, back_w) = (axes, step.back_w);
        let of = |a: usize, b: usize| Mat3::col(&around.metric, a)[b];
        let constant = back_v * back_v * of(v, v) + 2.0 * back_v * back_w * of(v, w) + of(w, w);
        step.squared = [constant, 2.0 * (back_v * of(u, v) + back_w * of(u, w)), of(u, u)];
        // Where it is below the upper and above the lower face.
        for (room, towards) in [((nv - 1) as f32 - at_v, back_v), (at_v, -back_v)] {
            if towards > 0.0 {
                step.end = step.end.min(room / towards);
            } else if towards < 0.0 {
                step.begin = step.begin.max(room / towards);
            } else if room < 0.0 {
                step.end = 0.0;
            }
        }
        if back_u.apart == 0.0 && around.cuts.is_empty() {
            let [constant, linear, square] = step.squared;
            let to_u = back_u.first;
            let length = ((to_u * square + linear) * to_u + constant).max(0.0).sqrt();
            step.even = Some(length * (step.end - step.begin).max(0.0));
        }
        step
    }

    /// Lengths inside the box and the cuts, in lengths of [`Lattice::length_unit`](super::lattice::Lattice::length_unit), of the rays from number `first` on.
    #[inline(always)]
    pub fn lengths<S: Lanes>(&self, simd: S, first: usize) -> S::f32s {
        let Self { around, axes: Axes { u, v, w }, way, at_w, back_w, .. } = *self;
        let RowWay { at_u, back_u, at_v, back_v, .. } = way;
        if let Some(even) = self.even
            && self.is_between_faces(first, S::WIDTH)
        {
            return S::f32s::splat(simd, even);
        }
        let splat = |x: f32| S::f32s::splat(simd, x);
        let i = S::f32s::from_fn(simd, |lane| lane as f32) + first as f32;
        let (at_u, to_u) = (i * at_u.apart + at_u.first, i * back_u.apart + back_u.first);
        let mut part = (splat(self.begin), splat(self.end));
        part = cut(simd, to_u, -at_u + self.last_u, part);
        part = cut(simd, -to_u, at_u, part);
        for half in &around.cuts {
            let normal = [half.normal[u], half.normal[v], half.normal[w]];
            let towards = to_u * normal[0] + (back_v * normal[1] + back_w * normal[2]);
            let room = at_u * -normal[0] + (half.offset - at_v * normal[1] - at_w * normal[2]);
            part = cut(simd, towards, room, part);
        }
        let [constant, linear, square] = self.squared;
        let whole = ((to_u * square + linear) * to_u + constant).max(splat(0.0)).sqrt();
        whole * (part.1 - part.0).max(splat(0.0))
    }

    /// Whether some parallel rays do not meet the box's faces along u.
    #[inline(always)]
    fn is_between_faces(&self, first: usize, count: usize) -> bool {
        let ends = [self.way.at_u.of(first), self.way.at_u.of(first + count - 1)];
        let back = self.way.back_u.first;
        ends[0].min(ends[0] + back) >= 0.0 && ends[1].max(ends[1] + back) <= self.last_u
    }
}

/// The part of a way on which `towards t <= room`; none is left where its end is before its beginning.
#[inline(always)]
fn cut<S: Lanes>(
    simd: S,
    towards: S::f32s,
    room: S::f32s,
    (begin, end): (S::f32s, S::f32s),
) -> (S::f32s, S::f32s) {
    let zero = S::f32s::splat(simd, 0.0);
    let at = room / towards;
    let never = towards.simd_eq(zero) & room.simd_lt(zero);
    let begin = towards.simd_lt(zero).select(begin.max(at), begin);
    let end = towards.simd_gt(zero).select(end.min(at), end);
    (begin, never.select(zero, end))
}
