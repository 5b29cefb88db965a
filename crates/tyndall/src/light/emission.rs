//! Glowing matter as a light: its points are sampled by power, so that a small bright spot is found.

use super::{Emitted, LightSample, Target};
use crate::math::{Binade, Bounds, Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::sampling::{Choice, Discrete, Stream, warp};
use crate::volume::Cells;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

/// Voxels along the edge of a cell that points are sampled from: small, since a point is uniform in its cell
/// and wasted where nothing glows.
const CELL: usize = 4;

/// Share of a cell's weight that comes from the upper bound of its emission; the rest comes from its voxels. So
/// what glows between the voxels is found too, and cells that only might glow are seldom sampled.
const CAUTION: f32 = 0.1;

/// A point of glowing matter, sampled by power. Lengths are in the unit of [`GlowingCells::unit`].
struct Glow {
    /// In index space.
    position: Vec3,
    sigma_t: f32,
    /// Emitted radiance per unit of length.
    emitted: Rgb,
    /// Pdf of the position, per unit of volume.
    per_volume: f32,
}

/// Glowing cells of a medium, weighted by what they emit. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Emission {
    glowing: Arc<GlowingCells>,
    /// Over the glowing cells.
    cells: Arc<Discrete>,
    density: f32,
}

/// Cells in which matter may glow, whatever its density.
#[derive(Debug)]
struct GlowingCells {
    positions: Arc<Cells>,
    /// Their numbers, ascending.
    numbers: Vec<usize>,
    bounds: Vec<Bounds>,
    /// What each emits per unit of length, at density 1.
    emitted: Vec<f32>,
    /// A unit of length of about a voxel, in world units: the cube of a voxel's size may be beyond single precision. As a power of two
    /// it rounds nothing.
    unit: Binade,
    /// Volume, in this unit, per unit of index-space volume.
    voxel_volume: f32,
}

impl GlowingCells {
    /// In parallel on the current pool.
    fn new(medium: &Medium) -> Self {
        let grid = medium.volume().grid();
        let positions = medium.volume().cells_of(CELL);
        let glowing = |(number, &values): (usize, &[f32; 2])| {
            let most = medium.transfer().emission_bound(values);
            (most > 0.0).then(|| {
                let bounds = positions.cell_bounds(number, &grid.index_bounds());
                let emitted = (1.0 - CAUTION) * mean_emission(medium, &bounds) + CAUTION * most;
                (number, bounds, emitted)
            })
        };
        let cells: Vec<_> = positions.ranges().par_iter().enumerate().filter_map(glowing).collect();
        Self {
            numbers: cells.iter().map(|c| c.0).collect(),
            bounds: cells.iter().map(|c| c.1).collect(),
            emitted: cells.iter().map(|c| c.2).collect(),
            unit: Binade::of(grid.voxel_size()),
            voxel_volume: grid.scaled_voxel_size().powi(3),
            positions,
        }
    }

    /// The probability of each, by its power; `None` where nothing glows.
    fn choice(&self, density: f32) -> Option<Discrete> {
        let unit = f64::from(self.unit.size()).powi(3);
        let power = |(emitted, bounds): (&f32, &Bounds)| {
            unit * f64::from(emitted * density * self.voxel_volume * bounds.size().element_product())
        };
        Discrete::new(self.emitted.iter().zip(&self.bounds).map(power))
    }
}

impl Emission {
    /// `None` where nothing can glow.
    #[must_use]
    pub fn new(medium: &Medium) -> Option<Self> {
        Self::after(None, medium)
    }

    /// [`Self::new`] that shares what an edit left unchanged with the emission of a medium with the very same matter.
    #[must_use]
    pub fn after(same_matter: Option<&Self>, medium: &Medium) -> Option<Self> {
        let density = medium.density();
        if !medium.transfer().emits() || density <= 0.0 {
            return None;
        }
        if let Some(before) = same_matter.filter(|before| before.density.to_bits() == density.to_bits()) {
            return Some(before.clone());
        }
        let glowing = || Arc::new(GlowingCells::new(medium));
        let glowing = same_matter.map_or_else(glowing, |before| before.glowing.clone());
        let cells = Arc::new(glowing.choice(density)?);
        Some(Self { glowing, cells, density })
    }

    /// Whether points are sampled as from the other: each cell with the same probability.
    #[must_use]
    pub fn same_cells(&self, other: &Self) -> bool {
        let (here, there) = (&*self.glowing, &*other.glowing);
        Arc::ptr_eq(&self.cells, &other.cells)
            || (here.numbers == there.numbers && self.cells == other.cells && here.bounds == there.bounds)
    }

