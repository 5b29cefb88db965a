//! Matter at the texels.

use super::Lattice;
use super::fan::Axes;
use crate::integrator::Limits;
use crate::math::cast;
use crate::medium::Medium;
use crate::simd::{Kernel, Lanes, Level};
use crate::transfer::OpacityIntegral;
use crate::volume::Interpolation;
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// What was found at a position: its place in the table of the integral, and the integral; or the extinction twice.
pub(super) type Found<S> = [<S as Simd>::f32s; 2];

/// What sweeps know of the matter.
#[derive(Debug)]
pub(super) struct Matter {
    /// Texels along each axis.
    pub texels: [usize; 3],
    /// Data values, or extinctions, at the texels; x fastest.
    pub by_x: Vec<f32>,
    /// The same with y fastest, then z: for sweeps along x.
    pub by_y: Vec<f32>,
    /// By which the extinction between two values is found; `None` if the texels hold extinctions.
    integral: Option<OpacityIntegral>,
    /// Extinction per world unit at opacity 1.
    density: f32,
    /// Values below this are no data.
    least: f32,
    /// Layers, along z, that are computed.
    done: usize,
}

impl Matter {
    /// With nothing computed. On a lattice of voxels, values that are interpolated linearly tell the matter between them. Otherwise
    /// extinctions, averaged over the cell around each texel, have to do.
    pub fn new(lattice: &Lattice, medium: &Medium) -> Self {
        let volume = medium.volume();
        let tells = !lattice.is_coarse() && volume.interpolation() == Interpolation::Linear;
        let [lo, hi] = volume.value_range().map(cast::single);
        let integral = tells.then(|| medium.transfer().opacity_integral([lo, hi]));
        let least = volume.no_data_below().map_or(f32::NEG_INFINITY, cast::single);
        let density = medium.density();
        Self { texels: lattice.texels(), by_x: Vec::new(), by_y: Vec::new(), integral, density, least, done: 0 }
    }

    /// Computes what is missing, in parallel on the current pool; false if stopped first.
    pub fn complete(&mut self, lattice: &Lattice, medium: &Medium, level: Level, limits: &Limits) -> bool {
        let [nx, ny, nz] = self.texels;
        self.by_x.resize(nx * ny * nz, 0.0);
        let stop = limits.stop();
        let samples = if self.integral.is_some() { 0 } else if lattice.is_coarse() { 2 } else { 1 };
        while self.done < nz {
            if stop.reached_now() {
                return false;
            }
            let z = self.done;
            let layer = &mut self.by_x[z * nx * ny..][..nx * ny];
            layer.par_chunks_exact_mut(nx).with_min_len(8).enumerate().for_each(|(y, row)| {
                level.run(MatterRow { lattice, medium, samples, y, z, row });
            });
            self.done += 1;
        }
        if self.by_y.is_empty() {
            self.by_y = transposed(&self.by_x, self.texels);
        }
        true
    }

    /// The `v`-th row of the `k`-th plane of a sweep.
    #[inline(always)]
    pub fn row(&self, axes: Axes, k: usize, v: usize) -> &[f32] {
        let [nx, ny, nz] = self.texels;
        match axes.w {
            0 => &self.by_y[(k * nz + v) * ny..][..ny],
            1 => &self.by_x[(v * ny + k) * nx..][..nx],
            _ => &self.by_x[(k * ny + v) * nx..][..nx],
        }
    }

    /// The integral of opacity up to each of these values; `None` if they are extinctions.
    #[inline(always)]
    pub fn integrals<S: Lanes>(&self, simd: S, values: &[f32]) -> Option<Vec<f32>> {
        let function = self.integral.as_ref()?;
        let index = S::u32s::from_fn(simd, |lane| cast::fit_u32(lane));
        let mut integrals = vec![0.0; values.len()];
        for (first, out) in (0..).step_by(S::WIDTH).zip(integrals.chunks_mut(S::WIDTH)) {
            let values = simd.numbers(values, index + cast::fit_u32(first));
            out.copy_from_slice(&function.at(simd, values).integral.as_slice()[..out.len()]);
        }
        Some(integrals)
    }

