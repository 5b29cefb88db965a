//! A tile: the unit of work, with the estimates of its pixels.

use super::PixelSample;
use super::encode::{BATCH, Planes};
use super::estimate::Estimate;
use super::noise::TileNoise;
use super::tree::{Piece, Place, Tree, pieces};
use crate::math::cast;
use std::ops::Range;
use std::sync::Arc;

/// Edge of a tile in pixels.
pub const TILE: u32 = 16;

const _: () = assert!((TILE * TILE) as usize == BATCH, "a tile is shown as one batch");

/// Maximum number of samples per pixel.
const MOST_SAMPLES: u32 = 1 << 31;

/// Edge of the blocks in which a tile's pixels are ordered.
const BLOCK: u32 = 4;

/// Pixels spread evenly over the film: those whose coordinates are multiples of 8, 4 or 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stride {
    /// One pixel of 64.
    Eight,
    /// One pixel of 16.
    Four,
    /// One pixel of 4.
    Two,
}

impl Stride {
    /// From the coarsest.
    pub const ALL: [Self; 3] = [Self::Eight, Self::Four, Self::Two];

    /// Distance between the pixels along rows and columns.
    #[must_use]
    pub fn pixels(self) -> u32 {
        8 >> self as u32
    }
}

/// How many samples a film is to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Goal {
    /// Samples in every pixel; those of earlier parts of the picture count.
    pub samples: u32,
    /// One sample more in the pixels of a stride.
    pub more: Option<Stride>,
}

impl Goal {
    /// This many samples in every pixel.
    #[must_use]
    pub fn samples(samples: u32) -> Self {
        Self { samples, more: None }
    }

    /// Whether it includes more samples than another goal.
    #[must_use]
    pub(crate) fn is_beyond(self, other: Self) -> bool {
        let rank = |goal: Self| (goal.samples, goal.more.map_or(0, |stride| 1 + stride as u32));
        rank(self) > rank(other)
    }
}

/// The order in which the pixels of a tile take their samples: from the coarsest stride to the finest, so that an unfinished pass
/// covers the whole picture, and in blocks of 4 x 4 within each stride, so that consecutive pixels are close together.
#[derive(Debug)]
pub(super) struct Order {
    /// Positions in the tile.
    positions: Vec<[u32; 2]>,
    size: [u32; 2],
    /// The index in this order of each pixel, row by row.
    numbers: Vec<u8>,
    /// For each stride, the number of its pixels.
    within: [usize; 3],
}

impl Order {
    /// For a tile of this size, whose origin in the film is a multiple of [`TILE`].
    pub fn new(size: [u32; 2]) -> Self {
        let [width, height] = size;
        let mut positions: Vec<_> = (0..width * height).map(|i| [i % width, i / width]).collect();
        let is_in = |[x, y]: [u32; 2], stride: Stride| (x | y).is_multiple_of(stride.pixels());
        let finer = |at: [u32; 2]| Stride::ALL.iter().take_while(|&&stride| !is_in(at, stride)).count();
        positions.sort_by_key(|&[x, y]| (finer([x, y]), y / BLOCK, x / BLOCK, y, x));
        let within = Stride::ALL.map(|stride| positions.iter().filter(|&&at| is_in(at, stride)).count());
        let mut numbers = vec![0; positions.len()];
        for (number, &[x, y]) in (0..=u8::MAX).zip(&positions) {
            numbers[(y * width + x) as usize] = number;
        }
        Self { positions, size, numbers, within }
    }
}

/// A square of pixels that take their samples in turn.
#[derive(Clone, Debug)]
pub struct Tile {
    origin: [u32; 2],
    order: Arc<Order>,
    samples: u32,
    /// Pixels that have one sample more.
    ahead: usize,
    /// The samples; its pixels are numbered row by row.
    tree: Tree,
    noise: TileNoise,
}

impl Tile {
    /// A tile without samples, of which the first will have the number `first`.
    pub(super) fn new(origin: [u32; 2], order: Arc<Order>, first: u32) -> Self {
        let tree = Tree::new(order.positions.len(), first);
        Self { origin, order, samples: first, ahead: 0, tree, noise: TileNoise::default() }
    }

    /// Forgets all samples, but keeps the memory.
    pub(super) fn clear(&mut self) {
        self.tree.clear();
        (self.samples, self.ahead, self.noise) = (0, 0, TileNoise::default());
    }

    /// Samples that every pixel of the tile has; those of earlier parts of the picture count.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Samples of the pixels that have most.
    pub(super) fn most_samples(&self) -> u32 {
        self.samples + u32::from(self.ahead > 0)
    }

    /// Number of the first sample that it has, or will have.
    pub(super) fn first(&self) -> u32 {
        self.tree.first()
    }

