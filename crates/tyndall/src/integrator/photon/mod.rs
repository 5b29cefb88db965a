//! Photon mapping that survives edits \[Jonsson12\].
//!
//! Light paths leave photons where they interact with matter (`paths`), sorted by place (`map`); rays from the camera gather
//! them, in segments (`segments`). Path and segment know the data values that they read, as a Historygram, so that an
//! edit of the transfer function redoes those alone that read what it changed. Where photons changed is known too
//! (`spatial`), for the segments that gather there.
//!
//! All is plain data in flat arrays, and everything follows from scene and numbers: what is redone comes out as it would
//! from nothing, bit for bit. The first sample of every pixel is this *base map*; later ones are refinement passes with
//! photons of their own and a shrinking radius \[Knaus11\], and start anew after an edit.

mod chunk;
mod edit;
mod gather;
mod grid;
mod kernel;
mod lights;
mod map;
mod matter;
mod pass;
mod paths;
mod segments;
mod spatial;
mod view;

pub(crate) use segments::SegmentTile;

use super::Stop;
use super::history::Reading;
use crate::film::Tile;
use crate::light::Enclosure;
use crate::math::DVec3;
use crate::scene::{Estimate, PhotonSettings, Scene, SpatialHistory};
use crate::simd::Level;
use grid::CellGrid;
use kernel::Slice;
use lights::{Ground, LightPaths, Plan, sources, trace};
use map::{Lit, PhotonMap};
use pass::Pass;
use segments::Refine;
use spatial::Changed;
use std::sync::atomic::{AtomicUsize, Ordering};
use view::View;

/// Light paths, photons, and what is known about edits since; the segments lie with their tiles.
#[derive(Debug)]
pub struct PhotonMapping {
    settings: PhotonSettings,
    ground: Ground,
    lights: Vec<LightPaths>,
    /// Of the base map; `None` where photons have changed since.
    map: Option<PhotonMap>,
    /// Where photons changed since the segments last asked.
    places: Changed,
    /// Whether there may be segments that an edit leaves valid.
    has_segments: bool,
    /// The refinement pass that is being made or used.
    pass: Option<Pass>,
    /// Paths traced since the last edit.
    traced: AtomicUsize,
}

impl PhotonMapping {
    /// Prepares the paths of a scene, in parallel on the current pool; nothing is traced yet.
    #[must_use]
    pub fn new(scene: &Scene, settings: PhotonSettings, level: Level) -> Self {
        let medium = &*scene.medium;
        let reading = Reading::new(medium, settings.history_bits, settings.bins);
        let sources = sources(scene);
        let plan = Plan::new(scene, &settings, 0, sources.len());
        let lights = sources.into_iter().map(|source| LightPaths::new(source, &plan)).collect();
        Self {
            settings,
            ground: Ground { reading, enclosure: Enclosure::new(medium.volume().grid()), level },
            lights,
            map: None,
            places: places_for(scene, &settings),
            has_segments: false,
            pass: None,
            traced: AtomicUsize::new(0),
        }
    }

    /// Bytes that photons and segments take at most, but for chance: with every path as long as it may
    /// be, and a refinement pass beside the base map.
    #[must_use]
    pub fn most_bytes(settings: &PhotonSettings, max_scatter: u32, size: [u32; 2]) -> u64 {
        let history = u64::from(settings.history_bits).div_ceil(8);
        let photon = size_of::<paths::Photon>() as u64 + map::BYTES;
        let interactions = paths::most_kept(max_scatter) * (2 * photon + 2 * history) as f64;
        let paths = f64::from(settings.photons) * (interactions + (16 + 2 * history) as f64);
        let segments = u64::from(size[0]) * u64::from(size[1]) * u64::from(settings.segments);
        crate::math::cast::whole(paths).saturating_add(segments.saturating_mul(segments::BYTES + history))
    }

    /// Makes the photons ready from which a sample is to be taken, those of the base map for the first; false where a stop
    /// came before.
    pub(super) fn prepare<'s>(
        &mut self,
        scene: &Scene,
        sample: u32,
        stop: &(impl Fn() -> Stop<'s> + Sync),
    ) -> bool {
        if scene.render.max_scatter == 0 {
            return true;
        }
        if sample > 0 {
            if self.pass.as_ref().is_none_or(|pass| pass.number != sample) {
                self.pass = Some(Pass::new(scene, &self.settings, sample));
            }
            return self.pass.as_mut().is_some_and(|pass| pass.prepare(scene, &self.ground, stop));
        }
        let off = Changed::off();
        let places = if self.has_segments { &self.places } else { &off };
        let before = self.traced.load(Ordering::Relaxed);
        let whole = trace(&mut self.lights, scene, &self.ground, 0, places, &self.traced, stop);
        if self.traced.load(Ordering::Relaxed) > before {
            self.map = None;
        }
        if !whole {
            return false;
        }
        if self.map.is_none() {
            self.map = Some(sorted(scene, self.settings.radius, &self.settings, &self.lights));
        }
        self.has_segments = true;
        true
    }

