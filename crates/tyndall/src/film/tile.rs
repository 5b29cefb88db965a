//! A tile: the unit of work, with all that its pixels' samples add up to.

use super::PixelSample;
use super::estimate::{CHUNK, Estimate, FAN_OUT, Sums, samples_below};
use std::sync::Arc;

/// Edge of a tile in pixels.
pub const TILE: u32 = 16;

/// Edge of the blocks in which a tile's pixels are ordered.
const BLOCK: u32 = 4;

/// A square of pixels that take their samples in turn.
#[derive(Clone, Debug)]
pub struct Tile {
    origin: [u32; 2],
    order: Arc<[[u32; 2]]>,
    samples: u32,
    /// Pixels that have one sample more.
    ahead: usize,
    /// The chunk that each pixel is at.
    open: Vec<Sums>,
    /// For each level of the tree and each pixel, the nodes of this level that have not yet met in one of the next. How many they
    /// are follows from the number of samples, so that what is left of older ones does no harm.
    nodes: Vec<Vec<Estimate>>,
}

/// The position of each pixel in a tile, in the order in which they take their samples: block by block of 4 x 4, so that pixels
/// that follow each other are near.
pub(super) fn order([width, height]: [u32; 2]) -> Arc<[[u32; 2]]> {
    let mut positions: Vec<_> = (0..width * height).map(|i| [i % width, i / width]).collect();
    positions.sort_by_key(|&[x, y]| (y / BLOCK, x / BLOCK, y, x));
    positions.into()
}

/// Bytes that a pixel takes once it has so many samples: 72, and 36 for each level of the tree that they reach.
pub(super) fn bytes_of_pixel(samples: u32) -> usize {
    let levels = (0..16).take_while(|&level| samples >= samples_below(level)).count();
    size_of::<Sums>() + levels * size_of::<Estimate>()
}

impl Tile {
    /// A tile without samples.
    pub(super) fn new(origin: [u32; 2], order: Arc<[[u32; 2]]>) -> Self {
        let open = vec![Sums::default(); order.len()];
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
        self.order.len()
    }

    /// Samples that its pixels have taken, all together.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.samples as usize * self.order.len() + self.ahead
    }

    /// The pixels that are next to take a sample, all with the same number, which comes second; at most `most`.
    pub fn next(&self, most: usize) -> (impl ExactSizeIterator<Item = [u32; 2]>, u32) {
        let last = self.order.len().min(self.ahead + most);
        (self.order[self.ahead..last].iter().map(|&position| self.in_film(position)), self.samples)
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
        if self.ahead == self.order.len() {
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
                self.nodes.push(vec![Estimate::default(); self.order.len()]);
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
        self.order.iter().enumerate().map(|(i, &position)| PixelEstimate {
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
