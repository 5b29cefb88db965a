//! Matter at the planes that sweeps pass together.

use super::Lattice;
use super::bricks::{Bricks, EDGE};
use super::course::Course;
use crate::math::cast;
use crate::medium::Medium;
use crate::simd::{Kernel, Lanes, Level};
use crate::volume::Interpolation;
use fearless_simd::prelude::*;
use rayon::prelude::*;
use std::ops::Range;

/// Extinction at the planes of a layer of bricks, and at the one before.
#[derive(Debug)]
pub(super) struct Slab {
    /// The first plane's number, away from the light.
    pub first: usize,
    /// The first plane of the slab before.
    pub before: usize,
    /// Planes, without the one before.
    pub count: usize,
    /// Coordinate of the layer among those of bricks.
    pub layer: usize,
    /// Texels along u and v.
    texels: [usize; 2],
    /// Extinction per [`Lattice::length_unit`], u fastest; the plane before the first comes first.
    extinction: Vec<f32>,
    /// Per row of bricks, the texels along u from the first to the last brick that is kept.
    spans: Vec<Range<usize>>,
    /// The same of the layer before, which counts for the plane before the first.
    spans_before: Vec<Range<usize>>,
}

impl Slab {
    /// Before the first plane.
    pub fn new(course: &Course) -> Self {
        let [nu, nv, _] = course.texels;
        let spans = vec![0..0; nv.div_ceil(EDGE)];
        Self {
            first: 0,
            before: 0,
            count: 0,
            layer: 0,
            texels: [nu, nv],
            extinction: vec![0.0; (EDGE + 1) * nu * nv],
            spans_before: spans.clone(),
            spans,
        }
    }

    /// Goes on to the next layer of bricks, whose planes are then to be filled; false if there is none.
    pub fn advance(&mut self, course: &Course, bricks: &Bricks) -> bool {
        let [nu, nv, nw] = course.texels;
        let first = self.first + self.count;
        if first >= nw {
            return false;
        }
        self.extinction.copy_within(self.count * nu * nv..(self.count + 1) * nu * nv, 0);
        let layer = course.plane(first) / EDGE;
        let planes = layer * EDGE..((layer + 1) * EDGE).min(nw);
        (self.before, self.first, self.count, self.layer) = (self.first, first, planes.len(), layer);
        std::mem::swap(&mut self.spans, &mut self.spans_before);
        for (row, span) in self.spans.iter_mut().enumerate() {
            *span = span_of(course, bricks, layer, row);
        }
        true
    }

    /// Finds the matter at the `m`-th plane of the layer. In parallel on the current pool.
    pub fn fill(
        &mut self,
        m: usize,
        course: &Course,
        lattice: &Lattice,
        bricks: &Bricks,
        medium: &Medium,
        level: Level,
    ) {
        let [nu, nv, _] = course.texels;
        let (layer, plane) = (self.layer, course.plane(self.first + m));
        let parts = Parts::new(lattice.spacing(), medium);
        let rows = self.extinction[(m + 1) * nu * nv..].par_chunks_exact_mut(nu).take(nv);
        rows.with_min_len(16).enumerate().for_each(|(v, row)| {
            level.run(FillRow { course, lattice, bricks, medium, parts: &parts, layer, plane, v, row });
        });
    }

    /// Extinction in a row, at the plane before the first for `m = 0`, and from there on.
    #[inline(always)]
    pub fn row(&self, m: usize, v: usize) -> &[f32] {
        let [nu, nv] = self.texels;
        &self.extinction[(m * nv + v) * nu..][..nu]
    }

    /// The texels along u, in two rows that follow each other, beyond which there is no matter.
    #[inline(always)]
    pub fn span(&self, m: usize, [v, next]: [usize; 2]) -> Range<usize> {
        let spans = if m == 0 { &self.spans_before } else { &self.spans };
        union(&spans[v / EDGE], &spans[next / EDGE])
    }
}

/// The shortest range that holds two.
pub(super) fn union(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    match (a.is_empty(), b.is_empty()) {
        (true, _) => b.clone(),
        (_, true) => a.clone(),
        _ => a.start.min(b.start)..a.end.max(b.end),
    }
}

