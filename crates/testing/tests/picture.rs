//! Comparing pictures must accept noise and reject real differences.

use std::fs::File;
use std::io::BufReader;
use std::panic::catch_unwind;
use std::path::PathBuf;
use tyndall_testing::{ChiSquare, Mean, Picture, SIGNIFICANCE, SplitMix};

const WIDTH: usize = 40;
const HEIGHT: usize = 30;

#[expect(clippy::cast_possible_truncation, reason = "pictures are kept in single precision")]
fn single(x: f64) -> f32 {
    x as f32
}

/// A ramp with a different brightness in each channel.
fn truth(x: usize, y: usize, channel: usize) -> f64 {
    (0.1 + x as f64 / WIDTH as f64 + y as f64 / HEIGHT as f64) * [1.0, 0.5, 0.25][channel]
}

/// A picture of the ramp, as a renderer would estimate it: the mean of samples, with its estimated variance.
fn noisy(seed: u64, samples: usize) -> Picture {
    let mut random = SplitMix::new(seed);
    let mut estimate = |i: usize| {
        let means = [0, 1, 2].map(|channel| {
            let sample = |_| 2.0 * random.uniform() * truth(i % WIDTH, i / WIDTH, channel);
            (0..samples).map(sample).collect::<Mean>()
        });
        (means.map(|mean| single(mean.mean())), means.map(|mean| single(mean.variance_of_mean())))
    };
    let (mean, variance) = (0..WIDTH * HEIGHT).map(&mut estimate).unzip();
    Picture::new(WIDTH, HEIGHT, mean, Some(variance))
}

fn exact() -> Picture {
    let pixel = |i: usize| [0, 1, 2].map(|channel| single(truth(i % WIDTH, i / WIDTH, channel)));
    Picture::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect(), None)
}

/// Shifts one channel of a pixel by `sigma` of its standard errors.
fn shift(picture: &mut Picture, pixel: usize, channel: usize, sigma: f32) {
    let deviation = picture.variance.as_ref().expect("a noisy picture")[pixel][channel].sqrt();
    picture.mean[pixel][channel] += sigma * deviation;
}

/// A folder for this run of the tests.
fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn noise_passes() {
    let (image, other, exact) = (noisy(1, 400), noisy(2, 400), exact());
    image.compare(&other).assert_in(&folder("noise"));
    image.compare(&exact).assert_in(&folder("noise-exact"));
    image.compare_blocks(&exact, 7).assert_in(&folder("noise-blocks"));
    let comparison = image.compare(&other);
    assert!((comparison.mean_ratio() - 1.0).abs() < 2e-3, "{comparison}");
    // Variance of the mean of 400 uniformly distributed samples, for both: 2 / 3 / 400 relative to the square.
    assert!((comparison.relative_mse() / (2.0 / 3.0 / 400.0) - 1.0).abs() < 0.1, "{comparison}");
    // With 3600 numbers, the fractions of a normal distribution within four standard errors.
    assert!((comparison.blocks_past(2.0) - 0.0455).abs() < 4.0 * 0.0035, "{comparison}");
    assert!((comparison.blocks_past(3.0) - 0.0027).abs() < 4.0 * 0.0009, "{comparison}");
}

#[test]
fn one_pixel_off_by_five_sigma_is_rejected_and_named() {
    let mut image = exact();
    image.variance = Some(vec![[1e-6; 3]; WIDTH * HEIGHT]);
    shift(&mut image, 3 * WIDTH + 7, 1, -5.0);
    let exact = exact();
    let comparison = image.compare(&exact);
    assert!(comparison.threshold > 4.0 && comparison.threshold < 5.0, "{comparison}");
    assert!(!comparison.passes(), "{comparison}");
    let worst = comparison.worst();
    assert_eq!((worst.x, worst.y, worst.channel), (7, 3, 1));
    assert!((worst.z + 5.0).abs() < 0.01, "{comparison}");
    // A deviation that a normal distribution reaches somewhere in so many pixels is no error.
    shift(&mut image, 3 * WIDTH + 7, 1, 1.5);
    assert!(image.compare(&exact).passes());
}

#[test]
fn a_faint_veil_is_rejected_by_blocks_only() {
    let mut image = noisy(3, 400);
    for y in 8..16 {
        for x in 16..24 {
            shift(&mut image, y * WIDTH + x, 0, 1.0);
        }
    }
    let exact = exact();
    image.compare(&exact).assert_in(&folder("veil"));
    let comparison = image.compare_blocks(&exact, 8);
    let worst = comparison.worst();
    assert!(!comparison.passes() && (worst.x, worst.y, worst.channel) == (16, 8, 0), "{comparison}");
}

