//! Tracing of light paths; each vertex is stored with what it depends on \[Jonsson12, sec. 3.2, 4.3.1\].

use crate::integrator::Stop;
use crate::integrator::cells::Positioned;
use crate::integrator::history::{PackedHistories, Past, Reading};
use crate::light::{Emission, Enclosure, Light};
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::sampling::LightPathSampler;
use crate::scene::Scene;
use crate::transfer::Historygram;
use bytemuck::Pod;
use std::fmt::Debug;

/// What a method stores where a light path interacts with matter. A path can be resumed from it.
pub(crate) trait Vertex: Positioned + Pod + Debug + PartialEq {
    /// From the light that arrives at an interaction.
    fn new(arrival: &Arrival) -> Self;

    /// The direction in which the light travels.
    fn direction(&self) -> Vec3;

    /// Flux per unit of the light's colour, times the number of that light's paths. Compensates for vertices that were
    /// not stored.
    fn flux(&self) -> Rgb;
}

/// Light that arrives at an interaction with matter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    /// Index space.
    pub position: Vec3,
    /// The direction in which the light travels.
    pub direction: Vec3,
    /// As [`Vertex::flux`].
    pub flux: Rgb,
}

/// The first vertices of a path are all stored, later ones with decreasing probability and with flux that compensates
/// for those left out: light of long paths is so diffuse that storing every vertex would cost memory without reducing
/// noise.
const WHOLE: u32 = 4;

/// Probability that a vertex is stored, by the number of scatterings before it.
fn chance(bounce: u32) -> f32 {
    WHOLE as f32 / (bounce + 1).max(WHOLE) as f32
}

/// Whether a path stores its vertex after `bounce` scatterings.
fn is_kept(numbers: &LightPathSampler, bounce: u32) -> bool {
    numbers.bounce(bounce).light_choice < chance(bounce)
}

/// Number of scatterings before the `kept`-th stored vertex of a path.
pub(super) fn bounce_of(numbers: &LightPathSampler, kept: usize) -> u32 {
    let mut bounces = (0..).filter(|&bounce| is_kept(numbers, bounce));
    bounces.nth(kept).unwrap_or(u32::MAX)
}

/// Expected number of stored interactions of a path that is not absorbed: all of the first few of `max_scatter`, plus
/// the sum of the probabilities of the others.
pub(crate) fn most_kept(max_scatter: u32) -> f64 {
    let whole = f64::from(WHOLE);
    let last = f64::from(max_scatter);
    if last <= whole { last } else { whole * (1.0 + (last / whole).ln()) }
}

/// The source of a light path.
#[derive(Clone, Copy, Debug)]
pub(crate) enum EmissionSource<'a> {
    Light(&'a Light),
    Matter(&'a Emission),
}

/// The vertices of paths, path by path, with what each depends on.
#[derive(Clone, Debug)]
pub(super) struct Vertices<V> {
    pub stored: Vec<V>,
    /// What each depends on, for flight and scattering; `None` if only whole paths have a history.
    pasts: Option<[PackedHistories; 2]>,
}

impl<V: Vertex> Vertices<V> {
    /// Empty.
    pub fn new(groups: u8, each_has_a_past: bool) -> Self {
        let pasts = each_has_a_past.then(|| [PackedHistories::new(groups), PackedHistories::new(groups)]);
        Self { stored: Vec::new(), pasts }
    }

    /// Whether each vertex has a past of its own.
    pub fn have_pasts(&self) -> bool {
        self.pasts.is_some()
    }

    /// What a vertex depends on; `None` if only whole paths have a history.
    #[inline]
    pub fn past(&self, i: usize) -> Option<Past> {
        let [flight, scatter] = self.pasts.as_ref()?;
        Some(Past { flight: flight.get(i), scatter: scatter.get(i) })
    }

    #[inline]
    fn push(&mut self, vertex: V, past: &Past) {
        self.stored.push(vertex);
        if let Some([flight, scatter]) = &mut self.pasts {
            flight.push(past.flight);
            scatter.push(past.scatter);
        }
    }

    /// Appends a range of other vertices.
    pub fn extend(&mut self, other: &Self, range: std::ops::Range<usize>) {
        self.stored.extend_from_slice(&other.stored[range.clone()]);
        if let (Some([flight, scatter]), Some([of_flight, of_scatter])) = (&mut self.pasts, &other.pasts) {
            flight.extend(of_flight, range.clone());
            scatter.extend(of_scatter, range);
        }
    }

    /// Releases unused memory.
    pub fn shrink_to_fit(&mut self) {
        self.stored.shrink_to_fit();
        self.pasts.iter_mut().flatten().for_each(PackedHistories::shrink_to_fit);
    }

    pub fn bytes(&self) -> usize {
        let pasts = self.pasts.iter().flatten().map(PackedHistories::bytes).sum::<usize>();
        size_of_val(&self.stored[..]) + pasts
    }
}

/// The inputs of tracing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracer<'a> {
    pub scene: &'a Scene,
    pub source: EmissionSource<'a>,
    pub enclosure: &'a Enclosure,
    pub reading: &'a Reading,
}

