//! Rays away from a light point, through the planes of a lattice.
//!
//! A fan's rays cross each plane in a regular grid, so that along a row of rays matter is read, and along a row of texels the result,
//! with steps that do not change: as in shear-warp volume rendering \[Lacroute94\]. Each ray keeps what reached it all the way from the
//! light, so that nothing is interpolated but matter, and once the transmittance, from rays to texels.

use super::bricks::EDGE;
use super::course::{Axes, Course};
use super::rows::{RowExtinction, between, load, mix_rows};
use super::slab::{Slab, union};
use super::step::{Crossings, RowWay, Step};
use super::texels::{PassedRays, PlaneOfBrick, RayGrid};
use super::{Aim, CLOSE, FULL, Surroundings};
use crate::math::cast;
use crate::simd::{Kernel, Lanes, Level, MOST_LANES, one_minus_exp};
use fearless_simd::prelude::*;
use rayon::prelude::*;
use std::ops::Range;

/// Rays of near points beyond the first and the last that cross the lattice, so that every texel is between two.
const MARGIN: i32 = 2;
/// Rays of distant points beyond the lattice on either side of its first plane in a slab, as many as leave it there at most, and as
/// [`MARGIN`].
const PAD: usize = EDGE + 2;
/// Values that a row of matter is continued by at either end: as many as a vector of rays may reach past it.
const ROW_PAD: usize = 32;
/// Values on either side of a span of matter that rays next to it may read.
const BESIDE: usize = 4;

/// See the module.
#[derive(Debug)]
pub(super) struct Fan {
    /// The light point's number.
    pub point: usize,
    course: Course,
    aim: Aim,
    /// Rays along u, in whole vectors, and v.
    rays: [usize; 2],
    /// For a near point, the slope from ray to ray, and the slopes of the first ones.
    near: Slopes,
    /// The first plane that lies beyond the light.
    begin: usize,
    /// Transmittance of each ray to the last plane passed, row by row.
    state: Vec<f32>,
    /// The same, a slab on.
    next: Vec<f32>,
    /// Transmittances to the planes of a slab, row by row of rays, and in it plane by plane.
    passed: Vec<u8>,
    /// Where rays cross these planes, along u and v; none where the light is still ahead.
    planes: Vec<RayGrid>,
}

/// Slopes of rays from a near point, in lattice units per plane.
#[derive(Clone, Copy, Debug)]
struct Slopes {
    first: [f32; 2],
    apart: f32,
}