    /// Pixels in it.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.order.positions.len()
    }

    /// Samples that its pixels have taken, all together.
    #[must_use]
    pub fn taken(&self) -> usize {
        (self.samples - self.first()) as usize * self.pixel_count() + self.ahead
    }

    /// Number of samples that its pixels have taken in total once it has reached a goal.
    pub(super) fn taken_at(&self, Goal { samples, more }: Goal) -> usize {
        let more = more.map_or(0, |stride| self.order.within[stride as usize]);
        samples.saturating_sub(self.first()) as usize * self.pixel_count() + more
    }

    /// Number of pixels that have a sample.
    pub(super) fn covered(&self) -> usize {
        if self.samples > self.first() { self.pixel_count() } else { self.ahead }
    }

    /// Whether it has reached a goal.
    #[must_use]
    pub fn has_reached(&self, goal: Goal) -> bool {
        self.taken() >= self.taken_at(goal)
    }

    /// The pixels that are next to take a sample towards a goal, as indices in the tile's order; all take sample number
    /// [`Self::samples`].
    #[must_use]
    pub fn turn(&self, goal: Goal) -> Range<usize> {
        let due = self.taken_at(goal).saturating_sub(self.taken());
        self.ahead..(self.ahead + due).min(self.pixel_count())
    }

    /// Positions in the film of at most `most` of these.
    pub fn next(&self, goal: Goal, most: usize) -> impl ExactSizeIterator<Item = [u32; 2]> {
        let turn = self.turn(goal);
        self.positions(turn.start..turn.end.min(turn.start.saturating_add(most)))
    }

    /// Positions in the film of pixels, given by their indices in the tile's order.
    pub fn positions(&self, pixels: Range<usize>) -> impl ExactSizeIterator<Item = [u32; 2]> {
        self.order.positions[pixels].iter().map(|&position| self.in_film(position))
    }

    /// Position in the film of its first pixel.
    pub(super) fn origin(&self) -> [u32; 2] {
        self.origin
    }

    /// Width and height.
    pub(super) fn size(&self) -> [u32; 2] {
        self.order.size
    }

    fn in_film(&self, [x, y]: [u32; 2]) -> [u32; 2] {
        [self.origin[0] + x, self.origin[1] + y]
    }

    /// Position in the film of a pixel that is numbered row by row.
    pub(super) fn position(&self, pixel: usize) -> [u32; 2] {
        let (pixel, width) = (cast::fit_u32(pixel), self.order.size[0]);
        self.in_film([pixel % width, pixel / width])
    }

    /// The number, row by row, of a pixel in the tile.
    fn pixel_at(&self, [x, y]: [u32; 2]) -> usize {
        (y * self.order.size[0] + x) as usize
    }

    /// Adds the sample of the pixel whose turn it is.
    pub fn add(&mut self, sample: &PixelSample) {
        let pixel = self.pixel_at(self.order.positions[self.ahead]);
        self.tree.add(pixel, self.samples, sample);
        self.ahead += 1;
        if self.ahead == self.pixel_count() {
            self.samples += 1;
            self.ahead = 0;
        }
    }

    /// Number of the sample that a pixel takes next.
    pub(super) fn next_sample(&self, pixel: usize) -> u32 {
        self.samples + u32::from(usize::from(self.order.numbers[pixel]) < self.ahead)
    }

    /// Where the samples are of pixels whose turn was not yet, and of those whose turn was.
    fn pieces(&self) -> [Vec<Piece>; 2] {
        [self.samples, self.samples + 1].map(|end| pieces(self.first(), end))
    }

    /// Measures the tile's noise if it has enough new samples; `whole` is the picture's mean luminance.
    pub(crate) fn measure_noise(&mut self, whole: f64) {
        self.noise.measure(&self.tree, self.order.positions.len(), self.samples, whole);
    }

    /// The sum of its pixels' mean luminances, when they were last measured.
    pub(super) fn luminance(&self) -> f64 {
        self.noise.luminance()
    }

    /// The sum of its pixels' relative variances, by the last measurement; `None` before every pixel has two samples.
    pub(super) fn relative_variance(&self) -> Option<f64> {
        self.noise.relative_variance(self.taken() as f64 / self.pixel_count() as f64)
    }

    /// For each pixel, row by row, that pixel or, if it has no sample, the first pixel of the smallest square around it whose first pixel has one; `None` if all have a sample.
    /// At least the tile's first pixel must have one.
    pub(super) fn shown(&self) -> Option<Vec<usize>> {
        if self.covered() == self.pixel_count() {
            return None;
        }
        let width = self.order.size[0];
        let shown = (0..cast::fit_u32(self.pixel_count())).map(|i| {
            let [x, y] = [i % width, i / width];
            let first_of = |stride: u32| self.pixel_at([x & !(stride - 1), y & !(stride - 1)]);
            let has_sample = |pixel: &usize| usize::from(self.order.numbers[*pixel]) < self.ahead;
            [1, 2, 4, 8].into_iter().map(first_of).find(has_sample).unwrap_or(0)
        });
        Some(shown.collect())
    }

    /// The mean radiance of each pixel, row by row, from its own samples.
    #[inline(always)]
    pub(super) fn radiance(&self, planes: &mut Planes) {
        let [before, after] = self.pieces();
        self.tree.radiance(&before, planes);
        if self.ahead > 0 {
            let mut with_next = [[0.0; BATCH]; 3];
            self.tree.radiance(&after, &mut with_next);
            for (plane, with_next) in planes.iter_mut().zip(&with_next) {
                self.take_ahead(plane, with_next);
            }
        }
    }

    /// The mean alpha of each pixel, row by row, from its own samples.
    #[inline(always)]
    pub(super) fn alpha(&self, plane: &mut [f32; BATCH]) {
        let [before, after] = self.pieces();
        self.tree.alpha(&before, plane);
        if self.ahead > 0 {
            let mut with_next = [0.0; BATCH];
            self.tree.alpha(&after, &mut with_next);
            self.take_ahead(plane, &with_next);
        }
    }

    /// Takes the values of the pixels that have one sample more from `with_next`.
    #[inline(always)]
    fn take_ahead(&self, plane: &mut [f32; BATCH], with_next: &[f32; BATCH]) {
        for (pixel, &number) in self.order.numbers.iter().enumerate() {
            if usize::from(number) < self.ahead {
                plane[pixel] = with_next[pixel];
            }
        }
    }

    /// Each pixel's position in the film, number of samples and estimate, row by row.
    pub(super) fn pixels(&self) -> impl Iterator<Item = PixelEstimate> {
        let [before, after] = self.pieces();
        (0..self.pixel_count()).map(move |pixel| {
            let next = self.next_sample(pixel);
            PixelEstimate {
                position: self.position(pixel),
                samples: f64::from(next - self.first()),
                estimate: self.tree.estimate(pixel, if next > self.samples { &after } else { &before }),
            }
        })
    }

    /// Every place where samples of a pixel are stored.
    pub(super) fn stored(&self) -> Vec<StoredAt> {
        let [before, after] = self.pieces();
        let of_pixel = |pixel| {
            let pieces = if self.next_sample(pixel) > self.samples { &after } else { &before };
            pieces.iter().map(move |piece| StoredAt { pixel, place: piece.place })
        };
        (0..self.pixel_count()).flat_map(of_pixel).collect()
    }

    /// Continues after the samples that its pixels have: `next` is the number of the sample that a pixel of the film takes next.
    ///
    /// # Errors
    /// The first pixel, in the order in which they take their turns, that is not as far as its neighbours say.
    pub(super) fn go_on_after(&mut self, next: impl Fn([u32; 2]) -> u32) -> Result<(), UnevenSamples> {
        let numbers: Vec<u32> = self.positions(0..self.pixel_count()).map(next).collect();
        let samples = numbers.last().copied().unwrap_or(0);
        let ahead = numbers.iter().take_while(|&&number| number > samples).count();
        for (i, (&found, position)) in numbers.iter().zip(self.positions(0..numbers.len())).enumerate() {
            let expected = if i < ahead { samples.saturating_add(1) } else { samples };
            if found != expected || found < self.first() || found > MOST_SAMPLES {
                return Err(UnevenSamples { position, found, expected: expected.max(self.first()) });
            }
        }
        (self.samples, self.ahead) = (samples, ahead);
        Ok(())
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    pub(super) fn tree_mut(&mut self) -> &mut Tree {
        &mut self.tree
    }

    /// Adds the samples of the same tile of a later part, which is complete, as this one is.
    pub(super) fn append(&mut self, part: &Self) {
        self.tree.append(&part.tree, part.samples);
        self.samples = part.samples;
        self.noise = TileNoise::default();
    }
}

/// A pixel whose number of samples does not fit those of the others of its tile.
pub(super) struct UnevenSamples {
    pub position: [u32; 2],
    pub found: u32,
    pub expected: u32,
}

/// A place where samples of a pixel are stored.
pub(super) struct StoredAt {
    /// The pixel's number, row by row.
    pub pixel: usize,
    pub place: Place,
}

/// A pixel's estimate, with its position in the film and the number of samples behind it, without those of earlier parts.
pub(super) struct PixelEstimate {
    pub position: [u32; 2],
    pub samples: f64,
    pub estimate: Estimate,
}