/// The vertex from which a path is resumed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resumed<V> {
    pub vertex: V,
    /// Number of scatterings before it.
    pub bounce: u32,
    pub past: Past,
}

/// A light path being traced.
#[derive(Clone, Debug)]
pub(super) struct LightPath {
    /// `None` if it has ended.
    flight: Option<Flight>,
    pub past: Past,
}

/// Light in flight between two interactions.
#[derive(Clone, Debug)]
struct Flight {
    ray: Ray,
    flux: Rgb,
    bounce: u32,
}

impl Tracer<'_> {
    fn medium(&self) -> &Medium {
        &self.scene.medium
    }

    /// The history entry for reading the optical properties at a position.
    #[inline(always)]
    pub fn read_at(&self, position: Vec3) -> Historygram {
        self.reading.of(self.medium().transfer().bins(), self.medium().volume().value(position))
    }

    /// A path at its beginning, or resumed from one of its vertices.
    #[inline(always)]
    pub fn begin<V: Vertex>(&self, numbers: &LightPathSampler, from: Option<Resumed<V>>) -> LightPath {
        let mut past = from.map_or(Past::NOTHING, |from| from.past);
        let flight = match from {
            Some(Resumed { vertex, bounce, .. }) => self.scatter(&vertex, bounce, numbers, &mut past),
            None => self.emit(numbers),
        };
        LightPath { flight, past }
    }

    /// Continues to the path's end, or until a stop, but for at least one scattering; returns whether the path has
    /// ended. If so, its past is what the whole path depends on, including matter that it passed without a collision.
    #[inline(always)]
    pub fn go_on<V: Vertex>(
        &self,
        path: &mut LightPath,
        numbers: &LightPathSampler,
        found: &mut Vertices<V>,
        stop: &Stop,
    ) -> bool {
        while let Some(flight) = path.flight.take() {
            let Some(vertex) = self.fly::<V>(&flight, numbers, &mut path.past) else { break };
            if is_kept(numbers, flight.bounce) {
                found.push(vertex, &path.past);
            }
            if flight.bounce + 1 >= self.scene.render.max_scatter {
                break;
            }
            path.flight = self.scatter(&vertex, flight.bounce, numbers, &mut path.past);
            if path.flight.is_some() && stop.reached() {
                return false;
            }
        }
        true
    }

    fn emit(&self, numbers: &LightPathSampler) -> Option<Flight> {
        let u = numbers.emission();
        let emitted = match self.source {
            EmissionSource::Light(light) => light.emit(self.enclosure, u),
            EmissionSource::Matter(glow) => glow.emit(self.medium(), u, &mut numbers.matter_emission()),
        }?;
        Some(Flight { ray: emitted.ray, flux: emitted.flux, bounce: 0 })
    }

    /// Flies to the next interaction \[Jonsson12, eq. 6\] by delta tracking: unbiased, and cheaper than marching.
    #[inline(always)]
    fn fly<V: Vertex>(&self, flight: &Flight, numbers: &LightPathSampler, past: &mut Past) -> Option<V> {
        let track = self.medium().track(&flight.ray, f32::INFINITY);
        let mut writer = self.reading.writer(self.medium(), *past);
        let first = numbers.bounce(flight.bounce).flight_depth();
        let mut stream = numbers.stream(flight.bounce);
        let collision = self.medium().free_flight_noting(&track, first, &mut stream, &mut writer);
        *past = writer.past;
        let collision = collision?;
        Some(V::new(&Arrival {
            position: collision.position,
            direction: flight.ray.direction,
            flux: flight.flux / chance(flight.bounce),
        }))
    }

    /// Scatters or absorbs the light \[Jonsson12, eq. 7\]: it survives with a probability equal to the albedo of the
    /// brightest channel, which depends only on the position and not on the path's flux, so that a black channel does
    /// not end the others.
    #[inline(always)]
    fn scatter<V: Vertex>(
        &self,
        vertex: &V,
        bounce: u32,
        numbers: &LightPathSampler,
        past: &mut Past,
    ) -> Option<Flight> {
        let position = vertex.position();
        let value = self.medium().volume().value(position);
        past.scatter |= self.reading.of(self.medium().transfer().bins(), value);
        let event = self.medium().event(position, &self.medium().transfer().optics(value));
        let u = numbers.bounce(bounce);
        let scattered = event.sample_adjoint(-vertex.direction(), u.scatter)?;
        let survival = scattered.weight.max_component().min(1.0);
        if u.roulette >= survival {
            return None;
        }
        Some(Flight {
            ray: Ray::new(self.medium().volume().grid().index_to_world(position), scattered.direction),
            flux: vertex.flux() * (scattered.weight * (chance(bounce) / survival)),
            bounce: bounce + 1,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_paths_keep_few_interactions() {
        for max_scatter in [0, 1, 4, 5, 64, 10_000] {
            let sum: f64 = (0..max_scatter).map(|bounce| f64::from(chance(bounce))).sum();
            assert!((most_kept(max_scatter) - sum).abs() < 0.6, "{sum} of {max_scatter}");
        }
    }
}