    /// As [`super::Light::strength`]: the power, as if it all came from a target's radius away.
    #[must_use]
    pub fn strength(&self, target: &Target) -> f64 {
        self.cells.total() / f64::from(target.radius * target.radius)
    }

    /// Samples a glowing point and what arrives from it at a world point. The pdf, over solid angle, is
    /// the one with which a free flight would have the same density of collisions at the point, so that
    /// the two ways of finding it can be weighted against each other.
    #[must_use]
    pub fn sample(&self, medium: &Medium, from: Vec3, stream: &mut Stream) -> Option<LightSample> {
        let choice = stream.uniform();
        let u = Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let glow = self.glow(medium, choice, u)?;
        let to_light = medium.volume().grid().index_to_world(glow.position) - from;
        let unit = self.glowing.unit;
        let squared = (to_light * unit.inverse()).length_squared();
        if squared == 0.0 {
            return None;
        }
        let distance = squared.sqrt() * unit.size();
        Some(LightSample {
            direction: to_light / distance,
            distance,
            radiance: glow.emitted / (squared * glow.per_volume),
            pdf: glow.per_volume * squared / glow.sigma_t,
        })
    }

    /// Starts a light path from a glowing point in any direction; `None` where the sampled point does not glow.
    ///
    /// `u[0]` and `u[1]` decide the direction, `u[2]` the cell, `u[3]` and the stream the position in it. The flux
    /// includes the colour: its mean, lost paths counted as 0, is the power of the matter, in W.
    #[must_use]
    pub fn emit(&self, medium: &Medium, u: [f32; 4], stream: &mut Stream) -> Option<Emitted> {
        let glow = self.glow(medium, u[2], Vec3::new(u[3], stream.uniform(), stream.uniform()))?;
        let origin = medium.volume().grid().index_to_world(glow.position);
        let ray = Ray::new(origin, warp::sphere([u[0], u[1]]));
        let unit = self.glowing.unit.size();
        Some(Emitted { ray, flux: glow.emitted * (4.0 * PI / glow.per_volume) * (unit * unit) })
    }

    /// The position `u` in a cell chosen by power, if it glows.
    fn glow(&self, medium: &Medium, choice: f32, u: Vec3) -> Option<Glow> {
        let Choice { index: i, probability: chance, .. } = self.cells.sample(choice);
        let b = &self.glowing.bounds[i];
        let position = b.min + b.size() * u;
        if !medium.contains(position) {
            return None;
        }
        let optics = medium.optics(position);
        let sigma_t = medium.density() * optics.opacity * self.glowing.unit.size();
        let emitted = optics.emitted() * sigma_t;
        let per_volume = chance / (b.size().element_product() * self.glowing.voxel_volume);
        (!emitted.is_black()).then_some(Glow { position, sigma_t, emitted, per_volume })
    }

    /// The pdf of [`Self::sample`] for a collision found by a free flight: at an index-space position
    /// with extinction `sigma_t`, `distance` world units away.
    #[must_use]
    pub fn pdf(&self, position: Vec3, sigma_t: f32, distance: f32) -> f32 {
        let glowing = &*self.glowing;
        let number = glowing.positions.cell_at(position);
        let Ok(i) = glowing.numbers.binary_search(&number) else { return 0.0 };
        let volume = glowing.bounds[i].size().element_product() * glowing.voxel_volume;
        let (distance, sigma_t) = (distance * glowing.unit.inverse(), sigma_t * glowing.unit.size());
        self.cells.probability(i) / volume * distance * distance / sigma_t
    }
}

/// Luminance emitted per unit length at density 1, averaged over the voxel centres of a cell.
fn mean_emission(medium: &Medium, cell: &Bounds) -> f32 {
    // The first centre is half a voxel inside the cell.
    let centres = |axis: usize| -> ([f32; CELL], usize) {
        let (start, end) = (cell.min[axis] + 0.5, cell.max[axis]);
        let all = [0.0, 1.0, 2.0, 3.0].map(|i| start + i);
        (all, all.iter().take_while(|&&x| x < end).count())
    };
    let axes = [centres(0), centres(1), centres(2)];
    let count = axes.iter().map(|axis| axis.1).product::<usize>();
    let mut values = [0.0; CELL * CELL * CELL];
    let [x, y, z] = &axes;
    medium.volume().value_block([&x.0[..x.1], &y.0[..y.1], &z.0[..z.1]], &mut values[..count]);
    let sum = values[..count].iter().map(|&value| medium.transfer().emitted_luminance(value)).sum::<f32>();
    sum / count as f32
}
