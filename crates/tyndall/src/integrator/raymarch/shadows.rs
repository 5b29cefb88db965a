//! The grid of shadows: how fine it is, what it needs before samples are taken, and what an edit leaves of it.

use super::cached::CachedLight;
use super::light_points::{LightPoints, points_on};
use super::{RayMarch, Settings, Shadows};
use crate::integrator::shadow_grid::{Layout, ShadowGrid};
use crate::integrator::{Edited, Limits, drop_elsewhere};
use crate::light::Light;
use crate::scene::{Difference, Scene};

/// Most memory for the texels.
const MOST_BYTES: u64 = 512 << 20;

/// Most optical thickness, from texel to texel, of the densest matter: light would be more than some 5 % off.
const MOST_THICKNESS: f32 = 1.0;

/// Where shadows will come from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Plan {
    /// A ray for each.
    Exact,
    /// As above, since no grid that holds so many light points would be fine enough.
    TooManyPoints,
    /// As above, since light would be lost between two texels of the finest grid that fits.
    TooDense,
    /// A grid.
    Grid(Layout),
}

impl Plan {
    /// For a scene.
    pub fn of_scene(scene: &Scene, settings: &Settings) -> Self {
        let points = light_points(scene, settings);
        if settings.shadows == Shadows::Exact || scene.render.max_scatter == 0 || points == 0 {
            return Self::Exact;
        }
        match Layout::within(&scene.medium, points, MOST_BYTES) {
            None => Self::TooManyPoints,
            Some(layout) if layout.thickness(&scene.medium) > MOST_THICKNESS => Self::TooDense,
            Some(layout) => Self::Grid(layout),
        }
    }

    /// What a user should know of it.
    pub fn note(&self) -> Option<&'static str> {
        match self {
            Self::TooManyPoints => Some(
                "`raymarch` marches every shadow ray, which is slow: shadows of so many points on lights fit 512 MiB only at a grid \
                 too coarse to use; fewer `render.raymarch.light_samples` or lights make it fast",
            ),
            Self::TooDense => Some(
                "`raymarch` marches every shadow ray, which is slow: matter is so dense that light is lost between the texels of cached shadows; \
                 a lower `medium.density` or fewer `render.raymarch.light_samples` make it fast",
            ),
            Self::Grid(layout) if layout.is_coarse() => Some(
                "`raymarch` keeps shadows in cells wider than a voxel, to stay within 512 MiB; fewer \
                 `render.raymarch.light_samples` or lights make them finer, `render.raymarch.shadows = \"exact\"` makes them exact",
            ),
            _ => None,
        }
    }

    /// Memory that its texels take, and while they are computed the rays.
    pub fn most_bytes(&self, scene: &Scene, settings: &Settings) -> Option<u64> {
        match self {
            Self::Grid(layout) => {
                let points = light_points(scene, settings);
                Some(layout.bytes(points) + layout.bytes_of_sweeps(points))
            }
            _ => None,
        }
    }
}

fn light_points(scene: &Scene, settings: &Settings) -> usize {
    let on = |light: &Light| points_on(light, settings.light_samples as usize);
    scene.lights.lights().iter().map(on).sum()
}

/// A grid of shadows and the light points that it is for.
#[derive(Debug)]
pub(super) struct CachedShadows {
    points: LightPoints,
    grid: ShadowGrid,
}

impl CachedShadows {
    /// With nothing computed yet; `None` if the scene needs no grid.
    pub fn of_scene(scene: &Scene, settings: &Settings) -> Option<Self> {
        let Plan::Grid(layout) = Plan::of_scene(scene, settings) else { return None };
        let points = LightPoints::of_scene(scene, settings.light_samples as usize);
        let aims = points.aims(&layout, scene.medium.volume().grid());
        let grid = ShadowGrid::new(layout, aims);
        Some(Self { points, grid })
    }

    /// What computes the light at positions, once the grid is complete.
    #[inline(always)]
    pub fn light<'a>(&'a self, scene: &'a Scene) -> CachedLight<'a> {
        CachedLight::new(scene, &self.points, &self.grid)
    }

    /// Whether the grid is complete.
    pub fn is_ready(&self) -> bool {
        self.grid.is_ready()
    }
}

impl RayMarch {
    /// Computes what is missing of the grid; false if stopped first.
    pub(super) fn prepare_shadows(&mut self, scene: &Scene, limits: &Limits) -> bool {
        let level = self.level;
        self.shadows.as_mut().is_none_or(|shadows| shadows.grid.complete(&scene.medium, level, limits))
    }

    /// Keeps the texels if the edit left them as they are.
    pub(super) fn update_shadows(&mut self, edit: &Edited, settings: &Settings) {
        let next = CachedShadows::of_scene(edit.new, settings);
        match (&mut self.shadows, next) {
            (Some(kept), Some(next)) if kept.grid.is_like(&next.grid) => {
                kept.points = next.points;
                if !keeps_shadows(edit.difference) {
                    kept.grid.restart();
                }
            }
            (Some(kept), Some(mut next)) => {
                next.grid.take_memory(&mut kept.grid);
                *kept = next;
            }
            (shadows, next) => drop_elsewhere(std::mem::replace(shadows, next)),
        }
    }
}

/// Whether transmittances along all rays are still the same, to the last bit.
fn keeps_shadows(difference: &Difference) -> bool {
    let Difference { transfer, density, clip, volume, .. } = difference;
    transfer.opacity.is_empty() && density.is_none() && !clip && !volume
}
