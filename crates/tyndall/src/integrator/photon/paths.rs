//! The photon pass: light paths, each of whose interactions knows what it depends on \[Jonsson12, sec. 3.2, 4.3.1\].

use crate::integrator::Stop;
use crate::integrator::history::{Histories, Past, Reading};
use crate::light::{Emission, Enclosure, Light};
use crate::math::{PackedDirection, Ray, Rgb, Vec3};
use crate::medium::Medium;
use crate::sampling::LightPathSampler;
use crate::scene::Scene;
use crate::transfer::Historygram;
use bytemuck::{Pod, Zeroable};

/// Light that arrives where it interacts with matter.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Photon {
    /// Index space.
    pub place: [f32; 3],
    /// In which it travels.
    pub direction: PackedDirection,
    /// Flux per unit of its light's colour, times the paths of that light: of this interaction and those left out like it.
    pub flux: [f32; 3],
}

/// So many interactions of a path are all kept, and of the later ones fewer and fewer, with the flux of those left out: the
/// light of long paths is spread so widely that more would cost memory and no noise.
const WHOLE: u32 = 4;

impl Photon {
    pub fn index_place(&self) -> Vec3 {
        Vec3::from_array(self.place)
    }
}

/// Chance of an interaction being kept, by the scatterings before it.
fn chance(bounce: u32) -> f32 {
    WHOLE as f32 / (bounce + 1).max(WHOLE) as f32
}

/// Whether a path keeps its interaction after so many scatterings.
fn is_kept(numbers: &LightPathSampler, bounce: u32) -> bool {
    numbers.bounce(bounce).light_choice < chance(bounce)
}

/// Scatterings before the interaction of a path that it keeps after so many others.
pub(super) fn bounce_of(numbers: &LightPathSampler, kept: usize) -> u32 {
    let mut bounces = (0..).filter(|&bounce| is_kept(numbers, bounce));
    bounces.nth(kept).unwrap_or(u32::MAX)
}

/// Interactions of a path that are kept on average if none is absorbed: of `max_scatter` the first few, and of the others the
/// sum of their chances.
pub(super) fn most_kept(max_scatter: u32) -> f64 {
    let whole = f64::from(WHOLE);
    let last = f64::from(max_scatter);
    if last <= whole { last } else { whole * (1.0 + (last / whole).ln()) }
}

/// What light paths start from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    Light(&'a Light),
    Matter(&'a Emission),
}

/// Interactions of paths, one path after the other, with what each depends on.
#[derive(Clone, Debug)]
pub(super) struct Interactions {
    pub photons: Vec<Photon>,
    /// Of each, for flight and scattering; `None` where paths have one alone.
    pasts: Option<[Histories; 2]>,
}

impl Interactions {
    /// None yet.
    pub fn new(groups: u8, each_has_a_past: bool) -> Self {
        let pasts = each_has_a_past.then(|| [Histories::new(groups), Histories::new(groups)]);
        Self { photons: Vec::new(), pasts }
    }

    /// Whether each interaction has a past of its own.
    pub fn have_pasts(&self) -> bool {
        self.pasts.is_some()
    }

    /// What an interaction depends on; `None` where that is not known apart from its path.
    #[inline]
    pub fn past(&self, i: usize) -> Option<Past> {
        let [flight, scatter] = self.pasts.as_ref()?;
        Some(Past { flight: flight.get(i), scatter: scatter.get(i) })
    }

    #[inline]
    fn push(&mut self, photon: Photon, past: &Past) {
        self.photons.push(photon);
        if let Some([flight, scatter]) = &mut self.pasts {
            flight.push(past.flight);
            scatter.push(past.scatter);
        }
    }

    /// Appends some of another's.
    pub fn extend(&mut self, other: &Self, range: std::ops::Range<usize>) {
        self.photons.extend_from_slice(&other.photons[range.clone()]);
        if let (Some([flight, scatter]), Some([of_flight, of_scatter])) = (&mut self.pasts, &other.pasts) {
            flight.extend(of_flight, range.clone());
            scatter.extend(of_scatter, range);
        }
    }

    /// Lets go of room that is not needed.
    pub fn shrink_to_fit(&mut self) {
        self.photons.shrink_to_fit();
        self.pasts.iter_mut().flatten().for_each(Histories::shrink_to_fit);
    }

    pub fn bytes(&self) -> usize {
        let pasts = self.pasts.iter().flatten().map(Histories::bytes).sum::<usize>();
        size_of_val(&self.photons[..]) + pasts
    }
}

