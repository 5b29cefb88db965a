//! The photon map: interactions sorted by the cell of a grid.

use super::kernel::Points;
use super::settings::Estimator;
use super::stored::Photon;
use crate::integrator::cells::{
    CellGrid, CellSort, CellStarts, KEY_BYTES, Positioned, SortedAddresses, SortedItems,
};
use crate::integrator::light_paths::Chunk;
use crate::integrator::{Limits, drop_elsewhere};
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

/// Bytes of a photon in the map, and of its sorting keys.
pub(super) const BYTES: u64 = 32 + KEY_BYTES;

/// Photons that are written into the map at once: some tenths of a millisecond's work.
const PIECE: usize = 1 << 12;

/// Chunks of one light, with the factor for their photons' flux.
pub(super) struct Lit<'a> {
    pub chunks: &'a [Chunk<Photon>],
    pub scale: DVec3,
}

/// Parameters of a map.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapSettings {
    pub grid: CellGrid,
    /// World units.
    pub radius: f32,
    pub estimate: Estimator,
}

/// A map being built, piece by piece, so that a stop takes effect soon and the work can be resumed.
#[derive(Debug)]
pub(super) struct MapInProgress {
    sort: CellSort,
    /// `None` until the photons are sorted.
    filling: Option<Filling>,
}

/// Addresses of sorted photons, and the map into which some pieces of them have been written.
#[derive(Debug)]
struct Filling {
    items: SortedAddresses,
    map: PhotonMap,
    filled: Vec<bool>,
}

/// The states of a map.
#[derive(Debug, Default)]
pub(super) enum MapState {
    /// It was never built, or photons have changed since.
    #[default]
    Absent,
    InProgress(MapInProgress),
    Ready(PhotonMap),
}

impl MapState {
    pub fn ready(&self) -> Option<&PhotonMap> {
        match self {
            Self::Ready(map) => Some(map),
            Self::Absent | Self::InProgress(_) => None,
        }
    }

    /// Discards the map, because photons change.
    pub fn discard(&mut self) {
        self.become_state(Self::Absent);
    }

    fn become_state(&mut self, state: Self) {
        match std::mem::replace(self, state) {
            Self::Absent => {}
            old => drop_elsewhere(old),
        }
    }

    /// Builds the map, or continues to; false if stopped first. See [`MapInProgress::go_on`].
    pub fn build(
        &mut self,
        medium: &Medium,
        settings: &MapSettings,
        lights: &[Lit],
        limits: &Limits,
    ) -> bool {
        if let Self::Absent = self {
            *self = Self::InProgress(MapInProgress::new(settings, lights));
        }
        if let Self::InProgress(map) = self
            && let Some(map) = map.go_on(medium, settings, lights, limits)
        {
            self.become_state(Self::Ready(map));
        }
        self.ready().is_some()
    }
}

impl MapInProgress {
    /// Starts a map of the photons of all lights, which must not change until it is complete.
    pub fn new(settings: &MapSettings, lights: &[Lit]) -> Self {
        let lengths = lights.iter().flat_map(|lit| lit.chunks).map(|chunk| chunk.vertices().len());
        Self { sort: CellSort::new(&settings.grid, lengths), filling: None }
    }

    /// Continues, in parallel on the current pool; `None` if stopped first. Photons and settings must be the same in every call.
    pub fn go_on(
        &mut self,
        medium: &Medium,
        settings: &MapSettings,
        lights: &[Lit],
        limits: &Limits,
    ) -> Option<PhotonMap> {
        let chunks: Vec<(&[Photon], DVec3)> = lights
            .iter()
            .flat_map(|lit| lit.chunks.iter().map(|chunk| (chunk.vertices(), lit.scale)))
            .collect();
        if self.filling.is_none() {
            let lists: Vec<&[Photon]> = chunks.iter().map(|chunk| chunk.0).collect();
            self.filling = self.sort.go_on(&settings.grid, &lists, limits).map(|sorted| {
                let SortedItems { items, starts } = sorted;
                let map = PhotonMap::with_room(settings, starts, items.len());
                let filled = vec![false; items.len().div_ceil(PIECE)];
                Filling { items, map, filled }
            });
        }
        let Filling { items, map, filled } = self.filling.as_mut()?;
        map.fill(medium, items, &chunks, filled, limits);
        if filled.contains(&false) {
            return None;
        }
        let Filling { items, map, .. } = self.filling.take()?;
        drop_elsewhere(items);
        Some(map)
    }
}

impl PhotonMap {
    /// A map with room for photons in these cells, and for a whole vector after the last.
    fn with_room(settings: &MapSettings, starts: CellStarts, photons: usize) -> Self {
        let MapSettings { grid, radius, estimate } = *settings;
        let room = photons + crate::simd::MOST_LANES;
        let zeros = || vec![0.0; room];
        Self {
            radius,
            points: Points::new(),
            estimate,
            grid,
            starts,
            x: zeros(),
            y: zeros(),
            z: zeros(),
            directions: vec![0; room],
            red: zeros(),
            green: zeros(),
            blue: zeros(),
            per_opacity: zeros(),
        }
    }

    /// Writes the pieces of the sorted photons that are not `filled` yet.
    fn fill(
        &mut self,
        medium: &Medium,
        items: &SortedAddresses,
        chunks: &[(&[Photon], DVec3)],
        filled: &mut [bool],
        limits: &Limits,
    ) {
        let grid = self.grid;
        let positions = (
            self.x.par_chunks_mut(PIECE),
            self.y.par_chunks_mut(PIECE),
            self.z.par_chunks_mut(PIECE),
            self.directions.par_chunks_mut(PIECE),
        );
        let weights = (
            self.red.par_chunks_mut(PIECE),
            self.green.par_chunks_mut(PIECE),
            self.blue.par_chunks_mut(PIECE),
            self.per_opacity.par_chunks_mut(PIECE),
        );
        let ((xs, ys, zs, directions), (reds, greens, blues, per_opacities)) = (positions, weights);
        (filled, xs, ys, zs, directions, reds, greens, blues, per_opacities)
            .into_par_iter()
            .enumerate()
            .with_max_len(1)
            .for_each(|(piece, (filled, x, y, z, direction, red, green, blue, per_opacity))| {
                if *filled || limits.stop().reached() {
                    return;
                }
                let first = piece * PIECE;
                for i in 0..PIECE.min(items.len() - first) {
                    let address = items.address(first + i);
                    let (photons, scale) = chunks[address.list];
                    let photon = photons[address.index];
                    [x[i], y[i], z[i]] = grid.to_metric(photon.position()).to_array();
                    direction[i] = photon.direction.word();
                    let value = medium.volume().value(photon.position());
                    per_opacity[i] = medium.transfer().opacity(value).recip();
                    let flux = Vec3::from_array(photon.flux).as_dvec3() * scale;
                    [red[i], green[i], blue[i]] = flux.to_array().map(cast::single);
                }
                *filled = true;
            });
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
