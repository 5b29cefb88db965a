//! Rectangles, disks and spheres that emit light.

use super::{Emitted, Enclosure, LightPoint, LightSample, Passed, Target, strength_of_area};
use crate::math::{Frame, Ray, Rgb, Vec3, cast};
use crate::sampling::warp;
use std::f32::consts::PI;

/// A sampled point of a flat light as seen from elsewhere, its pdf over solid angle.
fn flat_sample(from: Vec3, point: Vec3, normal: Vec3, area: f32, radiance: Rgb) -> Option<LightSample> {
    let to_light = point - from;
    let squared = to_light.length_squared();
    let distance = squared.sqrt();
    let direction = to_light / distance;
    let cos = -direction.dot(normal);
    // Behind the light, in its plane, or on it: nothing arrives. False for NaN too.
    if cos > 0.0 && squared > 0.0 {
        let pdf = squared / (cos * area);
        return Some(LightSample { direction, distance, radiance: radiance / pdf, pdf });
    }
    None
}

/// Where a ray passes the emitting side of a plane: the distance, the cosine, and the point relative to the middle.
fn flat_passed(ray: &Ray, middle: Vec3, normal: Vec3) -> Option<(f32, f32, Vec3)> {
    let cos = -ray.direction.dot(normal);
    if cos <= 0.0 {
        return None;
    }
    let distance = (ray.origin - middle).dot(normal) / cos;
    (distance > 0.0).then(|| (distance, cos, ray.at(distance) - middle))
}

/// A rectangle that emits light on the side that faces its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    middle: Vec3,
    /// `u` along the width, `v` along the height, `w` to the emitting side.
    frame: Frame,
    size: [f32; 2],
    radiance: Rgb,
}

impl Rect {
    /// `facing` and `up` are directions of any length; an `up` parallel to `facing` is replaced by an arbitrary one.
    #[must_use]
    pub fn new(middle: Vec3, facing: Vec3, up: Vec3, size: [f32; 2], radiance: Rgb) -> Self {
        let w = facing.normalize();
        let across = up.cross(w);
        let frame = if across.length() > 1e-6 * up.length() {
            let u = across.normalize();
            Frame { u, v: w.cross(u), w }
        } else {
            Frame::around(w)
        };
        Self { middle, frame, size, radiance }
    }

    fn area(&self) -> f32 {
        self.size[0] * self.size[1]
    }

    /// Uniform by area.
    #[inline]
    fn point(&self, u: [f32; 2]) -> Vec3 {
        self.middle
            + self.frame.u * ((u[0] - 0.5) * self.size[0])
            + self.frame.v * ((u[1] - 0.5) * self.size[1])
    }

    pub(super) fn light_point(&self, u: [f32; 2]) -> LightPoint {
        let intensity = self.radiance * self.area();
        LightPoint { position: self.point(u), normal: Some(self.frame.w), intensity }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        flat_sample(from, self.point(u), self.frame.w, self.area(), self.radiance)
    }

    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let point = self.point([u[2], u[3]]);
        Emitted::from_surface(into, point, self.frame.w, self.area(), [u[0], u[1]])
    }

    pub(super) fn color(&self) -> Rgb {
        self.radiance
    }

    pub(super) fn colored(self, radiance: Rgb) -> Self {
        Self { radiance, ..self }
    }

    #[inline]
    pub(super) fn passed(&self, ray: &Ray) -> Option<Passed> {
        let (distance, cos, offset) = flat_passed(ray, self.middle, self.frame.w)?;
        let inside = offset.dot(self.frame.u).abs() <= 0.5 * self.size[0]
            && offset.dot(self.frame.v).abs() <= 0.5 * self.size[1];
        let pdf = distance * distance / (cos * self.area());
        inside.then_some(Passed { distance, radiance: self.radiance, pdf })
    }

    pub(super) fn strength(&self, target: &Target) -> f64 {
        strength_of_area(self.radiance, self.area(), self.middle, target)
    }
}

/// A disk that emits light on the side that faces its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    middle: Vec3,
    frame: Frame,
    radius: f32,
    radiance: Rgb,
}

impl Disk {
    /// `facing` is a direction of any nonzero length.
    #[must_use]
    pub fn new(middle: Vec3, facing: Vec3, radius: f32, radiance: Rgb) -> Self {
        Self { middle, frame: Frame::around(facing.normalize()), radius, radiance }
    }

