//! Matter whose values lie between those of neighbouring samples is seen, by every method.

mod data;
mod support;

use data::{Data, Way, mean, picture, ways};
use serde_json::{Value, json};
use support::Folder;
use tyndall::film::Image;

/// A ball whose values fall from 40 to -1000 over two voxels, as HU; then scaled and moved.
fn ball(scale: f64, offset: f64) -> Data {
    const EDGE: f64 = 32.0;
    Data::new(32, move |[x, y, z]| {
        let radius = 0.5 * EDGE * (x * x + y * y + z * z).sqrt();
        offset + scale * (40.0 - 1040.0 * (0.5 * (radius - 10.0)).clamp(0.0, 1.0))
    })
}

/// A peak of opacity around -500 HU that glows red, in matter that would glow blue; emission only.
fn peak(width: f64, scale: f64, offset: f64) -> Value {
    let point = |value: f64, opacity: f64, emission: [f64; 3]| json!({ "value": offset + scale * value, "opacity": opacity, "albedo": 0, "emission": emission });
    let (blue, red) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let (from, to) = (-500.0 - 0.5 * width, -500.0 + 0.5 * width);
    json!({
        "transfer_function": { "points": [
            point(from - 1.0, 0.0, blue), point(from, 0.0, red), point(-500.0, 1.0, red),
            point(to, 0.0, red), point(to + 1.0, 0.0, blue),
        ] },
        "medium": { "density": 6 },
        "lights": [],
        "camera": { "type": "orthographic" },
        "film": { "size": [32, 32], "background": "transparent" },
        "render": { "max_scatter": 0 },
    })
}

/// The mean of red, blue and alpha.
fn seen(image: &Image) -> [f64; 3] {
    let [red, _, blue] = mean(image);
    let alpha = image.rgba.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
    [red, blue, alpha / image.rgba.len() as f64]
}

fn with_samples(look: &Value, way: Way) -> Value {
    let samples = if way.method == "path" { 400 } else { 4 };
    tyndall_live::document::apply(look, &json!({ "render": { "samples": samples } }))
}

#[test]
fn a_peak_between_two_samples_is_seen_by_every_method() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    for width in [10.0, 40.0, 200.0] {
        let look = peak(width, 1.0, 0.0);
        let truth = ways().into_iter().rev().find(|way| way.method == "path").expect("path");
        let [expected, _, alpha] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, truth), truth));
        assert!(alpha > 0.02, "{alpha} at a width of {width}");
        for way in ways().into_iter().filter(|way| way.method != "path") {
            let [red, blue, found] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, way), way));
            assert!((found / alpha - 1.0).abs() < 0.02, "alpha {found} for {alpha}, {width} HU, {way:?}");
            assert!((red / expected - 1.0).abs() < 0.02, "red {red} for {expected}, {width} HU, {way:?}");
            assert!(blue < 1e-3 * red, "blue {blue} beside {red}, {width} HU, {way:?}");
        }
    }
}

#[test]
fn scale_and_offset_of_the_values_change_nothing() {
    let folder = Folder::new();
    for way in ways().into_iter().filter(|way| way.method == "raymarch") {
        let found = [(1.0, 0.0), (1e-3, 0.0), (37.0, 5000.0), (-1e6, 1e7)].map(|(scale, offset)| {
            folder.put("a.nrrd", ball(scale, offset).nrrd("double"));
            let mut look = peak(10.0, scale, offset);
            if scale < 0.0 {
                look["transfer_function"]["points"].as_array_mut().expect("points").reverse();
            }
            seen(&picture(&folder, "a.nrrd", &with_samples(&look, way), way))[2]
        });
        for alpha in found {
            assert!((alpha / found[0] - 1.0).abs() < 5e-3, "{found:?} with {way:?}");
        }
    }
}

/// The shell is seen evenly: pixels at one distance from its centre have one opacity.
#[test]
fn a_thin_shell_has_no_rings() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let look = peak(40.0, 1.0, 0.0);
    for way in ways().into_iter().filter(|way| way.method == "raymarch") {
        let image = picture(&folder, "a.nrrd", &with_samples(&look, way), way);
        let alphas = (12..20).flat_map(|y| (12..20).map(move |x| x + 32 * y));
        let alphas: Vec<f64> = alphas.map(|i| f64::from(image.rgba[i][3])).collect();
        // Both walls of the shell, straight through: a triangle of 40 HU on a slope of 520 HU a voxel.
        let expected = 1.0 - (-2.0 * 6.0 * 0.5 * 40.0 / 520.0_f64).exp();
        for alpha in alphas {
            assert!((alpha / expected - 1.0).abs() < 0.15, "{alpha}, straight through {expected}, {way:?}");
        }
    }
}

#[test]
fn nothing_lies_between_voxels_that_are_not_interpolated() {
    let folder = Folder::new();
    folder.put(
        "a.nrrd",
        Data::new(32, |[x, y, z]| if x * x + y * y + z * z < 0.4 { 40.0 } else { -1000.0 }).nrrd("short"),
    );
    for way in ways() {
        let alpha = |interpolation: &str| {
            let look = tyndall_live::document::apply(
                &with_samples(&peak(200.0, 1.0, 0.0), way),
                &json!({ "volume": { "interpolation": interpolation } }),
            );
            seen(&picture(&folder, "a.nrrd", &look, way))[2]
        };
        assert_eq!(alpha("nearest"), 0.0, "{way:?}");
        assert!(alpha("linear") > 0.02, "{way:?}");
    }
}
