//! Samples that survive edits \[Jonsson12, sec. 7\]: each is kept with its histories, and an edit retakes only those
//! that it touched.

use crate::film::{PixelSample, Tile};
use crate::integrator::history::{PackedHistories, Past, Reading, Touched};
use crate::integrator::{Edited, ItemChanges, Limits};
use crate::math::Rgb;
use crate::scene::{Background, Difference, Scene};
use crate::transfer::Grouping;
use bytemuck::{Pod, Zeroable};

/// Groups of values in a history.
const GROUPS: u8 = 64;

/// Bytes of a sample with its histories.
const BYTES: usize = size_of::<KeptSample>() + 2 * GROUPS as usize / 8;

/// Decides which samples of a session are kept, and which an edit invalidates.
#[derive(Debug)]
pub(super) struct SampleKeeper {
    pub reading: Reading,
    /// Maximum number of samples kept per pixel.
    most: usize,
}

impl SampleKeeper {
    /// For a scene whose kept samples may occupy `bytes`; `None` if that is too little for one sample per pixel.
    pub fn new(scene: &Scene, bytes: usize) -> Option<Self> {
        let most = Self::most(scene, bytes);
        let reading = || Reading::new(&scene.medium, GROUPS, Grouping::Quantile);
        (most > 0).then(|| Self { reading: reading(), most })
    }

    fn most(scene: &Scene, bytes: usize) -> usize {
        let [width, height] = scene.size.map(|n| n as usize);
        bytes / BYTES / width / height
    }

    /// Whether to keep the next sample of a tile: if it is within the limit and no earlier one is missing.
    pub fn wants(&self, kept: &SampleTile, tile: &Tile) -> bool {
        let next = tile.taken();
        next < self.most * tile.pixel_count() && next <= kept.samples.len()
    }

    /// Whether any samples may survive an edit.
    pub fn survives(difference: &Difference) -> bool {
        let Difference { volume, majorants, clip, seed, camera, size, .. } = *difference;
        !(volume || majorants || clip || seed || camera || size)
    }

    /// The query for the kept samples after an edit that they may survive; `None` if stopped first, see [`Reading::update`].
    pub fn update(&mut self, edit: &Edited, limits: &Limits) -> Option<SampleQuery> {
        let Edited { old, new, difference } = *edit;
        let media = [&*old.medium, &*new.medium];
        let moved = self.reading.update(media, &difference.transfer.opacity, limits)?;
        let touched = Touched::new(&self.reading.groups, old, new, difference);
        let mut past = touched.paths;
        past.flight |= moved.sunk | moved.raised;
        let lights = !difference.lights.is_empty();
        if lights || touched.glow {
            // Every scattering samples one light, chosen among all by power.
            past.scatter = touched.matter;
        }
        let shows_sky = |scene: &Scene| scene.background == Background::Environment && scene.lights.has_sky();
        let sky = lights && (shows_sky(old) || shows_sky(new));
        Some(SampleQuery { past, behind: difference.background || sky })
    }
}

/// The query that an edit sends to samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleQuery {
    past: Past,
    /// Whether the background that rays see when they meet no matter has changed.
    behind: bool,
}

impl SampleQuery {
    /// Asks for what either asks for.
    fn with(mut self, other: Self) -> Self {
        self.past.add(&other.past);
        Self { past: self.past, behind: self.behind || other.behind }
    }
}

/// The result of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct KeptSample {
    radiance: [f32; 3],
    /// NaN if no matter was met.
    depth: f32,
}

/// The kept samples of a tile's pixels, in the order in which they are taken.
#[derive(Clone, Debug)]
pub struct SampleTile {
    samples: Vec<KeptSample>,
    flight: PackedHistories,
    scatter: PackedHistories,
    /// Queries that samples have yet to answer, by increasing `end`; a sample answers the first one that includes it.
    pending: Vec<PendingQuery>,
    /// Number of samples that were looked up since the last query.
    looked_up: usize,
    pub(super) counts: SampleCounts,
}

/// A query to samples that have not been looked up since.
#[derive(Clone, Copy, Debug)]
struct PendingQuery {
    /// One more than the index of the last sample that it includes.
    end: usize,
    query: SampleQuery,
}

/// Maximum number of pending queries; with more, two are merged, and a few samples are retaken in vain.
const MOST_PENDING: usize = 16;

/// Counts of a tile's samples since the last edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct SampleCounts {
    /// Samples that were taken and kept.
    pub taken: usize,
    /// Samples that were reused from those kept.
    pub found: usize,
}

impl Default for SampleTile {
    fn default() -> Self {
        let histories = PackedHistories::new(GROUPS);
        Self {
            samples: Vec::new(),
            flight: histories.clone(),
            scatter: histories,
            pending: Vec::new(),
            looked_up: 0,
            counts: SampleCounts::default(),
        }
    }
}

