//! Whether two noisy pictures show the same scene.

use crate::failure::{Error, write};
use crate::picture::Picture;
use crate::significance::{sidak, two_sided_threshold};
use crate::{ROUNDING, ZTest};
use std::fmt;
use std::io;
use std::path::Path;

/// Fraction of the reference's mean by which [`Comparison::relative_mse`] regularizes its denominator.
const DARKEST: f64 = 0.1;

impl Picture {
    /// Compares pixel by pixel with a reference: most sensitive to local errors.
    ///
    /// The variances must come from enough samples (a hundred, more where a few bright ones dominate the mean), or
    /// pixels will deviate by more than a normal distribution allows.
    ///
    /// # Panics
    /// If the sizes differ, or a list does not have one entry per pixel.
    pub fn compare<'a>(&'a self, reference: &'a Self) -> Comparison<'a> {
        self.compare_blocks(reference, 1)
    }

    /// Compares means of `block` x `block` pixels: more sensitive to errors as wide as a block, and closer to the
    /// normal distribution where pixels have few samples. Noise must be independent from pixel to pixel.
    ///
    /// # Panics
    /// As [`Self::compare`], and if `block` is zero.
    pub fn compare_blocks<'a>(&'a self, reference: &'a Self, block: usize) -> Comparison<'a> {
        self.check();
        reference.check();
        assert_eq!(
            (self.width, self.height),
            (reference.width, reference.height),
            "sizes of the two pictures"
        );
        assert!(block > 0, "a block has at least one pixel");
        let (columns, rows) = (self.width.div_ceil(block), self.height.div_ceil(block));
        let z_at = |i: usize| {
            let (x, y) = (i % columns * block, i / columns * block);
            [0, 1, 2].map(|channel| {
                let (image, reference) =
                    (self.block(x, y, block, channel), reference.block(x, y, block, channel));
                z(image, reference)
            })
        };
        let z = (0..columns * rows).map(z_at).collect();
        let threshold = two_sided_threshold(sidak(3 * columns * rows));
        Comparison { image: self, reference, block, columns, z, threshold }
    }
}

/// Signed difference of two estimates in standard errors of that difference; infinite if either is not finite.
fn z(image: (f64, f64), reference: (f64, f64)) -> f64 {
    // Both means were rounded; use the brighter one's rounding for both.
    let rounding = ROUNDING * image.0.abs().max(reference.0.abs());
    let variance = image.1 + reference.1 + rounding * rounding;
    let z = ZTest::new(image.0 - reference.0, variance, 0.0).z();
    if z.is_nan() { f64::INFINITY } else { z }
}

/// A picture compared with its reference: which pixels differ by more than noise explains.
#[derive(Clone, Debug)]
#[must_use = "a verdict says nothing until `assert` or `passes` is called"]
pub struct Comparison<'a> {
    /// The picture under test.
    pub image: &'a Picture,
    /// What it should show.
    pub reference: &'a Picture,
    /// Edge length in pixels of the blocks that were compared.
    pub block: usize,
    /// Blocks in a row.
    pub columns: usize,
    /// Image minus reference in standard errors, per block and channel, row by row from the top.
    pub z: Vec<[f64; 3]>,
    /// The largest allowed `abs(z)`, chosen so that all blocks and channels together have [`crate::SIGNIFICANCE`].
    pub threshold: f64,
}

/// Where a picture differs most from its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Column of the block's left pixel.
    pub x: usize,
    /// Row of the block's top pixel.
    pub y: usize,
    /// 0, 1, 2 for red, green, blue.
    pub channel: usize,
    /// Image minus reference in standard errors.
    pub z: f64,
    /// The image's mean over the block.
    pub image: f64,
    /// The reference's mean over the block.
    pub reference: f64,
}

