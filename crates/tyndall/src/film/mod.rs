//! The film: mean and variance of every pixel.
//!
//! The film is divided into tiles, each processed by one thread at a time, so that neighbouring pixels never share a
//! cache line across threads and a tile may be some samples ahead of another.

mod columns;
mod encode;
mod estimate;
mod exposure;
mod look;
mod noise;
mod state;
mod tile;
pub mod tone;
mod tree;

pub use encode::{Backdrop, Tone};
pub use look::Viewer;
pub use state::{FilmState, StateError, StateLayer, StateValues};
pub use tile::{Goal, Stride, TILE, Tile};

use crate::math::{LUMINANCE, Rgb, cast};
use estimate::CHUNK;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tile::{Order, PixelEstimate};
use tree::bytes_of_pixel;

/// The result of one sample of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance; premultiplied where the background is transparent.
    pub radiance: Rgb,
    /// 1 - transmittance to the background, or an unbiased estimate of it.
    pub alpha: f32,
    /// Distance of the visible matter along the view direction, times `alpha`.
    pub depth: f32,
}

fn luminance_of([r, g, b]: [f64; 3]) -> f64 {
    let [red, green, blue] = LUMINANCE.map(f64::from);
    red * r + green * g + blue * b
}

/// A picture being rendered.
#[derive(Clone, Debug)]
pub struct Film {
    /// Tells it from every other film of this process except its clones, so that a viewer notices a new one.
    generation: u64,
    size: [u32; 2],
    tiles: Vec<Tile>,
}

/// A finished or intermediate picture, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width and height.
    pub size: [u32; 2],
    /// Linear radiance and alpha, premultiplied.
    pub rgba: Vec<[f32; 4]>,
    /// Variance of each pixel's mean; infinite with one sample.
    pub variance: Vec<[f32; 3]>,
    /// Mean distance of the visible matter along the view direction, world units; infinite where there is none.
    pub depth: Vec<f32>,
}

/// Tells a film, or its state after all samples were dropped, from every other in this process.
fn new_generation() -> u64 {
    static FILMS: AtomicU64 = AtomicU64::new(1);
    FILMS.fetch_add(1, Ordering::Relaxed)
}

impl Image {
    /// Black, without depth.
    fn empty(size: [u32; 2]) -> Self {
        let pixels = size.map(|n| n as usize).iter().product();
        let (rgba, variance) = (vec![[0.0; 4]; pixels], vec![[f32::INFINITY; 3]; pixels]);
        Self { size, rgba, variance, depth: vec![f32::INFINITY; pixels] }
    }

    fn index_of(&self, [x, y]: [u32; 2]) -> usize {
        y as usize * self.size[0] as usize + x as usize
    }

    /// Updates the pixels of a tile.
    fn update(&mut self, tile: &Tile) {
        for PixelEstimate { position, samples: n, estimate: pixel } in tile.pixels() {
            let i = self.index_of(position);
            let [r, g, b] = pixel.mean;
            self.rgba[i] = [r, g, b, pixel.alpha];
            let of_mean =
                |s: f32| if n > 1.0 { cast::single(f64::from(s) / (n * (n - 1.0))) } else { f32::INFINITY };
            self.variance[i] = pixel.spread.map(of_mean);
            self.depth[i] = if pixel.alpha > 0.0 { pixel.depth / pixel.alpha } else { f32::INFINITY };
        }
    }
}