/// The texels from the first brick of a row to its last.
fn span_of(course: &Course, bricks: &Bricks, layer: usize, row: usize) -> Range<usize> {
    let [nu, ..] = course.texels;
    let is_kept = |u: &usize| bricks.first_texel(course.axes.coordinates(*u, row, layer)).is_some();
    let count = nu.div_ceil(EDGE);
    match (0..count).find(is_kept).zip((0..count).rfind(is_kept)) {
        Some((first, last)) => first * EDGE..((last + 1) * EDGE).min(nu),
        None => 0..0,
    }
}

struct FillRow<'a> {
    course: &'a Course,
    lattice: &'a Lattice,
    bricks: &'a Bricks,
    medium: &'a Medium,
    parts: &'a Parts,
    layer: usize,
    plane: usize,
    v: usize,
    row: &'a mut [f32],
}

impl Kernel for FillRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { course: Course { axes, .. }, lattice, bricks, medium, parts, layer, plane, v, row } = self;
        let is_kept = |u: usize| bricks.first_texel(axes.coordinates(u, v / EDGE, layer)).is_some();
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let [x, y, z] = axes.coordinates(0, v, plane);
        let middle =
            [lattice.index_at(0, x as f32), lattice.index_at(1, y as f32), lattice.index_at(2, z as f32)];
        let along = lattice.spacing()[axes.u];
        let density = medium.density() * Lattice::length_unit(medium.volume().grid());
        let splat = |x: f32| S::f32s::splat(simd, x);
        for (first, out) in (0..).step_by(S::WIDTH).zip(row.chunks_mut(S::WIDTH)) {
            if !(first / EDGE..(first + out.len()).div_ceil(EDGE)).any(is_kept) {
                out.fill(0.0);
                continue;
            }
            let mut sum = splat(0.0);
            let texels = (lane + first as f32) * along;
            for [x, y, z] in &parts.offsets {
                let mut position = [splat(middle[0] + x), splat(middle[1] + y), splat(middle[2] + z)];
                position[axes.u] += texels;
                sum += parts.opacity(simd, medium, position);
            }
            let extinction = sum * (density / parts.offsets.len() as f32);
            out.copy_from_slice(&extinction.as_slice()[..out.len()]);
        }
    }
}

/// The parts of the box around a texel, as wide as texels are apart; their mean is the extinction there.
struct Parts {
    /// Their middles, in voxels from the texel.
    offsets: Vec<[f32; 3]>,
    /// Their edges, in voxels.
    edges: [f32; 3],
    /// Whether opacity may peak between the values inside a part, so that the value in its middle does not stand for it.
    may_hold_peaks: bool,
}

impl Parts {
    /// About one for each voxel of the box, at most three along each axis. Where values jump from voxel to voxel, at least two along each axis, one on either side of
    /// a jump at the texel.
    fn new(spacing: [f32; 3], medium: &Medium) -> Self {
        let jumps = medium.volume().interpolation() == Interpolation::Nearest;
        let least = if jumps { 2 } else { 1 };
        let counts = spacing.map(|voxels| cast::index(voxels.round()).clamp(least, 3));
        let edges = [0, 1, 2].map(|a| spacing[a] / counts[a] as f32);
        let along = |a: usize, i: usize| (i as f32 + 0.5 - 0.5 * counts[a] as f32) * edges[a];
        let mut offsets = Vec::new();
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    offsets.push([along(0, x), along(1, y), along(2, z)]);
                }
            }
        }
        let may_hold_peaks = medium.may_peak_within(edges.into_iter().fold(0.0, f32::max));
        Self { offsets, edges, may_hold_peaks }
    }

    /// Mean opacity of a part, about a position in index space: of all values in it, if it may hold peaks.
    #[inline(always)]
    fn opacity<S: Lanes>(&self, simd: S, medium: &Medium, position: [S::f32s; 3]) -> S::f32s {
        let (volume, transfer) = (medium.volume(), medium.transfer());
        let value = volume.value_lanes(simd, position);
        if !self.may_hold_peaks {
            return transfer.opacity_lanes(simd, value);
        }
        let half = medium.half_spread(simd, position, self.edges);
        transfer.read_lanes(simd, value - half).mean(simd, transfer.read_lanes(simd, value + half))
    }
}
