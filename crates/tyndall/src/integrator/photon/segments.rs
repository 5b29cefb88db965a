//! View rays divided into segments, each computed, kept and invalidated independently \[Jonsson12, sec. 4.3.2\].

use super::division::{due_in, ends, segment_of, steps_of};
use super::gathers::{GatherMemory, LaneGathers, SegmentGathers, radiance};
use super::segment::Segment;
use super::view::{Notes, Stretches, View};
use crate::film::{Goal, PixelSample, Tile};
use crate::integrator::cells::ChangeMarks;
use crate::integrator::history::PackedHistories;
use crate::integrator::view_march::OPAQUE;
use crate::integrator::{ItemChanges, Stop};
use crate::math::{Ray, Rgb, Vec3, cast};
use crate::medium::Track;
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes, MOST_LANES};
use crate::transfer::{HistoryGroups, Historygram};

/// The segments of a tile's pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentTile {
    /// Number of segments per ray.
    per_ray: usize,
    segments: Vec<Segment>,
    /// Values that each segment read.
    histories: PackedHistories,
    /// What is kept of each known segment's gathers; `None` if nothing is kept.
    gathers: Option<SegmentGathers>,
    /// Whether none is known, whatever they hold; their memory will be reused.
    forgotten: bool,
    /// What has changed since the segments were last invalidated; `None` without an edit.
    changed: Option<SeenChange>,
    /// Number of pixels whose segments have been asked, if a stop interrupted that.
    asked: usize,
    pub(super) computed: SegmentCounts,
}

/// Values whose change is visible along a view ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct SeenChange {
    /// Those of which more changed than the albedo.
    pub matter: Historygram,
    /// Those whose albedo changed.
    pub colors: Historygram,
}

/// Work done since the last edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct SegmentCounts {
    /// Number of segments computed.
    pub segments: usize,
    /// Number of these that were marched; in the others, light was gathered where it had been.
    pub marched: usize,
    /// Number of positions in them where photons were gathered.
    pub gathers: usize,
}

impl SegmentTile {
    /// Without segments.
    pub fn new(per_ray: usize, groups: u8) -> Self {
        Self {
            per_ray,
            segments: Vec::new(),
            histories: PackedHistories::new(groups),
            gathers: None,
            forgotten: true,
            changed: None,
            asked: 0,
            computed: SegmentCounts::default(),
        }
    }

    /// Forgets all segments.
    pub fn forget(&mut self) {
        self.forgotten = true;
        self.changed = None;
    }

    /// Makes room for this many pixels if the segments were forgotten.
    pub fn make_room(&mut self, pixels: usize, keeps_gathers: bool) {
        if std::mem::take(&mut self.forgotten) {
            let count = pixels * self.per_ray;
            self.segments.clear();
            self.segments.resize(count, Segment::UNKNOWN);
            self.histories.resize(count);
            if keeps_gathers {
                self.gathers.get_or_insert_default().reset(count);
            }
        }
    }

    /// Removes what is kept of gathers, with its memory; the segments must have been forgotten.
    pub(super) fn take_gathers(&mut self) -> impl Send + use<> {
        self.gathers.take()
    }

