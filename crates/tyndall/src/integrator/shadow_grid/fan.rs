//! Rays away from a light point, through the planes of a lattice.
//!
//! A fan's rays cross each plane in a regular grid, so that along a row of rays matter is read, and along a row of texels the result,
//! with steps that do not change: as in shear-warp volume rendering \[Lacroute94\]. Each ray keeps what reached it all the way from the
//! light, so that nothing is interpolated but matter, and once the transmittance, from rays to texels.

use super::matter::Matter;
use super::{Aim, Surroundings};
use crate::math::{Mat3, cast};
use crate::simd::{Kernel, Lanes, Level, one_minus_exp};
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// Axes of a sweep through planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axes {
    /// In rows, along the lanes.
    pub u: usize,
    /// From row to row of a plane.
    pub v: usize,
    /// From plane to plane.
    pub w: usize,
}

/// The planes that a fan passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub axes: Axes,
    /// Whether planes ascend: away from a light at lower coordinates.
    pub ascending: bool,
    /// Texels along the axes u, v and w.
    pub texels: [usize; 3],
}

impl Course {
    /// The `n`-th plane away from the light.
    pub fn plane(&self, n: usize) -> usize {
        if self.ascending { n } else { self.texels[2] - 1 - n }
    }

    /// Distance of the `n`-th plane from a coordinate, in planes; negative before it.
    fn beyond(&self, n: usize, w: f32) -> f32 {
        let away = self.plane(n) as f32 - w;
        if self.ascending { away } else { -away }
    }
}

/// Rays beyond the first and the last that cross the lattice, so that every texel is between two.
const MARGIN: i32 = 2;
/// Values that a row of matter is continued by at either end.
const PAD: usize = 4;

/// Where rays cross a plane: at `first + apart i`, along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Crossings {
    first: f32,
    apart: f32,
}

/// See the module.
#[derive(Debug)]
pub(super) struct Fan {
    /// The light point's number.
    pub point: usize,
    course: Course,
    aim: Aim,
    /// Rays along u and v.
    rays: [usize; 2],
    /// For a near point, the slope from ray to ray, and the slopes of the first ones.
    near: Slopes,
    /// The first plane that lies beyond the light.
    begin: usize,
    /// What is known of each ray at the plane reached, row by row: in each, all of [`Known`] side by side.
    state: Vec<f32>,
    /// The same, at the plane after.
    next: Vec<f32>,
}

/// Slopes of rays from a near point, in lattice units per plane.
#[derive(Clone, Copy, Debug)]
struct Slopes {
    first: [f32; 2],
    apart: f32,
}

/// Numbers per ray: the transmittance; the place of the data value where it crosses the plane in the table of the integral of opacity, and
/// the integral up to it (or the extinction twice); and by how much optical thickness grew with the integral.
const KNOWN: usize = 4;

impl Fan {
    /// With no plane passed yet.
    pub fn new(point: usize, aim: Aim, course: Course) -> Self {
        let [nu, nv, nw] = course.texels;
        let mut fan = Self {
            point,
            course,
            aim,
            rays: [nu, nv].map(|n| n + 2 * PAD),
            near: Slopes { first: [0.0; 2], apart: 0.0 },
            begin: 0,
            state: Vec::new(),
            next: Vec::new(),
        };
        if let Aim::At(p) = aim {
            let Axes { u, v, w } = course.axes;
            fan.begin = (0..nw).find(|&n| course.beyond(n, p[w]) > 0.0).unwrap_or(nw);
            let (nearest, furthest) = (course.beyond(fan.begin, p[w]), course.beyond(nw - 1, p[w]));
            fan.near.apart = 1.0 / furthest.max(1.0);
            for (i, (a, n)) in [(u, nu), (v, nv)].into_iter().enumerate() {
                // Slopes of rays to the texels at either end; of those above 1 other sweeps take care.
                let slope = |x: f32, away: f32| ((x - p[a]) / away).clamp(-1.0, 1.0);
                let last = (n - 1) as f32;
                let least = slope(0.0, nearest).min(slope(0.0, furthest));
                let most = slope(last, nearest).max(slope(last, furthest));
                let from = (least / fan.near.apart).floor() - MARGIN as f32;
                fan.near.first[i] = from * fan.near.apart;
                fan.rays[i] = cast::index((most / fan.near.apart).ceil() + MARGIN as f32 - from) + 1;
            }
        }
        fan
    }

