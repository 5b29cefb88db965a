//! Sweeps through the lattice, away from light points.

use super::matter::{Classify, Matter};
use super::{FULL, Lattice};
use crate::integrator::Limits;
use crate::math::{Mat3, Vec3, cast};
use crate::medium::{HalfSpace, Medium};
use crate::simd::{Kernel, Lanes, Level, one_minus_exp};
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// Where a light point is, in units of the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::integrator) enum Aim {
    /// Infinitely far, in this direction.
    Distant(Vec3),
    /// At a position.
    At(Vec3),
}

/// Where the box and the cuts are, in units of the lattice.
#[derive(Debug)]
struct Surroundings {
    /// Products of the world vectors of the lattice's units: squared lengths follow.
    metric: Mat3,
    /// From the outer texels to the faces of the box.
    border: [f32; 3],
    cuts: Vec<HalfSpace>,
}

impl Surroundings {
    fn new(lattice: &Lattice, medium: &Medium) -> Self {
        let units = lattice.units(medium.volume().grid());
        let spacing = Vec3::from_array(lattice.spacing());
        let cut = |half: &HalfSpace| HalfSpace { normal: half.normal * spacing, ..*half };
        Self {
            metric: units.transpose() * units,
            border: spacing.to_array().map(|voxels| 0.5 / voxels),
            cuts: medium.clip().half_spaces().iter().map(cut).collect(),
        }
    }
}

/// All sweeps, and how far they are.
#[derive(Debug)]
pub(super) struct Sweeps {
    sweeps: Vec<Sweep>,
    /// Texels along each axis.
    texels: [usize; 3],
    around: Surroundings,
    /// Planes of the first sweep that are done.
    planes: usize,
    /// Transmittances in the plane before, row by row; in each row point by point.
    before: Vec<f32>,
    /// And in the current one.
    here: Vec<f32>,
}

/// A sweep along an axis, for the light points in whose direction rays cross its planes most steeply.
#[derive(Debug)]
struct Sweep {
    axes: Axes,
    /// Whether planes ascend: away from a light at lower coordinates.
    ascending: bool,
    points: Vec<usize>,
}

/// Axes of a sweep.
#[derive(Clone, Copy, Debug)]
struct Axes {
    /// In rows, along the lanes.
    u: usize,
    /// From row to row of a plane.
    v: usize,
    /// From plane to plane.
    w: usize,
}

/// By the axis from plane to plane. Lanes go along x where they can, since matter is stored so.
const AXES: [Axes; 3] = [Axes { u: 1, v: 2, w: 0 }, Axes { u: 0, v: 2, w: 1 }, Axes { u: 0, v: 1, w: 2 }];

impl Aim {
    /// Whether a sweep passes texels whose rays to the point cross its planes most steeply.
    fn needs(&self, Axes { u, v, w }: Axes, ascending: bool, texels: [usize; 3]) -> bool {
        match *self {
            Self::Distant(d) => {
                let steepest = d[w].abs() >= d[u].abs() && d[w].abs() >= d[v].abs();
                // Of axes that are equally steep, the last.
                let first = (w + 1..3).all(|a| d[a].abs() < d[w].abs());
                steepest && first && (d[w] < 0.0) == ascending
            }
            Self::At(p) => {
                let last = texels.map(|n| (n - 1) as f32);
                let beside = |a: usize| (-p[a]).max(p[a] - last[a]).max(0.0);
                let ahead = if ascending { last[w] - p[w] } else { p[w] };
                ahead >= beside(u).max(beside(v))
            }
        }
    }
}

impl Sweeps {
    pub fn new(aims: &[Aim], lattice: &Lattice, medium: &Medium) -> Self {
        let texels = lattice.texels();
        let of = |axes: Axes, ascending: bool| {
            let points = (0..aims.len()).filter(|&i| aims[i].needs(axes, ascending, texels)).collect();
            Sweep { axes, ascending, points }
        };
        let all = AXES.iter().flat_map(|&axes| [of(axes, false), of(axes, true)]);
        // The last one comes first.
        let sweeps = all.filter(|sweep| !sweep.points.is_empty()).collect();
        let around = Surroundings::new(lattice, medium);
        Self { sweeps, texels, around, planes: 0, before: Vec::new(), here: Vec::new() }
    }

