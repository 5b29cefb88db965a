//! Lights of the scene from those of the document.

use crate::assets::Assets;
use crate::document::{self, Axes};
use crate::scene_error::{SceneError, fault};
use tyndall::camera::{AutoFront, Camera};
use tyndall::light::{Directional, Disk, Environment, Light, PointLight, Rect, SphereLight};
use tyndall::math::{DVec3, Rgb, Vec3};
use tyndall::message::excerpt;
use tyndall::volume::Grid;

/// Whether any light follows the camera.
pub(crate) fn follow_camera(lights: &Option<Vec<document::Light>>) -> bool {
    lights.iter().flatten().any(|light| light.axes() == Axes::Camera)
}

/// The lights of a document, whose maps are among the assets.
///
/// # Errors
/// [`SceneError`] if a map is missing.
pub(crate) fn lights_of(
    lights: &[document::Light],
    grid: &Grid,
    camera: &Camera,
    assets: &Assets,
) -> Result<Vec<Light>, SceneError> {
    let read = |(i, light): (usize, &document::Light)| {
        let placing = Placing { grid, of_camera: (light.axes() == Axes::Camera).then_some(camera) };
        light_of(light, &placing, assets).map_err(|e| fault(format!("lights.{i}"), e))
    };
    lights.iter().enumerate().map(read).collect()
}

/// How the directions and positions of a light become those of the renderer, whose origin is the centre of the volume.
struct Placing<'a> {
    grid: &'a Grid,
    /// The camera in whose axes they are given, if it is not the world.
    of_camera: Option<&'a Camera>,
}

impl Placing<'_> {
    fn direction(&self, given: Vec3) -> Vec3 {
        match self.of_camera.map(Camera::frame) {
            Some(frame) => frame.u * given.x + frame.v * given.y - frame.w * given.z,
            None => given,
        }
    }

    fn position(&self, given: &[f64; 3]) -> Vec3 {
        match self.of_camera {
            Some(_) => self.direction(DVec3::from_array(*given).as_vec3()),
            None => self.grid.to_world(*given),
        }
    }

    fn between(&self, from: &[f64; 3], to: &[f64; 3]) -> Vec3 {
        self.direction((DVec3::from_array(*to) - DVec3::from_array(*from)).as_vec3())
    }

    fn up(&self) -> Vec3 {
        self.of_camera.map_or(self.grid.space().up(), |camera| camera.frame().v)
    }

    /// Straight ahead of whoever looks at the volume from the front.
    fn ahead(&self) -> Vec3 {
        self.of_camera.map_or(-self.grid.space().front(), Camera::view)
    }
}

fn light_of(light: &document::Light, placing: &Placing, assets: &Assets) -> Result<Light, String> {
    let vector = |given: &[f32; 3]| placing.direction(Vec3::from_array(*given));
    Ok(match light {
        document::Light::Directional { direction, irradiance, angle, .. } => {
            Light::Directional(Directional::new(vector(direction), Rgb::from(*irradiance), *angle))
        }
        document::Light::Point { position, intensity, .. } => Light::Point(PointLight {
            position: placing.position(position),
            intensity: Rgb::from(*intensity),
        }),
        document::Light::Rect { position, target, up, size, radiance, .. } => {
            let facing = placing.between(position, target);
            let up = up.as_ref().map_or(placing.up(), vector);
            Light::Rect(Rect::new(placing.position(position), facing, up, *size, Rgb::from(*radiance)))
        }
        document::Light::Disk { position, target, radius, radiance, .. } => {
            let facing = placing.between(position, target);
            Light::Disk(Disk::new(placing.position(position), facing, *radius, Rgb::from(*radiance)))
        }
        document::Light::Sphere { position, radius, radiance, .. } => Light::Sphere(SphereLight {
            middle: placing.position(position),
            radius: *radius,
            radiance: Rgb::from(*radiance),
        }),
        document::Light::Environment { radiance, map, studio, rotation, visible, .. } => {
            let map = match (map, studio) {
                (Some(path), _) => Some(
                    assets.maps.get(path).ok_or_else(|| format!("the map `{}` is missing", excerpt(path)))?,
                ),
                (None, Some(studio)) => Some(assets.studio(studio).ok_or("the studio's map is missing")?),
                (None, None) => None,
            };
            Light::Environment(match map {
                Some(map) => {
                    Environment::map(map.clone(), placing.ahead(), placing.up(), *rotation, *visible)
                }
                None => Environment::constant(radiance.map_or(Rgb::BLACK, Rgb::from), *visible),
            })
        }
    })
}

/// Lights that bring out shape: a warm, soft sun from the upper left in front, and a cool sky as fill light.
pub(crate) fn default_lights(grid: &Grid) -> Vec<Light> {
    let AutoFront { front, up, .. } = AutoFront::of(grid);
    let right = up.cross(front);
    let travel = right * 0.7 - up * 0.8 - front * 0.6;
    let sun = Directional::new(travel, Rgb::new(5.0, 4.7, 4.2), 12.0);
    let sky = Environment::constant(Rgb::new(0.22, 0.25, 0.30), true);
    vec![Light::Directional(sun), Light::Environment(sky)]
}
