//! Light from all around: constant, or a map of latitude and longitude.

use super::{BRIGHTEST, Emitted, Enclosure, LightSample, Passed};
use crate::math::{Frame, Ray, Rgb, Vec3, cast};
use crate::sampling::{Choice, Discrete, warp};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

/// An environment: radiance from every direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    sky: Sky,
    /// Whether the camera sees it.
    pub visible: bool,
}

#[derive(Clone, Debug)]
enum Sky {
    Constant(Rgb),
    Map {
        map: Arc<Map>,
        /// Map coordinates to the world: `w` is up, `u` points to the middle column.
        frame: Frame,
    },
}

/// Maps are compared by identity first: an edited scene shares its maps.
impl PartialEq for Sky {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => a == b,
            (Self::Map { map: a, frame: f }, Self::Map { map: b, frame: g }) => {
                f == g && (Arc::ptr_eq(a, b) || a == b)
            }
            _ => false,
        }
    }
}

const UNIFORM_PDF: f32 = 0.25 * FRAC_1_PI;

impl Environment {
    /// The same radiance from everywhere.
    #[must_use]
    pub fn constant(radiance: Rgb, visible: bool) -> Self {
        Self { sky: Sky::Constant(radiance), visible }
    }

    /// A map whose middle column is straight `ahead` of an upright viewer and whose top is `up`, unit vectors at right angles, turned about
    /// `up` by `rotation` degrees to that viewer's left; what is right of the middle column in the map is to the viewer's right.
    #[must_use]
    pub fn map(map: Arc<Map>, ahead: Vec3, up: Vec3, rotation: f32, visible: bool) -> Self {
        let (sin, cos) = rotation.to_radians().sin_cos();
        let u = ahead * cos + up.cross(ahead) * sin;
        Self { sky: Sky::Map { map, frame: Frame { u, v: up.cross(u), w: up } }, visible }
    }

    /// Radiance from a direction (unit vector towards the sky).
    #[inline]
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match &self.sky {
            Sky::Constant(radiance) => *radiance,
            Sky::Map { map, frame } => map.radiance(frame.to_local(direction)),
        }
    }

    fn pdf(&self, direction: Vec3) -> f32 {
        match &self.sky {
            Sky::Constant(_) => UNIFORM_PDF,
            Sky::Map { map, frame } => map.pdf(frame.to_local(direction)),
        }
    }

    fn toward(&self, u: [f32; 2]) -> Option<Vec3> {
        match &self.sky {
            Sky::Constant(_) => Some(warp::sphere(u)),
            Sky::Map { map, frame } => Some(frame.to_world(map.sample(u)?)),
        }
    }

    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let direction = self.toward(u)?;
        let pdf = self.pdf(direction);
        let radiance = self.radiance(direction) / pdf;
        (pdf > 0.0).then_some(LightSample { direction, distance: f32::INFINITY, radiance, pdf })
    }

    #[inline]
    pub(super) fn passed(&self, ray: &Ray) -> Passed {
        let (radiance, pdf) = (self.radiance(ray.direction), self.pdf(ray.direction));
        Passed { distance: f32::INFINITY, radiance, pdf }
    }

    /// Uniform over the silhouette of the box in a direction sampled as by [`Self::sample`].
    pub(super) fn emit(&self, into: &Enclosure, u: [f32; 4]) -> Option<Emitted> {
        let direction = self.toward([u[2], u[3]])?;
        let (ray, area) = into.cross(-direction.as_dvec3(), [u[0], u[1]])?;
        let measure = cast::single(area) / self.pdf(direction);
        let flux = match &self.sky {
            Sky::Constant(_) => Rgb::splat(measure),
            Sky::Map { .. } => self.radiance(direction) * measure,
        };
        Some(Emitted { ray, flux })
    }

    /// White for a map.
    pub(super) fn color(&self) -> Rgb {
        match &self.sky {
            Sky::Constant(radiance) => *radiance,
            Sky::Map { .. } => Rgb::WHITE,
        }
    }

    pub(super) fn same_paths(&self, other: &Self) -> bool {
        match (&self.sky, &other.sky) {
            (Sky::Constant(_), Sky::Constant(_)) => true,
            (a, b) => a == b,
        }
    }

    pub(super) fn strength(&self) -> f64 {
        let mean = match &self.sky {
            Sky::Constant(radiance) => f64::from(radiance.luminance()),
            Sky::Map { map, .. } => map.mean_luminance(),
        };
        // What a small sphere receives from all sides, per area of its cross-section.
        4.0 * std::f64::consts::PI * mean
    }
}

/// A sky by latitude (rows, the top row straight up) and longitude (columns), read bilinearly.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    width: usize,
    height: usize,
    texels: Vec<Rgb>,
    /// Probability of each row, and of each column within a row; `None` if the map is black.
    rows: Option<Discrete>,
    columns: Vec<Option<Discrete>>,
}

/// Why texels do not make a map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// Not as many texels as width times height, or none.
    #[error("{found} texels for a map of {width} x {height}")]
    Size {
        /// Texels given.
        found: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A texel is negative, not finite, or beyond [`BRIGHTEST`].
    #[error("texel ({x}, {y}) is {texel:?}: expected radiance from 0 to {BRIGHTEST:e}")]
    Texel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// What it holds.
        texel: [f32; 3],
    },
}

