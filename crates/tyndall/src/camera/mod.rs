//! Cameras: from film positions to rays.

mod fit;

pub use fit::{AutoFront, AutoView, FitLens, fit};

use crate::math::{Frame, Ray, Vec3};
use crate::sampling::warp;

/// A camera that looks from a position to a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    position: Vec3,
    /// `u` points to the right of the picture, `v` to its top, `w` where the camera looks.
    frame: Frame,
    lens: Lens,
}

/// The projection and its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Perspective.
    Perspective {
        /// Vertical field of view, degrees, between 0 and 180.
        fov: f32,
        /// Diameter of the thin lens, world units; 0 is a pinhole.
        aperture: f32,
        /// Distance of the plane in focus along the view direction; positive.
        focus: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the picture, world units; positive.
        height: f32,
    },
}

impl Camera {
    /// Position and target must differ, and `up` must not be parallel to the view; the document ensures both.
    ///
    /// # Panics
    /// If position and target coincide or `up` is parallel to the view.
    #[must_use]
    pub fn new(position: Vec3, target: Vec3, up: Vec3, lens: Lens) -> Self {
        Self { position, frame: upright(target - position, up), lens }
    }

    /// The camera's position.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit vector in the view direction.
    #[must_use]
    pub fn view(&self) -> Vec3 {
        self.frame.w
    }

    /// Unit vectors: `u` to the right of the picture, `v` to its top, `w` in the view direction.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The lens.
    #[must_use]
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// The ray through a film position, in pixels from the top left of a film of `size` pixels, and a lens position,
    /// in the unit square.
    #[inline]
    #[must_use]
    pub fn ray(&self, size: [u32; 2], film: [f32; 2], lens: [f32; 2]) -> Ray {
        let [width, height] = size.map(|n| n as f32);
        // In units of half the picture's height, from its middle.
        let x = (2.0 * film[0] - width) / height;
        let y = (height - 2.0 * film[1]) / height;
        let Frame { u, v, w } = self.frame;
        match self.lens {
            Lens::Perspective { fov, aperture, focus } => {
                let tan = (0.5 * fov.to_radians()).tan();
                let sharp = w + u * (x * tan) + v * (y * tan);
                if aperture == 0.0 {
                    return Ray::new(self.position, sharp.normalize());
                }
                let [a, b] = warp::disk(lens).map(|c| 0.5 * aperture * c);
                let origin = self.position + u * a + v * b;
                Ray::new(origin, (self.position + sharp * focus - origin).normalize())
            }
            Lens::Orthographic { height } => {
                let origin = self.position + (u * x + v * y) * (0.5 * height);
                Ray::new(origin, w)
            }
        }
    }
}

/// The frame of a camera that looks along `view` with `up` upwards; both of any length but zero.
fn upright(view: Vec3, up: Vec3) -> Frame {
    let w = view.normalize();
    let u = w.cross(up.normalize());
    assert!(u.length() > 1e-6, "no camera frame for view direction {view} and up {up}");
    let u = u.normalize();
    Frame { u, v: u.cross(w), w }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [200, 100];

    fn camera(lens: Lens) -> Camera {
        Camera::new(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, Vec3::Y, lens)
    }

    #[test]
    fn the_top_left_of_the_film_is_up_and_to_the_left() {
        let pinhole = camera(Lens::Perspective { fov: 90.0, aperture: 0.0, focus: 10.0 });
        let corner = pinhole.ray(SIZE, [0.0, 0.0], [0.5; 2]).direction;
        // 90 degrees vertically: at distance 1 the top edge is 1 up, the left edge 2 to the left.
        assert!((corner / -corner.z - Vec3::new(-2.0, 1.0, -1.0)).length() < 1e-5, "{corner}");
        let flat = camera(Lens::Orthographic { height: 4.0 });
        let ray = flat.ray(SIZE, [200.0, 100.0], [0.5; 2]);
        assert_eq!((ray.origin, ray.direction), (Vec3::new(4.0, -2.0, 10.0), -Vec3::Z));
    }

    #[test]
    fn a_thin_lens_is_sharp_only_at_its_focus() {
        let lens = camera(Lens::Perspective { fov: 40.0, aperture: 2.0, focus: 8.0 });
        let pinhole = camera(Lens::Perspective { fov: 40.0, aperture: 0.0, focus: 8.0 });
        let at_z = |r: Ray, z: f32| r.at((z - r.origin.z) / r.direction.z);
        let film = [33.0, 71.0];
        let sharp = at_z(pinhole.ray(SIZE, film, [0.5; 2]), 2.0);
        let mut blurred = 0.0_f32;
        for i in 0..16 {
            let u = [(i % 4) as f32 / 4.0 + 0.1, (i / 4) as f32 / 4.0 + 0.1];
            let ray = lens.ray(SIZE, film, u);
            assert!((at_z(ray, 2.0) - sharp).length() < 1e-4);
            assert!((ray.direction.length() - 1.0).abs() < 1e-6);
            blurred = blurred.max((at_z(ray, -6.0) - at_z(pinhole.ray(SIZE, film, u), -6.0)).length());
        }
        assert!(blurred > 0.5, "{blurred}");
    }
}
