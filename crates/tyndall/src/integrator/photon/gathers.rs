//! What is kept of the gathers along view rays. An edit of colours alone is a sum over what they found before the albedo
//! at their positions was applied; after an edit that moves only photons, light is gathered again without marching.

use super::gather::GatherSite;
use crate::math::{Rgb, cast};
use crate::simd::MOST_LANES;
use crate::transfer::TransferFunction;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of the radiance of a view ray's segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gathered {
    pub light: Rgb,
    /// Data value at the position of the gather, whose albedo multiplies the light; NaN if nothing does.
    pub value: f32,
}

/// The radiance of a segment, the sum of its parts in order.
pub(super) fn radiance(parts: &[Gathered], transfer: &TransferFunction) -> Rgb {
    let mut sum = Rgb::BLACK;
    for Gathered { light, value } in parts {
        sum += if value.is_nan() { *light } else { *light * transfer.albedo(*value) };
    }
    sum
}

/// What the lanes of a packet gather along their segments.
#[derive(Debug, Default)]
pub(super) struct LaneGathers {
    parts: [Vec<Gathered>; MOST_LANES],
    sites: [Vec<GatherSite>; MOST_LANES],
    /// Lanes whose light is not the sum of its parts.
    glossy: [bool; MOST_LANES],
    /// Lanes with a part that has no site.
    unsited: [bool; MOST_LANES],
}

impl LaneGathers {
    pub fn clear(&mut self) {
        self.parts.iter_mut().for_each(Vec::clear);
        self.sites.iter_mut().for_each(Vec::clear);
        (self.glossy, self.unsited) = ([false; MOST_LANES], [false; MOST_LANES]);
    }

    /// Adds light that a lane gathered, and where.
    #[inline(always)]
    pub fn add(&mut self, lane: usize, part: Gathered, site: Option<GatherSite>) {
        self.parts[lane].push(part);
        match site {
            Some(site) => self.sites[lane].push(site),
            None => self.unsited[lane] = true,
        }
    }

    /// Adds light that a lane gathered at a glossy surface, of which the albedo is not a factor.
    #[inline(always)]
    pub fn add_glossy(&mut self, lane: usize) {
        self.glossy[lane] = true;
    }

    /// Adds emitted light, after all that was gathered.
    #[inline(always)]
    pub fn add_emitted(&mut self, lane: usize, light: Rgb) {
        if !light.is_black() {
            self.parts[lane].push(Gathered { light, value: f32::NAN });
        }
    }

    /// The parts of a lane's light; `None` if it is not the sum of these.
    pub fn parts(&self, lane: usize) -> Option<&[Gathered]> {
        (!self.glossy[lane]).then_some(&self.parts[lane])
    }

    /// Where a lane gathered its parts, in their order; `None` if that is not known of all.
    pub fn sites(&self, lane: usize) -> Option<&[GatherSite]> {
        (!self.glossy[lane] && !self.unsited[lane]).then_some(&self.sites[lane])
    }
}

/// Memory for what a picture's tiles keep of their gathers.
#[derive(Debug)]
pub(super) struct GatherMemory {
    pub parts: Room,
    pub sites: Room,
}

/// Bytes that tiles may still take.
#[derive(Debug)]
pub(super) struct Room(AtomicUsize);

/// Most bytes for the gathers of a pixel, on average.
const PIXEL_BYTES: usize = 1 << 10;

/// Most bytes for the gathers of a picture.
const PICTURE_BYTES: usize = 1 << 28;

impl GatherMemory {
    /// The bytes that a picture of this size may take.
    pub fn most([width, height]: [u32; 2]) -> usize {
        let pixels = width as usize * height as usize;
        PICTURE_BYTES.min(pixels.saturating_mul(PIXEL_BYTES))
    }

    /// For a picture of this size, with at most so many bytes.
    pub fn new(size: [u32; 2], bytes: usize) -> Self {
        let bytes = bytes.min(Self::most(size));
        // Somewhat more for the parts than by their sizes, since without its parts a site is of no use.
        let parts = bytes / 4;
        Self { parts: Room(AtomicUsize::new(parts)), sites: Room(AtomicUsize::new(bytes - parts)) }
    }
}

impl Room {
    /// Takes so many bytes, or none if there are fewer.
    fn take(&self, bytes: usize) -> bool {
        self.0.try_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes)).is_ok()
    }
}

/// Lists of the segments of a tile, as far as memory allows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SegmentLists<T> {
    /// The items of a segment are adjacent; in between may be some that no segment has any more.
    all: Vec<T>,
    /// Where the items of each segment begin and end.
    segments: Vec<[u32; 2]>,
    /// Number of items that segments have.
    used: usize,
    /// Number of items for which memory was taken.
    most: usize,
}

impl<T> Default for SegmentLists<T> {
    fn default() -> Self {
        Self { all: Vec::new(), segments: Vec::new(), used: 0, most: 0 }
    }
}

/// Of a segment whose list is not kept.
const NOT_KEPT: [u32; 2] = [u32::MAX; 2];

/// Bytes of a segment without its gathers: where its two lists are, and whether it is outdated.
pub(super) const BYTES: u64 = 2 * size_of_val(&NOT_KEPT) as u64 + 1;