impl Map {
    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Linear radiance, row by row from the top.
    #[must_use]
    pub fn texels(&self) -> &[Rgb] {
        &self.texels
    }

    /// Linear radiance, row by row from the top.
    ///
    /// # Errors
    /// [`MapError`] if the size does not fit or a texel cannot be a radiance.
    pub fn new(width: usize, height: usize, texels: Vec<Rgb>) -> Result<Self, MapError> {
        if texels.is_empty() || texels.len() != width.saturating_mul(height) {
            return Err(MapError::Size { found: texels.len(), width, height });
        }
        let bad =
            texels.iter().position(|t| !t.to_array().into_iter().all(|x| (0.0..=BRIGHTEST).contains(&x)));
        if let Some(i) = bad {
            return Err(MapError::Texel { x: i % width, y: i / width, texel: texels[i].to_array() });
        }
        let mut map = Self { width, height, texels, rows: None, columns: Vec::new() };
        let weights: Vec<Vec<f64>> = (0..height).map(|y| map.row_weights(y)).collect();
        map.rows = Discrete::new(weights.iter().map(|row| row.iter().sum::<f64>()));
        map.columns = weights.into_iter().map(Discrete::new).collect();
        Ok(map)
    }

    /// Mean luminance of the bilinear texture over each texel of a row, times the texel's solid angle.
    ///
    /// A black texel next to a bright one is not black when read bilinearly; the mean includes that, so
    /// that nothing bright has probability 0.
    fn row_weights(&self, y: usize) -> Vec<f64> {
        let smooth = [0.125, 0.75, 0.125];
        let tap = |c: usize, n: usize, k: usize, wrap: bool| match (c + k).checked_sub(1) {
            None => {
                if wrap {
                    n - 1
                } else {
                    0
                }
            }
            Some(i) if i >= n => {
                if wrap {
                    0
                } else {
                    n - 1
                }
            }
            Some(i) => i,
        };
        let solid_angle = f64::from(self.solid_angle(y));
        let mean = |x: usize| -> f64 {
            let mut sum = 0.0;
            for (j, wy) in smooth.iter().enumerate() {
                for (i, wx) in smooth.iter().enumerate() {
                    let (tx, ty) = (tap(x, self.width, i, true), tap(y, self.height, j, false));
                    sum += wx * wy * f64::from(self.texels[ty * self.width + tx].luminance());
                }
            }
            sum
        };
        (0..self.width).map(|x| mean(x) * solid_angle).collect()
    }

    /// Cosines of the polar angle at the upper and lower border of a row.
    fn band(&self, y: usize) -> [f32; 2] {
        [y, y + 1].map(|y| (PI * y as f32 / self.height as f32).cos())
    }

    /// Solid angle of a texel of a row.
    fn solid_angle(&self, y: usize) -> f32 {
        let [top, bottom] = self.band(y);
        (top - bottom) * TAU / self.width as f32
    }

    /// Texture coordinates of a local direction, in texels.
    fn texture(&self, d: Vec3) -> [f32; 2] {
        // Longitude grows to the right of a viewer who looks along u with w up: towards -v.
        let turn = (-d.y).atan2(d.x) / TAU + 0.5;
        let drop = d.z.clamp(-1.0, 1.0).acos() * FRAC_1_PI;
        [turn * self.width as f32, drop * self.height as f32]
    }

    fn radiance(&self, d: Vec3) -> Rgb {
        let [x, y] = self.texture(d);
        let (x, y) = (x - 0.5, (y - 0.5).clamp(0.0, (self.height - 1) as f32));
        let left = x.floor();
        let column = |x: f32| if x < 0.0 { self.width - 1 } else { cast::index(x) % self.width };
        let (x0, x1, y0) = (column(left), column(left + 1.0), cast::index(y));
        let y1 = (y0 + 1).min(self.height - 1);
        let row =
            |y: usize| self.texels[y * self.width + x0].lerp(self.texels[y * self.width + x1], x - left);
        row(y0).lerp(row(y1), y - y0 as f32)
    }

    fn sample(&self, u: [f32; 2]) -> Option<Vec3> {
        let Choice { index: y, leftover: v, .. } = self.rows.as_ref()?.sample(u[0]);
        let Choice { index: x, leftover: t, .. } = self.columns[y].as_ref()?.sample(u[1]);
        // Uniform over the texel's solid angle: even in longitude and in the cosine of the polar angle.
        let [top, bottom] = self.band(y);
        let cos = top + (bottom - top) * v;
        let longitude = TAU * ((x as f32 + t) / self.width as f32 - 0.5);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Some(Vec3::new(sin * longitude.cos(), -sin * longitude.sin(), cos))
    }

    fn pdf(&self, d: Vec3) -> f32 {
        let Some(rows) = &self.rows else { return 0.0 };
        let [x, y] = self.texture(d);
        let (x, y) = (cast::index(x).min(self.width - 1), cast::index(y).min(self.height - 1));
        let Some(columns) = &self.columns[y] else { return 0.0 };
        rows.probability(y) * columns.probability(x) / self.solid_angle(y)
    }

    fn mean_luminance(&self) -> f64 {
        self.rows.as_ref().map_or(0.0, |rows| rows.total() / (4.0 * std::f64::consts::PI))
    }
}
