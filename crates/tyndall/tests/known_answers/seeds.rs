//! Pictures of several seeds, compared as a whole and by blocks: where pixels share photons, the uncertainty of a
//! picture can be estimated only from pictures of other seeds, not from its own variance.

use std::sync::{Arc, LazyLock};
use tyndall::film::Image;
use tyndall::scene::{MethodChoice, Scene};
use tyndall::session::{Budget, Session};
use tyndall_testing::Mean;

/// Number of pictures per estimate.
const SEEDS: u64 = 8;
/// Edge length in pixels of the picture, and of the blocks that are compared.
pub const PIXELS: usize = 32;
pub const BLOCK: usize = 8;

/// A picture's mean and the means of its blocks, each averaged over seeds; the channels are interleaved.
pub struct Estimate {
    pub whole: Vec<Mean>,
    pub blocks: Vec<Mean>,
}

/// Means of blocks of `edge` x `edge` pixels; the channels are interleaved.
fn block_means(image: &Image, edge: usize) -> Vec<f64> {
    let row = PIXELS / edge;
    let mut means = vec![0.0; 3 * row * row];
    for (i, pixel) in image.rgba.iter().enumerate() {
        let block = i / PIXELS / edge * row + i % PIXELS / edge;
        for channel in 0..3 {
            means[3 * block + channel] += f64::from(pixel[channel]) / (edge * edge) as f64;
        }
    }
    means
}

/// Renders a scene by a method, with `samples` per pixel, for all seeds.
pub fn estimate(scene: &Scene, method: &MethodChoice, samples: u32) -> Estimate {
    static POOL: LazyLock<Arc<rayon::ThreadPool>> =
        LazyLock::new(|| Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap()));
    let mut estimate = Estimate {
        whole: vec![Mean::default(); 3],
        blocks: vec![Mean::default(); 3 * (PIXELS / BLOCK).pow(2)],
    };
    for seed in 1..=SEEDS {
        let mut scene = scene.clone();
        (scene.render.method, scene.render.seed) = (method.clone(), seed);
        let mut session = Session::new(scene, POOL.clone());
        session.refine(&Budget::samples(samples));
        let image = session.image();
        for (means, edge) in [(&mut estimate.whole, PIXELS), (&mut estimate.blocks, BLOCK)] {
            means.iter_mut().zip(block_means(&image, edge)).for_each(|(mean, x)| mean.push(x));
        }
    }
    estimate
}

impl Estimate {
    /// Exact values, given for every block by its column and row.
    pub fn exactly(blocks: impl Fn([usize; 2]) -> [f64; 3]) -> Self {
        let row = PIXELS / BLOCK;
        let values: Vec<f64> = (0..row * row).flat_map(|i| blocks([i % row, i / row])).collect();
        let certain = |x: f64| Mean::from_iter([x, x]);
        let whole = |channel: usize| {
            certain(values.iter().skip(channel).step_by(3).sum::<f64>() / (row * row) as f64)
        };
        Self { whole: [0, 1, 2].map(whole).to_vec(), blocks: values.into_iter().map(certain).collect() }
    }

    /// RMS error of a channel's blocks beyond noise, relative to the channel's mean.
    pub fn blocks_off(&self, expected: &Self, channel: usize) -> f64 {
        let pairs = || self.blocks.iter().zip(&expected.blocks).skip(channel).step_by(3);
        let square = |(a, b): (&Mean, &Mean)| {
            (a.mean() - b.mean()).powi(2) - a.variance_of_mean() - b.variance_of_mean()
        };
        let mean = pairs().map(square).sum::<f64>() / pairs().count() as f64;
        mean.max(0.0).sqrt() / expected.whole[channel].mean()
    }

    /// Asserts low noise and relative errors of at most `bias` (whole picture) and twice `bias` (RMS of blocks).
    #[track_caller]
    pub fn assert_near(&self, expected: &Self, bias: f64, name: &str) {
        self.assert_within(expected, [bias, 2.0 * bias], name);
    }

    /// Asserts low noise and relative errors of at most `bias` (whole picture) and `of_blocks` (RMS of blocks).
    #[track_caller]
    pub fn assert_within(&self, expected: &Self, [bias, of_blocks]: [f64; 2], name: &str) {
        for channel in 0..3 {
            let (a, b) = (&self.whole[channel], &expected.whole[channel]);
            if b.mean() == 0.0 {
                assert_eq!(a.mean(), 0.0, "{name}, channel {channel} is black");
                continue;
            }
            let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt() / b.mean();
            let (off, blocks_off) = (a.mean() / b.mean() - 1.0, self.blocks_off(expected, channel));
            assert!(error < 0.5 * bias, "{name}, channel {channel}: noise {error}");
            assert!(off.abs() < bias + 3.0 * error, "{name}, channel {channel}: off by {off} +- {error}");
            assert!(blocks_off < of_blocks, "{name}, channel {channel}: blocks off by {blocks_off}");
        }
    }
}