/// What tracing reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracer<'a> {
    pub scene: &'a Scene,
    pub source: Source<'a>,
    pub enclosure: &'a Enclosure,
    pub reading: &'a Reading,
}

/// Where a path goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    pub photon: Photon,
    /// Scatterings before it.
    pub bounce: u32,
    pub past: Past,
}

/// A path on its way.
#[derive(Clone, Debug)]
pub(super) struct Walk {
    /// `None` where it has ended.
    flight: Option<Flight>,
    pub past: Past,
}

/// Light on its way between two interactions.
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

    /// What reading the optics of a place leaves in a history.
    #[inline(always)]
    pub fn read_at(&self, place: Vec3) -> Historygram {
        self.reading.of(self.medium().transfer().bins(), self.medium().volume().value(place))
    }

    /// A path at its beginning, or where it is to go on from one of its interactions.
    #[inline(always)]
    pub fn begin(&self, numbers: &LightPathSampler, from: Option<Begun>) -> Walk {
        let mut past = from.map_or(Past::NOTHING, |from| from.past);
        let flight = match from {
            Some(Begun { photon, bounce, .. }) => self.scatter(&photon, bounce, numbers, &mut past),
            None => self.emit(numbers),
        };
        Walk { flight, past }
    }

    /// Goes on to the path's end, or for one scattering at least when told to stop; gives whether it has ended. Then the walk's
    /// past is what the whole path depends on: also what it did not hit.
    #[inline(always)]
    pub fn go_on(
        &self,
        walk: &mut Walk,
        numbers: &LightPathSampler,
        found: &mut Interactions,
        stop: &Stop,
    ) -> bool {
        while let Some(flight) = walk.flight.take() {
            let Some(photon) = self.fly(&flight, numbers, &mut walk.past) else { break };
            if is_kept(numbers, flight.bounce) {
                found.push(photon, &walk.past);
            }
            if flight.bounce + 1 >= self.scene.render.max_scatter {
                break;
            }
            walk.flight = self.scatter(&photon, flight.bounce, numbers, &mut walk.past);
            if walk.flight.is_some() && stop.reached() {
                return false;
            }
        }
        true
    }

    fn emit(&self, numbers: &LightPathSampler) -> Option<Flight> {
        let u = numbers.emission();
        let emitted = match self.source {
            Source::Light(light) => light.emit(self.enclosure, u),
            Source::Matter(glow) => glow.emit(self.medium(), u, &mut numbers.matter_emission()),
        }?;
        Some(Flight { ray: emitted.ray, flux: emitted.flux, bounce: 0 })
    }

    /// To where light interacts next \[Jonsson12, eq. 6\], by tracking: without bias, and cheaper than to march.
    #[inline(always)]
    fn fly(&self, flight: &Flight, numbers: &LightPathSampler, past: &mut Past) -> Option<Photon> {
        let track = self.medium().track(&flight.ray, f32::INFINITY);
        let mut writer = self.reading.writer(self.medium(), *past);
        let first = numbers.bounce(flight.bounce).flight_depth();
        let mut stream = numbers.stream(flight.bounce);
        let collision = self.medium().free_flight_noting(&track, first, &mut stream, &mut writer);
        *past = writer.past;
        let collision = collision?;
        Some(Photon {
            place: collision.place.to_array(),
            direction: PackedDirection::new(flight.ray.direction),
            flux: (flight.flux / chance(flight.bounce)).to_array(),
        })
    }

    /// Scatters light on, or takes it away \[Jonsson12, eq. 7\]: it survives with the chance that its brightest channel
    /// does, which depends on the place alone and not on what the path carries, so that no channel's light ends another's.
    #[inline(always)]
    fn scatter(
        &self,
        photon: &Photon,
        bounce: u32,
        numbers: &LightPathSampler,
        past: &mut Past,
    ) -> Option<Flight> {
        let place = photon.index_place();
        let value = self.medium().volume().value(place);
        past.scatter |= self.reading.of(self.medium().transfer().bins(), value);
        let event = self.medium().event(place, &self.medium().transfer().optics(value));
        let u = numbers.bounce(bounce);
        let scattered = event.sample_adjoint(-photon.direction.unpack(), u.scatter)?;
        let survival = scattered.weight.max_component().min(1.0);
        if u.roulette >= survival {
            return None;
        }
        Some(Flight {
            ray: Ray::new(self.medium().volume().grid().index_to_world(place), scattered.direction),
            flux: Rgb::from(photon.flux) * (scattered.weight * (chance(bounce) / survival)),
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