    /// Number of segments that are not forgotten.
    pub fn len(&self) -> usize {
        if self.forgotten { 0 } else { self.segments.len() }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.segments[..]) + self.histories.bytes()
    }

    /// Number of their gathers that are kept.
    pub fn gathers(&self) -> usize {
        self.gathers.as_ref().map_or(0, |kept| kept.parts.len())
    }

    /// Size of these in bytes.
    pub fn bytes_of_gathers(&self) -> usize {
        self.gathers.as_ref().map_or(0, SegmentGathers::bytes)
    }

    /// Differences between its known segments and those known at another time; all are new if the number of segments
    /// differs.
    pub fn compare(&self, other: &Self) -> ItemChanges {
        if self.forgotten || self.len() != other.len() {
            return ItemChanges { differing: 0, new: self.len() };
        }
        let mut changes = ItemChanges::default();
        for (here, there) in self.segments.iter().zip(&other.segments) {
            match [here.is_known(), there.is_known()] {
                [true, true] => {
                    changes.differing += usize::from(bytemuck::bytes_of(here) != bytemuck::bytes_of(there));
                }
                [true, false] => changes.new += 1,
                _ => {}
            }
        }
        changes
    }

    /// Records which values an edit changed; photons may have changed anywhere.
    pub(super) fn add_change(&mut self, change: SeenChange) {
        let SeenChange { matter, colors } = self.changed.unwrap_or_default();
        self.changed = Some(SeenChange { matter: matter | change.matter, colors: colors | change.colors });
        self.asked = 0;
    }

    /// Whether all recorded changes have been applied.
    pub fn is_settled(&self) -> bool {
        self.changed.is_none()
    }

    /// Applies the recorded changes to the segments that they touch: what cannot be computed from their gathers is no
    /// longer known. False if stopped first.
    fn invalidate(&mut self, view: &View, tile: &Tile, positions: &ChangeMarks, stop: &Stop) -> bool {
        let Some(changed) = self.changed else { return true };
        let mut near = vec![false; self.per_ray];
        for pixel in tile.positions(self.asked..tile.pixel_count()) {
            let of_ray = self.asked * self.per_ray..(self.asked + 1) * self.per_ray;
            for i in of_ray.clone() {
                if self.histories.get(i).meets(changed.matter) {
                    self.segments[i] = Segment::UNKNOWN;
                }
            }
            near.fill(positions.everywhere());
            let segments = &self.segments[of_ray.clone()];
            if !positions.everywhere() && positions.any() && segments.iter().any(Segment::is_known) {
                find_near(view, pixel, positions, segments, &mut near);
            }
            for (i, &near) in of_ray.zip(&near) {
                let recolored = self.histories.get(i).meets(changed.colors);
                if self.segments[i].is_known() && !self.is_mended(i, near, recolored, view) {
                    self.segments[i] = Segment::UNKNOWN;
                }
                if let Some(kept) = self.gathers.as_mut().filter(|_| !self.segments[i].is_known()) {
                    kept.forget(i);
                }
            }
            self.asked += 1;
            if stop.reached() {
                return false;
            }
        }
        self.changed = None;
        true
    }

    /// Sums the light of a known segment anew, or lets it be gathered again; false if too little of its gathers is kept.
    fn is_mended(&mut self, i: usize, near: bool, recolored: bool, view: &View) -> bool {
        if !near && !recolored {
            return true;
        }
        let Some(kept) = &mut self.gathers else { return false };
        let Some(parts) = kept.parts.get(i) else { return false };
        if near {
            kept.outdated[i] = kept.sites.get(i).is_some();
            return kept.outdated[i];
        }
        self.segments[i].radiance = radiance(parts, view.scene.medium.transfer()).to_array();
        true
    }

    /// Gathers light again in the visible segments of a ray where photons changed; all these are known.
    #[inline(always)]
    fn gather_again<S: Lanes>(&mut self, simd: S, view: &View, ray: usize, w_out: Vec3) {
        let (Some(kept), Some(map)) = (&mut self.gathers, view.map) else { return };
        let medium = &*view.scene.medium;
        let mut transmittance = 1.0;
        for i in ray * self.per_ray..(ray + 1) * self.per_ray {
            if transmittance < OPAQUE {
                break;
            }
            transmittance *= self.segments[i].transmittance();
            if !std::mem::take(&mut kept.outdated[i]) {
                continue;
            }
            if let (Some(parts), Some(sites)) = (kept.parts.get_mut(i), kept.sites.get(i)) {
                // Emitted light comes last and has no site.
                for (part, site) in parts.iter_mut().zip(sites) {
                    part.light = map.scattered_again(simd, medium, site, part.value, w_out);
                }
                self.segments[i].radiance = radiance(parts, medium.transfer()).to_array();
                self.computed.segments += 1;
                self.computed.gathers += sites.len();
            }
        }
    }

    /// The first segment of a ray that is visible but not known; `None` if there is none.
    fn missing(&self, ray: usize) -> Option<usize> {
        let mut transmittance = 1.0;
        for segment in 0..self.per_ray {
            let found = &self.segments[ray * self.per_ray + segment];
            if !found.is_known() {
                return Some(segment);
            }
            transmittance *= found.transmittance();
            if transmittance < OPAQUE {
                return None;
            }
        }
        None
    }

    /// Composites a ray's segments front to back.
    fn composite(&self, view: &View, ray: usize, (world, track): &(Ray, Track)) -> PixelSample {
        let (mut radiance, mut transmittance, mut depth) = (Rgb::BLACK, 1.0_f32, 0.0);
        let count = track.steps(view.step);
        let segments = &self.segments[ray * self.per_ray..(ray + 1) * self.per_ray];
        for (number, segment) in segments.iter().enumerate() {
            radiance += Rgb::from(segment.radiance) * transmittance;
            let behind = transmittance * segment.transmittance();
            let distance = segment.distance(ends(steps_of(number, self.per_ray, count), view.step));
            depth += distance * (transmittance - behind);
            transmittance = behind;
            // Segments behind are not visible, and may be out of date.
            if transmittance < OPAQUE {
                break;
            }
        }
        let alpha = 1.0 - transmittance;
        let distance = depth + alpha * track.distance(0.0);
        PixelSample {
            radiance: radiance + view.scene.behind(world.direction) * transmittance,
            alpha,
            depth: distance * world.direction.dot(view.scene.camera.view()),
        }
    }
}