    /// Bytes that its rays take.
    pub fn bytes(&self) -> usize {
        2 * size_of::<f32>() * KNOWN * self.rays[0] * self.rays[1]
    }

    /// Whether a plane lies beyond the light.
    fn has_begun(&self, n: usize) -> bool {
        n >= self.begin
    }

    /// Where rays cross the `n`-th plane along u (0) or v (1).
    fn crossings(&self, n: usize, i: usize) -> Crossings {
        let Axes { u, v, w } = self.course.axes;
        let a = [u, v][i];
        match self.aim {
            Aim::Distant(d) => {
                // Away from the light, modulo 1: a ray that leaves at one end makes room for one at the other.
                let moved = f64::from(-d[a] / d[w].abs()) * n as f64;
                Crossings { first: cast::single(moved - moved.floor()) - PAD as f32, apart: 1.0 }
            }
            Aim::At(p) => {
                let away = self.course.beyond(n, p[w]);
                Crossings { first: p[a] + self.near.first[i] * away, apart: self.near.apart * away }
            }
        }
    }

    /// By how many places rays have moved in the grid since the plane before.
    fn moved(&self, n: usize) -> [i32; 2] {
        let Axes { u, v, w } = self.course.axes;
        let Aim::Distant(d) = self.aim else { return [0; 2] };
        [u, v].map(|a| {
            let at = |n: usize| (f64::from(-d[a] / d[w].abs()) * n as f64).floor();
            cast::truncate(cast::single(at(n) - at(n - 1)))
        })
    }

    /// From a ray's crossing to where it came from, one plane before, along u or v: `first + apart i`.
    fn back(&self, i: usize) -> Crossings {
        let Axes { u, v, w } = self.course.axes;
        match self.aim {
            Aim::Distant(d) => Crossings { first: d[[u, v][i]] / d[w].abs(), apart: 0.0 },
            Aim::At(_) => Crossings { first: -self.near.first[i], apart: -self.near.apart },
        }
    }

    /// How much of the way to the plane before there is, at most.
    fn reach(&self, n: usize, border: f32) -> f32 {
        let reach = if n == 0 { border } else { 1.0 };
        match self.aim {
            Aim::Distant(_) => reach,
            Aim::At(p) => reach.min(self.course.beyond(n, p[self.course.axes.w])),
        }
    }
}

/// A fan's step to its next plane.
pub(super) struct Step<'a> {
    fan: &'a Fan,
    matter: &'a Matter,
    around: &'a Surroundings,
    /// The plane's number, away from the light.
    n: usize,
}

impl Fan {
    /// Passes on to the `n`-th plane, in parallel on the current pool.
    pub fn step(&mut self, n: usize, matter: &Matter, around: &Surroundings, level: Level) {
        if !self.has_begun(n) {
            return;
        }
        let row = self.rays[0] * KNOWN;
        let mut next = std::mem::take(&mut self.next);
        next.resize(row * self.rays[1], 0.0);
        let step = Step { fan: self, matter, around, n };
        next.par_chunks_exact_mut(row).with_min_len(4).enumerate().for_each(|(j, known)| {
            level.run(StepRow { step: &step, j, known });
        });
        self.next = std::mem::replace(&mut self.state, next);
    }

    /// A row of one of the known numbers; ones and NaN beyond the grid's ends.
    fn known(&self, row: i32, moved: i32, component: usize, out: &mut [f32]) {
        let [nu, nv] = self.rays;
        out.fill(if component == 0 { 1.0 } else { f32::NAN });
        let Some(row) = usize::try_from(row).ok().filter(|&row| row < nv) else { return };
        let Some(state) = self.state.get((row * KNOWN + component) * nu..).and_then(|rest| rest.get(..nu)) else { return };
        // Ray `i` was number `i - moved`.
        let by = moved.unsigned_abs() as usize;
        let (from, to) = if moved < 0 { (by, 0) } else { (0, by) };
        let count = nu.saturating_sub(by);
        out[to..to + count].copy_from_slice(&state[from..from + count]);
    }
}

