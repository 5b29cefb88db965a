//! Transmittance from the points of a lattice to points on lights.
//!
//! A *texel* is a lattice point; it holds one byte for each light point, side by side, so that a look-up interpolates vectors of them.
//! Each light point has a byte of its own: one number for a whole light would not do, since at the skin of matter half of a large
//! light is behind the surface.
//!
//! Texels are computed by sweeps, plane after plane away from the light, with rays that pass from plane to plane (`fan`); the cost does
//! not depend on how far light travels. Only bricks of texels near matter are kept (`bricks`).

mod bricks;
mod course;
mod fan;
mod lattice;
mod rows;
mod slab;
mod step;
mod sweeps;
mod texels;

use bricks::{Bricks, EDGE, OpaqueCells};
use lattice::Lattice;

use super::{Limits, drop_elsewhere};
use crate::math::{Mat3, Vec3, cast};
use crate::medium::{HalfSpace, Medium};
use crate::simd::{Lanes, Level, MOST_LANES};
use crate::volume::Grid;
use fearless_simd::prelude::*;
use sweeps::{Sweeps, Texels};

/// Light points of a texel are padded to a multiple of this, so that every vector level reads whole vectors.
const PADDING: usize = MOST_LANES;

/// Distance, in cells, below which rounding decides on which side of a texel a light point is.
const CLOSE: f32 = 1e-3;

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

/// What is needed to measure lengths between texels, and where matter is cut away.
#[derive(Debug)]
struct Surroundings {
    /// Products of the vectors of the lattice's units, in lengths of [`Lattice::length_unit`]: squared lengths follow.
    metric: Mat3,
    /// What is cut away, in units of the lattice.
    cuts: Vec<HalfSpace>,
}

impl Surroundings {
    fn new(lattice: &Lattice, medium: &Medium) -> Self {
        let units = lattice.units(medium.volume().grid());
        let spacing = Vec3::from_array(lattice.spacing());
        // In units of the lattice, index space begins half a voxel from its first texel.
        let cut = |half: &HalfSpace| HalfSpace {
            normal: half.normal * spacing,
            offset: half.offset + 0.5 * half.normal.element_sum(),
        };
        Self {
            metric: units.transpose() * units,
            cuts: medium.clip().half_spaces().iter().map(cut).collect(),
        }
    }
}

/// A lattice and those of its bricks that are kept.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    lattice: Lattice,
    bricks: Bricks,
}

/// Spacing of texels, in voxels, that suffices where matter is no steeper than in scans.
const USUAL: f32 = 0.5;
/// Finest spacing, where there is memory for it: small volumes often have hard edges.
const FINEST: f32 = 0.25;
/// Coarsest spacing.
const COARSEST: f32 = 8.0;
/// By how much spacings grow until texels fit.
const COARSER: f32 = 1.02;
/// About the bytes of texels that are finer than usual: they take a fraction of a second to compute.
const BYTES_OF_FINER: u64 = 128 << 20;
/// Most bricks of a lattice, kept or not: four bytes are spent on each.
const MOST_BRICKS: usize = 1 << 24;

impl Layout {
    /// The finest one whose texels of so many light points take at most `most_bytes`; `None` if there is none that is fine enough.
    pub fn within(medium: &Medium, points: usize, most_bytes: u64) -> Option<Self> {
        let opaque = OpaqueCells::new(medium);
        let lattice = |voxels: f32| Lattice::new(medium.volume().grid(), voxels);
        let layout = |voxels: f32| {
            let lattice = lattice(voxels);
            Self { bricks: Bricks::new(&lattice, &opaque), lattice }
        };
        let mut voxels = USUAL;
        while Bricks::number(&lattice(voxels)) > MOST_BRICKS {
            voxels *= COARSER;
        }
        let usual = layout(voxels);
        // By how much wider the same bytes would be filled, if matter filled the same share of them.
        let wider = |bytes: u64| cast::single((usual.bytes(points) as f64 / bytes as f64).cbrt());
        if voxels == USUAL && usual.bytes(points) <= BYTES_OF_FINER.min(most_bytes) {
            let mut finer = (USUAL * wider(BYTES_OF_FINER)).max(FINEST);
            while Bricks::number(&lattice(finer)) > MOST_BRICKS {
                finer = (finer * COARSER).min(USUAL);
            }
            return Some(layout(finer));
        }
        voxels *= wider(most_bytes).max(1.0);
        let spacings = std::iter::successors(Some(voxels), |voxels| Some(voxels * COARSER));
        let mut layouts = spacings.take_while(|&voxels| voxels <= COARSEST).map(layout);
        layouts.find(|layout| layout.bytes(points) <= most_bytes)
    }