    /// Goes on, in parallel on the current pool; false if stopped first.
    pub fn complete(
        &mut self,
        matter: &Matter,
        aims: &[Aim],
        medium: &Medium,
        texels: &mut [u8],
        stride: usize,
        level: Level,
        limits: &Limits,
    ) -> bool {
        let stop = limits.stop();
        while let Some(sweep) = self.sweeps.last() {
            let [nx, ny, _] = self.texels;
            let Axes { u, v, w } = sweep.axes;
            let row = self.texels[u] * sweep.points.len();
            for plane in [&mut self.before, &mut self.here] {
                plane.resize(row * self.texels[v], 1.0);
            }
            while self.planes < self.texels[w] {
                if stop.reached_now() {
                    return false;
                }
                let k = if sweep.ascending { self.planes } else { self.texels[w] - 1 - self.planes };
                let (around, before) = (&self.around, &*self.before);
                let plane = Plane { sweep, aims, matter, medium, around, before, k, stride };
                // Layers of texels, or rows of one.
                let (slabs, slab) = match w {
                    2 => (&mut texels[k * nx * ny * stride..][..nx * ny * stride], nx * stride),
                    _ => (&mut *texels, nx * ny * stride),
                };
                let rows = self.here.par_chunks_exact_mut(row).zip(slabs.par_chunks_exact_mut(slab));
                rows.with_min_len(4).enumerate().for_each(|(number, (here, out))| {
                    level.run(SweepRow { plane: &plane, number, here, out });
                });
                std::mem::swap(&mut self.before, &mut self.here);
                self.planes += 1;
            }
            self.sweeps.pop();
            self.planes = 0;
        }
        true
    }
}

/// A plane of a sweep.
struct Plane<'a> {
    sweep: &'a Sweep,
    aims: &'a [Aim],
    matter: &'a Matter,
    medium: &'a Medium,
    around: &'a Surroundings,
    before: &'a [f32],
    k: usize,
    /// Bytes of a texel.
    stride: usize,
}

impl Plane<'_> {
    fn texels(&self) -> [usize; 3] {
        let (Axes { u, v, w }, n) = (self.sweep.axes, self.matter.texels);
        [n[u], n[v], n[w]]
    }

    /// A row of what is known of the matter.
    #[inline(always)]
    fn matter(&self, k: usize, v: usize) -> &[f32] {
        let [nu, nv, _] = self.texels();
        let ([nx, ny, _], matter) = (self.matter.texels, self.matter);
        match self.sweep.axes.w {
            0 => &matter.by_y[(k * nv + v) * nu..][..nu],
            1 => &matter.by_x[(v * ny + k) * nx..][..nu],
            _ => &matter.by_x[(k * ny + v) * nx..][..nu],
        }
    }

    /// A row of transmittances in the plane before.
    #[inline(always)]
    fn before(&self, point: usize, v: usize) -> &[f32] {
        let [nu, _, _] = self.texels();
        &self.before[(v * self.sweep.points.len() + point) * nu..][..nu]
    }

    /// The plane before, if there is one.
    fn previous(&self) -> Option<usize> {
        let [_, _, nw] = self.texels();
        if self.sweep.ascending { self.k.checked_sub(1) } else { Some(self.k + 1).filter(|&k| k < nw) }
    }
}

struct SweepRow<'a> {
    plane: &'a Plane<'a>,
    /// The row's number.
    number: usize,
    here: &'a mut [f32],
    /// The texels of the row, and others.
    out: &'a mut [u8],
}

