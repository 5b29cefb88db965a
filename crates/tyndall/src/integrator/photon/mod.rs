//! Photon mapping that survives edits \[Jonsson12\].
//!
//! Light paths store photons where they interact with matter (`light_paths`); photons are sorted by position (`map`),
//! and camera rays gather them, in segments (`segments`). Each path and segment records the data values that it read in
//! a Historygram, so that an edit of the transfer function recomputes only those that read changed values. The
//! positions of changed photons are recorded too (`cells::ChangeMarks`), for the segments that gather there.
//!
//! Everything is plain data in flat arrays, determined by the scene and the random numbers: a result after an edit
//! equals that of a new session, bit for bit. The first sample of every pixel uses this *base map*; later ones are
//! refinement passes with their own photons and a shrinking radius \[Knaus11\], which restart after an edit.

mod division;
mod edit;
mod gather;
mod gathering;
mod gathers;
mod kept;
mod kernel;
mod map;
mod matter;
mod pass;
mod segment;
mod segments;
mod settings;
mod stored;
mod view;

pub use settings::{Estimate, Histories, HistoryBins, Settings, SpatialHistory};

use super::cells::{CellGrid, ChangeMarks};
use super::history::Reading;
use super::light_paths::{
    Chunk, ChunkBytes, Ground, HistoryDetail, LightPaths, Plan, Tracing, most_kept, sources,
};
use super::{
    Edited, KeptCount, KeptItems, Limits, MemoryNeed, Method, MethodReport, NamedCount, PixelCounts,
    Resources, SettingProblem, StageNames, Stop, Updated, WorkShare, drop_elsewhere,
};
use crate::film::{Goal, Tile};
use crate::light::Enclosure;
use crate::math::DVec3;
use crate::scene::{Difference, Scene};
use gathers::GatherMemory;
use kept::KeptLight;
use kernel::Slice;
use map::{Lit, MapSettings, MapState, PhotonMap};
use pass::Pass;
use segments::{GatherSegments, SegmentCounts, SegmentTile};
use settings::Estimator;
use stored::Photon;
use view::View;

/// Light paths, photons, and marks of what edits have changed; segments are kept with their tiles.
#[derive(Debug)]
pub struct PhotonMapper {
    settings: Settings,
    ground: Ground,
    /// For what is kept of gathers; `None` if nothing is kept.
    gather_memory: Option<GatherMemory>,
    /// Bytes that may be kept for edits.
    edit_memory: usize,
    lights: Vec<LightPaths<Photon>>,
    /// Paths of the base map that are gone, with photons whose positions are yet to be marked.
    gone: Vec<Chunk<Photon>>,
    /// The base map.
    map: MapState,
    /// Where photons have changed since segments were last invalidated.
    marks: ChangeMarks,
    /// Whether there may be segments that an edit can leave valid.
    has_segments: bool,
    /// The current refinement pass.
    pass: Option<Pass>,
    /// Number of paths traced since the last edit.
    traced: usize,
}

impl PhotonMapper {
    /// Maximum size in bytes of photons and segments, up to random variation: with every path at its maximum length,
    /// and a refinement pass in addition to the base map.
    fn most_bytes(settings: &Settings, max_scatter: u32, size: [u32; 2]) -> u64 {
        let history = u64::from(settings.history_bits).div_ceil(8);
        let photon = size_of::<Photon>() as u64 + map::BYTES;
        let interactions = most_kept(max_scatter) * (2 * photon + 2 * history) as f64;
        let paths = f64::from(settings.photons) * (interactions + (16 + 2 * history) as f64);
        let segments = u64::from(size[0]) * u64::from(size[1]) * u64::from(settings.segments);
        let segment = segment::BYTES + history + gathers::BYTES;
        let view = segments.saturating_mul(segment).saturating_add(GatherMemory::most(size) as u64);
        crate::math::cast::whole(paths).saturating_add(view)
    }

    /// Number of photons of the base map, once traced.
    fn photons(&self) -> usize {
        self.lights.iter().flat_map(|light| &light.chunks).map(|chunk| chunk.vertices().len()).sum()
    }