#[test]
fn two_percent_too_bright_shows_in_the_mean() {
    let (mut image, exact) = (noisy(4, 400), exact());
    image.mean.iter_mut().flatten().for_each(|x| *x *= 1.02);
    let whole = image.compare_blocks(&exact, WIDTH);
    assert_eq!(whole.z.len(), 1);
    assert!(!whole.passes() && (whole.mean_ratio() - 1.02).abs() < 2e-3, "{whole}");
}

#[test]
fn without_noise_only_rounding_is_allowed() {
    let (image, mut other) = (exact(), exact());
    other.mean[5][0] *= 1.0 + f32::EPSILON;
    assert!(image.compare(&other).passes());
    assert_eq!(image.compare(&image).relative_mse(), 0.0);
    other.mean[5][0] *= 1.0 + 1e-4;
    assert!(!image.compare(&other).passes());
    let black = Picture::new(1, 1, vec![[0.0; 3]], None);
    assert!(black.compare(&black).passes() && black.compare(&black).relative_mse() == 0.0);
}

#[test]
fn what_is_not_a_number_never_passes() {
    let exact = exact();
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut image = noisy(5, 100);
        image.mean[9][2] = wrong;
        assert!(!image.compare(&exact).passes(), "{wrong} in the mean");
        assert!(!exact.compare(&image).passes(), "{wrong} in the reference");
        let mut image = noisy(5, 100);
        image.variance.as_mut().unwrap()[9][2] = wrong;
        assert!(!image.compare(&exact).passes(), "{wrong} in the variance");
    }
}

#[test]
fn correct_pictures_are_rejected_one_time_in_a_hundred() {
    // The threshold is a quantile of the distribution of the largest of this many normal numbers.
    let exact = Picture::new(8, 8, vec![[0.5; 3]; 64], None);
    let mut random = SplitMix::new(6);
    let mut rejected = 0_u64;
    for _ in 0..1000 {
        // Exactly normal numbers, by the Box-Muller transform.
        let mut normal = || {
            let (radius, angle) = ((-2.0 * (1.0 - random.uniform()).ln()).sqrt(), random.uniform());
            single(0.5 + 0.01 * radius * (std::f64::consts::TAU * angle).cos())
        };
        let mean = (0..64).map(|_| [normal(), normal(), normal()]).collect();
        let image = Picture::new(8, 8, mean, Some(vec![[1e-4; 3]; 64]));
        rejected += u64::from(!image.compare(&exact).passes());
    }
    ChiSquare::default().discrete(&[SIGNIFICANCE, 1.0 - SIGNIFICANCE], &[rejected, 1000 - rejected]).assert();
}

#[test]
fn a_failure_leaves_pictures_and_says_where() {
    let (mut image, reference) = (noisy(7, 100), noisy(8, 100));
    shift(&mut image, 2 * WIDTH + 3, 0, 40.0);
    shift(&mut image, 20 * WIDTH + 30, 2, -30.0);
    let folder = folder("failure");
    let panic = catch_unwind(|| image.compare(&reference).assert_in(&folder)).unwrap_err();
    let message = panic.downcast_ref::<String>().unwrap();
    assert!(message.contains("red of pixel (3, 2)"), "{message}");
    assert!(message.contains("z = ") && message.ends_with(&folder.display().to_string()), "{message}");

    let read = |name: &str| {
        let mut reader =
            png::Decoder::new(BufReader::new(File::open(folder.join(name)).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height, bytes.len()), (40, 30, 3 * WIDTH * HEIGHT));
        bytes.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect::<Vec<_>>()
    };
    let (shown, expected, error) = (read("image.png"), read("reference.png"), read("error.png"));
    assert!(shown[2 * WIDTH + 3][0] > expected[2 * WIDTH + 3][0] + 50, "the bright pixel is bright");
    assert_eq!((error[2 * WIDTH + 3], error[20 * WIDTH + 30]), ([255, 0, 0], [0, 0, 255]));
    let strong = error.iter().filter(|rgb| rgb.contains(&0)).count();
    assert_eq!(strong, 2, "only the two errors are saturated");
}

#[test]
#[should_panic(expected = "sizes of the two pictures")]
fn pictures_of_different_sizes_are_not_compared() {
    let (small, large) = (Picture::new(1, 1, vec![[0.0; 3]], None), exact());
    let _ = small.compare(&large);
}