impl Kernel for SweepRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { plane, number, here, out } = self;
        let [nu, _, _] = plane.texels();
        let mut space = vec![0.0; 3 * nu];
        let (arriving, rest) = space.split_at_mut(nu);
        let (matter, extinction) = rest.split_at_mut(nu);
        extinction.copy_from_slice(plane.matter(plane.k, number));
        if plane.matter.integral.is_some() {
            Classify { medium: plane.medium, values: extinction }.run(simd);
        }
        // Distance, in bytes, from the slab's first texel to the row's, and from texel to texel.
        let ([nx, _, _], stride) = (plane.matter.texels, plane.stride);
        let (first, apart) = match plane.sweep.axes.w {
            0 => (plane.k * stride, nx * stride),
            1 => (plane.k * nx * stride, stride),
            _ => (0, stride),
        };
        for (i, (&point, here)) in plane.sweep.points.iter().zip(here.chunks_exact_mut(nu)).enumerate() {
            let row = Row { plane, number, point: i, aim: plane.aims[point], extinction };
            row.sweep(simd, arriving, matter, here);
            let [from, to] = row.written();
            let mut at = first + point + from * apart;
            for &kept in here.get(from..to).unwrap_or(&[]) {
                out[at] = cast::low_u8(cast::truncate(kept * FULL + 0.5));
                at += apart;
            }
        }
    }
}

/// A row of a plane for one light point.
struct Row<'a> {
    plane: &'a Plane<'a>,
    number: usize,
    /// Its number in the sweep.
    point: usize,
    aim: Aim,
    /// Extinction per world unit at the row's texels.
    extinction: &'a [f32],
}

/// Where rays from a row cross the plane before, along one axis, relative to where they begin.
#[derive(Clone, Copy)]
struct Crossing {
    /// Of the ray from coordinate 0.
    offset: f32,
    /// How it grows with the coordinate.
    slope: f32,
}