impl Fan {
    /// With no plane passed yet.
    pub fn new(point: usize, aim: Aim, course: Course) -> Self {
        let [nu, nv, nw] = course.texels;
        let mut fan = Self {
            point,
            course,
            aim,
            rays: [nu, nv].map(|n| n + 2 * PAD + 2 + EDGE),
            near: Slopes { first: [0.0; 2], apart: 0.0 },
            begin: 0,
            state: Vec::new(),
            next: Vec::new(),
            passed: Vec::new(),
            planes: Vec::new(),
        };
        if let Aim::At(p) = aim {
            let Axes { u, v, w } = course.axes;
            fan.begin = (0..nw).find(|&n| course.beyond(n, p[w]) > 0.0).unwrap_or(nw);
            let (nearest, furthest) =
                (course.beyond(fan.begin.min(nw - 1), p[w]), course.beyond(nw - 1, p[w]));
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
        fan.rays[0] = fan.rays[0].next_multiple_of(MOST_LANES);
        fan
    }

    /// Bytes that a ray takes.
    pub const BYTES_OF_RAY: usize = 2 * size_of::<f32>() + EDGE;

    /// Bytes that its rays take.
    pub fn bytes(&self) -> usize {
        Self::BYTES_OF_RAY * self.rays[0] * self.rays[1]
    }

    /// Whether a plane lies beyond the light.
    fn has_begun(&self, n: usize) -> bool {
        n >= self.begin
    }

    /// By how many places rays have moved in the grid from the first plane to the first of a slab: one that leaves at one end makes room for
    /// one at the other.
    #[inline(always)]
    fn moved(&self, slab: usize, i: usize) -> f64 {
        let Axes { u, v, w } = self.course.axes;
        let Aim::Distant(d) = self.aim else { return 0.0 };
        (f64::from(-d[[u, v][i]] / d[w].abs()) * slab as f64).floor()
    }

    /// Where rays cross the plane `n`, in the slab that begins with plane `slab`, along u (0) or v (1).
    #[inline(always)]
    fn crossings(&self, slab: usize, n: f64, i: usize) -> Crossings {
        let Axes { u, v, w } = self.course.axes;
        let a = [u, v][i];
        match self.aim {
            Aim::Distant(d) => {
                let moved = f64::from(-d[a] / d[w].abs()) * n - self.moved(slab, i);
                Crossings::new(cast::single(moved) - PAD as f32, 1.0)
            }
            Aim::At(p) => {
                let first = self.course.beyond(slab, p[w]);
                let away = first + cast::single(n - slab as f64);
                Crossings::new(p[a] + self.near.first[i] * away, self.near.apart * away)
            }
        }
    }

    /// From a ray's crossing to where it came from, one plane before, along u or v: `first + apart i`.
    #[inline(always)]
    fn back(&self, i: usize) -> Crossings {
        let Axes { u, v, w } = self.course.axes;
        match self.aim {
            Aim::Distant(d) => Crossings::new(d[[u, v][i]] / d[w].abs(), 0.0),
            Aim::At(_) => Crossings::new(-self.near.first[i], -self.near.apart),
        }
    }

    /// How much of the way to the plane before there is. The first plane is a face of the box, before which there is none.
    #[inline(always)]
    fn reach(&self, n: usize) -> f32 {
        let reach = if n == 0 { 0.0 } else { 1.0 };
        match self.aim {
            Aim::Distant(_) => reach,
            Aim::At(p) => self.course.beyond(n, p[self.course.axes.w]).clamp(0.0, reach),
        }
    }

    /// How a row of rays comes to the `n`-th plane.
    #[inline(always)]
    fn way(&self, slab: &Slab, n: usize, row: usize) -> RowWay {
        RowWay {
            at_u: self.crossings(slab.first, n as f64, 0),
            back_u: self.back(0),
            at_v: self.crossings(slab.first, n as f64, 1).of(row),
            back_v: self.back(1).of(row),
            reach: self.reach(n),
        }
    }

    /// Passes a slab, in parallel on the current pool.
    pub fn pass(&mut self, slab: &Slab, around: &Surroundings, level: Level) {
        self.planes.clear();
        if !self.has_begun(slab.first + slab.count - 1) {
            return;
        }
        let [rays, rows] = self.rays;
        let (mut next, mut passed) = (std::mem::take(&mut self.next), std::mem::take(&mut self.passed));
        next.resize(rays * rows, 0.0);
        passed.resize(rays * rows * EDGE, 0);
        let fan = &*self;
        let row = next.par_chunks_exact_mut(rays).zip(passed.par_chunks_exact_mut(rays * EDGE));
        let space = || Space::new(fan.course.texels[0], rays);
        row.with_min_len(16).enumerate().for_each_init(space, |space, (j, (kept, passed))| {
            level.run(PassRow { fan, slab, around, j, space, kept, passed });
        });
        self.next = std::mem::replace(&mut self.state, next);
        self.passed = passed;
        for n in slab.first..slab.first + slab.count {
            let crossings = [0, 1].map(|i| self.crossings(slab.first, n as f64, i));
            let is_distant = matches!(self.aim, Aim::Distant(_));
            self.planes.push(if is_distant {
                RayGrid::parallel(crossings)
            } else {
                RayGrid::Spread(crossings)
            });
        }
    }

    /// The transmittances of a row of rays before a slab; ones beyond the grid's ends.
    fn enter(&self, slab: &Slab, j: usize, out: &mut [f32]) {
        let [moved_u, moved_v] = [0, 1]
            .map(|i| cast::truncate(cast::single(self.moved(slab.first, i) - self.moved(slab.before, i))));
        let [nu, nv] = self.rays;
        out.fill(1.0);
        let row = i32::try_from(j).unwrap_or(i32::MAX) - moved_v;
        let Some(row) = usize::try_from(row).ok().filter(|&row| row < nv) else { return };
        let Some(state) = self.state.get(row * nu..).and_then(|rest| rest.get(..nu)) else { return };
        // Ray `i` was number `i - moved`.
        let by = moved_u.unsigned_abs() as usize;
        let (from, to) = if moved_u < 0 { (by, 0) } else { (0, by) };
        let count = nu.saturating_sub(by);
        out[to..to + count].copy_from_slice(&state[from..from + count]);
    }
}

/// Transmittances below this are 0, half of what a byte can tell.
const LEAST: f32 = 0.5 / FULL;

/// Mean extinction, over that at the end, of a way on which matter begins or ends: for a ramp that begins anywhere on it, a third; for an
/// edge, a half. Scans have both; this keeps the light of the three in docs/shadows.md within 1 %.
const BORDER_MEAN: f32 = 0.46;

struct PassRow<'a> {
    fan: &'a Fan,
    slab: &'a Slab,
    around: &'a Surroundings,
    /// The row's number.
    j: usize,
    space: &'a mut Space,
    /// Transmittances of the rays.
    kept: &'a mut [f32],
    /// See [`Fan::passed`].
    passed: &'a mut [u8],
}

