//! What gathers found before the albedo at their positions was applied: an edit of colours alone is a sum over these.

use crate::math::{Rgb, cast};
use crate::simd::MOST_LANES;
use crate::transfer::TransferFunction;

/// Part of the radiance of a view ray's segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gathered {
    light: [f32; 3],
    /// Data value at the position of the gather, whose albedo multiplies the light; NaN if nothing does.
    value: f32,
}

/// Most bytes of gathers that are kept for each pixel, on average over a tile.
const PIXEL_BYTES: usize = 1 << 10;

/// Most bytes of gathers that are kept for a picture.
const PICTURE_BYTES: usize = 1 << 28;

/// Most bytes of gathers that are kept for a picture of this many pixels.
pub(super) fn most_bytes(pixels: usize) -> usize {
    PICTURE_BYTES.min(pixels.saturating_mul(PIXEL_BYTES))
}

impl Gathered {
    /// Light scattered at a position with this data value, if its albedo were 1.
    pub fn scattered(light: Rgb, value: f32) -> Self {
        Self { light: light.to_array(), value }
    }

    /// Emitted light.
    pub fn emitted(light: Rgb) -> Self {
        Self { light: light.to_array(), value: f32::NAN }
    }

    /// The light that is seen through a transfer function.
    fn seen(&self, transfer: &TransferFunction) -> Rgb {
        let light = Rgb::from(self.light);
        if self.value.is_nan() { light } else { light * transfer.albedo(self.value) }
    }
}

/// What each lane of a packet gathers along its segment.
#[derive(Debug, Default)]
pub(super) struct LaneGathers {
    lanes: [Vec<Gathered>; MOST_LANES],
    /// Lanes whose light is not a sum of these.
    glossy: [bool; MOST_LANES],
}

impl LaneGathers {
    pub fn clear(&mut self) {
        self.lanes.iter_mut().for_each(Vec::clear);
        self.glossy = [false; MOST_LANES];
    }

    /// Adds what a lane gathered; `None` if the albedo is more than a factor of it.
    #[inline(always)]
    pub fn add(&mut self, lane: usize, gathered: Option<Gathered>) {
        match gathered {
            // Black adds nothing, whatever the albedo.
            Some(gathered) if gathered.light == [0.0; 3] => {}
            Some(gathered) => self.lanes[lane].push(gathered),
            None => self.glossy[lane] = true,
        }
    }

    /// All that a lane gathered, in order; `None` if its light is not the sum of that.
    pub fn of(&self, lane: usize) -> Option<&[Gathered]> {
        (!self.glossy[lane]).then_some(&self.lanes[lane])
    }
}

/// The gathers of a tile's segments, as far as memory allows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct KeptGathers {
    /// Those of a segment are adjacent; in between may be some that no segment has any more.
    all: Vec<Gathered>,
    /// Where those of each segment begin and end.
    segments: Vec<[u32; 2]>,
    /// Number of gathers that segments have.
    used: usize,
    /// Maximum number of gathers.
    most: usize,
}

/// Of a segment whose gathers are not kept.
const NOT_KEPT: [u32; 2] = [u32::MAX; 2];

/// Bytes of a segment without its gathers.
pub(super) const BYTES: u64 = size_of_val(&NOT_KEPT) as u64;

impl KeptGathers {
    /// Forgets all, and makes room for the gathers of this many segments in as many bytes; keeps none if that is 0.
    pub fn reset(&mut self, segments: usize, bytes: usize) {
        let most = (bytes / size_of::<Gathered>()).min(u32::MAX as usize);
        let segments = if most > 0 { vec![NOT_KEPT; segments] } else { Vec::new() };
        *self = Self { all: Vec::new(), segments, used: 0, most };
    }