impl SampleTile {
    /// Number of samples kept.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.samples[..]) + self.flight.bytes() + self.scatter.bytes()
    }

    /// The `i`-th sample; `None` if it must be taken.
    #[inline]
    pub fn get(&mut self, i: usize) -> Option<PixelSample> {
        let KeptSample { radiance, depth } = *self.samples.get(i)?;
        let met = !depth.is_nan();
        if let Some(PendingQuery { query, .. }) = self.pending.iter().find(|pending| i < pending.end) {
            let past = Past { flight: self.flight.get(i), scatter: self.scatter.get(i) };
            if past.meets(&query.past) || (query.behind && !met) {
                return None;
            }
        }
        self.counts.found += 1;
        self.looked_up = i + 1;
        Some(PixelSample {
            radiance: Rgb::from(radiance),
            alpha: f32::from(u8::from(met)),
            depth: if met { depth } else { 0.0 },
        })
    }

    /// Keeps the `i`-th sample of a tile of `pixels` pixels, replacing the old one or after all others.
    #[inline]
    pub(super) fn put(&mut self, i: usize, sample: &PixelSample, past: &Past, pixels: usize) {
        let depth = if sample.alpha > 0.0 { sample.depth } else { f32::NAN };
        let sample = KeptSample { radiance: sample.radiance.to_array(), depth };
        if i == self.samples.len() {
            if self.samples.len() == self.samples.capacity() {
                self.reserve(pixels.max(self.samples.len() / 4));
            }
            self.samples.push(sample);
            self.flight.push(past.flight);
            self.scatter.push(past.scatter);
        } else {
            self.samples[i] = sample;
            self.flight.set(i, past.flight);
            self.scatter.set(i, past.scatter);
        }
        self.counts.taken += 1;
        self.looked_up = i + 1;
    }

    fn reserve(&mut self, more: usize) {
        self.samples.reserve_exact(more);
        self.flight.reserve(more);
        self.scatter.reserve(more);
    }

    /// Invalidates the samples that an edit touched. They answer the query when they are looked up, so that an edit costs no time for
    /// samples that the next one may touch too.
    pub(super) fn ask(&mut self, query: SampleQuery) {
        let looked_up = PendingQuery { end: self.looked_up, query };
        let others = self.pending.iter().filter(|pending| pending.end > self.looked_up);
        let others = others.map(|pending| PendingQuery { query: pending.query.with(query), ..*pending });
        let mut pending: Vec<_> = std::iter::once(looked_up).chain(others).collect();
        if pending.last().is_some_and(|last| last.end < self.len()) {
            pending.push(PendingQuery { end: self.len(), query });
        }
        pending.retain(|pending| pending.end > 0);
        if pending.len() > MOST_PENDING {
            let last = pending.remove(MOST_PENDING);
            let before = &mut pending[MOST_PENDING - 1];
            *before = PendingQuery { end: last.end, query: before.query.with(last.query) };
        }
        (self.pending, self.looked_up) = (pending, 0);
    }

    /// Differences to the samples at another time.
    pub fn compare(&self, other: &Self) -> ItemChanges {
        let pairs = self.samples.iter().zip(&other.samples);
        let differing = pairs.filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count();
        ItemChanges { differing, new: self.len().saturating_sub(other.len()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cast;
    use crate::sampling::Stream;
    use crate::transfer::Historygram;

    /// Queries that wait until a sample is looked up invalidate what queries at once would, however far the samples were looked up
    /// between them; merging many may only invalidate more.
    #[test]
    fn pending_queries_invalidate_what_immediate_ones_would() {
        const SAMPLES: usize = 40;
        let mut stream = Stream::new(3, [0; 3]);
        let (mut found, mut retaken) = (0, 0);
        // Fewer edits than queries may wait are never merged.
        for edits in [MOST_PENDING; 30].into_iter().chain([60; 3]) {
            let mut tile = SampleTile::default();
            // What each sample depends on, and whether an edit has touched it since it was taken.
            let mut model: Vec<(Past, bool)> = Vec::new();
            for _ in 0..edits {
                let reach = cast::index(stream.uniform() * (SAMPLES + 1) as f32);
                for i in 0..reach {
                    let group = |stream: &mut Stream| Historygram::from_bits(1 << (stream.bits() % 20));
                    if let Some(sample) = tile.get(i) {
                        assert!(!model[i].1, "sample {i} is out of date");
                        assert_eq!(sample.radiance.r, i as f32);
                        found += 1;
                    } else {
                        assert!(
                            edits > MOST_PENDING || i >= model.len() || model[i].1,
                            "sample {i} is up to date"
                        );
                        let past = Past { flight: group(&mut stream), scatter: group(&mut stream) };
                        let radiance = Rgb::splat(i as f32);
                        tile.put(i, &PixelSample { radiance, ..PixelSample::default() }, &past, SAMPLES);
                        if i < model.len() {
                            model[i] = (past, false);
                        } else {
                            model.push((past, false));
                        }
                        retaken += 1;
                    }
                }
                let bits = |stream: &mut Stream| {
                    Historygram::from_bits(u128::from(stream.bits() & stream.bits() & 0xfffff))
                };
                let past = Past { flight: bits(&mut stream), scatter: Historygram::EMPTY };
                for (sample, touched) in &mut model {
                    *touched |= sample.meets(&past);
                }
                tile.ask(SampleQuery { past, behind: false });
            }
        }
        assert!(found > 100 && retaken > 100, "{found} found, {retaken} retaken");
    }
}
