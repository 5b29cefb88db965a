//! The film: mean and variance of every pixel.
//!
//! The film is divided into tiles, each processed by one thread at a time, so that neighbouring pixels never share a
//! cache line across threads and a tile may be a sample ahead of another.

pub mod tone;

use crate::math::{Rgb, cast};
use std::sync::Arc;

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

/// Edge of a tile in pixels.
pub const TILE: u32 = 16;

/// Mean and sum of squared deviations of the samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pixel {
    mean: [f32; 3],
    /// Sum of squared deviations from the mean.
    scatter: [f32; 3],
    /// The same for the luminance; it cannot be derived from those of the channels.
    luminance_scatter: f32,
    alpha: f32,
    depth: f32,
}

impl Pixel {
    /// Welford's update with the `n`-th sample, in double precision.
    fn add(&mut self, sample: &PixelSample, n: f64) {
        let radiance = sample.radiance.to_array();
        let luminance = f64::from(sample.radiance.luminance());
        let before = luminance - luminance_of(self.mean.map(f64::from));
        for (x, (mean, scatter)) in radiance.into_iter().zip(self.mean.iter_mut().zip(&mut self.scatter)) {
            let x = f64::from(x);
            let (old, sum) = (f64::from(*mean), f64::from(*scatter));
            let moved = old + (x - old) / n;
            *mean = cast::single(moved);
            *scatter = cast::single(sum + (x - old) * (x - moved));
        }
        let after = luminance - luminance_of(self.mean.map(f64::from));
        self.luminance_scatter = cast::single(f64::from(self.luminance_scatter) + before * after);
        let blend = |old: f32, new: f32| cast::single(f64::from(old) + (f64::from(new) - f64::from(old)) / n);
        self.alpha = blend(self.alpha, sample.alpha);
        self.depth = blend(self.depth, sample.depth);
    }
}

fn luminance_of([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// A square of pixels that take their samples in turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    origin: [u32; 2],
    /// Position of each pixel in the tile, in blocks of 4 x 4, so that consecutive pixels are close together.
    order: Arc<[[u32; 2]]>,
    samples: u32,
    /// Number of pixels that have one sample more.
    ahead: usize,
    pixels: Vec<Pixel>,
}

/// Edge of the blocks in which a tile's pixels are ordered.
const BLOCK: u32 = 4;

impl Tile {
    /// Number of samples that every pixel of the tile has.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.pixels.len()
    }

    /// Number of samples that its pixels have taken in total.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.samples as usize * self.pixels.len() + self.ahead
    }

    /// At most `most` pixels that are next to take a sample, and the sample number, which is the same for all of them.
    pub fn next(&self, most: usize) -> (impl ExactSizeIterator<Item = [u32; 2]>, u32) {
        let last = self.order.len().min(self.ahead + most);
        let [x, y] = self.origin;
        (
            self.order[self.ahead..last].iter().map(move |position| [x + position[0], y + position[1]]),
            self.samples,
        )
    }

    /// Adds a sample to the next pixel in turn.
    pub fn add(&mut self, sample: &PixelSample) {
        self.pixels[self.ahead].add(sample, f64::from(self.samples) + 1.0);
        self.ahead += 1;
        if self.ahead == self.pixels.len() {
            self.samples += 1;
            self.ahead = 0;
        }
    }

    /// Number of samples of the `i`-th pixel.
    fn samples_of(&self, i: usize) -> f64 {
        f64::from(self.samples) + f64::from(i < self.ahead)
    }
}

/// The order of a tile's pixels.
fn order([width, height]: [u32; 2]) -> Arc<[[u32; 2]]> {
    let mut positions: Vec<_> = (0..width * height).map(|i| [i % width, i / width]).collect();
    positions.sort_by_key(|&[x, y]| (y / BLOCK, x / BLOCK, y, x));
    positions.into()
}

/// A picture being rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
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