impl Comparison<'_> {
    /// Whether no block differs from its reference by more than chance explains.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.worst().z.abs() <= self.threshold
    }

    /// The block and channel that differ most.
    #[must_use]
    pub fn worst(&self) -> Worst {
        let places = (0..self.z.len()).flat_map(|i| [(i, 0), (i, 1), (i, 2)]);
        let farther = |a: &(usize, usize), b: &(usize, usize)| {
            self.z[a.0][a.1].abs().total_cmp(&self.z[b.0][b.1].abs())
        };
        let (i, channel) = places.max_by(farther).unwrap_or((0, 0));
        let (x, y) = (i % self.columns * self.block, i / self.columns * self.block);
        let mean = |picture: &Picture| picture.block(x, y, self.block, channel).0;
        Worst {
            x,
            y,
            channel,
            z: self.z[i][channel],
            image: mean(self.image),
            reference: mean(self.reference),
        }
    }

    /// Fraction of blocks and channels that differ by more than `sigma` standard errors. Noise alone gives 0.0455
    /// beyond 2 and 0.0027 beyond 3, less where both pictures are black.
    #[must_use]
    pub fn blocks_past(&self, sigma: f64) -> f64 {
        let past = self.z.iter().flatten().filter(|z| z.abs() > sigma).count();
        past as f64 / (3 * self.z.len()) as f64
    }

    /// Mean of the image divided by the mean of the reference, over all channels.
    #[must_use]
    pub fn mean_ratio(&self) -> f64 {
        total(self.image) / total(self.reference)
    }

    /// Mean over pixels and channels of squared difference over squared reference \[Rousselle11\]; the square of a
    /// tenth of the reference's mean is added to the denominator. Includes the noise of both.
    #[must_use]
    pub fn relative_mse(&self) -> f64 {
        let channels = (3 * self.image.mean.len()) as f64;
        let darkest = DARKEST * total(self.reference) / channels;
        let pairs = self.image.mean.iter().flatten().zip(self.reference.mean.iter().flatten());
        let errors = pairs.map(|(&image, &reference)| {
            let (image, reference) = (f64::from(image), f64::from(reference));
            let square = (image - reference).powi(2);
            if square == 0.0 { 0.0 } else { square / (reference * reference + darkest * darkest) }
        });
        errors.sum::<f64>() / channels
    }

    /// Panics unless the comparison [`passes`](Self::passes), after writing the pictures to the folder
    /// `tyndall-failures/NAME` in the system's folder for temporary files.
    ///
    /// # Panics
    /// If the comparison fails.
    #[track_caller]
    pub fn assert(&self, name: &str) {
        self.assert_in(&std::env::temp_dir().join("tyndall-failures").join(name));
    }

    /// As [`Self::assert`], but writes to a given folder, such as `env!("CARGO_TARGET_TMPDIR")`.
    ///
    /// # Panics
    /// If the comparison fails.
    #[track_caller]
    pub fn assert_in(&self, folder: &Path) {
        if self.passes() {
            return;
        }
        match self.write(folder) {
            Ok(()) => panic!("{self}; see {}", folder.display()),
            Err(error) => panic!("{self}; no pictures in {}: {error}", folder.display()),
        }
    }

    /// Writes `image.png` and `reference.png`, both at the same exposure, and `error.png`: per block the z of largest
    /// magnitude, from blue (image too dark) through white to red (too bright), saturated at the threshold.
    ///
    /// # Errors
    /// If the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
        let worst = |z: &[f64; 3]| z.iter().copied().max_by(by_size).unwrap_or(0.0);
        let signed = self.z.iter().map(|z| worst(z) / self.threshold).collect();
        write(self.image, self.reference, &Error { block: self.block, columns: self.columns, signed }, folder)
    }
}

impl fmt::Display for Comparison<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Worst { x, y, channel, z, image, reference } = self.worst();
        let channel = ["red", "green", "blue"][channel];
        write!(f, "worst: {channel} of ")?;
        match self.block {
            1 => write!(f, "pixel ({x}, {y})")?,
            block => write!(f, "the {block} x {block} pixels from ({x}, {y})")?,
        }
        write!(f, " is {image:.6}, expected {reference:.6}, z = {z:.2}, allowed {:.2}; ", self.threshold)?;
        write!(f, "past 3 sigma {:.3} %, ", 100.0 * self.blocks_past(3.0))?;
        write!(f, "mean ratio {:.5}, relMSE {:.3e}", self.mean_ratio(), self.relative_mse())
    }
}

fn total(picture: &Picture) -> f64 {
    picture.mean.iter().flatten().map(|&x| f64::from(x)).sum()
}