impl<T: Copy> SegmentLists<T> {
    /// Forgets all lists, of this many segments.
    pub fn reset(&mut self, segments: usize) {
        self.all.clear();
        self.segments.clear();
        self.segments.resize(segments, NOT_KEPT);
        self.used = 0;
    }

    /// Replaces the list of a segment; it is not kept if there is none, or no room for it.
    pub fn set(&mut self, segment: usize, list: Option<&[T]>, room: &Room) {
        self.forget(segment);
        let Some(list) = list.filter(|list| self.make_room(list.len(), room)) else { return };
        let first = self.all.len();
        self.all.extend_from_slice(list);
        self.used += list.len();
        self.segments[segment] = [first, self.all.len()].map(cast::fit_u32);
    }

    /// Forgets the list of a segment.
    pub fn forget(&mut self, segment: usize) {
        let [first, end] = std::mem::replace(&mut self.segments[segment], NOT_KEPT);
        self.used -= (end - first) as usize;
    }

    /// The list of a segment; `None` if it is not kept.
    pub fn get(&self, segment: usize) -> Option<&[T]> {
        let [first, end] = self.segments[segment];
        self.all.get(first as usize..end as usize)
    }

    /// The same, to be changed.
    pub fn get_mut(&mut self, segment: usize) -> Option<&mut [T]> {
        let [first, end] = self.segments[segment];
        self.all.get_mut(first as usize..end as usize)
    }

    /// Number of items that segments have.
    pub fn len(&self) -> usize {
        self.used
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<T>() * self.most + size_of_val(&self.segments[..])
    }

    /// Makes room for more items; false if there is none.
    fn make_room(&mut self, more: usize, room: &Room) -> bool {
        if self.all.len() + more <= self.most {
            return true;
        }
        // With some to spare, so that items are not moved over and over for the last few.
        let wanted = self.used + more;
        if wanted + wanted / 4 > self.most {
            let most = wanted + wanted / 2;
            if !room.take((most - self.most) * size_of::<T>()) {
                return false;
            }
            self.most = most;
        }
        let mut all = Vec::with_capacity(self.most);
        for kept in self.segments.iter_mut().filter(|kept| **kept != NOT_KEPT) {
            let first = all.len();
            all.extend_from_slice(&self.all[kept[0] as usize..kept[1] as usize]);
            *kept = [first, all.len()].map(cast::fit_u32);
        }
        self.all = all;
        true
    }
}

/// What is kept of the gathers of a tile's segments.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SegmentGathers {
    pub parts: SegmentLists<Gathered>,
    pub sites: SegmentLists<GatherSite>,
    /// Segments whose light must be gathered again before they are seen.
    pub outdated: Vec<bool>,
}

impl SegmentGathers {
    /// Forgets all, of this many segments.
    pub fn reset(&mut self, segments: usize) {
        self.parts.reset(segments);
        self.sites.reset(segments);
        self.outdated.clear();
        self.outdated.resize(segments, false);
    }

    /// Forgets what a segment gathered.
    pub fn forget(&mut self, segment: usize) {
        self.parts.forget(segment);
        self.sites.forget(segment);
        self.outdated[segment] = false;
    }

    /// Keeps what a lane gathered along a segment, as far as there is memory.
    pub fn keep(&mut self, segment: usize, gathers: &LaneGathers, lane: usize, memory: &GatherMemory) {
        self.parts.set(segment, gathers.parts(lane), &memory.parts);
        self.sites.set(segment, gathers.sites(lane), &memory.sites);
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.parts.bytes() + self.sites.bytes() + size_of_val(&self.outdated[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_testing::SplitMix;

    /// Whatever is kept, replaced and forgotten, each segment has its own list or none, in bounded memory.
    #[test]
    fn segments_have_their_own_lists() {
        const SEGMENTS: usize = 40;
        let mut random = SplitMix::new(3);
        for bytes in [0, 100, 4000, 8000, 1 << 20] {
            let room = Room(AtomicUsize::new(bytes));
            let mut kept = SegmentLists::default();
            kept.reset(SEGMENTS);
            let (mut expected, mut refused) = ([const { None }; SEGMENTS], 0);
            for _ in 0..20_000 {
                let mut segment =
                    || cast::index(cast::single(random.uniform()) * SEGMENTS as f32).min(SEGMENTS - 1);
                let (i, k) = (segment(), segment());
                let list: Vec<u64> = (0..random.bits() % 60).map(|_| random.bits()).collect();
                if random.bits().is_multiple_of(4) {
                    kept.forget(i);
                    expected[i] = None;
                } else {
                    kept.set(i, Some(&list), &room);
                    expected[i] = kept.get(i).map(|_| list);
                    refused += usize::from(expected[i].is_none());
                }
                assert_eq!(kept.get(k), expected[k].as_deref());
                assert!(kept.bytes() <= bytes + 8 * SEGMENTS && 8 * kept.all.capacity() <= bytes);
            }
            assert_eq!(refused > 0, bytes < 1 << 20, "{bytes}: {refused}");
            (0..SEGMENTS).for_each(|i| kept.set(i, None, &room));
            assert_eq!(kept.len(), 0);
            kept.reset(3);
            assert_eq!(kept.get(2), None);
        }
    }
}
