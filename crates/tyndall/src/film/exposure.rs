//! The exposure that suits a picture, from its own luminance.

use super::{Backdrop, Image, luminance_of};
use crate::math::cast;

/// Edge of the blocks of pixels that are metered, so that noise of single pixels counts little.
const BLOCK: usize = 8;

/// A block is metered if matter covers at least this share of it.
const COVERED: f64 = 0.5;

/// This share of the metered blocks is darker than the one that is exposed for.
const PERCENTILE: f64 = 0.9;

/// Linear radiance that this block is shown with before black, and before white, where matter must be darker than the paper to be seen on it.
/// The tone curve comes after.
const BRIGHT: [f64; 2] = [0.6, 0.3];

/// Pictures are brightened or darkened by at most so many stops.
const MOST_STOPS: f64 = 40.0;

impl Image {
    /// Stops that bring the bright parts of the matter to a linear radiance of 0.6, or of 0.3 before white: the mean luminance of blocks of 8 x 8 pixels, of which a tenth
    /// is brighter. Blocks are metered where matter covers half of them, or anywhere if it does so nowhere; light is that of the matter
    /// without the `backdrop`. 0 for a black picture.
    #[must_use]
    pub fn exposure(&self, backdrop: Option<Backdrop>) -> f32 {
        let blocks = self.blocks(backdrop);
        let covered = |block: &&Block| block.alpha >= COVERED;
        let mut luminances: Vec<f64> = blocks.iter().filter(covered).map(|b| b.luminance / b.alpha).collect();
        if luminances.iter().all(|&luminance| luminance <= 0.0) {
            luminances = blocks.iter().map(|block| block.luminance).collect();
        }
        luminances.retain(|luminance| luminance.is_finite() && *luminance > 0.0);
        if luminances.is_empty() {
            return 0.0;
        }
        let index =
            (cast::index(cast::single(PERCENTILE * luminances.len() as f64))).min(luminances.len() - 1);
        let (_, &mut bright, _) = luminances.select_nth_unstable_by(index, f64::total_cmp);
        let paper = backdrop.map_or(0.0, |b| luminance_of(b.color.to_array().map(f64::from)).clamp(0.0, 1.0));
        let wanted = BRIGHT[0] + (BRIGHT[1] - BRIGHT[0]) * paper;
        let stops = (wanted / bright).log2().clamp(-MOST_STOPS, MOST_STOPS);
        // As a person would write it; a hundredth of a stop is not seen.
        cast::single((stops * 100.0).round() / 100.0)
    }

    /// Means over blocks of pixels.
    fn blocks(&self, backdrop: Option<Backdrop>) -> Vec<Block> {
        let [width, height] = self.size.map(|n| n as usize);
        let columns = width.div_ceil(BLOCK);
        let mut blocks = vec![Block::default(); columns * height.div_ceil(BLOCK)];
        let behind = backdrop.filter(|backdrop| backdrop.in_radiance).map(|b| b.color.to_array());
        let behind = behind.unwrap_or_default().map(f64::from);
        for (i, pixel) in self.rgba.iter().enumerate() {
            let [r, g, b, alpha] = pixel.map(f64::from);
            let light = luminance_of([r, g, b]) - (1.0 - alpha) * luminance_of(behind);
            let block = &mut blocks[i / width / BLOCK * columns + i % width / BLOCK];
            block.luminance += light;
            block.alpha += alpha;
            block.pixels += 1.0;
        }
        for block in &mut blocks {
            block.luminance /= block.pixels;
            block.alpha /= block.pixels;
        }
        blocks
    }
}

/// Means over the pixels of a block.
#[derive(Clone, Copy, Default)]
struct Block {
    luminance: f64,
    alpha: f64,
    pixels: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    /// A disk of matter in the left half, brighter in its upper quarter, on a backdrop.
    fn picture(size: [u32; 2], radiance: f32, back: f32) -> Image {
        let mut image = Image::empty(size);
        let [width, height] = size.map(|n| n as usize);
        for (i, pixel) in image.rgba.iter_mut().enumerate() {
            let matter = i % width < width / 2;
            let upper = i / width < height / 4;
            let light = if upper { radiance } else { 0.25 * radiance };
            *pixel = if matter { [light, light, light, 1.0] } else { [back, back, back, 0.0] };
        }
        image
    }

    #[test]
    fn bright_matter_is_shown_bright_whatever_its_light_and_the_backdrop() {
        for (radiance, back) in [(1.0, 0.0), (40.0, 0.0), (0.003, 0.0), (1.0, 1.0), (0.01, 1.0)] {
            let image = picture([64, 64], radiance, back);
            let backdrop = Some(Backdrop { color: Rgb::splat(back), in_radiance: true });
            let stops = image.exposure(backdrop);
            let wanted = 0.6 - 0.3 * back;
            assert!((radiance * stops.exp2() - wanted).abs() < 0.005, "{radiance} before {back}: {stops}");
        }
    }

    #[test]
    fn neither_size_nor_noise_counts() {
        let plain = picture([64, 64], 1.0, 0.0).exposure(None);
        assert!((picture([256, 192], 1.0, 0.0).exposure(None) - plain).abs() < 0.02);
        // Every other pixel has all the light, as after a single sample.
        let mut image = picture([256, 256], 1.0, 0.0);
        for (i, pixel) in image.rgba.iter_mut().enumerate() {
            let share = if i % 2 == 0 { 2.0 } else { 0.0 };
            pixel[..3].iter_mut().for_each(|x| *x *= share);
        }
        assert!((image.exposure(None) - plain).abs() < 0.02);
    }

    #[test]
    fn thin_matter_is_metered_and_black_stays() {
        let mut image = picture([32, 32], 1.0, 0.0);
        assert_eq!(Image::empty([9, 5]).exposure(None), 0.0);
        // A mist that covers a hundredth, and light without matter.
        for alpha in [0.01, 0.0] {
            image.rgba.iter_mut().for_each(|pixel| *pixel = [0.02, 0.02, 0.02, alpha]);
            assert!((0.02 * image.exposure(None).exp2() - 0.6).abs() < 0.005);
        }
        image.rgba.iter_mut().for_each(|pixel| *pixel = [f32::NAN, f32::INFINITY, -1.0, 1.0]);
        assert_eq!(image.exposure(None), 0.0);
        image.rgba.iter_mut().for_each(|pixel| *pixel = [f32::MIN_POSITIVE, 0.0, 0.0, 1.0]);
        assert!(image.exposure(None).abs() <= 40.0);
    }
}