/// Smallest growth of an integral, in units of its table, from which a steepness follows.
const LEAST_GROWTH: f32 = 0.1;

struct StepRow<'a> {
    step: &'a Step<'a>,
    /// The row's number.
    j: usize,
    known: &'a mut [f32],
}

impl Kernel for StepRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { step: Step { fan, matter, around, n }, j, known } = self;
        let Course { axes: Axes { u, v, w }, texels: [nu, nv, _], ascending } = fan.course;
        let [rays, _] = fan.rays;
        let width = rays.next_multiple_of(S::WIDTH);
        // Values in a row of matter where the row of rays crosses the plane, continued beyond its ends.
        let mut space = vec![0.0; 3 * width + width.max(nu + 2 * PAD) + 2 * S::WIDTH];
        let (row, kept) = space.split_at_mut(width.max(nu + 2 * PAD) + 2 * S::WIDTH);
        let at_v = fan.crossings(*n, 1).of(j);
        let k = fan.course.plane(*n);
        {
            let within = at_v.clamp(0.0, (nv - 1) as f32);
            let first = cast::index(within).min(nv.saturating_sub(2));
            let rows = [first, (first + 1).min(nv - 1)].map(|v| matter.row(fan.course.axes, k, v));
            mix_rows(simd, rows, within - first as f32, &mut row[PAD..PAD + nu]);
            let ends = [row[PAD], row[PAD + nu - 1]];
            row[..PAD].fill(ends[0]);
            row[PAD + nu..].fill(ends[1]);
        }
        let moved = fan.moved(*n);
        for (component, out) in kept.chunks_exact_mut(width).enumerate() {
            fan.known(i32::try_from(j).unwrap_or(i32::MAX) - moved[1], moved[0], component, &mut out[..rays]);
        }
        let [arriving, positions, integrals] = [0, 1, 2].map(|c| &kept[c * width..][..width]);
        let crossings = fan.crossings(*n, 0);
        let (back_u, back_v) = (fan.back(0), fan.back(1).of(j));
        let back = Way { v: back_v, w: if ascending { -1.0 } else { 1.0 } };
        let zero = S::f32s::splat(simd, 0.0);
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let share = crossings.first + PAD as f32;
        let reach = S::f32s::splat(simd, fan.reach(*n, around.border[w]));
        let is_inside = Slab { border: around.border[v], last: (nv - 1) as f32 };
        let (begin, end) = is_inside.cut(simd, S::f32s::splat(simd, at_v), S::f32s::splat(simd, back_v), (zero, reach));
        let sides = Slab { border: around.border[u], last: (nu - 1) as f32 };
        for first in (0..rays).step_by(S::WIDTH) {
            let i = lane + first as f32;
            let at_u = i * crossings.apart + crossings.first;
            let value = if crossings.apart == 1.0 {
                let (a, b) = (S::f32s::from_slice(simd, &row[first..first + S::WIDTH]), S::f32s::from_slice(simd, &row[first + 1..first + 1 + S::WIDTH]));
                (b - a).mul_add(S::f32s::splat(simd, share), a)
            } else {
                let at = (at_u + PAD as f32).max(zero).min((nu + 2 * PAD - 1) as f32);
                let cell: S::i32s = at.to_int();
                let share = at - cell.to_float::<S::f32s>();
                between(simd, row, cell.bitcast(), share)
            };
            let range = first..first + S::WIDTH;
            let before = [S::f32s::from_slice(simd, &positions[range.clone()]), S::f32s::from_slice(simd, &integrals[range.clone()])];
            let (extinction, here) = matter.between(simd, value, before);
            let to_u = i * back_u.apart + back_u.first;
            let (mut from, mut to) = sides.cut(simd, at_u, to_u, (begin, end));
            for half in &around.cuts {
                let normal = [half.normal[u], half.normal[v], half.normal[w]];
                let towards = to_u * normal[0] + (back.v * normal[1] + back.w * normal[2]);
                let room = at_u * -normal[0] + (half.offset - at_v * normal[1] - k as f32 * normal[2]);
                (from, to) = cut(simd, towards, room, (from, to));
            }
            let length = back.length::<S>(fan.course.axes, &around.metric, to_u);
            let thickness = extinction * length * (to - from).max(0.0);
            let arrives = S::f32s::from_slice(simd, &arriving[range.clone()]);
            let kept = arrives - arrives * one_minus_exp(simd, thickness);
            let grown = here[1] - before[1];
            // False for NaN.
            let grows = grown.abs().simd_gt(S::f32s::splat(simd, LEAST_GROWTH));
            let steepness = grows.select(thickness / grown, zero);
            let count = S::WIDTH.min(rays - first);
            for (component, numbers) in [kept, here[0], here[1], steepness].into_iter().enumerate() {
                known[component * rays + first..][..count].copy_from_slice(&numbers.as_slice()[..count]);
            }
        }
    }
}

