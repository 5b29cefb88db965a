//! Starts of light paths: from a light into the medium's box.

use super::{Enclosure, Light};
use crate::math::{Frame, Ray, Rgb, Vec3, cast};
use crate::sampling::warp;
use std::f64::consts::PI;

/// The start of a light path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitted {
    /// World ray along the light's travel. It starts at the light, or farther on, but not beyond where it enters the
    /// box; a few miss the box, by rounding or because they start on its border.
    pub ray: Ray,
    /// Flux per unit of the light's colour, over the pdf of the path: its mean over all random numbers, lost
    /// paths counted as 0, times [`Light::color`] is the light's power into the box, in W.
    pub flux: Rgb,
}

impl Emitted {
    /// `measure` is the area, the solid angle, or their product that the paths are sampled from.
    pub(super) fn evenly(ray: Ray, measure: f64) -> Self {
        Self { ray, flux: Rgb::splat(cast::single(measure)) }
    }

    /// A path from a point of a surface of radiance 1; `area` is the whole area that the point was sampled from.
    pub(super) fn from_surface(
        into: &Enclosure,
        point: Vec3,
        normal: Vec3,
        area: f32,
        u: [f32; 2],
    ) -> Option<Self> {
        if into.contains(point) {
            let direction = Frame::around(normal).to_world(warp::cosine_hemisphere(u)).normalize();
            return Some(Self::evenly(Ray::new(point, direction), PI * f64::from(area)));
        }
        let (ray, solid_angle) = into.aim(point, u)?;
        let cos = ray.direction.dot(normal);
        (cos > 0.0).then(|| Self::evenly(ray, f64::from(cos * area) * solid_angle))
    }
}

impl Light {
    /// Starts a light path into the box; `None` if these numbers start none.
    ///
    /// `u[0]` and `u[1]` decide where into the box it goes, nearby numbers giving nearby rays; `u[2]` and `u[3]`
    /// decide the rest: the point on the light, or the direction in its cone or in the sky.
    #[inline]
    #[must_use]
    pub fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let emitted = match self {
            Self::Directional(l) => l.emit(into, u),
            Self::Point(l) => l.emit(into, u),
            Self::Rect(l) => l.emit(into, u),
            Self::Disk(l) => l.emit(into, u),
            Self::Sphere(l) => l.emit(into, u),
            Self::Environment(l) => l.emit(into, u),
        };
        // A flux beyond single precision is more than a picture could show.
        emitted.filter(|e| e.flux.is_finite())
    }

    /// What multiplies every path's flux: the irradiance of parallel light (W/m^2), a point's intensity (W/sr), else
    /// the radiance (W/m^2/sr); white for a map, whose colours are in the flux.
    #[must_use]
    pub fn color(&self) -> Rgb {
        match self {
            Self::Directional(l) => l.color(),
            Self::Point(l) => l.intensity,
            Self::Rect(l) => l.color(),
            Self::Disk(l) => l.color(),
            Self::Sphere(l) => l.radiance,
            Self::Environment(l) => l.color(),
        }
    }

    /// Whether the other light sends the same paths: equal except in [`Self::color`] and in what the camera sees of it.
    #[must_use]
    pub fn same_paths(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Directional(a), Self::Directional(b)) => a.colored(Rgb::WHITE) == b.colored(Rgb::WHITE),
            (Self::Point(a), Self::Point(b)) => a.position == b.position,
            (Self::Rect(a), Self::Rect(b)) => a.colored(Rgb::WHITE) == b.colored(Rgb::WHITE),
            (Self::Disk(a), Self::Disk(b)) => a.colored(Rgb::WHITE) == b.colored(Rgb::WHITE),
            (Self::Sphere(a), Self::Sphere(b)) => (a.middle, a.radius) == (b.middle, b.radius),
            (Self::Environment(a), Self::Environment(b)) => a.same_paths(b),
            _ => false,
        }
    }
}
