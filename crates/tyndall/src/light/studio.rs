//! A photographer's studio as an environment: a gradient from ground to ceiling, and softboxes.

use super::environment::{Map, MapError};
use crate::math::{Rgb, Vec3};
use std::f32::consts::{PI, TAU};

/// Radiance all around, of which everything is said by a few numbers. Directions are those in which light is seen from the middle of the
/// studio: azimuth 0 is behind a viewer who looks straight ahead, 90 degrees to the viewer's right, 180 straight ahead.
#[derive(Clone, Debug, PartialEq)]
pub struct Studio {
    /// Radiance straight up.
    pub zenith: Rgb,
    /// Radiance at the horizon.
    pub horizon: Rgb,
    /// Radiance straight down.
    pub ground: Rgb,
    /// Lamps, whose radiance is added to that behind them.
    pub softboxes: Vec<Softbox>,
}

/// A lamp behind a rectangle of cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softbox {
    /// Where its middle is, degrees about the up axis.
    pub azimuth: f32,
    /// Degrees above the horizon.
    pub elevation: f32,
    /// Degrees from edge to edge, across and upwards; at most 180.
    pub size: [f32; 2],
    /// Width of the band about each edge in which the radiance falls to nothing, over half of the size; 0 to 1.
    pub softness: f32,
    /// Radiance in the middle.
    pub radiance: Rgb,
}

/// Rows of the map, half as many as columns: a texel is 0.7 degrees wide.
const ROWS: usize = 256;

impl Studio {
    /// The same radiance as a map for [`super::Environment`].
    ///
    /// # Errors
    /// [`MapError::Texel`] where the lamps together are brighter than [`super::BRIGHTEST`].
    pub fn map(&self) -> Result<Map, MapError> {
        let boxes: Vec<_> = self.softboxes.iter().map(Placed::new).collect();
        let columns = 2 * ROWS;
        let texel = |i: usize| {
            let [x, y] = [i % columns, i / columns].map(|n| n as f32 + 0.5);
            let (sin, cos) = (TAU * (x / columns as f32 - 0.5)).sin_cos();
            let (sin_polar, up) = (PI * y / ROWS as f32).sin_cos();
            self.radiance(&boxes, Vec3::new(sin_polar * cos, -sin_polar * sin, up))
        };
        Map::new(columns, ROWS, (0..columns * ROWS).map(texel).collect())
    }

    /// Radiance from a direction of the map: x straight ahead, y to the left, z up.
    fn radiance(&self, boxes: &[Placed], direction: Vec3) -> Rgb {
        let far = if direction.z > 0.0 { self.zenith } else { self.ground };
        let mut sum = self.horizon.lerp(far, direction.z.abs());
        for lamp in boxes {
            sum += lamp.radiance * lamp.share(direction);
        }
        sum
    }
}

/// A softbox with its own axes.
struct Placed {
    /// To its middle, across it to the viewer's right when the viewer faces it, and upwards.
    axes: [Vec3; 3],
    /// Half of its size, radians.
    half: [f32; 2],
    softness: f32,
    radiance: Rgb,
}

impl Placed {
    fn new(lamp: &Softbox) -> Self {
        let (sin_a, cos_a) = lamp.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = lamp.elevation.to_radians().sin_cos();
        Self {
            axes: [
                Vec3::new(-cos_a * cos_e, -sin_a * cos_e, sin_e),
                Vec3::new(-sin_a, cos_a, 0.0),
                Vec3::new(cos_a * sin_e, sin_a * sin_e, cos_e),
            ],
            half: lamp.size.map(|degrees| 0.5 * degrees.to_radians()),
            softness: lamp.softness,
            radiance: lamp.radiance,
        }
    }

    /// The share of its radiance that is seen in a direction.
    fn share(&self, direction: Vec3) -> f32 {
        let [ahead, across, up] = self.axes.map(|axis| axis.dot(direction));
        let within = |aside: f32, half: f32| {
            let beyond = aside.atan2(ahead).abs() / half - 1.0;
            let t = (0.5 - beyond / self.softness.max(1e-3)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        within(across, self.half[0]) * within(up, self.half[1])
    }
}
