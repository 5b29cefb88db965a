//! Next-event estimation: light that reaches a scattering position without scattering on the way.

use crate::light::LightSample;
use crate::math::{Ray, Rgb, Vec3};
use crate::medium::FlightNotes;
use crate::sampling::{BounceSample, Stream};
use crate::scattering::Event;
use crate::scene::Scene;
use crate::simd::Lanes;

/// A position where light scatters towards a viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScatteringPoint<'a> {
    pub event: &'a Event,
    /// World space.
    pub position: Vec3,
    pub w_out: Vec3,
}

impl ScatteringPoint<'_> {
    /// Light from one source, chosen by power, that the point scatters to the viewer, weighted by the balance heuristic
    /// \[Veach97\] against hitting the light by sampling the scattered direction.
    #[inline(always)]
    pub fn direct<S: Lanes>(
        &self,
        simd: S,
        scene: &Scene,
        u: &BounceSample,
        stream: &mut Stream,
        notes: &mut impl FlightNotes,
    ) -> Rgb {
        let Self { event, position, w_out } = *self;
        let medium = &*scene.medium;
        let Some(light) = scene.lights.sample(medium, position, u, stream) else { return Rgb::BLACK };
        let unshadowed = event.eval(w_out, light.direction) * light.radiance * self.balance(&light);
        if unshadowed.is_black() {
            return Rgb::BLACK;
        }
        let track = medium.track(&Ray::new(position, light.direction), light.distance);
        unshadowed * medium.transmittance_lanes(simd, &track, stream, notes)
    }

    /// Weight of sampling the light against sampling the scattered direction.
    fn balance(&self, light: &LightSample) -> f32 {
        if light.pdf.is_infinite() {
            1.0
        } else {
            light.pdf / (light.pdf + self.event.pdf(self.w_out, light.direction))
        }
    }
}
