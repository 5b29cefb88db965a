//! Sources of light. They are sources only: the camera does not see them (except for a visible
//! environment), they cast no shadow and block nothing, and they may be inside the volume.

mod area;
mod directional;
mod emission;
mod emit;
mod enclosure;
mod environment;
mod point;
mod set;
mod studio;
mod triangle;

pub use area::{Disk, Rect, SphereLight};
pub use directional::Directional;
pub use emission::Emission;
pub use emit::Emitted;
pub use enclosure::Enclosure;
pub use environment::{Environment, Map, MapError};
pub use point::PointLight;
pub use set::LightSet;
pub use studio::{Softbox, Studio};

use crate::math::{Ray, Rgb, Vec3};

/// The largest radiance, irradiance, intensity and emission that a scene may have: single precision holds its square,
/// which the variance of the picture needs.
pub const BRIGHTEST: f32 = 1e18;

/// A sphere around everything that can be lit, for which the power of lights is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Middle, world.
    pub center: Vec3,
    /// Radius, world units; positive.
    pub radius: f32,
}

/// A direction towards a light, sampled from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector to the light.
    pub direction: Vec3,
    /// How far the light is; infinite for distant ones.
    pub distance: f32,
    /// Radiance that arrives in empty space, over the pdf: the mean of its product with the
    /// scattering function is the scattered light.
    pub radiance: Rgb,
    /// Pdf over solid angle; infinite where no other technique could sample this direction.
    pub pdf: f32,
}

/// A point of a light: [`LightSample::radiance`] from it is `intensity max(0, cos) / distance^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// World position.
    pub position: Vec3,
    /// The axis from which the cosine is measured; `None` for a light that is equal in all directions.
    pub normal: Option<Vec3>,
    /// Radiant intensity along the normal, over the pdf by area, W/sr.
    pub intensity: Rgb,
}

/// A light that a ray passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Where on the ray; infinite for distant ones.
    pub distance: f32,
    /// Radiance towards the ray's origin.
    pub radiance: Rgb,
    /// Pdf with which [`Light::sample`] from the ray's origin would have sampled its direction.
    pub pdf: f32,
}

/// Any light of the scene document.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Parallel light, or nearly so.
    Directional(Directional),
    /// From one point.
    Point(PointLight),
    /// From a rectangle.
    Rect(Rect),
    /// From a disk.
    Disk(Disk),
    /// From a sphere.
    Sphere(SphereLight),
    /// From all around.
    Environment(Environment),
}

impl Light {
    /// Samples a direction towards the light from a world point; `None` if it sends nothing there.
    #[inline]
    #[must_use]
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        match self {
            Self::Directional(l) => l.sample(u),
            Self::Point(l) => l.sample(from),
            Self::Rect(l) => l.sample(from, u),
            Self::Disk(l) => l.sample(from, u),
            Self::Sphere(l) => l.sample(from, u),
            Self::Environment(l) => l.sample(u),
        }
    }

    /// A fixed point of a light from whose points light comes whatever receives it: of a point light, a rectangle or a disk. `u` selects it
    /// as in [`Self::sample`].
    #[must_use]
    pub fn point(&self, u: [f32; 2]) -> Option<LightPoint> {
        match self {
            Self::Point(l) => Some(LightPoint { position: l.position, normal: None, intensity: l.intensity }),
            Self::Rect(l) => Some(l.light_point(u)),
            Self::Disk(l) => Some(l.light_point(u)),
            Self::Directional(_) | Self::Sphere(_) | Self::Environment(_) => None,
        }
    }

    /// Where a ray passes the light, if it passes its emitting side.
    #[inline]
    #[must_use]
    pub fn passed(&self, ray: &Ray) -> Option<Passed> {
        match self {
            Self::Directional(l) => l.passed(ray),
            Self::Point(_) => None,
            Self::Rect(l) => l.passed(ray),
            Self::Disk(l) => l.passed(ray),
            Self::Sphere(l) => l.passed(ray),
            Self::Environment(l) => Some(l.passed(ray)),
        }
    }

    /// Whether a ray can pass it at all: false for points and parallel light.
    #[must_use]
    pub fn can_be_passed(&self) -> bool {
        match self {
            Self::Directional(l) => !l.is_sharp(),
            Self::Point(_) => false,
            _ => true,
        }
    }

    /// Luminance of the light that reaches the target, roughly, as an irradiance: the weight by which
    /// lights are chosen. Positive for every light that is not black.
    #[must_use]
    pub fn strength(&self, target: &Target) -> f64 {
        match self {
            Self::Directional(l) => l.strength(),
            Self::Point(l) => l.strength(target),
            Self::Rect(l) => l.strength(target),
            Self::Disk(l) => l.strength(target),
            Self::Sphere(l) => l.strength(target),
            Self::Environment(l) => l.strength(),
        }
    }
}

/// Luminance of the irradiance at a target from a small source of given radiance and area.
fn strength_of_area(radiance: Rgb, area: f32, position: Vec3, target: &Target) -> f64 {
    let distance = position.distance(target.center).max(target.radius);
    f64::from(radiance.luminance()) * f64::from(area) / f64::from(distance * distance)
}