    /// Number of light paths.
    fn paths(&self) -> usize {
        self.lights.iter().map(|light| light.count() as usize).sum()
    }

    /// What is kept for future edits besides segments.
    fn kept_paths(&self) -> [KeptCount; 3] {
        let chunks = || self.lights.iter().flat_map(|light| &light.chunks);
        let bytes = |of: fn(ChunkBytes) -> usize| chunks().map(|chunk| of(chunk.bytes())).sum();
        let count = self.photons();
        let map = self.map.ready().map_or(0, PhotonMap::bytes);
        [
            KeptCount { name: "paths", count: self.paths(), bytes: bytes(|chunk| chunk.paths) },
            KeptCount { name: "photons", count, bytes: bytes(|chunk| chunk.vertices) },
            KeptCount { name: "map", count, bytes: map },
        ]
    }
}

impl Method for PhotonMapper {
    const NAME: &'static str = "photon";
    const ABOUT: &'static str =
        "Photon mapping whose photons and view rays survive edits that do not touch them.";

    type Settings = Settings;
    /// The segments of the tile's view rays, once computed.
    type TileState = Option<SegmentTile>;

    fn check(settings: &Settings) -> Result<(), SettingProblem> {
        match settings.history_bits {
            32 | 64 | 128 => Ok(()),
            bits => Err(SettingProblem {
                key: "history_bits",
                found: bits.to_string(),
                expected: "32, 64 or 128",
            }),
        }
    }

    fn draft(settings: &Settings) -> Settings {
        Settings {
            photons: settings.photons.min(1 << 12),
            segments: settings.segments.min(9),
            steps_per_voxel: settings.steps_per_voxel.min(4.0),
            ..*settings
        }
    }

