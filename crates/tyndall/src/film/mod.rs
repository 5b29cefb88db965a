//! The film: mean and variance of every pixel.
//!
//! The film is divided into tiles, each processed by one thread at a time, so that neighbouring pixels never share a
//! cache line across threads and a tile may be a sample ahead of another.

mod estimate;
mod look;
mod tile;
pub mod tone;

pub use look::{Tone, Viewer};
pub use tile::{Goal, Stride, TILE, Tile};

use crate::math::{LUMINANCE, Rgb, cast};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tile::{Order, PixelEstimate, bytes_of_pixel};

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
    /// Tells it from every other film of this process, so that a viewer notices a new one.
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

impl Film {
    /// Black, without samples. Width and height must be at least 1.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let whole = Arc::new(Order::new([TILE; 2]));
        let tile = |i: u32| {
            let origin = [i % columns * TILE, i / columns * TILE];
            let size = [0, 1].map(|a| TILE.min(size[a] - origin[a]));
            let order = if size == [TILE; 2] { whole.clone() } else { Arc::new(Order::new(size)) };
            Tile::new(origin, order)
        };
        static FILMS: AtomicU64 = AtomicU64::new(1);
        let generation = FILMS.fetch_add(1, Ordering::Relaxed);
        Self { generation, size, tiles: (0..columns * rows).map(tile).collect() }
    }

    /// Number of tiles of a film of this size.
    #[must_use]
    pub fn tile_count(size: [u32; 2]) -> usize {
        size.map(|n| n.div_ceil(TILE) as usize).iter().product()
    }

    /// Bytes that a film of this size occupies once every pixel has this many samples.
    #[must_use]
    pub fn bytes(size: [u32; 2], samples: u32) -> u64 {
        u64::from(size[0]) * u64::from(size[1]) * bytes_of_pixel(samples) as u64
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
        self.tiles.iter().map(Tile::samples).min().unwrap_or(0)
    }

    /// Whether every tile has come as far as a goal.
    #[must_use]
    pub fn has_reached(&self, goal: Goal) -> bool {
        self.tiles.iter().all(|tile| tile.has_reached(goal))
    }

    /// The coarsest stride whose pixels do not all have a sample yet; `None` if even the finest do.
    pub(crate) fn coarse_goal(&self) -> Option<Goal> {
        let goals = Stride::ALL.map(|stride| Goal { samples: 0, more: Some(stride) });
        goals.into_iter().find(|&goal| !self.has_reached(goal))
    }

    /// Fraction of the pixels that have a sample.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        let covered: usize = self.tiles.iter().map(Tile::covered).sum();
        covered as f64 / (f64::from(self.size[0]) * f64::from(self.size[1]))
    }

    /// Samples per pixel, averaged over the picture.
    #[must_use]
    pub fn mean_samples(&self) -> f64 {
        let taken: f64 = self.tiles.iter().map(|t| t.taken() as f64).sum();
        taken / (f64::from(self.size[0]) * f64::from(self.size[1]))
    }

    fn pixels(&self) -> impl Iterator<Item = PixelEstimate> {
        self.tiles.iter().flat_map(Tile::pixels)
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
        for PixelEstimate { position: [x, y], samples: n, estimate: pixel } in self.pixels() {
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
        for pixel in self.pixels() {
            for (sum, &x) in sum.iter_mut().zip(&pixel.estimate.mean) {
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
        for PixelEstimate { samples: n, estimate: pixel, .. } in self.pixels() {
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
    use crate::simd::Level;

    /// A sample for every pixel of a tile.
    fn add_pass(tile: &mut Tile, sample: impl Fn([u32; 2], u32) -> PixelSample) {
        let before = tile.samples();
        while tile.samples() == before {
            let pixel = tile.next(Goal::samples(before + 1), 1).next().unwrap();
            tile.add(&sample(pixel, before));
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
    fn a_pass_goes_from_coarse_pixels_to_fine_ones() {
        for size in [[16, 16], [37, 19], [3, 5]] {
            let mut film = Film::new(size);
            let inside = |at: u32, edge: u32| at < edge;
            for more in Stride::ALL.map(Some).into_iter().chain([None]) {
                let goal = Goal { samples: u32::from(more.is_none()), more };
                let mut taken = 0;
                for tile in film.tiles_mut() {
                    while !tile.has_reached(goal) {
                        let [x, y] = tile.next(goal, 7).next().unwrap();
                        let step = more.map_or(1, Stride::pixels);
                        assert!(inside(x, size[0]) && inside(y, size[1]));
                        assert!(x % step == 0 && y % step == 0, "({x}, {y}) on the way to {goal:?}");
                        tile.add(&PixelSample { radiance: Rgb::WHITE, ..PixelSample::default() });
                    }
                    assert!(tile.turn(goal).is_empty() && tile.next(goal, 7).len() == 0);
                    taken += tile.taken();
                }
                let step = more.map_or(1, Stride::pixels);
                assert_eq!(taken, size.iter().map(|edge| edge.div_ceil(step) as usize).product::<usize>());
            }
        }
    }

    #[test]
    fn tiles_may_have_different_numbers_of_samples() {
        let mut film = Film::new([32, 16]);
        let grey = |_: [u32; 2], _: u32| PixelSample { radiance: Rgb::WHITE, ..PixelSample::default() };
        add_pass(&mut film.tiles_mut()[1], grey);
        assert_eq!((film.samples(), film.mean_samples(), film.coverage()), (0, 0.5, 0.5));
        assert_eq!(film.relative_error(), None);
        for _ in 0..2 {
            film.tiles_mut().iter_mut().for_each(|t| add_pass(t, grey));
        }
        assert_eq!(film.relative_error(), Some(0.0));
    }

    /// The picture of one pixel with these samples.
    fn of_samples(samples: impl IntoIterator<Item = f32>) -> Film {
        let mut film = Film::new([1, 1]);
        for x in samples {
            film.tiles_mut()[0].add(&PixelSample { radiance: Rgb::splat(x), alpha: 1.0, depth: 3.0 * x });
        }
        film
    }

    /// A single precision mean that is updated sample by sample stops moving after 10^7 of them.
    #[test]
    fn no_sample_is_lost_after_ten_million() {
        let (n, x) = (10_000_000, 0.1_f32);
        let image = of_samples(std::iter::repeat_n(x, n)).image();
        assert!((image.rgba[0][0] / x - 1.0).abs() < 1e-6, "{:?}", image.rgba);
        assert!(image.variance[0][0] <= 1e-14, "{:?}", image.variance);
        // The second half twice as bright.
        let image = of_samples((0..n).map(|i| if i < n / 2 { x } else { 2.0 * x })).image();
        assert!((image.rgba[0][0] / (1.5 * x) - 1.0).abs() < 1e-6, "{:?}", image.rgba);
        let variance = 0.25 * x * x / n as f32;
        assert!((image.variance[0][0] / variance - 1.0).abs() < 1e-5, "{:?}", image.variance);
    }

    /// Whatever the number of samples: between chunks, in one, and where nodes meet.
    #[test]
    fn chunks_and_nodes_give_the_statistics_of_all_samples() {
        for n in [1, 2, 15, 16, 17, 63, 64, 65, 255, 256, 257, 1023, 1024, 1500] {
            let samples =
                || (0..n).map(|i: u32| ((i + 1).wrapping_mul(2_654_435_769) >> 8) as f32 / (1 << 24) as f32);
            let image = of_samples(samples()).image();
            let n = f64::from(n);
            let mean = samples().map(f64::from).sum::<f64>() / n;
            let scatter = samples().map(|x| (f64::from(x) - mean).powi(2)).sum::<f64>();
            assert!((f64::from(image.rgba[0][1]) / mean - 1.0).abs() < 1e-6, "{n} samples");
            assert!((f64::from(image.depth[0]) / (3.0 * mean) - 1.0).abs() < 1e-6, "{n} samples");
            if n > 1.0 {
                let variance = scatter / (n * (n - 1.0));
                assert!((f64::from(image.variance[0][1]) / variance - 1.0).abs() < 1e-5, "{n} samples");
            }
        }
    }

    #[test]
    fn a_pixels_memory_grows_with_the_logarithm_of_its_samples() {
        let bytes = [1, 15, 16, 63, 64, 1 << 20].map(|samples| Film::bytes([1, 1], samples));
        assert_eq!(bytes, [72, 72, 108, 108, 144, 72 + 36 * 9]);
    }

    /// A film whose tiles are apart by some samples, and of which some are in the middle of one.
    fn uneven(size: [u32; 2], samples: u32) -> Film {
        let mut film = Film::new(size);
        let mut turn = 0_u32;
        for tile in film.tiles_mut() {
            turn += 1;
            let pixels = cast::fit_u32(tile.pixel_count());
            let more = if turn.is_multiple_of(3) { pixels / 2 } else { 0 };
            let all = (samples + turn % 3) * pixels + more;
            for i in 0..all {
                let x = (i.wrapping_mul(2_654_435_769).wrapping_add(turn) >> 8) as f32 / (1 << 22) as f32;
                tile.add(&PixelSample { radiance: Rgb::new(x, 2.0 - x, 0.3 * x), alpha: 1.0, depth: 1.0 });
            }
        }
        film
    }

    #[test]
    fn a_look_shows_what_a_file_would() {
        let tone = Tone { curve: tone::ToneCurve::Agx, stops: 0.3 };
        for samples in [1, 15, 16, 70, 300] {
            let film = uneven([37, 50], samples);
            let pixels: Vec<[f32; 3]> = film.image().rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            let mut expected = vec![[0; 3]; pixels.len()];
            tone.curve.encode(Level::best(), tone.stops, &pixels, &mut expected);
            let mut viewer = Viewer::default();
            viewer.look(&film, tone, Level::best());
            assert_eq!((viewer.size(), viewer.changed().len()), ([37, 50], 12));
            assert!(viewer.pixels() == expected.as_flattened(), "{samples} samples");
        }
    }

    #[test]
    fn a_look_renews_what_changed_and_a_missing_pixel_shows_its_blocks_first() {
        let (tone, level) = (Tone { curve: tone::ToneCurve::Linear, stops: 0.0 }, Level::best());
        let grey =
            |x: u8| PixelSample { radiance: Rgb::splat(f32::from(x) / 40.0), ..PixelSample::default() };
        let mut film = Film::new([32, 20]);
        let mut viewer = Viewer::default();
        viewer.look(&film, tone, level);
        assert!(viewer.changed().is_empty() && viewer.pixels().iter().all(|&code| code == 0));
        // One pixel of 64, each of its own grey.
        let coarse = Goal { samples: 0, more: Some(Stride::Eight) };
        let mut number = 0;
        for tile in film.tiles_mut() {
            while !tile.has_reached(coarse) {
                number += 1;
                tile.add(&grey(number));
            }
        }
        viewer.look(&film, tone, level);
        assert_eq!(viewer.changed(), [[0, 0], [16, 0], [0, 16], [16, 16]]);
        let at = |viewer: &Viewer, [x, y]: [usize; 2]| viewer.pixels()[3 * (y * 32 + x)];
        for [x, y] in [[7, 7], [8, 7], [31, 0], [17, 19], [15, 15]] {
            assert_eq!(at(&viewer, [x, y]), at(&viewer, [x / 8 * 8, y / 8 * 8]), "({x}, {y})");
        }
        assert!(at(&viewer, [0, 0]) < at(&viewer, [8, 0]) && at(&viewer, [8, 0]) < at(&viewer, [8, 8]));
        viewer.look(&film, tone, level);
        assert!(viewer.changed().is_empty());
        film.tiles_mut()[3].add(&grey(40));
        viewer.look(&film, tone, level);
        assert_eq!(viewer.changed(), [[16, 16]]);
        // A new film without samples keeps the old picture until it has some; another exposure renews all.
        let before = viewer.pixels().to_vec();
        viewer.look(&Film::new([32, 20]), tone, level);
        assert!(viewer.changed().is_empty() && viewer.pixels() == before);
        viewer.look(&film, Tone { stops: 1.0, ..tone }, level);
        assert_eq!(viewer.changed().len(), 4);
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