impl Film {
    /// Black, without samples. Width and height must be at least 1.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        Self::part(size, 0)
    }

    /// The samples of a chunk: a part of a picture begins with a multiple of them.
    pub const CHUNK: u32 = CHUNK;

    /// A part of a picture, whose first sample has the number `first`, a multiple of [`Self::CHUNK`].
    #[must_use]
    pub fn part(size: [u32; 2], first: u32) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let whole = Arc::new(Order::new([TILE; 2]));
        let tile = |i: u32| {
            let origin = [i % columns * TILE, i / columns * TILE];
            let size = [0, 1].map(|a| TILE.min(size[a] - origin[a]));
            let order = if size == [TILE; 2] { whole.clone() } else { Arc::new(Order::new(size)) };
            Tile::new(origin, order, first)
        };
        Self { generation: new_generation(), size, tiles: (0..columns * rows).map(tile).collect() }
    }

    /// Forgets all samples but keeps the memory; the film is then that of a whole picture, whatever part it was of.
    pub fn clear(&mut self) {
        self.generation = new_generation();
        self.tiles.iter_mut().for_each(Tile::clear);
    }

    /// Adds the samples of the next part of the picture. Both must be complete: every pixel has the same number of samples, and those
    /// of `part` begin where those here end.
    ///
    /// # Panics
    /// If they are not, or differ in size.
    pub fn append(&mut self, part: &Self) {
        assert!(self.is_even() && part.is_even(), "parts with the same number of samples in every pixel");
        assert_eq!((self.size, self.samples()), (part.size, part.first()), "parts that follow each other");
        assert!(self.samples().is_multiple_of(CHUNK), "a part that ends with a chunk");
        self.generation = new_generation();
        self.tiles.iter_mut().zip(&part.tiles).for_each(|(tile, part)| tile.append(part));
    }

    /// Number of the first sample: 0 unless it is a later part of a picture.
    #[must_use]
    pub fn first(&self) -> u32 {
        self.tiles.first().map_or(0, Tile::first)
    }

    /// Whether every pixel has the same number of samples.
    #[must_use]
    pub fn is_even(&self) -> bool {
        let goal = Goal::samples(self.samples());
        self.tiles.iter().all(|tile| tile.taken() == tile.taken_at(goal))
    }

    /// Number of tiles of a film of this size.
    #[must_use]
    pub fn tile_count(size: [u32; 2]) -> usize {
        size.map(|n| n.div_ceil(TILE) as usize).iter().product()
    }

    /// Bytes that a film of this size occupies with the samples from number `first` until every pixel has `samples`.
    #[must_use]
    pub fn bytes(size: [u32; 2], first: u32, samples: u32) -> u64 {
        u64::from(size[0]) * u64::from(size[1]) * bytes_of_pixel(first, samples) as u64
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The tiles, which can be processed independently.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.size.map(|n| n as usize).iter().product()
    }

    /// Minimum number of samples per pixel; those of earlier parts of the picture count.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.tiles.iter().map(Tile::samples).min().unwrap_or(0)
    }

    /// Maximum number of samples per pixel: a stop may leave some pixels ahead of others.
    #[must_use]
    pub fn most_samples(&self) -> u32 {
        self.tiles.iter().map(Tile::most_samples).max().unwrap_or(0)
    }

    /// Whether every tile has come as far as a goal.
    #[must_use]
    pub fn has_reached(&self, goal: Goal) -> bool {
        self.tiles.iter().all(|tile| tile.has_reached(goal))
    }

    /// The goal of giving a first sample to the pixels of the coarsest stride that still lacks some; `None` if even the finest lacks none.
    pub(crate) fn coarse_goal(&self) -> Option<Goal> {
        let goals = Stride::ALL.map(|stride| Goal { samples: self.first(), more: Some(stride) });
        goals.into_iter().find(|&goal| !self.has_reached(goal))
    }

    /// Number of tiles, from the first, that can reach a goal with at most `most` samples of all their pixels together. If not even one
    /// tile can: that one if `may_exceed`, otherwise `None`.
    pub(crate) fn tiles_within(&self, goal: Goal, most: u64, may_exceed: bool) -> Option<usize> {
        let mut all = 0;
        for (i, tile) in self.tiles.iter().enumerate() {
            let due = tile.taken_at(goal).saturating_sub(tile.taken()) as u64;
            if all + due > most && (all > 0 || !may_exceed) {
                return (all > 0).then_some(i);
            }
            all += due;
        }
        Some(self.tiles.len())
    }

    /// Fraction of the pixels that have a sample.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        let covered: usize = self.tiles.iter().map(Tile::covered).sum();
        covered as f64 / self.pixel_count() as f64
    }

    /// Samples that it has of all pixels together, without those of earlier parts.
    #[must_use]
    pub fn pixel_samples(&self) -> u64 {
        self.tiles.iter().map(|tile| tile.taken() as u64).sum()
    }

    /// Samples that it has per pixel, averaged over the picture; without those of earlier parts, unlike [`Self::samples`].
    #[must_use]
    pub fn mean_samples(&self) -> f64 {
        self.pixel_samples() as f64 / self.pixel_count() as f64
    }

    fn pixels(&self) -> impl Iterator<Item = PixelEstimate> {
        self.tiles.iter().flat_map(Tile::pixels)
    }

    /// The picture so far.
    #[must_use]
    pub fn image(&self) -> Image {
        let mut image = Image::empty(self.size);
        self.tiles.iter().for_each(|tile| image.update(tile));
        image
    }

    /// The mean luminance, as the tiles last measured it.
    pub(crate) fn measured_luminance(&self) -> f64 {
        self.tiles.iter().map(Tile::luminance).sum::<f64>() / self.pixel_count() as f64
    }

    /// The noise of the picture, as the tiles last measured it; close to [`Self::relative_error`] but does not visit the pixels.
    #[must_use]
    pub fn measured_error(&self) -> Option<f64> {
        let variances = self.tiles.iter().map(Tile::relative_variance);
        let sum = variances.sum::<Option<f64>>().filter(|_| self.measured_luminance() > 0.0)?;
        Some((sum / self.pixel_count() as f64).sqrt())
    }

    /// Mean radiance over the picture.
    #[must_use]
    pub fn mean_radiance(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in self.pixels() {
            for (sum, &x) in sum.iter_mut().zip(&pixel.estimate.mean) {
                *sum += f64::from(x);
            }
        }
        sum.map(|s| s / self.pixel_count() as f64)
    }

    /// Noise of the picture: `sqrt(mean of var / (mean^2 + 0.01 M^2))` in luminance over the pixels, where `M` is the
    /// picture's mean. `None` before every pixel has two samples, or if the picture is black.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        if self.samples() - self.first() < 2 {
            return None;
        }
        let whole = luminance_of(self.mean_radiance());
        let mut sum = 0.0;
        let mut count = 0.0;
        for PixelEstimate { samples: n, estimate: pixel, .. } in self.pixels() {
            let variance = f64::from(pixel.luminance_spread.max(0.0)) / (n * (n - 1.0));
            let mean = luminance_of(pixel.mean.map(f64::from));
            sum += variance / (mean * mean + 0.01 * whole * whole).max(f64::MIN_POSITIVE);
            count += 1.0;
        }
        (whole > 0.0).then(|| (sum / count).sqrt())
    }
}

#[cfg(test)]
mod tests;