    fn area(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// Uniform by area.
    #[inline]
    fn point(&self, u: [f32; 2]) -> Vec3 {
        let [x, y] = warp::disk(u).map(|c| c * self.radius);
        self.middle + self.frame.u * x + self.frame.v * y
    }

    pub(super) fn light_point(&self, u: [f32; 2]) -> LightPoint {
        let intensity = self.radiance * self.area();
        LightPoint { position: self.point(u), normal: Some(self.frame.w), intensity }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        flat_sample(from, self.point(u), self.frame.w, self.area(), self.radiance)
    }

    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let point = self.point([u[2], u[3]]);
        Emitted::from_surface(into, point, self.frame.w, self.area(), [u[0], u[1]])
    }

    pub(super) fn color(&self) -> Rgb {
        self.radiance
    }

    pub(super) fn colored(self, radiance: Rgb) -> Self {
        Self { radiance, ..self }
    }

    #[inline]
    pub(super) fn passed(&self, ray: &Ray) -> Option<Passed> {
        let (distance, cos, offset) = flat_passed(ray, self.middle, self.frame.w)?;
        let pdf = distance * distance / (cos * self.area());
        (offset.length() <= self.radius).then_some(Passed { distance, radiance: self.radiance, pdf })
    }

    pub(super) fn strength(&self, target: &Target) -> f64 {
        strength_of_area(self.radiance, self.area(), self.middle, target)
    }
}

/// A sphere that emits light outwards, and none into its inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// Middle, world.
    pub middle: Vec3,
    /// Radius, world units; positive.
    pub radius: f32,
    /// Radiance of its surface.
    pub radiance: Rgb,
}

impl SphereLight {
    /// Solid angle that it subtends; 0 from inside, where it sends no light.
    pub(crate) fn solid_angle(&self, from: Vec3) -> f32 {
        2.0 * PI * self.cap(from).unwrap_or(0.0)
    }

    /// `1 - cos` of the half angle that the sphere subtends; `None` from inside.
    fn cap(&self, from: Vec3) -> Option<f32> {
        let sin_squared = self.radius * self.radius / (self.middle - from).length_squared();
        (sin_squared < 1.0).then(|| sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let cap = self.cap(from)?;
        let to_middle = self.middle - from;
        let drop = u[0] * cap;
        let sin = (drop * (2.0 - drop)).sqrt();
        let turned = (warp::around_z(0.0, u[1]) * sin).with_z(1.0 - drop);
        let direction = Frame::around(to_middle.normalize()).to_world(turned).normalize();
        let distance = self.nearest(&Ray::new(from, direction))?;
        let pdf = 1.0 / (2.0 * PI * cap);
        Some(LightSample { direction, distance, radiance: self.radiance / pdf, pdf })
    }

    /// Distance to the near side; a ray that misses the edge by rounding counts as touching it.
    fn nearest(&self, ray: &Ray) -> Option<f32> {
        let to_middle = self.middle - ray.origin;
        let along = to_middle.dot(ray.direction);
        let aside = (to_middle - ray.direction * along).length_squared();
        let half_chord = (self.radius * self.radius - aside).max(0.0).sqrt();
        (along - half_chord > 0.0).then_some(along - half_chord)
    }

    #[inline]
    pub(super) fn passed(&self, ray: &Ray) -> Option<Passed> {
        let cap = self.cap(ray.origin)?;
        let to_middle = (self.middle - ray.origin).normalize();
        let drop = 0.5 * (ray.direction - to_middle).length_squared();
        if drop > cap {
            return None;
        }
        let distance = self.nearest(ray)?;
        Some(Passed { distance, radiance: self.radiance, pdf: 1.0 / (2.0 * PI * cap) })
    }

    /// From the cap of points whose outward side sees any of the ball around the box, and so may see the box.
    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let (center, radius) = into.ball();
        let to_box = center - self.middle.as_dvec3();
        let distance = to_box.length();
        let lowest = cast::single((f64::from(self.radius) - radius) / distance).clamp(-1.0, 1.0);
        let toward = if distance > 0.0 { (to_box / distance).as_vec3() } else { Vec3::Z };
        let normal = Frame::around(toward).to_world(warp::cone([u[2], u[3]], lowest)).normalize();
        let area = 2.0 * PI * self.radius * self.radius * (1.0 - lowest);
        let point = self.middle + normal * self.radius;
        // A sphere around the whole box lights none of it; if it equals the ball, `lowest` is NaN.
        if area > 0.0 { Emitted::from_surface(into, point, normal, area, [u[0], u[1]]) } else { None }
    }

    pub(super) fn strength(&self, target: &Target) -> f64 {
        strength_of_area(self.radiance, PI * self.radius * self.radius, self.middle, target)
    }
}