/// The ray of a pixel's segments, through the middle of the pixel and of the lens.
fn ray_of(scene: &Scene, [x, y]: [u32; 2]) -> (Ray, Track) {
    let ray = scene.camera.ray(scene.size, [x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
    (ray, scene.medium.track(&ray, f32::INFINITY))
}

/// Finds the known segments of a ray that gather where photons changed.
fn find_near(view: &View, pixel: [u32; 2], positions: &ChangeMarks, segments: &[Segment], near: &mut [bool]) {
    let medium = &*view.scene.medium;
    let (_, track) = ray_of(view.scene, pixel);
    let count = track.steps(view.step);
    for cell in medium.majorants().walk_singly(&track) {
        // Nothing is gathered where there is no matter.
        if cell.most <= 0.0 || !positions.near_cell(cell.cell) {
            continue;
        }
        // All steps that reach into the cell; one extra on either side, since the border is subject to rounding.
        let first = cast::truncate(cell.start / view.step - 1.0).max(0);
        let last = cast::truncate(cell.end / view.step + 1.0).min(count - 1);
        for k in first..=last {
            let i = segment_of(k, segments.len(), count);
            if !near[i] && segments[i].is_known() {
                near[i] = positions.near(track.step_ends(k, view.step).map(|t| track.at(t)));
            }
        }
    }
}

/// Computes the segments that are visible but not known, of the pixels of a tile that the goal includes, and adds a sample to
/// each of these pixels, unless stopped first.
pub(super) struct GatherSegments<'a> {
    pub view: View<'a>,
    pub segments: &'a mut SegmentTile,
    pub tile: &'a mut Tile,
    pub goal: Goal,
    pub groups: &'a HistoryGroups,
    pub cells: &'a [Historygram],
    pub positions: &'a ChangeMarks,
    /// For what is kept of gathers; `None` if nothing is kept.
    pub memory: Option<&'a GatherMemory>,
    pub stop: &'a Stop<'a>,
}

impl Kernel for GatherSegments<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { view, segments, tile, goal, groups, cells, positions, memory, stop } = self;
        if !segments.invalidate(&view, tile, positions, stop) {
            return;
        }
        let turn = tile.turn(goal);
        let pixels: Vec<[u32; 2]> = tile.positions(turn.clone()).collect();
        let rays: Vec<(Ray, Track)> = pixels.iter().map(|&pixel| ray_of(view.scene, pixel)).collect();
        for (ray, (_, track)) in turn.clone().zip(&rays) {
            if track.steps(view.step) == 0 {
                // The ray misses the volume.
                let segments = &mut segments.segments[ray * segments.per_ray..(ray + 1) * segments.per_ray];
                segments.fill(Segment::CLEAR);
            }
        }
        // Rays with missing segments, in pixel order; each round computes one segment per ray.
        let mut lacking: Vec<usize> = turn.clone().filter(|&ray| segments.missing(ray).is_some()).collect();
        let mut gathers = LaneGathers::default();
        while !lacking.is_empty() {
            for packet in lacking.chunks(S::WIDTH) {
                let mut stretches = Stretches::default();
                let mut numbers = [0; MOST_LANES];
                for (lane, &ray) in packet.iter().enumerate() {
                    let segment = segments.missing(ray).unwrap_or(0);
                    let here = ray - turn.start;
                    (stretches.rays[lane], stretches.tracks[lane]) = rays[here];
                    let count = rays[here].1.steps(view.step);
                    [stretches.from[lane], stretches.to[lane]] = steps_of(segment, segments.per_ray, count);
                    stretches.due[lane] = due_in(pixels[here], segment);
                    numbers[lane] = ray * segments.per_ray + segment;
                }
                let bins = view.scene.medium.transfer().bins();
                gathers.clear();
                let read = [Historygram::EMPTY; MOST_LANES];
                let mut notes =
                    Notes { groups, records: groups.records(), bins, cells, read, gathers: &mut gathers };
                let found = view.march(simd, &stretches, &mut notes);
                for lane in 0..packet.len() {
                    let steps = [stretches.from[lane], stretches.to[lane]];
                    segments.segments[numbers[lane]] = Segment::new(&found[lane], ends(steps, view.step));
                    segments.histories.set(numbers[lane], notes.read[lane]);
                    if let (Some(kept), Some(memory)) = (&mut segments.gathers, memory) {
                        kept.keep(numbers[lane], notes.gathers, lane, memory);
                    }
                    segments.computed.gathers += found[lane].gathers;
                }
                segments.computed.segments += packet.len();
                segments.computed.marched += packet.len();
                if stop.reached_now() {
                    return;
                }
            }
            lacking.retain(|&ray| segments.missing(ray).is_some());
        }
        for (ray, (world, _)) in turn.clone().zip(&rays) {
            segments.gather_again(simd, &view, ray, -world.direction);
            if stop.reached() {
                return;
            }
        }
        for (ray, of_ray) in turn.zip(&rays) {
            tile.add(&segments.composite(&view, ray, of_ray));
        }
    }
}
