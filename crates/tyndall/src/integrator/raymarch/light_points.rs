//! Fixed points on all lights, the same for every position, and the light that arrives from them.

use crate::integrator::shadow_grid::{Aim, Layout, padded};
use crate::light::{Light, LightPoint, LightSample, SphereLight};
use crate::math::{Rgb, Vec3, cast};
use crate::sampling::warp;
use crate::scene::Scene;
use crate::simd::Lanes;
use crate::volume::Grid;
use fearless_simd::prelude::*;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct LightPoints {
    places: Vec<Place>,
    /// The points whose direction depends on where they are seen from.
    near: Vec<NearLight>,
    /// From distant points; elsewhere black.
    distant: Arrivals,
}

/// Where a point is, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Infinitely far, in this direction.
    Distant(Vec3),
    At(Vec3),
}

/// Consecutive points of a light at a finite distance.
#[derive(Clone, Debug)]
struct NearLight {
    /// The number of the first.
    first: usize,
    points: Vec<LightPoint>,
    /// The sphere that they are on, if they are. As some of them face away, the others share its light.
    sphere: Option<SphereLight>,
}

/// Directions to the points and the light from them, each in an array of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrivals {
    direction: [Vec<f32>; 3],
    /// Unshadowed radiance over pdf over the number of points of the light.
    radiance: [Vec<f32>; 3],
}

/// A vector of points.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArrivalLanes<S: Lanes> {
    /// Unit vectors to the points.
    pub direction: [S::f32s; 3],
    /// Radiance, over the pdf.
    pub radiance: [S::f32s; 3],
}

/// Number of points on a light.
pub(super) fn points_on(light: &Light, samples: usize) -> usize {
    match light {
        // Of which one half is seen.
        Light::Sphere(_) => 2 * samples,
        light if light.can_be_passed() => samples,
        _ => 1,
    }
}

impl LightPoints {
    /// With so many points on lights that can be passed.
    pub fn of_scene(scene: &Scene, samples: usize) -> Self {
        let mut points = Self { places: Vec::new(), near: Vec::new(), distant: Arrivals::default() };
        let mut distant = Vec::new();
        for light in scene.lights.lights() {
            let count = points_on(light, samples);
            let square = if count == 1 { vec![[0.5; 2]] } else { points_on_lights(count) };
            let share = 1.0 / count as f32;
            let first = points.places.len();
            let mut near = NearLight { first, points: Vec::new(), sphere: None };
            for u in square {
                if let Light::Sphere(sphere) = light {
                    let normal = warp::sphere(u);
                    let position = sphere.middle + normal * sphere.radius;
                    near.points.push(LightPoint {
                        position,
                        normal: Some(normal),
                        intensity: sphere.radiance,
                    });
                    near.sphere = Some(*sphere);
                    points.places.push(Place::At(position));
                } else if let Some(point) = light.point(u) {
                    near.points.push(LightPoint { intensity: point.intensity * share, ..point });
                    points.places.push(Place::At(point.position));
                } else if let Some(LightSample { direction, radiance, .. }) = light.sample(Vec3::ZERO, u) {
                    distant.push((direction, radiance * share));
                }
            }
            if !near.points.is_empty() {
                points.near.push(near);
            }
        }
        // Points in similar directions side by side, since they are written together.
        let grid = scene.medium.volume().grid();
        distant.sort_by_key(|&(direction, _)| {
            let along = grid.direction_to_index(direction);
            (along.abs().max_position(), along.is_negative_bitmask())
        });
        let first = points.places.len();
        points.distant = Arrivals::dark(padded(first + distant.len()));
        for (i, (direction, radiance)) in (first..).zip(distant) {
            points.distant.set(i, direction, radiance);
            points.places.push(Place::Distant(direction));
        }
        points
    }

    /// The points in units of a layout's lattice.
    pub fn aims(&self, layout: &Layout, grid: &Grid) -> Vec<Aim> {
        let aim = |place: &Place| match *place {
            Place::Distant(direction) => layout.aim_towards(grid, direction),
            Place::At(position) => layout.aim_at(grid, position),
        };
        self.places.iter().map(aim).collect()
    }

    /// Number of vectors of points.
    #[inline(always)]
    pub fn vectors<S: Lanes>(&self) -> usize {
        self.places.len().div_ceil(S::WIDTH)
    }

