//! The photon map: interactions sorted by the cell of a grid, and what they tell about the light at a place
//! \[Jonsson12, eq. 8\].

use super::chunk::Chunk;
use super::grid::CellGrid;
use super::kernel::Kernel;
use crate::math::{PackedDirection, Rgb, Vec3, cast};
use crate::medium::{MarchNotes, Medium};
use crate::scattering::{Event, Phase};
use crate::simd::{Lanes, unpack_directions};
use fearless_simd::prelude::*;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Interactions in the order of their cells, then of lights, paths and bounces, so that sums do not depend on what was
/// traced when. Arrays end with room for a whole vector.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PhotonMap {
    grid: CellGrid,
    kernel: Kernel,
    /// Where each cell begins.
    starts: Vec<u32>,
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    directions: Vec<u32>,
    /// Flux.
    red: Vec<f32>,
    green: Vec<f32>,
    blue: Vec<f32>,
}

/// Where light is gathered, and for whom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathering {
    /// Index space.
    pub place: Vec3,
    /// Opacity there.
    pub opacity: f32,
    pub event: Event,
    /// Towards the viewer.
    pub w_out: Vec3,
    /// Of the ray in its packet.
    pub lane: usize,
}

/// Chunks of one light, with what their photons' flux is to be multiplied by.
pub(super) struct Lit<'a> {
    pub chunks: &'a [Chunk],
    pub scale: Rgb,
}

/// Bits of a sorting key for the place in a chunk, then for the chunk, then for the cell.
const PLACE_BITS: u32 = 20;
const CHUNK_BITS: u32 = 20;

impl PhotonMap {
    /// Sorts the photons of all lights.
    pub fn new(grid: CellGrid, lights: &[Lit]) -> Self {
        let chunks: Vec<(&Chunk, Rgb)> =
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
            kernel: Kernel::new(&grid),
            grid,
            starts,
            x: vec![0.0; room],
            y: vec![0.0; room],
            z: vec![0.0; room],
            directions: vec![0; room],
            red: vec![0.0; room],
            green: vec![0.0; room],
            blue: vec![0.0; room],
        };
        let places = (&mut map.x, &mut map.y, &mut map.z, &mut map.directions);
        let colors = (&mut map.red, &mut map.green, &mut map.blue);
        let ((x, y, z, directions), (red, green, blue)) = (places, colors);
        (&keys, x, y, z, directions, red, green, blue).into_par_iter().for_each(
            |(key, x, y, z, direction, red, green, blue)| {
                let (chunk, scale) =
                    chunks[cast::low_u32(key >> PLACE_BITS & ((1 << CHUNK_BITS) - 1)) as usize];
                let photon = chunk.photons()[cast::low_u32(key & ((1 << PLACE_BITS) - 1)) as usize];
                [*x, *y, *z] = grid.to_metric(photon.index_place()).to_array();
                *direction = photon.direction.word();
                let flux = photon.whole_flux() * scale;
                [*red, *green, *blue] = flux.to_array();
            },
        );
        map
    }

    /// Bytes kept.
    pub fn bytes(&self) -> usize {
        4 * (7 * self.x.len() + self.starts.len())
    }

    /// Light from everywhere that a place of index space scatters to `w_out`, per unit extinction, by photons within a fixed
    /// radius \[Jonsson12, eq. 8\].
    ///
    /// Photons lie where light collides, also where it is then absorbed: their density is extinction times fluence, of which
    /// eq. 8 takes the scattering away alone, and that at the place. Here the flux within the radius is divided by the
    /// extinction that it met there, its mean over the sphere: what is right wherever the fluence is even, also at the skin
    /// of matter, where half the sphere is empty (see [`Kernel`]).
    ///
    /// `notes` hears of the values that are read about the place.
    #[inline(always)]
    pub fn scattered<S: Lanes>(
        &self,
        simd: S,
        medium: &Medium,
        at: &Gathering,
        notes: &mut impl MarchNotes<S>,
    ) -> Rgb {
        let Gathering { place, opacity, event, w_out, lane } = *at;
        let q = self.grid.to_metric(place);
        let radius = self.grid.radius();
        let volume = 4.0 / 3.0 * PI * radius * radius * radius;
        let matter = self.kernel.matter(simd, medium, place, opacity, lane, notes);
        let c = matter.slope / radius;
        let mut sum = Sum::new(simd, &event, w_out);
        let number = S::f32s::from_fn(simd, |lane| lane as f32);
        let squared_radius = S::f32s::splat(simd, radius * radius);
        let [[x0, x1], [y0, y1], [z0, z1]] = self.grid.around(q);
        for z in z0..=z1 {
            for y in y0..=y1 {
                // Cells of a row lie side by side, and so do their photons.
                let mut i = self.starts[self.grid.number([x0, y, z])] as usize;
                let end = self.starts[self.grid.number([x1, y, z]) + 1] as usize;
                while i < end {
                    let dx = load(simd, &self.x, i) - q.x;
                    let dy = load(simd, &self.y, i) - q.y;
                    let dz = load(simd, &self.z, i) - q.z;
                    let there = number.simd_lt(S::f32s::splat(simd, (end - i) as f32));
                    let near = (dx * dx + dy * dy + dz * dz).simd_lt(squared_radius) & there;
                    if near.any_true() {
                        let weight = -(dx * c.x + dy * c.y + dz * c.z) + 1.0;
                        sum.add(self, i, near, weight);
                    }
                    i += S::WIDTH;
                }
            }
        }
        sum.total() / (volume * matter.opacity * medium.density())
    }
}