impl Crossings {
    #[inline(always)]
    fn of(self, i: usize) -> f32 {
        self.first + self.apart * i as f32
    }
}

/// The ways from where a row of rays crosses a plane back to the plane before.
struct Way {
    v: f32,
    w: f32,
}

impl Way {
    /// World lengths of ways that go so far along u.
    #[inline(always)]
    fn length<S: Lanes>(&self, Axes { u, v, w }: Axes, metric: &Mat3, to_u: S::f32s) -> S::f32s {
        let of = |a: usize, b: usize| metric.col(a)[b];
        let linear = 2.0 * (self.v * of(u, v) + self.w * of(u, w));
        let constant = self.v * self.v * of(v, v) + 2.0 * self.v * self.w * of(v, w) + of(w, w);
        ((to_u * of(u, u) + linear) * to_u + constant).max(0.0).sqrt()
    }
}

/// The box along an axis.
struct Slab {
    /// From the outer texels to the faces.
    border: f32,
    /// The last texel.
    last: f32,
}

impl Slab {
    /// The part of a way from `at` to `at + to` that is inside; ways are from 0 to 1.
    #[inline(always)]
    fn cut<S: Lanes>(&self, simd: S, at: S::f32s, to: S::f32s, part: (S::f32s, S::f32s)) -> (S::f32s, S::f32s) {
        let part = cut(simd, to, -at + (self.last + self.border), part);
        cut(simd, -to, at + self.border, part)
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

/// Between an entry of a table and the next.
#[inline(always)]
fn between<S: Lanes>(simd: S, table: &[f32], entry: S::u32s, share: S::f32s) -> S::f32s {
    let (a, b) = (simd.numbers(table, entry), simd.numbers(table, entry + 1));
    (b - a).mul_add(share, a)
}

/// Between two rows.
#[inline(always)]
fn mix_rows<S: Lanes>(simd: S, [a, b]: [&[f32]; 2], share: f32, out: &mut [f32]) {
    let width = S::WIDTH;
    let whole = out.len() / width * width;
    for i in (0..whole).step_by(width) {
        let from = S::f32s::from_slice(simd, &a[i..i + width]);
        let to = S::f32s::from_slice(simd, &b[i..i + width]);
        let mixed = (to - from).mul_add(S::f32s::splat(simd, share), from);
        mixed.store_slice(&mut out[i..i + width]);
    }
    for i in whole..out.len() {
        out[i] = (b[i] - a[i]) * share + a[i];
    }
}

impl Fan {
    /// The texels along u of a row that lie in the `n`-th plane within reach of the fan's rays; those for which another axis is steeper
    /// are left to other sweeps.
    pub fn reached(&self, n: usize, row: usize) -> std::ops::Range<usize> {
        let [nu, _, _] = self.course.texels;
        let Axes { u, v, w } = self.course.axes;
        let Aim::At(p) = self.aim else { return 0..nu };
        let away = self.course.beyond(n, p[w]);
        if !self.has_begun(n) || (p[v] - row as f32).abs() > away {
            return 0..0;
        }
        let from = cast::index((p[u] - away).ceil()).min(nu);
        from..cast::index((p[u] + away).floor() + 1.0).clamp(from, nu)
    }

    /// Transmittances at a row of texels of the `n`-th plane, which has just been reached: those of the four rays around each.
    ///
    /// Where the texel has another integral of opacity than a ray, the thickness between them is what it grows by along the ray: thus skins
    /// of matter are as they are, not as straight lines between rays.
    #[inline(always)]
    pub fn transmittances<S: Lanes>(&self, simd: S, n: usize, row: usize, integrals: Option<&[f32]>, out: &mut [f32]) {
        let [rays, rows] = self.rays;
        let at_v = self.crossings(n, 1);
        let r = ((row as f32 - at_v.first) / at_v.apart).clamp(0.0, (rows - 2) as f32);
        let first_row = cast::index(r).min(rows - 2);
        let share_v = r - first_row as f32;
        let at_u = self.crossings(n, 0);
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let index = S::u32s::from_fn(simd, |lane| cast::fit_u32(lane));
        let constant = at_u.apart == 1.0;
        let whole = cast::index(-at_u.first);
        let share = S::f32s::splat(simd, -at_u.first - whole as f32);
        let one = S::f32s::splat(simd, 1.0);
        for (first, out) in (0..).step_by(S::WIDTH).zip(out.chunks_mut(S::WIDTH)) {
            let (cell, share): (S::u32s, S::f32s) = if constant {
                (index + cast::fit_u32(first + whole), share)
            } else {
                let r = ((lane + (first as f32 - at_u.first)) / at_u.apart).max(0.0).min((rays - 2) as f32);
                let cell: S::i32s = r.to_int();
                (cell.bitcast(), r - cell.to_float::<S::f32s>())
            };
            let integral = match integrals {
                Some(integrals) => simd.numbers(integrals, index + cast::fit_u32(first)),
                None => one,
            };
            let mut sum = S::f32s::splat(simd, 0.0);
            for upper in 0..4 {
                let [on_u, on_v] = [upper & 1, upper >> 1];
                let part_u = if on_u == 1 { share } else { one - share };
                let part = part_u * if on_v == 1 { share_v } else { 1.0 - share_v };
                let from = (first_row + on_v) * KNOWN * rays;
                let at = cell + cast::fit_u32(on_u);
                let load = |component: usize| {
                    let row = &self.state[from + component * rays..][..rays];
                    let i = first + whole + on_u;
                    match row.get(i..i + S::WIDTH).filter(|_| constant) {
                        Some(numbers) => S::f32s::from_slice(simd, numbers),
                        None => simd.numbers(row, at),
                    }
                };
                let mut kept = load(0);
                if integrals.is_some() {
                    let less = (load(2) - integral) * load(3);
                    kept *= exponential(simd, less);
                }
                sum = kept.mul_add(part, sum);
            }
            let kept = sum.max(0.0).min(1.0);
            out.copy_from_slice(&kept.as_slice()[..out.len()]);
        }
    }
}

/// Largest thickness by which a transmittance is corrected.
const MOST_CORRECTED: f32 = 1.5;

/// `exp(x)`, for `x` up to [`MOST_CORRECTED`] and down to its negative, where it stays: by a polynomial.
#[inline(always)]
pub(super) fn exponential<S: Lanes>(simd: S, x: S::f32s) -> S::f32s {
    let most = S::f32s::splat(simd, MOST_CORRECTED);
    // Half of it, squared.
    let x = x.max(-most).min(most) * 0.5;
    let half = ((x * (1.0 / 24.0) + 1.0 / 6.0) * x + 0.5) * x;
    let half = (half + 1.0) * x + 1.0;
    half * half
}