    /// Space for what arrives at a position.
    pub fn arrivals(&self) -> Arrivals {
        if self.near.is_empty() { Arrivals::default() } else { self.distant.clone() }
    }

    /// What arrives at an index-space position without matter; `space` is from [`Self::arrivals`].
    #[inline(always)]
    pub fn arriving<'a>(&'a self, grid: &Grid, position: Vec3, space: &'a mut Arrivals) -> &'a Arrivals {
        if self.near.is_empty() {
            return &self.distant;
        }
        let here = grid.index_to_world(position);
        for NearLight { first, points, sphere } in &self.near {
            let mut sum = 0.0;
            for (i, point) in (*first..).zip(points) {
                let way = point.position - here;
                let squared = way.length_squared();
                let direction = way / squared.sqrt();
                let cos = point.normal.map_or(1.0, |normal| -direction.dot(normal));
                // False for NaN, on the light, too.
                if cos > 0.0 && squared > 0.0 {
                    space.set(i, direction, point.intensity * (cos / squared));
                    sum += cos / squared;
                } else {
                    space.set(i, Vec3::X, Rgb::BLACK);
                }
            }
            if let Some(sphere) = sphere {
                let share = sphere.solid_angle(here) / sum;
                space.scale(*first, points.len(), if sum > 0.0 { share } else { 0.0 });
            }
        }
        space
    }
}

impl Arrivals {
    /// No light, from any direction.
    fn dark(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self { direction: [vec![1.0; count], zeros(), zeros()], radiance: [zeros(), zeros(), zeros()] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, direction: Vec3, radiance: Rgb) {
        for (axis, x) in self.direction.iter_mut().zip(direction.to_array()) {
            axis[i] = x;
        }
        for (channel, x) in self.radiance.iter_mut().zip(radiance.to_array()) {
            channel[i] = x;
        }
    }

    fn scale(&mut self, first: usize, count: usize, share: f32) {
        for channel in &mut self.radiance {
            channel[first..first + count].iter_mut().for_each(|x| *x *= share);
        }
    }

    /// The `i`-th vector of points.
    #[inline(always)]
    pub fn lanes<S: Lanes>(&self, simd: S, i: usize) -> ArrivalLanes<S> {
        let range = i * S::WIDTH..(i + 1) * S::WIDTH;
        let ([x, y, z], [r, g, b]) = (&self.direction, &self.radiance);
        ArrivalLanes {
            direction: [
                S::f32s::from_slice(simd, &x[range.clone()]),
                S::f32s::from_slice(simd, &y[range.clone()]),
                S::f32s::from_slice(simd, &z[range.clone()]),
            ],
            radiance: [
                S::f32s::from_slice(simd, &r[range.clone()]),
                S::f32s::from_slice(simd, &g[range.clone()]),
                S::f32s::from_slice(simd, &b[range]),
            ],
        }
    }

    /// Direction to a point, and the radiance from there.
    pub fn of(&self, i: usize) -> (Vec3, Rgb) {
        let ([x, y, z], [r, g, b]) = (&self.direction, &self.radiance);
        (Vec3::new(x[i], y[i], z[i]), Rgb::new(r[i], g[i], b[i]))
    }
}

/// Points in the unit square, stratified in both coordinates.
pub(super) fn points_on_lights(count: usize) -> Vec<[f32; 2]> {
    let count = cast::fit_u32(count);
    (0..count).map(|i| hammersley(i, count)).collect()
}

/// The `i`-th of `n` points of the Hammersley set: stratified in the first coordinate, and in the second for powers of two.
fn hammersley(i: u32, n: u32) -> [f32; 2] {
    let radical_inverse = (i.reverse_bits() >> 8) as f32 / (1 << 24) as f32;
    // Below 1: the largest of n radical inverses is 1 - 1/2^k with 2^k < 2n.
    [(i as f32 + 0.5) / n as f32, radical_inverse + 0.5 / n as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_points_are_stratified_and_inside_the_square() {
        for n in [1, 2, 3, 5, 16, 100, 256, 4096] {
            let mut strata = vec![0; n as usize];
            for i in 0..n {
                let [u, v] = hammersley(i, n);
                assert!((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v), "{u}, {v} of {n}");
                strata[cast::index(v * n as f32)] += 1;
            }
            assert!(!n.is_power_of_two() || strata.iter().all(|&k| k == 1), "{n}: {strata:?}");
        }
    }
}
