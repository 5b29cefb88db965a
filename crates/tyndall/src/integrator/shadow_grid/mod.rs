//! Transmittance from the points of a lattice to points on lights.
//!
//! A *texel* is a lattice point; it holds one byte for each light point, side by side, so that a look-up interpolates vectors of them.
//! Each light point has a byte of its own: one number for a whole light would not do, since at the skin of matter half of a large
//! light is behind the surface.
//!
//! Texels are computed by sweeps, plane after plane away from the light, with rays that pass from plane to plane (`fan`); the cost does
//! not depend on how far light travels.

mod fan;
mod lattice;
mod matter;
mod sweeps;

pub(super) use lattice::Lattice;

use super::Limits;
use crate::math::{Mat3, Vec3};
use crate::medium::{HalfSpace, Medium};
use crate::simd::{Lanes, Level, MOST_LANES};
use fearless_simd::prelude::*;
use matter::{Integrals, Matter};
use sweeps::Sweeps;

/// Light points of a texel are padded to a multiple of this, so that every vector level reads whole vectors.
const PADDING: usize = MOST_LANES;

/// What a byte holds for a transmittance of 1.
const FULL: f32 = 255.0;

/// Bytes of a texel with this many light points.
pub(super) fn padded(points: usize) -> usize {
    points.next_multiple_of(PADDING)
}

/// Where a light point is, in units of the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Aim {
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

/// See the module.
#[derive(Debug)]
pub(super) struct ShadowGrid {
    lattice: Lattice,
    /// The light points, in lattice units.
    aims: Vec<Aim>,
    /// Bytes of a texel.
    stride: usize,
    /// x fastest.
    texels: Vec<u8>,
    /// `None` where values do not tell the matter between texels.
    integrals: Option<Integrals>,
    state: State,
}

/// How far the texels are.
#[derive(Debug)]
enum State {
    Empty,
    /// The matter at the texels is being computed.
    Matter(Box<Matter>),
    Sweeping(Box<Matter>, Sweeps),
    Ready,
}

impl ShadowGrid {
    /// With nothing computed yet; `aims` are in lattice units.
    pub fn new(lattice: Lattice, aims: Vec<Aim>) -> Self {
        let state = State::Empty;
        Self { stride: padded(aims.len()), texels: Vec::new(), integrals: None, lattice, aims, state }
    }

    /// Forgets all texels but keeps their memory.
    pub fn restart(&mut self) {
        self.state = State::Empty;
    }

    /// Whether another grid would hold the same, but for the medium.
    pub fn is_like(&self, other: &Self) -> bool {
        self.lattice == other.lattice && self.aims == other.aims
    }

    /// Whether all texels are computed.
    pub fn is_ready(&self) -> bool {
        matches!(self.state, State::Ready)
    }

    /// Computes what is missing, in parallel on the current pool; false if stopped first.
    pub fn complete(&mut self, medium: &Medium, level: Level, limits: &Limits) -> bool {
        loop {
            match std::mem::replace(&mut self.state, State::Empty) {
                State::Ready => {
                    self.state = State::Ready;
                    return true;
                }
                State::Empty => {
                    self.state = State::Matter(Box::new(Matter::new(&self.lattice, medium)));
                }
                State::Matter(mut matter) => {
                    if !matter.complete(&self.lattice, medium, level, limits) {
                        self.state = State::Matter(matter);
                        return false;
                    }
                    let sweeps = Sweeps::new(&self.aims, self.lattice.texels());
                    self.state = State::Sweeping(matter, sweeps);
                }
                State::Sweeping(matter, mut sweeps) => {
                    let bytes = self.lattice.texels().iter().product::<usize>() * self.stride;
                    if self.texels.len() != bytes {
                        self.texels = vec![0; bytes];
                    }
                    let around = Surroundings::new(&self.lattice, medium);
                    if !sweeps.complete(&matter, &around, &mut self.texels, self.stride, level, limits) {
                        self.state = State::Sweeping(matter, sweeps);
                        return false;
                    }
                    self.integrals = matter.into_integrals();
                    self.state = State::Ready;
                }
            }
        }
    }