    /// Replaces the gathers of a segment; they are not kept if there are none to keep, or too many.
    pub fn set(&mut self, segment: usize, gathers: Option<&[Gathered]>) {
        self.forget(segment);
        let Some(gathers) = gathers.filter(|gathers| self.make_room(gathers.len())) else { return };
        let first = self.all.len();
        self.all.extend_from_slice(gathers);
        self.used += gathers.len();
        self.segments[segment] = [first, self.all.len()].map(cast::fit_u32);
    }

    /// Forgets the gathers of a segment.
    pub fn forget(&mut self, segment: usize) {
        if let Some(kept) = self.segments.get_mut(segment) {
            let [first, end] = std::mem::replace(kept, NOT_KEPT);
            self.used -= (end - first) as usize;
        }
    }

    /// Radiance of a segment through a transfer function; `None` if its gathers are not kept.
    pub fn radiance(&self, segment: usize, transfer: &TransferFunction) -> Option<Rgb> {
        let [first, end] = *self.segments.get(segment).filter(|&kept| *kept != NOT_KEPT)?;
        let gathers = &self.all[first as usize..end as usize];
        Some(gathers.iter().fold(Rgb::BLACK, |sum, gathered| sum + gathered.seen(transfer)))
    }

    /// Number of gathers that segments have.
    pub fn len(&self) -> usize {
        self.used
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Gathered>() * self.all.capacity() + size_of_val(&self.segments[..])
    }

    /// Makes room for more gathers; false if that would be too many.
    fn make_room(&mut self, more: usize) -> bool {
        if self.all.len() + more <= self.all.capacity() {
            return self.most > 0;
        }
        // With a quarter to spare, so that gathers are not moved over and over for the last few.
        let wanted = self.used + more;
        if wanted + wanted / 4 > self.most {
            return false;
        }
        let mut all = Vec::with_capacity((wanted + wanted / 2).min(self.most));
        for kept in self.segments.iter_mut().filter(|kept| **kept != NOT_KEPT) {
            let first = all.len();
            all.extend_from_slice(&self.all[kept[0] as usize..kept[1] as usize]);
            *kept = [first, all.len()].map(cast::fit_u32);
        }
        self.all = all;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::{Optics, Point};
    use tyndall_testing::SplitMix;

    /// Whatever is kept, replaced and forgotten, each segment has its own gathers or none, in bounded memory.
    #[test]
    fn segments_keep_their_own_gathers() {
        const SEGMENTS: usize = 40;
        let white = Optics { albedo: Rgb::WHITE, ..Optics::default() };
        let white = TransferFunction::new(vec![Point { value: 0.0, optics: white }]).expect("a function");
        let mut random = SplitMix::new(3);
        for bytes in [0, 100, 4000, 16_000, 1 << 20] {
            let mut kept = KeptGathers::default();
            kept.reset(SEGMENTS, bytes);
            let (mut expected, mut refused) = ([const { None }; SEGMENTS], 0);
            for _ in 0..20_000 {
                let mut segment =
                    || cast::index(cast::single(random.uniform()) * SEGMENTS as f32).min(SEGMENTS - 1);
                let (i, k) = (segment(), segment());
                let count = random.bits() % 60;
                let gathers: Vec<_> = (0..count)
                    .map(|_| Gathered::scattered(Rgb::splat(cast::single(random.uniform())), 0.5))
                    .collect();
                if random.bits().is_multiple_of(4) {
                    kept.forget(i);
                    expected[i] = None;
                } else {
                    kept.set(i, Some(&gathers));
                    expected[i] =
                        Some(gathers.iter().fold(Rgb::BLACK, |sum, gather| sum + gather.seen(&white)));
                    if kept.radiance(i, &white).is_none() {
                        expected[i] = None;
                        refused += 1;
                    }
                }
                assert_eq!(kept.radiance(k, &white), expected[k]);
                assert!(kept.bytes() <= bytes + 8 * SEGMENTS, "{}", kept.bytes());
            }
            assert_eq!(refused > 0, bytes < 1 << 20, "{bytes}: {refused}");
            (0..SEGMENTS).for_each(|i| kept.set(i, None));
            assert_eq!(kept.len(), 0);
        }
    }
}