    /// Bytes that its texels take.
    pub fn bytes(&self, points: usize) -> u64 {
        (self.bricks.texels() as u64).saturating_mul(padded(points) as u64)
    }

    /// About the bytes that the rays of a sweep take, and the matter that they meet.
    pub fn bytes_of_sweeps(&self, points: usize) -> u64 {
        sweeps::most_bytes(self.lattice.texels(), points)
    }

    /// Optical thickness from texel to texel in the densest matter, over the mean edge of a voxel.
    pub fn thickness(&self, medium: &Medium) -> f32 {
        let [_, most] = medium.transfer().opacity_range(medium.volume().value_range().map(cast::single));
        let voxels = self.lattice.spacing().into_iter().fold(0.0, f32::max);
        medium.density() * most * (voxels * medium.volume().grid().voxel_size())
    }

    /// Whether texels are more than a voxel apart.
    pub fn is_coarse(&self) -> bool {
        self.lattice.spacing().iter().any(|&voxels| voxels > 1.0)
    }

    /// Where a light is in units of the lattice.
    pub fn aim_at(&self, grid: &Grid, position: Vec3) -> Aim {
        Aim::At(self.lattice.index_to_lattice(grid.world_to_index(position)))
    }

    /// Where a distant light is, in a world direction, in units of the lattice.
    pub fn aim_towards(&self, grid: &Grid, direction: Vec3) -> Aim {
        Aim::Distant(grid.direction_to_index(direction) / Vec3::from_array(self.lattice.spacing()))
    }
}

/// See the module.
#[derive(Debug)]
pub(super) struct ShadowGrid {
    layout: Layout,
    /// The light points, in lattice units.
    aims: Vec<Aim>,
    /// Bytes of a texel.
    stride: usize,
    /// Brick by brick; x fastest.
    texels: Vec<u8>,
    state: State,
}

/// How far the texels are.
#[derive(Debug)]
enum State {
    Empty,
    Sweeping(Sweeps),
    Ready,
}

impl ShadowGrid {
    /// With nothing computed yet; `aims` are in lattice units.
    pub fn new(layout: Layout, aims: Vec<Aim>) -> Self {
        Self { stride: padded(aims.len()), texels: Vec::new(), layout, aims, state: State::Empty }
    }

    /// Forgets all texels but keeps their memory.
    pub fn restart(&mut self) {
        self.state = State::Empty;
    }

    /// Uses the memory of a grid that is no longer needed, so that there are never two.
    pub fn take_memory(&mut self, other: &mut Self) {
        self.texels = std::mem::take(&mut other.texels);
    }

    /// Whether another grid would hold the same, but for the medium.
    pub fn is_like(&self, other: &Self) -> bool {
        self.layout == other.layout && self.aims == other.aims
    }

    /// Whether all texels are computed.
    pub fn is_ready(&self) -> bool {
        matches!(self.state, State::Ready)
    }

    /// Computes what is missing, in parallel on the current pool; false if stopped first.
    pub fn complete(&mut self, medium: &Medium, level: Level, limits: &Limits) -> bool {
        let Layout { lattice, bricks } = &self.layout;
        if matches!(self.state, State::Empty) {
            let bytes = bricks.texels() * self.stride;
            if self.texels.len() < bytes {
                // Growing would copy texels that are all written anew, and clear the rest; new memory is clear already.
                drop_elsewhere(std::mem::take(&mut self.texels));
                self.texels = vec![0; bytes];
            }
            self.texels.truncate(bytes);
            self.state = State::Sweeping(Sweeps::new(&self.aims, lattice.texels()));
        }
        if let State::Sweeping(sweeps) = &mut self.state {
            let around = Surroundings::new(lattice, medium);
            let mut texels = Texels { lattice, bricks, bytes: &mut self.texels, stride: self.stride };
            if !sweeps.complete(&self.aims, medium, &around, &mut texels, level, limits) {
                return false;
            }
            self.light_up_near_points();
            self.state = State::Ready;
        }
        true
    }

    /// No ray goes to a texel that a light point is on: it is fully lit.
    fn light_up_near_points(&mut self) {
        let last = self.layout.lattice.texels().map(|n| (n - 1) as f32);
        for (point, aim) in self.aims.iter().enumerate() {
            let Aim::At(p) = *aim else { continue };
            let texel = p.round();
            let is_inside = (0..3).all(|a| (0.0..=last[a]).contains(&texel[a]));
            if is_inside
                && texel.distance(p) < CLOSE
                && let Some(texel) = self.texel(texel.to_array().map(cast::index))
            {
                self.texels[texel * self.stride + point] = u8::MAX;
            }
        }
    }