/// What is computed for a row of rays and needed no longer.
struct Space {
    /// Extinction at the texels of a row.
    row: Vec<f32>,
    before: RowExtinction,
    here: RowExtinction,
}

impl Space {
    fn new(texels: usize, rays: usize) -> Self {
        let met = || RowExtinction::new(rays);
        Self { row: vec![0.0; texels + 2 * ROW_PAD], before: met(), here: met() }
    }
}

impl Kernel for PassRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { fan, slab, around, j, space: Space { row, before, here }, kept: transmittance, passed } =
            self;
        let [rays, _] = fan.rays;
        fan.enter(slab, j, transmittance);
        before.clear();
        if slab.first > 0 && fan.has_begun(slab.first - 1) {
            fan.meet(simd, slab, 0, j, row, before);
        }
        for (m, bytes) in passed.chunks_exact_mut(rays).take(slab.count).enumerate() {
            let n = slab.first + m;
            if !fan.has_begun(n) {
                continue;
            }
            fan.meet(simd, slab, m + 1, j, row, here);
            if n == fan.begin {
                // The way begins at the light, near which matter is taken to be as here.
                before.clone_from(here);
            }
            let step = Step::new(around, &fan.course, n, fan.way(slab, n, j));
            let range = union(&before.rays, &here.rays);
            for first in (range.start / S::WIDTH * S::WIDTH..range.end).step_by(S::WIDTH) {
                let vector = first..first + S::WIDTH;
                let arriving = S::f32s::from_slice(simd, &transmittance[vector.clone()]);
                if !arriving.simd_gt(S::f32s::splat(simd, 0.0)).any_true() {
                    bytes[vector].fill(0);
                    continue;
                }
                let from = S::f32s::from_slice(simd, &before.extinction[vector.clone()]);
                let to = S::f32s::from_slice(simd, &here.extinction[vector.clone()]);
                let zero = S::f32s::splat(simd, 0.0);
                let is_border = (from.simd_eq(zero)) | (to.simd_eq(zero));
                let mean = (from + to)
                    * is_border.select(S::f32s::splat(simd, BORDER_MEAN), S::f32s::splat(simd, 0.5));
                let thickness = mean * step.lengths(simd, first);
                let left = arriving - arriving * one_minus_exp(simd, thickness);
                let left = left.simd_lt(S::f32s::splat(simd, LEAST)).select(S::f32s::splat(simd, 0.0), left);
                left.store_slice(&mut transmittance[vector]);
                let numbers: S::i32s =
                    left.mul_add(S::f32s::splat(simd, FULL), S::f32s::splat(simd, 0.5)).to_int();
                let (bytes, numbers) = (&mut bytes[first..first + S::WIDTH], numbers.as_slice());
                for lane in 0..S::WIDTH {
                    bytes[lane] = cast::low_u8(numbers[lane]);
                }
            }
            std::mem::swap(before, here);
        }
    }
}