    /// Mean extinction between where something `was` returned, NaN if nowhere, and here, where `value` was found; and what is found here.
    #[inline(always)]
    pub fn between<S: Lanes>(&self, simd: S, value: S::f32s, was: Found<S>) -> (S::f32s, Found<S>) {
        let Some(integral) = &self.integral else {
            let is_known = was[0].simd_eq(was[0]);
            return (is_known.select((value + was[0]) * 0.5, value), [value, value]);
        };
        let here = integral.at(simd, value);
        let mean = here.mean_since(simd, was) * self.density;
        let is_data = value.simd_ge(self.least);
        let nothing = S::f32s::splat(simd, f32::NAN);
        let found = [is_data.select(here.position, nothing), here.integral];
        (is_data.select(mean, S::f32s::splat(simd, 0.0)), found)
    }

    /// The integral of the opacity up to the value of each texel, in the table's units, x fastest, and that of any value; `None` if values do not tell
    /// the matter between texels.
    pub fn into_integrals(self) -> Option<Integrals> {
        let (function, mut at_texels) = (self.integral?, self.by_x);
        at_texels.par_chunks_mut(1 << 14).for_each(|values| {
            values.iter_mut().for_each(|value| *value = function.up_to(*value));
        });
        Some(Integrals { function, at_texels })
    }
}

/// Integrals of the opacity over data values.
#[derive(Debug)]
pub(super) struct Integrals {
    pub function: OpacityIntegral,
    pub at_texels: Vec<f32>,
}

/// `[z][y][x]` to `[x][z][y]`.
fn transposed(by_x: &[f32], [nx, ny, nz]: [usize; 3]) -> Vec<f32> {
    let mut by_y = vec![0.0; by_x.len()];
    by_y.par_chunks_exact_mut(ny * nz).enumerate().for_each(|(x, plane)| {
        for (i, value) in plane.iter_mut().enumerate() {
            *value = by_x[i * nx + x];
        }
    });
    by_y
}

struct MatterRow<'a> {
    lattice: &'a Lattice,
    medium: &'a Medium,
    /// Samples of extinction along each axis of a cell; 0 for the value at its middle.
    samples: usize,
    y: usize,
    z: usize,
    row: &'a mut [f32],
}

impl Kernel for MatterRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { lattice, medium, samples, y, z, row } = self;
        let spacing = lattice.spacing();
        let lane = S::f32s::from_fn(simd, |lane| lane as f32);
        let count = samples.max(1);
        let scale = medium.density() / (count * count * count) as f32;
        for (first, out) in (0..).step_by(S::WIDTH).zip(row.chunks_mut(S::WIDTH)) {
            let x = lane + first as f32;
            let mut sum = S::f32s::splat(simd, 0.0);
            for i in 0..count * count * count {
                let part = [i % count, i / count % count, i / (count * count)];
                let [dx, dy, dz] = [offset(part[0], count), offset(part[1], count), offset(part[2], count)];
                let position = [
                    (x + dx) * spacing[0],
                    S::f32s::splat(simd, (y as f32 + dy) * spacing[1]),
                    S::f32s::splat(simd, (z as f32 + dz) * spacing[2]),
                ];
                let value = medium.volume().value_lanes(simd, position);
                sum += if samples == 0 { value } else { medium.transfer().opacity_lanes(simd, value) * scale };
            }
            out.copy_from_slice(&sum.as_slice()[..out.len()]);
        }
    }
}

/// The middle of the `i`-th of so many parts of a cell, from the cell's middle.
fn offset(i: usize, count: usize) -> f32 {
    (i as f32 + 0.5) / count as f32 - 0.5
}
