//! Transmittance from the points of a lattice to points on lights.
//!
//! A *texel* is a lattice point; it holds one byte for each light point, side by side, so that a look-up interpolates vectors of them.
//! Each light point has a byte of its own: one number for a whole light would not do, since at the skin of matter half of a large
//! light is behind the surface.
//!
//! Texels are computed by sweeps, plane after plane away from the light: what reaches a texel is what reaches the point where its ray
//! crosses the plane before, less what is absorbed between the planes (`sweep`). That is short characteristics \[Kunasz88\]; its cost
//! does not depend on how far light travels.

mod lattice;
mod matter;
mod sweep;

pub(super) use lattice::Lattice;
pub(super) use sweep::Aim;

use super::Limits;
use crate::math::Vec3;
use crate::medium::Medium;
use crate::simd::{Lanes, Level, MOST_LANES};
use fearless_simd::prelude::*;
use matter::{Integrals, Matter};
use sweep::Sweeps;

/// Light points of a texel are padded to a multiple of this, so that every vector level reads whole vectors.
const PADDING: usize = MOST_LANES;

/// What a byte holds for a transmittance of 1.
const FULL: f32 = 255.0;

/// Bytes of a texel with this many light points.
pub(super) fn padded(points: usize) -> usize {
    points.next_multiple_of(PADDING)
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
    Sweeping(Box<Matter>, Box<Sweeps>),
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
                    let sweeps = Sweeps::new(&self.aims, &self.lattice, medium);
                    self.state = State::Sweeping(matter, Box::new(sweeps));
                }
                State::Sweeping(matter, mut sweeps) => {
                    let bytes = self.lattice.texels().iter().product::<usize>() * self.stride;
                    if self.texels.len() != bytes {
                        self.texels = vec![0; bytes];
                    }
                    if !sweeps.complete(&matter, &self.aims, medium, &mut self.texels, self.stride, level, limits) {
                        self.state = State::Sweeping(matter, sweeps);
                        return false;
                    }
                    self.integrals = matter.into_integrals();
                    self.state = State::Ready;
                }
            }
        }
    }

    /// The texels around an index-space position with a data value.
    #[inline(always)]
    pub fn around(&self, position: Vec3, value: f32) -> Corners<'_> {
        let cell = self.lattice.cell(position);
        let [nx, ny, nz] = self.lattice.texels();
        // An axis with one texel has no upper corner.
        let steps = [usize::from(nx > 1), if ny > 1 { nx } else { 0 }, if nz > 1 { nx * ny } else { 0 }];
        let mut corners = Corners { texels: [&[]; 8], weights: [0.0; 8], bend: 0.0, spread: 0.0 };
        let (mut mean, mut squares) = (0.0, 0.0);
        let here = self.integrals.as_ref().map_or(0.0, |integrals| integrals.function.up_to(value));
        for i in 0..8 {
            let upper = [i & 1, i >> 1 & 1, i >> 2];
            let texel = cell.first + upper[0] * steps[0] + upper[1] * steps[1] + upper[2] * steps[2];
            let first = texel * self.stride;
            corners.texels[i] = self.texels.get(first..first + self.stride).unwrap_or(&[]);
            let share = |a: usize| if upper[a] == 1 { cell.within[a] } else { 1.0 - cell.within[a] };
            let weight = share(0) * share(1) * share(2);
            corners.weights[i] = weight / FULL;
            if let Some(Integrals { at_texels, .. }) = &self.integrals {
                let apart = at_texels.get(texel).map_or(0.0, |integral| integral - here);
                mean += weight * apart;
                squares += weight * apart * apart;
            }
        }
        corners.bend = mean;
        corners.spread = (squares - mean * mean).max(0.0);
        corners
    }
}

/// The texels at the corners of a cell, and how the integral of opacity over data values varies between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners<'a> {
    texels: [&'a [u8]; 8],
    weights: [f32; 8],
    /// Mean of the corners' integrals less that of the position: how far interpolation overestimates it.
    bend: f32,
    /// Variance of the corners' integrals.
    spread: f32,
}

impl Corners<'_> {
    /// Transmittance to the light points from number `first` on, a multiple of the number of lanes. `thickness` is by how much optical
    /// thickness grows per unit of the integral.
    #[inline(always)]
    pub fn transmittance<S: Lanes>(&self, simd: S, first: usize, thickness: S::f32s) -> S::f32s {
        let mut sum = S::f32s::splat(simd, 0.0);
        for i in 0..8 {
            let numbers: S::i32s = simd.bytes(self.texels[i], first).bitcast();
            sum = numbers.to_float::<S::f32s>().mul_add(S::f32s::splat(simd, self.weights[i]), sum);
        }
        // Within a skin of matter, optical thickness is a linear function of the integral, so that the transmittance at each corner is
        // that of the position times the exponential of their distance in thickness; here to second order.
        let less = (thickness * self.bend).max(-MOST_BEND).min(MOST_BEND);
        let grows = (less * 0.5 + 1.0) * less + 1.0;
        let excess = (thickness * thickness * (0.5 * self.spread)).min(MOST_BEND) + 1.0;
        (sum * grows / excess).max(0.0).min(1.0)
    }
}

/// Largest correction of an interpolated thickness.
const MOST_BEND: f32 = 0.7;

#[cfg(test)]
mod tests;