    fn notes(settings: &Settings, _: &Scene) -> Vec<&'static str> {
        match settings.spatial {
            SpatialHistory::Off => vec![
                "with `spatial = \"off\"` edits leave outdated light: the picture differs from a full recomputation",
            ],
            SpatialHistory::Cells | SpatialHistory::Axes => Vec::new(),
        }
    }

    fn memory(settings: &Settings, scene: &Scene) -> Option<MemoryNeed> {
        let max_scatter = scene.render.max_scatter;
        Some(MemoryNeed {
            bytes: Self::most_bytes(settings, max_scatter, scene.size),
            key: "photons",
            what: format!(
                "{} light paths of up to {max_scatter} scatterings and {} segments a pixel",
                settings.photons, settings.segments
            ),
            fix: "fewer of them",
        })
    }

    /// Creates the paths of a scene, in parallel on the current pool; nothing is traced yet.
    fn new(scene: &Scene, settings: &Settings, resources: &Resources) -> Self {
        let medium = &*scene.medium;
        let reading = Reading::new(medium, settings.groups(), settings.grouping());
        let sources = sources(scene);
        let plan = plan(scene, settings, sources.len());
        let lights = sources.into_iter().map(|source| LightPaths::new(source, &plan)).collect();
        let enclosure = Enclosure::new(medium.volume().grid());
        Self {
            settings: *settings,
            ground: Ground { reading, enclosure, level: resources.level },
            gather_memory: gather_memory(scene, resources.edit_memory),
            edit_memory: resources.edit_memory,
            lights,
            gone: Vec::new(),
            map: MapState::Absent,
            marks: marks_for(scene, settings),
            has_segments: false,
            pass: None,
            traced: 0,
        }
    }

    fn is_touched_by(&self, difference: &Difference) -> bool {
        // Majorant cells determine which random numbers tracking uses, and names those of a light's paths.
        let numbers = difference.majorants || difference.seed || difference.lights.names;
        difference.view() || difference.light() || numbers
    }

    fn update(&mut self, edit: &Edited, tiles: &mut [Option<SegmentTile>], limits: &Limits) -> Updated {
        self.keep_valid(edit, tiles, limits)
    }

    fn is_settling(&self, scene: &Scene, first: u32) -> bool {
        let is_lit = || self.map.ready().is_some() && self.lights.iter().all(LightPaths::is_valid);
        // A later part of a picture has no base map.
        !self.ground.reading.is_complete() || (scene.render.max_scatter > 0 && first == 0 && !is_lit())
    }

    fn count_anew(&mut self, tiles: &mut [Option<SegmentTile>]) {
        self.traced = 0;
        tiles.iter_mut().flatten().for_each(|tile| tile.computed = SegmentCounts::default());
    }

    /// Prepares the photons for a sample; the first sample uses the base map. False if stopped first.
    fn prepare(&mut self, scene: &Scene, sample: u32, limits: &Limits) -> bool {
        if !self.ground.reading.complete(limits) {
            return false;
        }
        if scene.render.max_scatter == 0 {
            return true;
        }
        if sample > 0 {
            if self.pass.as_ref().is_none_or(|pass| pass.number != sample) {
                let old = self.pass.replace(Pass::new(scene, &self.settings, sample));
                drop_elsewhere(old);
            }
            return self.pass.as_mut().is_some_and(|pass| pass.prepare(scene, &self.ground, limits));
        }
        if !self.mark_changed(limits) {
            return false;
        }
        let off = ChangeMarks::off();
        let marks = if self.has_segments { &self.marks } else { &off };
        let tracing = Tracing { scene, ground: &self.ground, marks, limits };
        let done = tracing.trace(&mut self.lights);
        self.traced += done.traced;
        if done.traced > 0 {
            self.map.discard();
        }
        let radius = self.settings.radius;
        if !done.finished || !build_map(&mut self.map, scene, radius, &self.settings, &self.lights, limits) {
            return false;
        }
        self.has_segments = true;
        true
    }

    fn samples_at_once(&self) -> u32 {
        1
    }

    fn refine(
        &self,
        scene: &Scene,
        tile: &mut Tile,
        segments: &mut Option<SegmentTile>,
        goal: Goal,
        stop: &Stop,
    ) {
        let (step, gather_spacing) = (step(scene, &self.settings), self.settings.gather_spacing);
        if tile.samples() > 0 {
            let map = self.pass.as_ref().and_then(|pass| pass.map.ready());
            let view = View { scene, map, step, gather_spacing };
            self.ground.level.run(pass::GatherPass { view, tile, goal, stop });
            return;
        }
        let Ground { reading: Reading { groups, cells, .. }, level, .. } = &self.ground;
        let per_ray = self.settings.segments as usize;
        let segments = segments.get_or_insert_with(|| SegmentTile::new(per_ray, groups.count()));
        segments.make_room(tile.pixel_count(), self.gather_memory.is_some());
        let view = View { scene, map: self.map.ready(), step, gather_spacing };
        let positions = &self.marks;
        let memory = self.gather_memory.as_ref();
        level.run(GatherSegments { view, segments, tile, goal, groups, cells, positions, memory, stop });
    }

    fn report(&self, tiles: &[Option<SegmentTile>], _: &PixelCounts) -> MethodReport {
        let sum = |of: fn(&SegmentTile) -> usize| tiles.iter().flatten().map(of).sum::<usize>();
        let (segments, bytes) = (sum(SegmentTile::len), sum(SegmentTile::bytes));
        let computed = sum(|tile| tile.computed.segments);
        let traced = self.traced;
        let segments_kept = KeptCount { name: "segments", count: segments, bytes };
        let (count, bytes) = (sum(SegmentTile::gathers), sum(SegmentTile::bytes_of_gathers));
        let gathers_kept = KeptCount { name: "gathers", count, bytes };
        MethodReport {
            recomputed: vec![
                WorkShare::new("photons", traced, self.paths()),
                WorkShare::new("segments", computed, segments),
            ],
            kept: self.kept_paths().into_iter().chain([segments_kept, gathers_kept]).collect(),
            items_computed: Some(traced + computed),
            counts: vec![
                NamedCount { name: "gathers", count: sum(|tile| tile.computed.gathers) },
                NamedCount { name: "marched", count: sum(|tile| tile.computed.marched) },
            ],
            stages: StageNames { preparation: Some("photons"), sampling: "segments" },
        }
    }

    fn kept_items(&self, tiles: &[Option<SegmentTile>]) -> Option<Box<dyn KeptItems>> {
        Some(Box::new(KeptLight { lights: self.lights.clone(), tiles: tiles.to_vec() }))
    }
}

