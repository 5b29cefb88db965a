//! Tests of the film.

use super::*;
use crate::sampling::Stream;
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
    let bytes = [1, 15, 16, 63, 64, 1 << 20].map(|samples| Film::bytes([1, 1], 0, samples));
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
            tile.add(&PixelSample { radiance: Rgb::new(x, 2.0 - x, 0.3 * x), alpha: x / 4.0, depth: 1.0 });
        }
    }
    film
}

#[test]
fn a_look_shows_what_a_file_would() {
    let plain = Tone { stops: 0.3, ..Tone::default() };
    let color = Rgb::new(0.4, 0.6, 0.5);
    let before_color = Tone { backdrop: Some(Backdrop { color, in_radiance: true }), ..plain };
    for (samples, tone) in [1, 15, 16, 70, 300].into_iter().flat_map(|n| [(n, plain), (n, before_color)]) {
        let film = uneven([37, 50], samples);
        let pixels = film.image().rgba;
        let mut expected = vec![[0; 3]; pixels.len()];
        tone.encode(Level::best(), &pixels, &mut expected);
        for level in Level::available() {
            let (mut viewer, mut picture) = (Viewer::default(), Vec::new());
            viewer.look(&film, tone, level, &mut picture);
            assert_eq!((viewer.size(), viewer.changed().len()), ([37, 50], 12));
            assert!(picture == expected, "{samples} samples, {level:?}");
        }
        let mut linear = Image::empty([1, 1]);
        Viewer::default().look_linear(&film, &mut linear);
        assert!(linear == film.image(), "{samples} samples");
    }
}

