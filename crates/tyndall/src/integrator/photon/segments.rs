//! View rays in segments, each by itself computed, kept and found invalid \[Jonsson12, sec. 4.3.2\].

use super::histories::Histories;
use super::spatial::Changed;
use super::view::{Notes, OPAQUE, Stretch, Stretches, View};
use crate::film::{PixelSample, Tile};
use crate::integrator::Stop;
use crate::math::{Ray, Rgb};
use crate::medium::{MOST_LANES, Track};
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes};
use crate::transfer::{HistoryGroups, Historygram};

/// The segments of a tile's pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SegmentTile {
    /// Segments of each ray.
    per_ray: usize,
    /// Radiance and transmittance; NaN where none is known.
    light: Vec<[f32; 4]>,
    depth: Vec<f32>,
    /// Values that each segment read.
    histories: Histories,
    /// Values that have changed since the segments were last asked, unless there was no edit.
    changed: Option<Historygram>,
    /// Segments computed since the last edit, and places in them where photons were gathered.
    pub computed: [usize; 2],
}

/// Bytes of a segment without its Historygram.
pub(super) const BYTES: u64 = 20;

/// Transmittance of a segment that is not known.
const UNKNOWN: [f32; 4] = [0.0, 0.0, 0.0, f32::NAN];

impl SegmentTile {
    /// For so many pixels, nothing known yet.
    pub fn new(pixels: usize, per_ray: usize, groups: u8) -> Self {
        let count = pixels * per_ray;
        Self {
            per_ray,
            light: vec![UNKNOWN; count],
            depth: vec![0.0; count],
            histories: Histories::with_len(groups, count),
            changed: None,
            computed: [0; 2],
        }
    }

    /// Segments in it.
    pub fn len(&self) -> usize {
        self.light.len()
    }

    /// Bytes kept.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.light[..]) + size_of_val(&self.depth[..]) + self.histories.bytes()
    }

    /// Segments known here and there, with another light; and those known here alone.
    pub fn differing(&self, other: &Self) -> [usize; 2] {
        let mut counts = [0; 2];
        for (here, there) in self.light.iter().zip(&other.light) {
            match [here[3].is_nan(), there[3].is_nan()] {
                [false, false] => counts[0] += usize::from(here.map(f32::to_bits) != there.map(f32::to_bits)),
                [false, true] => counts[1] += 1,
                _ => {}
            }
        }
        counts
    }

    /// What values an edit changed; photons may have changed anywhere.
    pub fn add_change(&mut self, values: Historygram) {
        self.changed = Some(self.changed.unwrap_or_default() | values);
        self.computed = [0; 2];
    }

    /// Whether all changes have been asked for.
    pub fn is_settled(&self) -> bool {
        self.changed.is_none()
    }

    /// Forgets the segments that changes touch.
    fn invalidate(&mut self, view: &View, pixels: &[[u32; 2]], places: &Changed) {
        let Some(changed) = self.changed.take() else { return };
        if !changed.is_empty() {
            for i in 0..self.len() {
                if self.histories.get(i).meets(changed) {
                    self.light[i] = UNKNOWN;
                }
            }
        }
        if places.everywhere() {
            self.light.fill(UNKNOWN);
        } else if places.any() {
            for (ray, light) in self.light.chunks_exact_mut(self.per_ray).enumerate() {
                if light.iter().any(|l| !l[3].is_nan()) {
                    forget_near(view, pixels[ray], places, light);
                }
            }
        }
    }

    /// The first segment of a ray that shows and is not known; `None` if there is none.
    fn missing(&self, ray: usize) -> Option<usize> {
        let mut transmittance = 1.0;
        for segment in 0..self.per_ray {
            let [.., t] = self.light[ray * self.per_ray + segment];
            if t.is_nan() {
                return Some(segment);
            }
            transmittance *= t;
            if transmittance < OPAQUE {
                return None;
            }
        }
        None
    }

    /// A ray's segments put together, front to back.
    fn composite(&self, scene: &Scene, ray: usize, (world, track): &(Ray, Track)) -> PixelSample {
        let (mut radiance, mut transmittance, mut depth) = (Rgb::BLACK, 1.0_f32, 0.0);
        let segments = ray * self.per_ray..(ray + 1) * self.per_ray;
        for (&[r, g, b, t], segment_depth) in self.light[segments.clone()].iter().zip(&self.depth[segments]) {
            radiance += Rgb::new(r, g, b) * transmittance;
            depth += segment_depth * transmittance;
            transmittance *= t;
            // What lies behind does not show, and may be out of date.
            if transmittance < OPAQUE {
                break;
            }
        }
        let alpha = 1.0 - transmittance;
        let distance = depth + alpha * track.distance(0.0);
        PixelSample {
            radiance: radiance + scene.behind(world.direction) * transmittance,
            alpha,
            depth: distance * world.direction.dot(scene.camera.view()),
        }
    }
}

/// The steps of a ray that a segment has: the segments share them evenly.
fn steps_of(segment: usize, per_ray: usize, count: i32) -> [i32; 2] {
    let border = |segment: usize| {
        let steps = i64::from(count) * segment as i64 / per_ray as i64;
        i32::try_from(steps).unwrap_or(i32::MAX)
    };
    [border(segment), border(segment + 1)]
}

/// The segment that a step is in.
fn segment_of(step: i32, per_ray: usize, count: i32) -> usize {
    let number = ((i64::from(step) + 1) * per_ray as i64 - 1) / i64::from(count.max(1));
    usize::try_from(number).unwrap_or(0).min(per_ray - 1)
}