/// The plan for the base map's paths from each of `sources` sources.
fn plan(scene: &Scene, settings: &Settings, sources: usize) -> Plan {
    Plan {
        count: Plan::share(settings.photons, sources),
        seed: scene.render.seed,
        pass: 0,
        groups: settings.groups(),
        histories: match settings.histories {
            Histories::Interactions => HistoryDetail::Vertices,
            Histories::Paths => HistoryDetail::Paths,
        },
    }
}

/// Step of a view ray in world units: short enough that attenuation within a step in the densest matter is small, with
/// a lower bound.
fn step(scene: &Scene, settings: &Settings) -> f32 {
    const THICKEST: f32 = 0.5;
    const SHORTEST: f32 = 1.0 / 16.0;
    let usual = scene.medium.volume().grid().voxel_size() / settings.steps_per_voxel;
    usual.min((THICKEST / scene.medium.density()).max(SHORTEST * usual))
}

/// The cells for photons that are gathered within a radius, in voxels.
fn cells_for(scene: &Scene, settings: &Settings, radius: f32) -> CellGrid {
    let grid = scene.medium.volume().grid();
    let radius = radius * grid.voxel_size();
    let reach = match settings.estimator() {
        // At least as wide as a step.
        Estimator::Beam => Slice::reach_of((step(scene, settings) / radius).max(settings.gather_spacing)),
        Estimator::Point | Estimator::Nearest(_) => 1.0,
    };
    CellGrid::new(grid, radius, reach)
}

/// Empty marks for changed photons, in the map's own cells: a gather sums photons cell by cell, so that even a photon
/// outside its radius can change its last bit.
fn marks_for(scene: &Scene, settings: &Settings) -> ChangeMarks {
    let medium = &*scene.medium;
    let grid = cells_for(scene, settings, settings.radius);
    // Above this number of changed photons, almost every segment gathers some of them.
    let enough = settings.photons as usize / 2;
    match settings.spatial {
        SpatialHistory::Off => ChangeMarks::off(),
        SpatialHistory::Axes => ChangeMarks::axes(grid, enough),
        SpatialHistory::Cells => {
            ChangeMarks::cells(grid, medium.volume().cells_of(medium.majorants().voxels()), enough)
        }
    }
}

/// Memory for what is kept of gathers, out of so many bytes; `None` if there is none.
fn gather_memory(scene: &Scene, bytes: usize) -> Option<GatherMemory> {
    (bytes > 0).then(|| GatherMemory::new(scene.size, bytes))
}

/// Sorts the photons of all lights into a map, unless it is ready; `radius` in voxels. False if stopped first.
fn build_map(
    map: &mut MapState,
    scene: &Scene,
    radius: f32,
    settings: &Settings,
    lights: &[LightPaths<Photon>],
    limits: &Limits,
) -> bool {
    if map.ready().is_some() {
        return true;
    }
    let voxel = scene.medium.volume().grid().voxel_size();
    let grid = cells_for(scene, settings, radius);
    let settings = MapSettings { grid, radius: radius * voxel, estimate: settings.estimator() };
    // In double precision, since world units may have any scale.
    let per_volume = f64::from(settings.radius).powi(3).recip() / f64::from(scene.medium.density());
    let scale = |light: &LightPaths<Photon>| {
        let [r, g, b] = light.color().to_array().map(f64::from);
        DVec3::new(r, g, b) * (per_volume / f64::from(light.count()))
    };
    let lit: Vec<Lit> =
        lights.iter().map(|light| Lit { chunks: &light.chunks, scale: scale(light) }).collect();
    map.build(&scene.medium, &settings, &lit, limits)
}