    /// Data values per unit of the integrals; `None` where values do not tell the matter between texels.
    pub fn integral_unit(&self) -> Option<f64> {
        self.integrals.as_ref().map(|integrals| integrals.function.unit())
    }

    /// The texels around an index-space position with a data value.
    #[inline(always)]
    pub fn around(&self, position: Vec3, value: f32) -> Corners<'_> {
        let cell = self.lattice.cell(position);
        let [nx, ny, nz] = self.lattice.texels();
        // An axis with one texel has no upper corner.
        let steps = [usize::from(nx > 1), if ny > 1 { nx } else { 0 }, if nz > 1 { nx * ny } else { 0 }];
        let mut corners = Corners { texels: [&[]; 8], weights: [0.0; 8], moments: [[0.0; 8]; 3], widest: 0.0 };
        let here = self.integrals.as_ref().map_or(0.0, |integrals| integrals.function.up_to(value));
        for i in 0..8 {
            let upper = [i & 1, i >> 1 & 1, i >> 2];
            let texel = cell.first + upper[0] * steps[0] + upper[1] * steps[1] + upper[2] * steps[2];
            let first = texel * self.stride;
            corners.texels[i] = self.texels.get(first..first + self.stride).unwrap_or(&[]);
            let share = |a: usize| if upper[a] == 1 { cell.within[a] } else { 1.0 - cell.within[a] };
            corners.weights[i] = share(0) * share(1) * share(2) / FULL;
            if let Some(Integrals { at_texels, .. }) = &self.integrals {
                let beyond = at_texels.get(texel).map_or(0.0, |integral| integral - here);
                let first = corners.weights[i] * beyond;
                let second = first * beyond * 0.5;
                let moments = [first, second, second * beyond * (1.0 / 3.0)];
                for (all, moment) in corners.moments.iter_mut().zip(moments) {
                    all[i] = moment;
                }
                corners.widest = corners.widest.max(beyond.abs());
            }
        }
        corners
    }
}

/// The texels at the corners of a cell, and how the integral of opacity over data values varies between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners<'a> {
    texels: [&'a [u8]; 8],
    /// Their shares at the position, over [`FULL`].
    weights: [f32; 8],
    /// Powers 1 to 3 of how much their integrals exceed that of the position, over the factorials of the powers, times the weights.
    moments: [[f32; 8]; 3],
    /// The largest of these excesses.
    widest: f32,
}

/// Largest thickness by which a corner's transmittance is corrected.
const MOST_CORRECTED: f32 = 1.2;

impl Corners<'_> {
    /// Transmittance to the light points from number `first` on, a multiple of the number of lanes. `steepness` is by how much optical
    /// thickness grows with the integral where the position is.
    ///
    /// Each corner contributes what would reach the position if all that lies between them were a skin of matter in which thickness
    /// depends on the data value alone: its transmittance times the exponential, as a polynomial, of the difference in thickness.
    #[inline(always)]
    pub fn transmittance<S: Lanes>(&self, simd: S, first: usize, steepness: S::f32s) -> S::f32s {
        let zero = S::f32s::splat(simd, 0.0);
        let [mut constant, mut linear, mut square, mut cube] = [zero; 4];
        let [firsts, seconds, thirds] = &self.moments;
        for i in 0..8 {
            let numbers: S::i32s = simd.bytes(self.texels[i], first).bitcast();
            let kept = numbers.to_float::<S::f32s>();
            constant = kept.mul_add(S::f32s::splat(simd, self.weights[i]), constant);
            linear = kept.mul_add(S::f32s::splat(simd, firsts[i]), linear);
            square = kept.mul_add(S::f32s::splat(simd, seconds[i]), square);
            cube = kept.mul_add(S::f32s::splat(simd, thirds[i]), cube);
        }
        let most = S::f32s::splat(simd, MOST_CORRECTED / self.widest.max(f32::MIN_POSITIVE));
        let k = steepness.max(-most).min(most);
        let kept = ((cube * k + square) * k + linear) * k + constant;
        kept.max(zero).min(1.0)
    }
}

#[cfg(test)]
mod tests;