impl Row<'_> {
    /// The crossing along an axis; `None` if the point is nearer than the plane before.
    #[inline(always)]
    fn crossing(&self, axis: usize) -> Option<Crossing> {
        let w = self.plane.sweep.axes.w;
        match self.aim {
            Aim::Distant(d) => Some(Crossing { offset: d[axis] / d[w].abs(), slope: 0.0 }),
            Aim::At(p) => {
                let away = (p[w] - self.plane.k as f32).abs();
                (away >= 1.0).then(|| Crossing { offset: p[axis] / away, slope: -1.0 / away })
            }
        }
    }

    /// The texels of the row whose rays cross planes of the sweep most steeply.
    fn written(&self) -> [usize; 2] {
        let [nu, _, _] = self.plane.texels();
        let Axes { u, v, w } = self.plane.sweep.axes;
        let Aim::At(p) = self.aim else { return [0, nu] };
        let away = self.plane.k as f32 - p[w];
        let is_ahead = if self.plane.sweep.ascending { away >= 0.0 } else { away <= 0.0 };
        let away = away.abs();
        if !is_ahead || (p[v] - self.number as f32).abs() > away {
            return [0, 0];
        }
        [cast::index((p[u] - away).ceil()).min(nu), cast::index((p[u] + away).floor() + 1.0).min(nu)]
    }

    /// Computes the transmittances of a row. The first two slices are space.
    #[inline(always)]
    fn sweep<S: Lanes>(&self, simd: S, arriving: &mut [f32], matter: &mut [f32], here: &mut [f32]) {
        let plane = self.plane;
        let [nu, nv, _] = plane.texels();
        let Axes { u, v, w } = plane.sweep.axes;
        let (Some(along_u), Some(along_v)) = (self.crossing(u), self.crossing(v)) else {
            return self.beside_light(here);
        };
        let number = self.number as f32;
        let to_v = along_v.offset + along_v.slope * number;
        let crossed_v = (number + to_v).clamp(0.0, (nv - 1) as f32);
        let row = cast::index(crossed_v).min(nv.saturating_sub(2));
        let share = crossed_v - row as f32;
        let next = (row + 1).min(nv - 1);
        // Beyond the last plane there is only the way to the face of the box.
        let previous = plane.previous();
        let from = previous.unwrap_or(plane.k);
        mix_rows(simd, [plane.matter(from, row), plane.matter(from, next)], share, matter);
        if previous.is_some() {
            let rows = [
                plane.before(self.point, row.saturating_sub(1)),
                plane.before(self.point, row),
                plane.before(self.point, next),
                plane.before(self.point, (row + 2).min(nv - 1)),
            ];
            mix_four_rows(simd, rows, weights(share), arriving);
        }
        let border = plane.around.border;
        let in_plane = if previous.is_some() { 1.0 } else { border[w] };
        let inside_v = in_plane.min(inside(number, to_v, (nv - 1) as f32, border[v]));
        let back = if plane.sweep.ascending { -1.0 } else { 1.0 };
        let way = Way { axes: plane.sweep.axes, along_u, to_v, back, number, k: plane.k as f32 };
        let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
        let last = (nu - 1) as f32;
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let index = S::u32s::from_fn(simd, |lane| cast::fit_u32(lane));
        let values = plane.matter(plane.k, self.number);
        for (first, out) in (0..).step_by(S::WIDTH).zip(here.chunks_mut(S::WIDTH)) {
            let x = lane + first as f32;
            let to_u = x * along_u.slope + along_u.offset;
            let crossed = (x + to_u).max(zero).min(last);
            let cell: S::i32s = crossed.to_int();
            let share = crossed - cell.to_float::<S::f32s>();
            let cell: S::u32s = cell.bitcast();
            let (value, there) = (simd.numbers(values, index + cast::fit_u32(first)), between(simd, matter, cell, share));
            let extinction = simd.numbers(self.extinction, index + cast::fit_u32(first));
            let extinction = match &plane.matter.integral {
                Some(integral) => {
                    let opacity = extinction * (1.0 / plane.medium.density().max(f32::MIN_POSITIVE));
                    integral.at(simd, value).mean(simd, integral.at(simd, there), opacity) * plane.medium.density()
                }
                None => (extinction + there) * 0.5,
            };
            // The part of the way to the plane before that is in the box and not cut away.
            let room = to_u.simd_gt(zero).select(-x + (last + border[u]), x + border[u]);
            let (mut begin, mut end) = (zero, (room / to_u.abs().max(1e-12)).min(inside_v));
            for half in &plane.around.cuts {
                (begin, end) = way.cut(simd, half, x, to_u, begin, end);
            }
            let length = way.length::<S>(&plane.around.metric, to_u);
            let thickness = extinction * length * (end.min(1.0) - begin).max(0.0);
            let arrives = if previous.is_some() {
                end.simd_lt(one).select(one, curved(simd, arriving, cell, share))
            } else {
                one
            };
            let kept = arrives - arrives * one_minus_exp(simd, thickness);
            out.copy_from_slice(&kept.as_slice()[..out.len()]);
        }
    }

    /// Transmittances in the plane next to a light point.
    fn beside_light(&self, here: &mut [f32]) {
        let plane = self.plane;
        let Axes { u, v, w } = plane.sweep.axes;
        let Aim::At(p) = self.aim else { return here.fill(1.0) };
        for (i, (kept, extinction)) in here.iter_mut().zip(self.extinction).enumerate() {
            let mut way = Vec3::ZERO;
            (way[u], way[v], way[w]) = (p[u] - i as f32, p[v] - self.number as f32, p[w] - plane.k as f32);
            let length = way.dot(plane.around.metric * way).max(0.0).sqrt();
            *kept = (-extinction * length).exp();
        }
    }
}

/// The ways from a row to the plane before.
struct Way {
    axes: Axes,
    along_u: Crossing,
    to_v: f32,
    back: f32,
    number: f32,
    k: f32,
}