impl Fan {
    /// The extinction where a row of rays crosses the `m`-th plane of a slab, of which the first is the one before. `row` is space.
    #[inline(always)]
    fn meet<S: Lanes>(
        &self,
        simd: S,
        slab: &Slab,
        m: usize,
        j: usize,
        row: &mut [f32],
        met: &mut RowExtinction,
    ) {
        met.clear();
        let [nu, nv, _] = self.course.texels;
        let [rays, _] = self.rays;
        let n = (slab.first + m) as f64 - 1.0;
        let at_v = self.crossings(slab.first, n, 1).of(j).clamp(0.0, (nv - 1) as f32);
        let v = cast::index(at_v).min(nv.saturating_sub(2));
        let rows = [v, (v + 1).min(nv - 1)];
        let span = slab.span(m, rows);
        let crossings = self.crossings(slab.first, n, 0);
        met.rays = crossings.rays_within(&span, rays);
        if met.rays.is_empty() {
            return;
        }
        mix_rows(
            simd,
            [&slab.row(m, rows[0])[span.clone()], &slab.row(m, rows[1])[span.clone()]],
            at_v - v as f32,
            &mut row[ROW_PAD + span.start..ROW_PAD + span.end],
        );
        // Beyond the faces of the box, where only a part of a way counts, matter is as at the face.
        let (from, to) = (ROW_PAD + span.start, ROW_PAD + span.end);
        let before = if span.start == 0 { row[from] } else { 0.0 };
        let after = if span.end == nu { row[to - 1] } else { 0.0 };
        row[from - BESIDE..from].fill(before);
        row[to..to + BESIDE].fill(after);
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let start = crossings.first + ROW_PAD as f32;
        for first in (met.rays.start / S::WIDTH * S::WIDTH..met.rays.end).step_by(S::WIDTH) {
            let extinction = if matches!(self.aim, Aim::Distant(_)) {
                let cell = start.floor();
                let share = S::f32s::splat(simd, start - cell);
                let cell = cast::index(cell) + first;
                let (a, b) = (load(simd, row, cell), load(simd, row, cell + 1));
                (b - a).mul_add(share, a)
            } else {
                let at = (lane + first as f32) * crossings.apart + start;
                let at = at.max(S::f32s::splat(simd, 0.0)).min((nu + 2 * ROW_PAD - 2) as f32);
                let cell: S::i32s = at.to_int();
                between(simd, row, cell.bitcast(), at - cell.to_float::<S::f32s>())
            };
            extinction.store_slice(&mut met.extinction[first..first + S::WIDTH]);
        }
        // Rays of the first and the last vector that are none of these.
        let aligned = met.rays.start / S::WIDTH * S::WIDTH..met.rays.end.next_multiple_of(S::WIDTH);
        met.extinction[aligned.start..met.rays.start].fill(0.0);
        met.extinction[met.rays.end..aligned.end].fill(0.0);
    }
}

impl Fan {
    /// The texels along u of a row that lie in the `n`-th plane within reach of the fan's rays; those for which another axis is steeper
    /// are left to other sweeps.
    #[inline(always)]
    fn reached(&self, n: usize, row: usize) -> Range<usize> {
        let [nu, _, _] = self.course.texels;
        let Axes { u, v, w } = self.course.axes;
        let Aim::At(p) = self.aim else { return 0..nu };
        // Rather by two sweeps than, by rounding, by none.
        let away = self.course.beyond(n, p[w]) + CLOSE;
        if !self.has_begun(n) || (p[v] - row as f32).abs() > away {
            return 0..0;
        }
        let from = cast::index((p[u] - away).ceil()).min(nu);
        from..cast::index((p[u] + away).floor() + 1.0).clamp(from, nu)
    }

    /// Transmittances at a brick's texels in the `m`-th plane of a slab. `brick` is where it is along u and v.
    #[inline(always)]
    pub fn texels(&self, slab: &Slab, m: usize, brick: [usize; 2]) -> PlaneOfBrick {
        let rays = PassedRays { bytes: &self.passed, rays: self.rays, plane: m };
        let reached = |row| self.reached(slab.first + m, row);
        self.planes.get(m).map_or_else(PlaneOfBrick::default, |grid| grid.texels(&rays, brick, reached))
    }
}