#[test]
fn a_look_renews_what_changed_and_a_missing_pixel_shows_its_blocks_first() {
    let (tone, level) = (Tone { curve: tone::ToneCurve::Linear, ..Tone::default() }, Level::best());
    let grey = |x: u8| PixelSample { radiance: Rgb::splat(f32::from(x) / 40.0), ..PixelSample::default() };
    let mut film = Film::new([32, 20]);
    let (mut viewer, mut picture) = (Viewer::default(), Vec::new());
    let (mut linear_viewer, mut linear) = (Viewer::default(), Image::empty([1, 1]));
    viewer.look(&film, tone, level, &mut picture);
    assert!(viewer.changed().is_empty() && picture == [[0; 3]; 640]);
    // One pixel of 64, each of its own grey.
    let coarse = Goal { samples: 0, more: Some(Stride::Eight) };
    let mut number = 0;
    for tile in film.tiles_mut() {
        while !tile.has_reached(coarse) {
            number += 1;
            tile.add(&grey(number));
        }
    }
    viewer.look(&film, tone, level, &mut picture);
    linear_viewer.look_linear(&film, &mut linear);
    assert_eq!(viewer.changed(), [[0, 0], [16, 0], [0, 16], [16, 16]]);
    assert_eq!(linear_viewer.changed(), viewer.changed());
    let at = |[x, y]: [usize; 2]| picture[y * 32 + x][0];
    for [x, y] in [[7, 7], [8, 7], [31, 0], [17, 19], [15, 15]] {
        let first = [x / 8 * 8, y / 8 * 8];
        assert_eq!(at([x, y]), at(first), "({x}, {y})");
        assert_eq!(linear.rgba[y * 32 + x], linear.rgba[first[1] * 32 + first[0]], "({x}, {y})");
    }
    assert!(at([0, 0]) < at([8, 0]) && at([8, 0]) < at([8, 8]));
    // Of files, statistics and parts a missing pixel is no part.
    assert_eq!(film.image().rgba[7 * 32 + 7], [0.0; 4]);
    viewer.look(&film, tone, level, &mut picture);
    assert!(viewer.changed().is_empty());
    film.tiles_mut()[3].add(&grey(40));
    viewer.look(&film, tone, level, &mut picture);
    linear_viewer.look_linear(&film, &mut linear);
    assert_eq!((viewer.changed(), linear_viewer.changed()), (&[[16, 16]][..], &[[16, 16]][..]));
    // A new film without samples keeps the old picture until it has some; another exposure renews all.
    let before = picture.clone();
    viewer.look(&Film::new([32, 20]), tone, level, &mut picture);
    assert!(viewer.changed().is_empty() && picture == before);
    viewer.look(&film, Tone { stops: 1.0, ..tone }, level, &mut picture);
    assert_eq!(viewer.changed().len(), 4);
    // So does another picture, or another way to look.
    viewer.look(&film, Tone { stops: 1.0, ..tone }, level, &mut Vec::new());
    assert_eq!(viewer.changed().len(), 4);
    viewer.look_linear(&film, &mut linear);
    assert_eq!(viewer.changed().len(), 4);
    // A film that drops its samples is a new one.
    film.clear();
    linear_viewer.look_linear(&film, &mut linear);
    assert!(linear_viewer.changed().is_empty() && film.coverage() == 0.0 && film.samples() == 0);
    // It is seen to be one also when it has as many samples as the old one had.
    while !film.tiles[0].has_reached(coarse) {
        film.tiles[0].add(&grey(7));
    }
    linear_viewer.look_linear(&film, &mut linear);
    assert_eq!(linear_viewer.changed(), [[0, 0]]);
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

/// The samples of a picture, whatever part they are taken for.
fn sample_of([x, y]: [u32; 2], number: u32) -> PixelSample {
    let bits = (number + 1).wrapping_mul(2_654_435_769) ^ (x * 71 + y).wrapping_mul(2_246_822_519);
    let u = (bits.wrapping_mul(3_266_489_917) >> 8) as f32 / (1 << 24) as f32;
    let alpha = f32::from(u8::from(bits & 3 > 0));
    PixelSample { radiance: Rgb::new(u, 4.0 * u * u, 1.0 - u), alpha, depth: alpha * (7.0 + u) }
}

/// Adds samples to every pixel up to number `end`, and one more to the first pixels of each tile.
fn go_on(film: &mut Film, end: u32, ahead: usize) {
    for tile in film.tiles_mut() {
        let all = tile.taken_at(Goal::samples(end)) + ahead.min(tile.pixel_count() - 1);
        while tile.taken() < all {
            let at = tile.next(Goal::samples(end + 1), 1).next().unwrap();
            tile.add(&sample_of(at, tile.samples()));
        }
    }
}

/// A film with the samples from number `first` on.
fn rendered(first: u32, end: u32, ahead: usize) -> Film {
    let mut film = Film::part([19, 17], first);
    go_on(&mut film, end, ahead);
    film
}

fn assert_same(film: &Film, expected: &Film, what: &str) {
    assert!(film.image() == expected.image(), "{what}: pictures");
    assert!(film.state() == expected.state(), "{what}: states");
    assert!(film.relative_error() == expected.relative_error(), "{what}: errors");
}

#[test]
fn parts_merge_to_the_bits_of_the_whole() {
    let mut stream = Stream::new(5, [0; 3]);
    for (samples, runs) in [(16, 1), (37, 3), (256, 6), (500, 12), (1100, 8)] {
        let whole = rendered(0, samples, 0);
        let chunks = samples / CHUNK;
        for run in 0..runs {
            let mut cuts: Vec<u32> = (0..run).map(|_| stream.bits() % (chunks + 1) * CHUNK).collect();
            cuts.extend([0, samples]);
            cuts.sort_unstable();
            cuts.dedup();
            let parts: Vec<Film> = cuts.windows(2).map(|ends| rendered(ends[0], ends[1], 0)).collect();
            // From the left, and from the right.
            let mut merged = Film::new(whole.size());
            parts.iter().for_each(|part| merged.append(part));
            assert_same(&merged, &whole, &format!("{cuts:?}"));
            let from_right = parts.into_iter().rev().reduce(|right, mut left| {
                left.append(&right);
                left
            });
            assert_same(&from_right.unwrap(), &whole, &format!("{cuts:?} from the right"));
        }
    }
}

#[test]
fn a_part_is_the_picture_of_its_own_samples() {
    for (first, end) in [(16, 17), (48, 80), (32, 400), (1008, 1100)] {
        let image = rendered(first, end, 0).image();
        let mean: f32 = (first..end).map(|number| sample_of([3, 2], number).radiance.g).sum::<f32>()
            / (end - first) as f32;
        let found = image.rgba[2 * 19 + 3][1];
        assert!((found / mean - 1.0).abs() < 1e-5, "{first}..{end}: {found}, expected {mean}");
    }
}

#[test]
fn a_film_goes_on_from_its_state() {
    for (first, between, ahead) in
        [(0, 0, 0), (0, 0, 5), (0, 3, 0), (0, 15, 9), (0, 80, 200), (48, 70, 1), (16, 320, 9)]
    {
        let mut film = Film::from_state(&rendered(first, between.max(first), ahead).state()).unwrap();
        let what = format!("{first}..{between} and {ahead}");
        assert_same(&film, &rendered(first, between.max(first), ahead), &what);
        go_on(&mut film, 500, 0);
        assert_same(&film, &rendered(first, 500, 0), &what);
    }
}

#[test]
fn layers_that_are_no_state_are_refused() {
    let state = rendered(16, 40, 3).state();
    let changed = |change: &dyn Fn(&mut FilmState)| {
        let mut state = state.clone();
        change(&mut state);
        Film::from_state(&state).unwrap_err()
    };
    for i in 0..state.layers.len() {
        let name = state.layers[i].name.clone();
        let missing = StateError::Layer(name.clone());
        assert_eq!(changed(&|state| drop(state.layers.remove(i))), missing);
        assert_eq!(changed(&|state| state.layers[i].values = StateValues::Float(vec![0.0; 7])), missing);
        let other = match state.layers[i].values {
            StateValues::Float(_) => StateValues::Whole(vec![0; 19 * 17]),
            StateValues::Whole(_) => StateValues::Float(vec![0.0; 19 * 17]),
        };
        assert_eq!(changed(&|state| state.layers[i].values = other.clone()), missing);
    }
    assert_eq!(changed(&|state| state.first = 7), StateError::First(7));
    for (pixel, found) in [(0, 40), (20, 43), (322, 5), (322, u32::MAX)] {
        let error = changed(&|state| match &mut state.layers[0].values {
            StateValues::Whole(next) => next[pixel] = found,
            StateValues::Float(_) => unreachable!(),
        });
        assert!(matches!(error, StateError::Samples { .. }), "{error:?}");
    }
    let all_later = changed(&|state| state.first = 64);
    assert!(matches!(all_later, StateError::Samples { .. }), "{all_later:?}");
}

/// Tiles measure their noise only now and then, and with an earlier mean of the picture.
#[test]
fn the_measured_error_is_close_to_the_true_one() {
    let mut film = Film::new([100, 80]);
    let mut whole = film.measured_luminance();
    for end in 1..200 {
        go_on(&mut film, end, 3);
        film.tiles_mut().iter_mut().for_each(|tile| tile.measure_noise(whole));
        whole = film.measured_luminance();
        let (measured, exact) = (film.measured_error(), film.relative_error());
        assert_eq!(measured.is_some(), exact.is_some(), "{end} samples");
        if let (Some(measured), Some(exact)) = (measured, exact) {
            assert!((measured / exact - 1.0).abs() < 0.02, "{end} samples: {measured} for {exact}");
        }
    }
    film.clear();
    assert_eq!(film.measured_error(), None);
}