impl Film {
    /// Black, without samples. Width and height must be at least 1.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let whole = order([TILE; 2]);
        let tile = |i: u32| {
            let origin = [i % columns * TILE, i / columns * TILE];
            let size = [0, 1].map(|a| TILE.min(size[a] - origin[a]));
            let order = if size == [TILE; 2] { whole.clone() } else { order(size) };
            let pixels = vec![Pixel::default(); order.len()];
            Tile { origin, order, samples: 0, ahead: 0, pixels }
        };
        Self { size, tiles: (0..columns * rows).map(tile).collect() }
    }

    /// Number of tiles of a film of this size.
    #[must_use]
    pub fn tile_count(size: [u32; 2]) -> usize {
        size.map(|n| n.div_ceil(TILE) as usize).iter().product()
    }

    /// Bytes that a film of this size occupies.
    #[must_use]
    pub fn bytes(size: [u32; 2]) -> u64 {
        u64::from(size[0]) * u64::from(size[1]) * size_of::<Pixel>() as u64
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

    /// Minimum number of samples per pixel.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.tiles.iter().map(|t| t.samples).min().unwrap_or(0)
    }

    /// Samples per pixel, averaged over the picture.
    #[must_use]
    pub fn mean_samples(&self) -> f64 {
        let taken: f64 = self.tiles.iter().map(|t| t.taken() as f64).sum();
        taken / (f64::from(self.size[0]) * f64::from(self.size[1]))
    }

    fn pixels(&self) -> impl Iterator<Item = ([u32; 2], f64, &Pixel)> {
        self.tiles.iter().flat_map(|tile| {
            let [x, y] = tile.origin;
            let positions = tile.order.iter().zip(&tile.pixels).enumerate();
            positions.map(move |(i, (position, pixel))| {
                ([x + position[0], y + position[1]], tile.samples_of(i), pixel)
            })
        })
    }

    /// The picture so far.
    #[must_use]
    pub fn image(&self) -> Image {
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let mut image = Image {
            size: self.size,
            rgba: vec![[0.0; 4]; pixels],
            variance: vec![[f32::INFINITY; 3]; pixels],
            depth: vec![f32::INFINITY; pixels],
        };
        for ([x, y], n, pixel) in self.pixels() {
            let i = y as usize * self.size[0] as usize + x as usize;
            let [r, g, b] = pixel.mean;
            image.rgba[i] = [r, g, b, pixel.alpha];
            if n > 1.0 {
                let of_mean = |s: f32| cast::single(f64::from(s) / (n * (n - 1.0)));
                image.variance[i] = pixel.scatter.map(of_mean);
            }
            if pixel.alpha > 0.0 {
                image.depth[i] = pixel.depth / pixel.alpha;
            }
        }
        image
    }

    /// Mean radiance over the picture.
    #[must_use]
    pub fn mean_radiance(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (_, _, pixel) in self.pixels() {
            for (sum, &x) in sum.iter_mut().zip(&pixel.mean) {
                *sum += f64::from(x);
            }
        }
        sum.map(|s| s / (f64::from(self.size[0]) * f64::from(self.size[1])))
    }

    /// Noise of the picture: `sqrt(mean of var / (mean^2 + 0.01 M^2))` in luminance over the pixels, where `M` is the
    /// picture's mean. `None` before every pixel has two samples, or if the picture is black.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        if self.samples() < 2 {
            return None;
        }
        let whole = luminance_of(self.mean_radiance());
        let mut sum = 0.0;
        let mut count = 0.0;
        for (_, n, pixel) in self.pixels() {
            let variance = f64::from(pixel.luminance_scatter.max(0.0)) / (n * (n - 1.0));
            let mean = luminance_of(pixel.mean.map(f64::from));
            sum += variance / (mean * mean + 0.01 * whole * whole).max(f64::MIN_POSITIVE);
            count += 1.0;
        }
        (whole > 0.0).then(|| (sum / count).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sample for every pixel of a tile.
    fn add_pass(tile: &mut Tile, sample: impl Fn([u32; 2], u32) -> PixelSample) {
        let before = tile.samples();
        while tile.samples() == before {
            let (mut pixels, n) = tile.next(1);
            let pixel = pixels.next().unwrap();
            drop(pixels);
            tile.add(&sample(pixel, n));
        }
    }

    #[test]
    fn mean_variance_and_depth_are_those_of_the_samples() {
        let mut film = Film::new([37, 19]);
        let samples = [0.5_f32, 1.5, 4.0];
        for tile in film.tiles_mut() {
            for _ in 0..3 {
                add_pass(tile, |[x, y], n| {
                    let hit = n > 0;
                    PixelSample {
                        radiance: Rgb::new(samples[n as usize], x as f32, y as f32),
                        alpha: f32::from(hit),
                        depth: if hit { 7.0 + n as f32 } else { 0.0 },
                    }
                });
            }
        }
        let image = film.image();
        let i = 17 * 37 + 33;
        assert_eq!(image.rgba[i], [2.0, 33.0, 17.0, 2.0 / 3.0]);
        // Deviations -1.5, -0.5, 2: squares 6.5, over n (n - 1) = 6.
        assert!((image.variance[i][0] - 6.5 / 6.0).abs() < 1e-6 && image.variance[i][1] == 0.0);
        assert!((image.depth[i] - 8.5).abs() < 1e-6);
        assert_eq!(film.samples(), 3);
        assert!((film.mean_radiance()[1] - 18.0).abs() < 1e-6);
    }

    #[test]
    fn tiles_may_have_different_numbers_of_samples() {
        let mut film = Film::new([32, 16]);
        let grey = |_: [u32; 2], _: u32| PixelSample { radiance: Rgb::WHITE, ..PixelSample::default() };
        add_pass(&mut film.tiles_mut()[1], grey);
        assert_eq!((film.samples(), film.mean_samples()), (0, 0.5));
        assert_eq!(film.relative_error(), None);
        for _ in 0..2 {
            film.tiles_mut().iter_mut().for_each(|t| add_pass(t, grey));
        }
        assert_eq!(film.relative_error(), Some(0.0));
    }

    #[test]
    fn the_error_is_that_of_the_mean() {
        // Alternating samples 0 and 2: variance 1, mean 1, n = 400.
        let mut film = Film::new([16, 16]);
        for _ in 0..400 {
            add_pass(&mut film.tiles_mut()[0], |_, n| PixelSample {
                radiance: Rgb::splat((n % 2) as f32 * 2.0),
                ..PixelSample::default()
            });
        }
        let expected = (1.0 / 399.0 / 1.01_f64).sqrt();
        assert!((film.relative_error().unwrap() / expected - 1.0).abs() < 1e-3);
    }
}
