//! The photon map: interactions sorted by the cell of a grid.

use super::kernel::Points;
use super::settings::Estimator;
use super::stored::Photon;
use crate::integrator::cells::{CellGrid, CellStarts, KEY_BYTES, Positioned, SortedItems};
use crate::integrator::light_paths::Chunk;
use crate::math::{DVec3, Vec3, cast};
use crate::medium::Medium;
use rayon::prelude::*;
use std::ops::Range;

/// Interactions sorted by cell, then by light, path and bounce, so that sums do not depend on when they were traced.
/// Arrays are padded at the end by a whole vector.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PhotonMap {
    pub(super) grid: CellGrid,
    /// World units.
    pub(super) radius: f32,
    pub(super) points: Points,
    pub(super) estimate: Estimator,
    starts: CellStarts,
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) z: Vec<f32>,
    pub(super) directions: Vec<u32>,
    /// Flux divided by density and by the radius cubed.
    pub(super) red: Vec<f32>,
    pub(super) green: Vec<f32>,
    pub(super) blue: Vec<f32>,
    /// Reciprocal of the opacity at the photon's position.
    pub(super) per_opacity: Vec<f32>,
}

/// Chunks of one light, with the factor for their photons' flux.
pub(super) struct Lit<'a> {
    pub chunks: &'a [Chunk<Photon>],
    pub scale: DVec3,
}

/// Bytes of a photon in the map, and of its sorting key.
pub(super) const BYTES: u64 = 32 + KEY_BYTES;

impl PhotonMap {
    /// Sorts the photons of all lights; `radius` in world units.
    pub fn new(medium: &Medium, grid: CellGrid, radius: f32, estimate: Estimator, lights: &[Lit]) -> Self {
        let chunks: Vec<(&[Photon], DVec3)> = lights
            .iter()
            .flat_map(|lit| lit.chunks.iter().map(|chunk| (chunk.vertices(), lit.scale)))
            .collect();
        let lists: Vec<&[Photon]> = chunks.iter().map(|chunk| chunk.0).collect();
        let sorted = SortedItems::new(&grid, &lists);
        let room = sorted.len() + crate::medium::MOST_LANES;
        let mut map = Self {
            radius,
            points: Points::new(),
            estimate,
            grid,
            starts: sorted.starts.clone(),
            x: vec![0.0; room],
            y: vec![0.0; room],
            z: vec![0.0; room],
            directions: vec![0; room],
            red: vec![0.0; room],
            green: vec![0.0; room],
            blue: vec![0.0; room],
            per_opacity: vec![0.0; room],
        };
        let positions = (&mut map.x, &mut map.y, &mut map.z, &mut map.directions);
        let weights = (&mut map.red, &mut map.green, &mut map.blue, &mut map.per_opacity);
        let ((x, y, z, directions), (red, green, blue, per_opacity)) = (positions, weights);
        (sorted.addresses(), x, y, z, directions, red, green, blue, per_opacity).into_par_iter().for_each(
            |(address, x, y, z, direction, red, green, blue, per_opacity)| {
                let (photons, scale) = chunks[address.list];
                let photon = photons[address.index];
                [*x, *y, *z] = grid.to_metric(photon.position()).to_array();
                *direction = photon.direction.word();
                let value = medium.volume().value(photon.position());
                *per_opacity = medium.transfer().opacity(value).recip();
                let flux = Vec3::from_array(photon.flux).as_dvec3() * scale;
                [*red, *green, *blue] = flux.to_array().map(cast::single);
            },
        );
        map
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        4 * 8 * self.x.len() + self.starts.bytes()
    }

    /// The range of photons in the cells of a row, which is contiguous.
    #[inline(always)]
    pub fn row(&self, xs: [usize; 2], y: usize, z: usize) -> Range<usize> {
        self.starts.row(&self.grid, xs, y, z)
    }
}
