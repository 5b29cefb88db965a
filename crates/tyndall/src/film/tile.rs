//! A tile: the unit of work, with all that its pixels' samples add up to.

use super::PixelSample;
use super::estimate::{CHUNK, Estimate, FAN_OUT, Sums, samples_below};
use std::ops::Range;
use std::sync::Arc;

/// Edge of a tile in pixels.
pub const TILE: u32 = 16;

/// Edge of the blocks in which a tile's pixels are ordered.
const BLOCK: u32 = 4;

/// Pixels that are spread evenly over the film: those whose coordinates are multiples of 8, 4 or 2.
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

    /// Distance between its pixels along rows and columns.
    #[must_use]
    pub fn pixels(self) -> u32 {
        8 >> self as u32
    }
}

/// How far a film is to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Goal {
    /// Samples in every pixel.
    pub samples: u32,
    /// One sample more in the pixels of a stride.
    pub more: Option<Stride>,
}

impl Goal {
    /// So many samples in every pixel.
    #[must_use]
    pub fn samples(samples: u32) -> Self {
        Self { samples, more: None }
    }

    /// Whether it includes all of another goal, and more.
    #[must_use]
    pub(crate) fn is_beyond(self, other: Self) -> bool {
        let rank = |goal: Self| (goal.samples, goal.more.map_or(0, |stride| 1 + stride as u32));
        rank(self) > rank(other)
    }
}

/// The order in which the pixels of a tile take their samples: from the coarsest stride to the finest, so that an unfinished pass
/// shows the whole picture; block by block of 4 x 4 within each, so that pixels that follow each other are near.
#[derive(Debug)]
pub(super) struct Order {
    /// Positions in the tile.
    positions: Vec<[u32; 2]>,
    /// The number of pixels of each stride, those of coarser ones included.
    within: [usize; 3],
}

impl Order {
    /// Of a tile of a size, whose origin in the film is a multiple of [`TILE`].
    pub fn new([width, height]: [u32; 2]) -> Self {
        let mut positions: Vec<_> = (0..width * height).map(|i| [i % width, i / width]).collect();
        let is_in = |[x, y]: [u32; 2], stride: Stride| (x | y).is_multiple_of(stride.pixels());
        let finer = |at: [u32; 2]| Stride::ALL.iter().take_while(|&&stride| !is_in(at, stride)).count();
        positions.sort_by_key(|&[x, y]| (finer([x, y]), y / BLOCK, x / BLOCK, y, x));
        let within = Stride::ALL.map(|stride| positions.iter().filter(|&&at| is_in(at, stride)).count());
        Self { positions, within }
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
    /// The chunk that each pixel is at.
    open: Vec<Sums>,
    /// For each level of the tree and each pixel, the nodes of this level that have not yet met in one of the next. How many they
    /// are follows from the number of samples, so that what is left of older ones does no harm.
    nodes: Vec<Vec<Estimate>>,
}

/// Bytes that a pixel takes once it has so many samples: 72, and 36 for each level of the tree that they reach.
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

    /// Samples that its pixels have taken, all together, once it has come as far as a goal.
    fn taken_at(&self, Goal { samples, more }: Goal) -> usize {
        let more = more.map_or(0, |stride| self.order.within[stride as usize]);
        samples as usize * self.pixel_count() + more
    }

    /// Whether it has come as far as a goal.
    #[must_use]
    pub fn has_reached(&self, goal: Goal) -> bool {
        self.taken() >= self.taken_at(goal)
    }

    /// The pixels that are next to take a sample on the way to a goal, by their number in the order of the tile; all take the
    /// same sample.
    #[must_use]
    pub fn turn(&self, goal: Goal) -> Range<usize> {
        let due = self.taken_at(goal).saturating_sub(self.taken());
        self.ahead..(self.ahead + due).min(self.pixel_count())
    }

    /// The first of these, at most `most`, by their position in the film.
    pub fn next(&self, goal: Goal, most: usize) -> impl ExactSizeIterator<Item = [u32; 2]> {
        let turn = self.turn(goal);
        self.positions(turn.start..turn.end.min(turn.start + most))
    }

    /// The positions in the film of pixels, by their numbers in the order of the tile.
    pub fn positions(&self, pixels: Range<usize>) -> impl ExactSizeIterator<Item = [u32; 2]> {
        self.order.positions[pixels].iter().map(|&position| self.in_film(position))
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

    /// Moves a pixel's complete chunk into the tree, and each node that this completes.
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

    /// What the samples of the `i`-th pixel add up to, from the largest node to the open chunk.
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

    /// Each pixel's position in the film, number of samples and estimate.
    pub(super) fn pixels(&self) -> impl Iterator<Item = PixelEstimate> {
        self.order.positions.iter().enumerate().map(|(i, &position)| PixelEstimate {
            position: self.in_film(position),
            samples: f64::from(self.samples_of(i)),
            estimate: self.estimate(i),
        })
    }
}

/// What is known of a pixel.
pub(super) struct PixelEstimate {
    pub position: [u32; 2],
    pub samples: f64,
    pub estimate: Estimate,
}
