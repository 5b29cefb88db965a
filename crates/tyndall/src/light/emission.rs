//! Glowing matter as a light: a point of it is drawn by power, so that a small bright spot is found.

use super::{LightSample, Target};
use crate::math::{Bounds, Vec3};
use crate::medium::Medium;
use crate::sampling::{Discrete, Stream};

/// Glowing cells of a medium, weighted by an upper bound of what they emit.
#[derive(Clone, Debug)]
pub struct Emission {
    cells: Discrete,
    /// Number of the cell behind each weight, ascending.
    numbers: Vec<usize>,
    bounds: Vec<Bounds>,
    /// World volume per unit of index-space volume.
    voxel_volume: f32,
}

impl Emission {
    /// `None` where nothing can glow.
    #[must_use]
    pub fn new(medium: &Medium) -> Option<Self> {
        if !medium.transfer().emits() || medium.density() <= 0.0 {
            return None;
        }
        let grid = medium.volume().grid();
        let bricks = medium.volume().bricks();
        let voxel_volume = grid.voxel_size().powi(3);
        let (mut numbers, mut bounds, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        for (number, &values) in bricks.ranges().iter().enumerate() {
            let most = medium.transfer().emission_bound(values);
            if most > 0.0 {
                let b = bricks.cell_bounds(number, &grid.index_bounds());
                weights.push(f64::from(most * medium.density() * voxel_volume * b.size().element_product()));
                numbers.push(number);
                bounds.push(b);
            }
        }
        Some(Self { cells: Discrete::new(weights)?, numbers, bounds, voxel_volume })
    }

    /// As [`super::Light::strength`]: the power, as if it all came from the target's middle to its border.
    #[must_use]
    pub fn strength(&self, target: &Target) -> f64 {
        self.cells.total() / f64::from(target.radius * target.radius)
    }

    /// Draws a glowing point and what arrives from it at a world point. The density is that over solid
    /// angle at which a free flight towards the point would have to collide there, so that both ways
    /// of finding it can be weighed.
    #[must_use]
    pub fn sample(&self, medium: &Medium, from: Vec3, stream: &mut Stream) -> Option<LightSample> {
        let (i, chance, _) = self.cells.sample(stream.uniform());
        let b = &self.bounds[i];
        let u = Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let place = b.min + b.size() * u;
        if !medium.contains(place) {
            return None;
        }
        let optics = medium.optics(place);
        let to_light = medium.volume().grid().index_to_world(place) - from;
        let squared = to_light.length_squared();
        let sigma_t = medium.density() * optics.opacity;
        let emitted = Medium::emitted(&optics) * sigma_t;
        if squared == 0.0 || emitted.is_black() {
            return None;
        }
        let per_volume = chance / (b.size().element_product() * self.voxel_volume);
        let distance = squared.sqrt();
        Some(LightSample {
            direction: to_light / distance,
            distance,
            radiance: emitted / (squared * per_volume),
            pdf: per_volume * squared / sigma_t,
        })
    }

    /// The density of [`Self::sample`] for a collision found by a free flight: at an index-space place
    /// with extinction `sigma_t`, `distance` world units away.
    #[must_use]
    pub fn pdf(&self, medium: &Medium, place: Vec3, sigma_t: f32, distance: f32) -> f32 {
        let number = medium.volume().bricks().cell_at(place);
        let Ok(i) = self.numbers.binary_search(&number) else { return 0.0 };
        let volume = self.bounds[i].size().element_product() * self.voxel_volume;
        self.cells.probability(i) / volume * distance * distance / sigma_t
    }
}