    /// Takes the next sample of every pixel of a tile, unless a stop comes first.
    pub(super) fn refine(
        &self,
        scene: &Scene,
        tile: &mut Tile,
        segments: &mut Option<SegmentTile>,
        stop: &Stop,
    ) {
        let (step, gather_spacing) = (step(scene, &self.settings), self.settings.gather_spacing);
        if tile.samples() > 0 {
            let map = self.pass.as_ref().and_then(|pass| pass.map.as_ref());
            let view = View { scene, map, step, gather_spacing };
            self.ground.level.run(pass::Refine { view, tile, stop });
            return;
        }
        let Ground { reading: Reading { groups, cells, .. }, level, .. } = &self.ground;
        let per_ray = self.settings.segments as usize;
        let segments = segments.get_or_insert_with(|| {
            let pixels = tile.next(usize::MAX).0.len();
            SegmentTile::new(pixels, per_ray, groups.count())
        });
        let view = View { scene, map: self.map.as_ref(), step, gather_spacing };
        level.run(Refine { view, segments, tile, groups, cells, places: &self.places, stop });
    }

    /// Paths, and of these the ones traced since the last edit.
    #[must_use]
    pub fn paths(&self) -> [usize; 2] {
        let all = self.lights.iter().map(|light| light.count as usize).sum();
        [all, self.traced.load(Ordering::Relaxed)]
    }

    /// Paths, as they are now.
    pub(super) fn light_paths(&self) -> Paths {
        Paths(self.lights.clone())
    }

    /// Begins to count the paths traced.
    pub(super) fn count_anew(&self) {
        self.traced.store(0, Ordering::Relaxed);
    }

    /// Photons of the base map, once it is made.
    #[must_use]
    pub fn photons(&self) -> usize {
        self.lights.iter().flat_map(|light| &light.chunks).map(|chunk| chunk.photons().len()).sum()
    }

    /// Bytes kept for paths, for photons, both with their histories, and for the base map that sorts the photons.
    #[must_use]
    pub fn bytes(&self) -> [usize; 3] {
        let chunks = self.lights.iter().flat_map(|light| &light.chunks).map(chunk::Chunk::bytes);
        let [paths, photons] = chunks.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
        [paths, photons, self.map.as_ref().map_or(0, PhotonMap::bytes)]
    }
}

/// Step of a view ray, world units: so short that little light is lost in the densest matter within one, since light and
/// view then change as fast; but not without end.
fn step(scene: &Scene, settings: &PhotonSettings) -> f32 {
    const THICKEST: f32 = 0.5;
    const SHORTEST: f32 = 1.0 / 16.0;
    let usual = scene.medium.volume().grid().voxel_size() / settings.steps_per_voxel;
    usual.min((THICKEST / scene.medium.density()).max(SHORTEST * usual))
}

/// The cells for photons that are gathered within a radius, in voxels.
fn cells_for(scene: &Scene, settings: &PhotonSettings, radius: f32) -> CellGrid {
    let grid = scene.medium.volume().grid();
    let radius = radius * grid.voxel_size();
    let reach = match settings.estimate {
        // As wide as a step at least.
        Estimate::Beam => Slice::reach_of((step(scene, settings) / radius).max(settings.gather_spacing)),
        Estimate::Point | Estimate::Nearest(_) => 1.0,
    };
    CellGrid::new(grid, radius, reach)
}

/// Where photons will change, in the map's own cells: photons are added up in the order of whole cells, so that one beside a
/// gather moves its last bit.
fn places_for(scene: &Scene, settings: &PhotonSettings) -> Changed {
    let medium = &*scene.medium;
    let grid = cells_for(scene, settings, settings.radius);
    // When so many photons have changed, few segments are left that gather none of them.
    let enough = settings.photons as usize / 2;
    match settings.spatial {
        SpatialHistory::Off => Changed::off(),
        SpatialHistory::Axes => Changed::axes(grid, enough),
        SpatialHistory::Cells => {
            Changed::cells(grid, medium.volume().cells_of(medium.majorants().voxels()), enough)
        }
    }
}

/// The paths of all lights at one time.
#[derive(Clone, Debug, Default)]
pub(super) struct Paths(Vec<LightPaths>);

impl Paths {
    /// How many are other ones at another time, or were not there.
    pub fn differing(&self, other: &Self) -> usize {
        let of_light = |light: &LightPaths| {
            let same = other.0.iter().find(|other| other.stream == light.stream);
            let chunks = light.chunks.iter().enumerate();
            let differing = chunks.map(|(i, chunk)| {
                same.and_then(|same| same.chunks.get(i)).map_or(chunk.len(), |other| chunk.differing(other))
            });
            differing.sum::<usize>()
        };
        self.0.iter().map(of_light).sum()
    }
}

/// Sorts the photons of all lights; `radius` in voxels.
fn sorted(scene: &Scene, radius: f32, settings: &PhotonSettings, lights: &[LightPaths]) -> PhotonMap {
    let grid = scene.medium.volume().grid();
    let cells = cells_for(scene, settings, radius);
    let radius = radius * grid.voxel_size();
    // In double precision, since world units may be anything.
    let per_volume = f64::from(radius).powi(3).recip() / f64::from(scene.medium.density());
    let scale = |light: &LightPaths| {
        let [r, g, b] = light.color().to_array().map(f64::from);
        DVec3::new(r, g, b) * (per_volume / f64::from(light.count))
    };
    let lit: Vec<Lit> =
        lights.iter().map(|light| Lit { chunks: &light.chunks, scale: scale(light) }).collect();
    PhotonMap::new(&scene.medium, cells, radius, settings.estimate, &lit)
}
