//! A picture as a noisy estimate.

/// A picture as an estimate: the mean of the samples of each pixel, and how uncertain this mean is.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Linear RGB, row by row from the top.
    pub mean: Vec<[f32; 3]>,
    /// Variance of the mean (not of one sample), per pixel and channel; `None` for a picture without noise.
    pub variance: Option<Vec<[f32; 3]>>,
}

impl Picture {
    /// From its parts.
    ///
    /// # Panics
    /// If a list does not have one entry per pixel, or there are no pixels.
    #[must_use]
    pub fn new(width: usize, height: usize, mean: Vec<[f32; 3]>, variance: Option<Vec<[f32; 3]>>) -> Self {
        let picture = Self { width, height, mean, variance };
        picture.check();
        picture
    }

    /// Mean and variance of the mean of a block of pixels, clipped at the picture's edge.
    pub(crate) fn block(&self, x: usize, y: usize, size: usize, channel: usize) -> (f64, f64) {
        let (mut mean, mut variance, mut pixels) = (0.0, 0.0, 0.0);
        for row in y..(y + size).min(self.height) {
            for column in x..(x + size).min(self.width) {
                let i = row * self.width + column;
                mean += f64::from(self.mean[i][channel]);
                variance += self.variance.as_ref().map_or(0.0, |variance| f64::from(variance[i][channel]));
                pixels += 1.0;
            }
        }
        (mean / pixels, variance / (pixels * pixels))
    }

    pub(crate) fn check(&self) {
        let pixels = self.width * self.height;
        assert!(pixels > 0, "a picture of {} x {} pixels", self.width, self.height);
        assert_eq!(self.mean.len(), pixels, "entries of the mean of {} x {} pixels", self.width, self.height);
        if let Some(variance) = &self.variance {
            assert_eq!(
                variance.len(),
                pixels,
                "entries of the variance of {} x {} pixels",
                self.width,
                self.height
            );
        }
    }
}