#[inline(always)]
fn load<S: Lanes>(simd: S, numbers: &[f32], i: usize) -> S::f32s {
    S::f32s::from_slice(simd, &numbers[i..i + S::WIDTH])
}

/// What photons add up to, each weighted by the scattering function.
struct Sum<'a, S: Lanes> {
    simd: S,
    event: &'a Event,
    w_out: Vec3,
    lanes: [S::f32s; 3],
    rest: Rgb,
}

impl<'a, S: Lanes> Sum<'a, S> {
    #[inline(always)]
    fn new(simd: S, event: &'a Event, w_out: Vec3) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        Self { simd, event, w_out, lanes: [zero; 3], rest: Rgb::BLACK }
    }

    #[inline(always)]
    fn add(&mut self, map: &PhotonMap, i: usize, near: S::mask32s, slope: S::f32s) {
        let simd = self.simd;
        if self.event.is_surface() {
            let near = near.select(S::f32s::splat(simd, 1.0), S::f32s::splat(simd, 0.0));
            for (lane, &near) in near.as_slice().iter().enumerate() {
                if near > 0.0 {
                    let i = i + lane;
                    let w_in = -PackedDirection::from_word(map.directions[i]).unpack();
                    let flux = Rgb::new(map.red[i], map.green[i], map.blue[i]);
                    self.rest += self.event.eval(self.w_out, w_in) * flux * slope.as_slice()[lane];
                }
            }
            return;
        }
        let zero = S::f32s::splat(simd, 0.0);
        let weight = match self.event.phase {
            Phase::Isotropic => S::f32s::splat(simd, 1.0),
            phase => {
                let words = S::u32s::from_slice(simd, &map.directions[i..i + S::WIDTH]);
                phase.eval_between_lanes(simd, unpack_directions(simd, words), self.w_out)
            }
        };
        let weight = near.select(weight * slope, zero);
        let [red, green, blue] = self.lanes;
        self.lanes = [
            load(simd, &map.red, i).mul_add(weight, red),
            load(simd, &map.green, i).mul_add(weight, green),
            load(simd, &map.blue, i).mul_add(weight, blue),
        ];
    }

    #[inline(always)]
    fn total(&self) -> Rgb {
        let [red, green, blue] = self.lanes;
        let mut phase = Rgb::new(total(red.as_slice()), total(green.as_slice()), total(blue.as_slice()));
        if self.event.phase == Phase::Isotropic {
            phase *= 1.0 / (4.0 * PI);
        }
        phase * self.event.surface.albedo + self.rest
    }
}

#[inline(always)]
fn total(lanes: &[f32]) -> f32 {
    lanes.iter().sum()
}
