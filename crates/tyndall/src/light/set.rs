//! All lights of a scene together, and the choice among them by power.

use super::{Emission, Environment, Light, LightSample, Target};
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::sampling::{BounceSample, Choice, Discrete, Stream};

/// The lights of a scene, glowing matter among them.
#[derive(Clone, Debug)]
pub struct LightSet {
    lights: Vec<Light>,
    emission: Option<Emission>,
    /// Over the lights, then the glowing matter; `None` where nothing shines.
    choice: Option<Discrete>,
    /// Numbers of the lights that a ray can pass.
    passable: Vec<usize>,
}

impl LightSet {
    /// Weighs the lights by what reaches the medium.
    #[must_use]
    pub fn new(lights: Vec<Light>, medium: &Medium) -> Self {
        Self::with_emission(lights, medium, Emission::new(medium))
    }

    /// [`Self::new`] with the emission of the medium.
    #[must_use]
    pub fn with_emission(lights: Vec<Light>, medium: &Medium, emission: Option<Emission>) -> Self {
        let box_ = medium.volume().grid().world_bounds();
        let target = Target { center: box_.center(), radius: 0.5 * box_.size().length() };
        let of_matter = emission.iter().map(|e| e.strength(&target));
        let choice = Discrete::new(lights.iter().map(|l| l.strength(&target)).chain(of_matter));
        let passable = (0..lights.len()).filter(|&i| lights[i].can_be_passed()).collect();
        Self { lights, emission, choice, passable }
    }

    /// The lights, without the glowing matter.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Glowing matter.
    #[must_use]
    pub fn emission(&self) -> Option<&Emission> {
        self.emission.as_ref()
    }

    /// What the camera sees behind everything: the visible environments.
    #[must_use]
    pub fn sky(&self, direction: Vec3) -> Rgb {
        self.visible().map(|environment| environment.radiance(direction)).sum()
    }

    /// Whether there is a visible environment.
    #[must_use]
    pub fn has_sky(&self) -> bool {
        self.visible().next().is_some()
    }

    fn visible(&self) -> impl Iterator<Item = &Environment> {
        self.lights.iter().filter_map(|light| match light {
            Light::Environment(environment) if environment.visible => Some(environment),
            _ => None,
        })
    }

    /// Samples a light by power and a direction to it; the sample's pdf includes the choice.
    #[inline]
    #[must_use]
    pub fn sample(
        &self,
        medium: &Medium,
        from: Vec3,
        numbers: &BounceSample,
        stream: &mut Stream,
    ) -> Option<LightSample> {
        let Choice { index: i, probability: chance, .. } = self.choice.as_ref()?.sample(numbers.light_choice);
        let sample = match self.lights.get(i) {
            Some(light) => light.sample(from, numbers.light),
            None => self.emission.as_ref()?.sample(medium, from, stream),
        }?;
        Some(LightSample { radiance: sample.radiance / chance, pdf: sample.pdf * chance, ..sample })
    }

    /// Light that a scattered ray gathers by passing lights nearer than `end`, each weighted against
    /// [`Self::sample`] by the balance heuristic \[Veach97\]; `pdf` is that of the ray's direction.
    #[inline]
    #[must_use]
    pub fn passed(&self, ray: &Ray, end: f32, pdf: f32) -> Rgb {
        let one = |&i: &usize| {
            let passed = self.lights[i].passed(ray).filter(|p| p.distance <= end)?;
            let by_sampling = passed.pdf * self.chance(i);
            Some(passed.radiance * (pdf / (pdf + by_sampling)))
        };
        self.passable.iter().filter_map(one).sum()
    }

    /// Weight of finding glowing matter by a free flight rather than by [`Self::sample`].
    #[inline]
    #[must_use]
    pub fn flight_weight(&self, position: Vec3, sigma_t: f32, distance: f32, pdf: f32) -> f32 {
        let by_sampling = self
            .emission
            .as_ref()
            .map_or(0.0, |e| e.pdf(position, sigma_t, distance) * self.chance(self.lights.len()));
        pdf / (pdf + by_sampling)
    }

    fn chance(&self, i: usize) -> f32 {
        self.choice.as_ref().map_or(0.0, |c| c.probability(i))
    }
}