    /// Where index-space positions are among the texels.
    #[inline(always)]
    pub fn places<S: Lanes>(&self, simd: S, [x, y, z]: [S::f32s; 3]) -> Places {
        let mut places = Places { lower: [[0; MOST_LANES]; 3], weights: [[0.0; MOST_LANES]; 8] };
        let x = self.place_along(simd, 0, x, &mut places);
        let y = self.place_along(simd, 1, y, &mut places);
        let z = self.place_along(simd, 2, z, &mut places);
        for i in 0..8 {
            let weight = x[i & 1] * y[i >> 1 & 1] * (z[i >> 2] * (1.0 / FULL));
            weight.store_slice(&mut places.weights[i][..S::WIDTH]);
        }
        places
    }

    /// Finds the texels on either side along an axis, and returns their shares.
    #[inline(always)]
    fn place_along<S: Lanes>(&self, simd: S, a: usize, index: S::f32s, places: &mut Places) -> [S::f32s; 2] {
        let lattice = &self.layout.lattice;
        let last = lattice.texels()[a] - 1;
        let at = (index + 0.5) * (1.0 / lattice.spacing()[a]);
        let at = at.max(S::f32s::splat(simd, 0.0)).min(last as f32);
        let lower: S::i32s = at.to_int();
        let lower = lower.min(S::i32s::splat(simd, cast::fit_u32(last - 1).cast_signed()));
        lower.store_slice(&mut places.lower[a][..S::WIDTH]);
        let upper = at - lower.to_float::<S::f32s>();
        [-upper + 1.0, upper]
    }

    /// The texels around a lane's position.
    #[inline(always)]
    pub fn corners(&self, places: &Places, lane: usize) -> Corners<'_> {
        let at = |a: usize| places.lower[a][lane].cast_unsigned() as usize;
        let lower = [at(0), at(1), at(2)];
        let mut corners = Corners { texels: [&[]; 8], weights: [0.0; 8] };
        // Most cells lie within a brick.
        let is_within =
            lower[0] % EDGE < EDGE - 1 && lower[1] % EDGE < EDGE - 1 && lower[2] % EDGE < EDGE - 1;
        let first = if is_within { self.texel(lower) } else { None };
        for i in 0..8 {
            let (ux, uy, uz) = (i & 1, i >> 1 & 1, i >> 2);
            let texel = if is_within {
                first.map(|first| first + ux + EDGE * (uy + EDGE * uz))
            } else {
                self.texel([lower[0] + ux, lower[1] + uy, lower[2] + uz])
            };
            if let Some(texel) = texel {
                corners.texels[i] =
                    self.texels.get(texel * self.stride..(texel + 1) * self.stride).unwrap_or(&[]);
            }
            corners.weights[i] = places.weights[i][lane];
        }
        corners
    }

    /// The number of a texel, if it is kept.
    #[inline(always)]
    fn texel(&self, [x, y, z]: [usize; 3]) -> Option<usize> {
        let first = self.layout.bricks.first_texel([x / EDGE, y / EDGE, z / EDGE])?;
        Some(first + x % EDGE + EDGE * (y % EDGE + EDGE * (z % EDGE)))
    }
}

/// Where positions are among the texels, one per lane.
pub(super) struct Places {
    /// The coordinates of the lowest texel around.
    lower: [[i32; MOST_LANES]; 3],
    /// Shares of the eight texels around, over [`FULL`].
    weights: [[f32; MOST_LANES]; 8],
}

/// The texels at the corners of a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners<'a> {
    texels: [&'a [u8]; 8],
    /// Their shares at the position, over [`FULL`].
    weights: [f32; 8],
}

impl Corners<'_> {
    /// Transmittance to the light points from number `first` on, a multiple of the number of lanes.
    #[inline(always)]
    pub fn transmittance<S: Lanes>(&self, simd: S, first: usize) -> S::f32s {
        let mut kept = S::f32s::splat(simd, 0.0);
        for i in 0..8 {
            let numbers: S::i32s = simd.bytes(self.texels[i], first).bitcast();
            kept = numbers.to_float::<S::f32s>().mul_add(S::f32s::splat(simd, self.weights[i]), kept);
        }
        kept
    }
}

#[cfg(test)]
mod tests;