/// Share of a gather that is due at the beginning of a segment: even over neighbouring pixels and segments, by a lattice of
/// irrational steps.
fn due_in([x, y]: [u32; 2], segment: usize) -> f32 {
    let along = crate::math::cast::fit_u32(segment).wrapping_mul(0x9e37_79b9);
    let turn = x.wrapping_mul(0xc13f_a9a9).wrapping_add(y.wrapping_mul(0x91e1_0da5)).wrapping_add(along);
    (turn >> 8) as f32 / (1 << 24) as f32
}

/// The ray of a pixel's segments, through its middle and the lens's.
fn ray_of(scene: &Scene, [x, y]: [u32; 2]) -> (Ray, Track) {
    let ray = scene.camera.ray(scene.size, [x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
    (ray, scene.medium.track(&ray, f32::INFINITY))
}

/// Forgets the segments of a ray that gather where photons changed.
fn forget_near(view: &View, pixel: [u32; 2], places: &Changed, light: &mut [[f32; 4]]) {
    let medium = &*view.scene.medium;
    let (_, track) = ray_of(view.scene, pixel);
    let count = track.steps(view.step);
    for cell in medium.majorants().walk_singly(&track) {
        // Nothing is gathered where there is no matter.
        if cell.most <= 0.0 || !places.near_cell(cell.cell) {
            continue;
        }
        // A step more to either side, whatever rounding says about the border.
        let first = crate::math::cast::truncate(cell.start / view.step - 1.5).max(0);
        let last = crate::math::cast::truncate(cell.end / view.step + 0.5).min(count - 1);
        for k in first..=last {
            let segment = &mut light[segment_of(k, light.len(), count)];
            if !segment[3].is_nan() && places.near(track.at(track.midpoint(k, view.step))) {
                *segment = UNKNOWN;
            }
        }
    }
}

/// Computes the segments of a tile that show and are not known, and gives each pixel its sample, unless a
/// stop comes first.
pub(super) struct Refine<'a> {
    pub view: View<'a>,
    pub segments: &'a mut SegmentTile,
    pub tile: &'a mut Tile,
    pub groups: &'a HistoryGroups,
    pub cells: &'a [Historygram],
    pub places: &'a Changed,
    pub stop: &'a Stop<'a>,
}

impl Kernel for Refine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { view, segments, tile, groups, cells, places, stop } = self;
        let pixels: Vec<[u32; 2]> = tile.next(usize::MAX).0.collect();
        segments.invalidate(&view, &pixels, places);
        let rays: Vec<(Ray, Track)> = pixels.iter().map(|&pixel| ray_of(view.scene, pixel)).collect();
        for (ray, _) in rays.iter().enumerate().filter(|(_, (_, track))| track.steps(view.step) == 0) {
            // Past the volume.
            let segments = &mut segments.light[ray * segments.per_ray..(ray + 1) * segments.per_ray];
            segments.fill([0.0, 0.0, 0.0, 1.0]);
        }
        // Rays that lack segments, and those that still do after a packet's turn, in the order of the pixels.
        let mut lacking: Vec<usize> =
            (0..pixels.len()).filter(|&ray| segments.missing(ray).is_some()).collect();
        while !lacking.is_empty() {
            for packet in lacking.chunks(S::WIDTH) {
                let mut stretches = Stretches::default();
                let mut numbers = [0; MOST_LANES];
                for (lane, &ray) in packet.iter().enumerate() {
                    let segment = segments.missing(ray).unwrap_or(0);
                    (stretches.rays[lane], stretches.tracks[lane]) = rays[ray];
                    let count = rays[ray].1.steps(view.step);
                    [stretches.from[lane], stretches.to[lane]] = steps_of(segment, segments.per_ray, count);
                    stretches.due[lane] = due_in(pixels[ray], segment);
                    numbers[lane] = ray * segments.per_ray + segment;
                }
                let bins = view.scene.medium.transfer().bins();
                let mut notes = Notes { groups, bins, cells, read: [Historygram::EMPTY; MOST_LANES] };
                let found = view.march(simd, &stretches, &mut notes);
                for lane in 0..packet.len() {
                    let Stretch { radiance, transmittance, depth, gathers } = found[lane];
                    let Rgb { r, g, b } = radiance;
                    segments.light[numbers[lane]] = [r, g, b, transmittance];
                    segments.depth[numbers[lane]] = depth;
                    segments.histories.set(numbers[lane], notes.read[lane]);
                    segments.computed[1] += gathers;
                }
                segments.computed[0] += packet.len();
                if stop.reached() {
                    return;
                }
            }
            lacking.retain(|&ray| segments.missing(ray).is_some());
        }
        for (ray, of_ray) in rays.iter().enumerate() {
            tile.add(&segments.composite(view.scene, ray, of_ray));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathers_are_due_evenly_over_neighbouring_pixels() {
        for (x, y, segment) in [(0, 0, 0), (0, 0, 1), (500, 301, 6), (4000, 3, 19)] {
            let pixels = (0..64).map(|i| [x + i % 8, y + i / 8]);
            let mut due: Vec<f32> = pixels.map(|pixel| due_in(pixel, segment)).collect();
            due.sort_by(f32::total_cmp);
            for (i, due) in due.iter().enumerate() {
                assert!((due - (i as f32 + 0.5) / 64.0).abs() < 0.06, "{i}: {due}");
            }
        }
    }

    #[test]
    fn every_step_is_in_the_segment_that_has_it() {
        for (per_ray, count) in [(1, 7), (7, 3), (7, 700), (20, 333), (5, 0)] {
            let mut next = 0;
            for segment in 0..per_ray {
                let [from, to] = steps_of(segment, per_ray, count);
                assert_eq!(from, next);
                for step in from..to {
                    assert_eq!(segment_of(step, per_ray, count), segment, "{step} of {count}");
                }
                next = to;
            }
            assert_eq!(next, count);
        }
    }
}