impl Way {
    /// World lengths.
    #[inline(always)]
    fn length<S: Lanes>(&self, metric: &Mat3, to_u: S::f32s) -> S::f32s {
        let Self { axes: Axes { u, v, w }, to_v, back, .. } = *self;
        let of = |a: usize, b: usize| metric.col(a)[b];
        let linear = 2.0 * (to_v * of(u, v) + back * of(u, w));
        let constant = to_v * to_v * of(v, v) + 2.0 * to_v * back * of(v, w) + of(w, w);
        ((to_u * of(u, u) + linear) * to_u + constant).max(0.0).sqrt()
    }

    /// The part of the ways, from `begin` to `end`, that a half space keeps.
    #[inline(always)]
    fn cut<S: Lanes>(
        &self,
        simd: S,
        half: &HalfSpace,
        x: S::f32s,
        to_u: S::f32s,
        begin: S::f32s,
        end: S::f32s,
    ) -> (S::f32s, S::f32s) {
        let Self { axes: Axes { u, v, w }, to_v, back, number, k, .. } = *self;
        let zero = S::f32s::splat(simd, 0.0);
        let n = half.normal;
        let towards = to_u * n[u] + (to_v * n[v] + back * n[w]);
        let room = x * -n[u] + (half.offset - number * n[v] - k * n[w]);
        let at = room / towards;
        let never = towards.simd_eq(zero) & room.simd_lt(zero);
        let begin = towards.simd_lt(zero).select(begin.max(at), begin);
        let end = towards.simd_gt(zero).select(end.min(at), end);
        (begin, never.select(zero, end))
    }
}

/// The share of a way from `x` to `x + to` that is at most `border` below 0 or above `last`.
fn inside(x: f32, to: f32, last: f32, border: f32) -> f32 {
    let room = if to > 0.0 { last + border - x } else { x + border };
    if to.abs() > room { room / to.abs() } else { 1.0 }
}

/// Between an entry of a table and the next.
#[inline(always)]
fn between<S: Lanes>(simd: S, table: &[f32], entry: S::u32s, share: S::f32s) -> S::f32s {
    let (a, b) = (simd.numbers(table, entry), simd.numbers(table, entry + 1));
    (b - a).mul_add(share, a)
}

/// Between an entry of a table and the next, along a curve that follows the entries before and after; from 0 to 1.
#[inline(always)]
fn curved<S: Lanes>(simd: S, table: &[f32], entry: S::u32s, t: S::f32s) -> S::f32s {
    let before = entry.max(S::u32s::splat(simd, 1)) - 1;
    let (a, b) = (simd.numbers(table, before), simd.numbers(table, entry));
    let (c, d) = (simd.numbers(table, entry + 1), simd.numbers(table, entry + 2));
    // Horner's scheme of the Catmull-Rom spline.
    let cubic = ((b - c) * 1.5 + (d - a) * 0.5) * t + (a - b * 2.5 + c * 2.0 - d * 0.5);
    ((cubic * t + (c - a) * 0.5) * t + b).max(0.0).min(1.0)
}

/// Weights of a Catmull-Rom spline.
fn weights(t: f32) -> [f32; 4] {
    let u = 1.0 - t;
    [
        -0.5 * t * u * u,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        -0.5 * t * t * u,
    ]
}

#[inline(always)]
fn mix_four_rows<S: Lanes>(simd: S, [a, b, c, d]: [&[f32]; 4], [p, q, r, s]: [f32; 4], out: &mut [f32]) {
    let width = S::WIDTH;
    let whole = out.len() / width * width;
    for i in (0..whole).step_by(width) {
        let range = i..i + width;
        let mixed = S::f32s::from_slice(simd, &a[range.clone()]) * p
            + S::f32s::from_slice(simd, &b[range.clone()]) * q
            + S::f32s::from_slice(simd, &c[range.clone()]) * r
            + S::f32s::from_slice(simd, &d[range.clone()]) * s;
        mixed.max(0.0).min(1.0).store_slice(&mut out[range]);
    }
    for i in whole..out.len() {
        out[i] = (a[i] * p + b[i] * q + c[i] * r + d[i] * s).clamp(0.0, 1.0);
    }
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
