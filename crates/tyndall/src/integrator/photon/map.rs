//! The photon map: interactions sorted by the cell of a grid.

use super::chunk::Chunk;
use super::grid::CellGrid;
use super::kernel::Points;
use super::settings::Estimator;
use crate::math::{DVec3, Vec3, cast};
use crate::medium::Medium;
use rayon::prelude::*;

/// Interactions in the order of their cells, then of lights, paths and bounces, so that sums do not depend on what was
/// traced when. Arrays end with room for a whole vector.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PhotonMap {
    pub(super) grid: CellGrid,
    /// World units.
    pub(super) radius: f32,
    pub(super) points: Points,
    pub(super) estimate: Estimator,
    /// Where each cell begins.
    starts: Vec<u32>,
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) z: Vec<f32>,
    pub(super) directions: Vec<u32>,
    /// Flux, over density and radius cubed.
    pub(super) red: Vec<f32>,
    pub(super) green: Vec<f32>,
    pub(super) blue: Vec<f32>,
    /// One over the opacity where the photon is.
    pub(super) per_opacity: Vec<f32>,
}

/// Chunks of one light, with what their photons' flux is to be multiplied by.
pub(super) struct Lit<'a> {
    pub chunks: &'a [Chunk],
    pub scale: DVec3,
}

/// Bytes of a photon in the map, and of its sorting key.
pub(super) const BYTES: u64 = 32 + 8;

/// Bits of a sorting key for the place in a chunk, then for the chunk, then for the cell.
const PLACE_BITS: u32 = 20;
const CHUNK_BITS: u32 = 20;

impl PhotonMap {
    /// Sorts the photons of all lights; `radius` in world units.
    pub fn new(medium: &Medium, grid: CellGrid, radius: f32, estimate: Estimator, lights: &[Lit]) -> Self {
        let chunks: Vec<(&Chunk, DVec3)> =
            lights.iter().flat_map(|lit| lit.chunks.iter().map(|chunk| (chunk, lit.scale))).collect();
        assert!(chunks.len() < 1 << CHUNK_BITS, "{} chunks", chunks.len());
        let mut keys: Vec<u64> = chunks
            .par_iter()
            .enumerate()
            .flat_map_iter(|(number, (chunk, _))| {
                assert!(chunk.photons().len() < 1 << PLACE_BITS, "{} photons", chunk.photons().len());
                chunk.photons().iter().enumerate().map(move |(place, photon)| {
                    let cell = grid.number(grid.cell(grid.to_metric(photon.index_place())));
                    ((cell as u64) << CHUNK_BITS | number as u64) << PLACE_BITS | place as u64
                })
            })
            .collect();
        keys.par_sort_unstable();

        let cell = |key: u64| key >> (CHUNK_BITS + PLACE_BITS);
        let mut starts = Vec::with_capacity(grid.len() + 1);
        for (i, &key) in keys.iter().enumerate() {
            while starts.len() as u64 <= cell(key) {
                starts.push(cast::fit_u32(i));
            }
        }
        starts.resize(grid.len() + 1, cast::fit_u32(keys.len()));

        let room = keys.len() + crate::medium::MOST_LANES;
        let mut map = Self {
            radius,
            points: Points::new(),
            estimate,
            grid,
            starts,
            x: vec![0.0; room],
            y: vec![0.0; room],
            z: vec![0.0; room],
            directions: vec![0; room],
            red: vec![0.0; room],
            green: vec![0.0; room],
            blue: vec![0.0; room],
            per_opacity: vec![0.0; room],
        };
        let places = (&mut map.x, &mut map.y, &mut map.z, &mut map.directions);
        let weights = (&mut map.red, &mut map.green, &mut map.blue, &mut map.per_opacity);
        let ((x, y, z, directions), (red, green, blue, per_opacity)) = (places, weights);
        (&keys, x, y, z, directions, red, green, blue, per_opacity).into_par_iter().for_each(
            |(key, x, y, z, direction, red, green, blue, per_opacity)| {
                let (chunk, scale) =
                    chunks[cast::low_u32(key >> PLACE_BITS & ((1 << CHUNK_BITS) - 1)) as usize];
                let photon = chunk.photons()[cast::low_u32(key & ((1 << PLACE_BITS) - 1)) as usize];
                [*x, *y, *z] = grid.to_metric(photon.index_place()).to_array();
                *direction = photon.direction.word();
                let value = medium.volume().value(photon.index_place());
                *per_opacity = medium.transfer().opacity(value).recip();
                let flux = Vec3::from_array(photon.flux).as_dvec3() * scale;
                [*red, *green, *blue] = flux.to_array().map(cast::single);
            },
        );
        map
    }

    /// Bytes kept.
    pub fn bytes(&self) -> usize {
        4 * (8 * self.x.len() + self.starts.len())
    }

    /// The range of photons in the cells of a row, which lie side by side.
    #[inline(always)]
    pub fn row(&self, [x0, x1]: [usize; 2], y: usize, z: usize) -> [usize; 2] {
        let first = self.starts[self.grid.number([x0, y, z])];
        let end = self.starts[self.grid.number([x1, y, z]) + 1];
        [first as usize, end as usize]
    }
}
