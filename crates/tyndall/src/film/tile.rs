//! A tile: the unit of work, with the estimates of its pixels.

use super::PixelSample;
use super::estimate::{CHUNK, Estimate, FAN_OUT, Sums, merged_mean, samples_below};
use std::ops::Range;
use std::sync::Arc;

/// Edge of a tile in pixels.
pub const TILE: u32 = 16;

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
    /// Samples in every pixel.
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
    /// The incomplete chunk of each pixel.
    open: Vec<Sums>,
    /// For each level of the tree and each pixel, the merged children of the node that is incomplete. Their number follows from
    /// the number of samples; where it is zero, the entry is out of date.
    nodes: Vec<Vec<Estimate>>,
}

/// Bytes per pixel once it has this many samples: 72, and 36 for each level of the tree that they reach.
pub(super) fn bytes_of_pixel(samples: u32) -> usize {
    let levels = (0..16).take_while(|&level| samples >= samples_below(level)).count();
    size_of::<Sums>() + levels * size_of::<Estimate>()
}

impl Tile {
    /// A tile without samples.
    pub(super) fn new(origin: [u32; 2], order: Arc<Order>) -> Self {
        let open = vec![Sums::default(); order.positions.len()];
        Self { origin, order, samples: 0, ahead: 0, open, nodes: Vec::new() }
    }

    /// Samples that every pixel of the tile has.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Pixels in it.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.order.positions.len()
    }

    /// Samples that its pixels have taken, all together.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.samples as usize * self.pixel_count() + self.ahead
    }

    /// Number of samples that its pixels have taken in total once it has reached a goal.
    fn taken_at(&self, Goal { samples, more }: Goal) -> usize {
        let more = more.map_or(0, |stride| self.order.within[stride as usize]);
        samples as usize * self.pixel_count() + more
    }

    /// Number of pixels that have a sample.
    pub(super) fn covered(&self) -> usize {
        if self.samples > 0 { self.pixel_count() } else { self.ahead }
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
        self.positions(turn.start..turn.end.min(turn.start + most))
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

    /// Adds the sample of the pixel whose turn it is.
    pub fn add(&mut self, sample: &PixelSample) {
        let i = self.ahead;
        self.open[i].add(sample);
        let samples = self.samples + 1;
        if samples.is_multiple_of(CHUNK) {
            self.close_chunk(i, samples / CHUNK - 1);
        }
        self.ahead += 1;
        if self.ahead == self.pixel_count() {
            self.samples = samples;
            self.ahead = 0;
        }
    }

    /// Merges a pixel's complete chunk into the tree, and each node that this completes.
    fn close_chunk(&mut self, pixel: usize, chunk: u32) {
        let mut node = std::mem::take(&mut self.open[pixel]).estimate(CHUNK);
        let mut number = chunk;
        for level in 0.. {
            if level == self.nodes.len() {
                self.nodes.push(vec![Estimate::default(); self.order.positions.len()]);
            }
            let met = &mut self.nodes[level][pixel];
            let (child, size) = (number % FAN_OUT, samples_below(level));
            if child > 0 {
                node = met.merged(child * size, &node, size);
            }
            if child + 1 < FAN_OUT {
                *met = node;
                return;
            }
            number /= FAN_OUT;
        }
    }

    /// Samples of the `i`-th pixel.
    fn samples_of(&self, i: usize) -> u32 {
        self.samples + u32::from(i < self.ahead)
    }

    /// The estimate from all samples of the `i`-th pixel, merged from the largest node to the incomplete chunk.
    fn estimate(&self, i: usize) -> Estimate {
        let samples = self.samples_of(i);
        let (mut whole, mut n) = (Estimate::default(), 0);
        let mut add = |part: Estimate, m: u32| {
            whole = if n > 0 { whole.merged(n, &part, m) } else { part };
            n += m;
        };
        for (level, nodes) in self.nodes.iter().enumerate().rev() {
            let met = samples / samples_below(level) % FAN_OUT;
            if met > 0 {
                add(nodes[i], met * samples_below(level));
            }
        }
        let open = samples % CHUNK;
        if open > 0 {
            add(self.open[i].estimate(open), open);
        }
        whole
    }

    /// The radiance of each pixel, row by row; where a pixel has no sample, that of the first pixel of its block. At least the
    /// tile's first pixel must have a sample.
    pub(super) fn look(&self, radiance: &mut [[f32; 3]]) {
        let means = [self.samples, self.samples + 1].map(|samples| Means::new(samples, self.nodes.len()));
        let width = self.order.size[0];
        for (i, radiance) in (0..).zip(radiance) {
            let [x, y] = [i % width, i / width];
            let number = |stride: u32| {
                let mask = !(stride - 1);
                usize::from(self.order.numbers[((y & mask) * width + (x & mask)) as usize])
            };
            let has_sample = |pixel: usize| self.samples > 0 || pixel < self.ahead;
            let pixel = [1, 2, 4, 8].into_iter().map(number).find(|&pixel| has_sample(pixel)).unwrap_or(0);
            *radiance = means[usize::from(pixel < self.ahead)].radiance(self, pixel);
        }
    }

    /// Each pixel's position in the film, number of samples and estimate.
    pub(super) fn pixels(&self) -> impl Iterator<Item = PixelEstimate> {
        self.order.positions.iter().enumerate().map(|(i, &position)| PixelEstimate {
            position: self.in_film(position),
            samples: f64::from(self.samples_of(i)),
            estimate: self.estimate(i),
        })
    }
}

/// How to merge the mean radiance of pixels with a given number of samples: gives the same bits as [`Tile::estimate`].
struct Means {
    /// Levels to merge, each with its share of the samples merged so far.
    nodes: Vec<(usize, f64)>,
    /// Samples of the incomplete chunk, and their share.
    open: (u32, f64),
}

impl Means {
    fn new(samples: u32, levels: usize) -> Self {
        let mut n = 0;
        let mut share = |m: u32| {
            n += m;
            f64::from(m) / f64::from(n)
        };
        let met = |level: usize| samples / samples_below(level) % FAN_OUT * samples_below(level);
        let nodes = (0..levels).rev().filter(|&level| met(level) > 0).map(|level| (level, share(met(level))));
        let nodes = nodes.collect();
        let open = samples % CHUNK;
        Self { nodes, open: (open, if open > 0 { share(open) } else { 0.0 }) }
    }

    #[inline]
    fn radiance(&self, tile: &Tile, pixel: usize) -> [f32; 3] {
        let mut mean = [0.0; 3];
        let mut add = |part: [f32; 3], share: f64| {
            // The first part is exact.
            mean = if share == 1.0 {
                part
            } else {
                std::array::from_fn(|c| merged_mean(mean[c], part[c], share))
            };
        };
        for &(level, share) in &self.nodes {
            add(tile.nodes[level][pixel].mean, share);
        }
        let (open, share) = self.open;
        if open > 0 {
            add(tile.open[pixel].mean(open), share);
        }
        mean
    }
}

/// The state of a pixel.
pub(super) struct PixelEstimate {
    pub position: [u32; 2],
    pub samples: f64,
    pub estimate: Estimate,
}
