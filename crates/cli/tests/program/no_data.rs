//! NaN is no data, and data of a single value are nothing or a solid.

use crate::data::{Data, apart, mean, picture, ways};
use crate::support::{Ended, Folder, json as parse, run};
use serde_json::{Value, json};
use tyndall::film::Image;

fn even(value: f64) -> Data {
    Data::new(8, move |_| value)
}

fn is_black(image: &Image) -> bool {
    image.rgba.iter().all(|pixel| pixel[..3] == [0.0; 3])
}

#[test]
fn background_everywhere_is_nothing_and_anything_else_a_solid() {
    let folder = Folder::new();
    for (value, kind, seen) in [
        (0.0, "uchar", false),
        (f64::NAN, "float", false),
        (f64::NAN, "double", false),
        (-1024.0, "short", false),
        (-1e20, "float", false),
        (1.0, "uchar", true),
        (255.0, "uchar", true),
        (-5.5, "float", true),
    ] {
        for data in [even(value), even(value).anatomical()] {
            folder.put("a.nrrd", data.nrrd(kind));
            for way in ways() {
                let image = picture(&folder, "a.nrrd", &json!({ "film": { "size": [8, 8] } }), way);
                assert_eq!(!is_black(&image), seen, "{value} as {kind} with {way:?}");
            }
            let arguments = ["render", "../a.nrrd", "--size", "8x8", "--samples", "1"];
            let Ended { status, stderr, .. } = folder.run(&arguments);
            let note = if value.is_nan() {
                "note: every sample is NaN".to_owned()
            } else {
                format!("note: every sample is {value:?}").replace(".0", "")
            };
            assert!(status == Some(0) && (stderr.contains(&note) || value == -1e20), "{value}: {stderr}");
            assert_eq!(stderr.contains("invisible") || value.is_nan(), !seen, "{value}: {stderr}");
            assert_eq!(stderr.contains("one solid block"), seen, "{value}: {stderr}");
            for preset in ["mri", "mri-glass", "solid", "cloud", "layers"] {
                let patch = json!({ "transfer_function": { "preset": preset }, "film": { "size": [8, 8] } });
                let image = picture(&folder, "a.nrrd", &patch, ways()[2]);
                assert_eq!(!is_black(&image), seen, "{value} as {kind} by {preset}");
            }
        }
    }
}

/// A body beside `outside`.
fn body(outside: f64) -> Data {
    Data::new(16, move |[x, y, z]| {
        let r = (x * x + y * y + z * z).sqrt();
        if r < 0.7 { 3.0 + x } else { outside }
    })
}

#[test]
fn nan_is_in_no_range_histogram_or_label() {
    let folder = Folder::new();
    folder.put("a.nrrd", body(f64::NAN).nrrd("float"));
    let report = parse(&run(&folder, &["info", "../a.nrrd", "--json"]));
    let missing = body(f64::NAN).samples.iter().filter(|v| v.is_nan()).count();
    let present = 16 * 16 * 16 - missing;
    let ends = |key: &str| [0, 1].map(|i| report[key][i].as_f64().expect("a number"));
    assert!(ends("value_range")[0] > 2.2 && ends("value_range")[1] < 3.8, "{report}");
    assert!(ends("robust_range")[0] > 2.2, "{report}");
    let counts: Vec<usize> = serde_json::from_value(report["histogram"]["counts"].clone()).expect("counts");
    assert_eq!(
        (counts.iter().sum::<usize>(), report["no_data"].clone()),
        (present, json!(missing)),
        "{report}"
    );
    folder.put("a.nrrd", even(f64::NAN).nrrd("float"));
    let report = parse(&run(&folder, &["info", "../a.nrrd", "--json"]));
    assert!(report["value_range"].is_null() && report["robust_range"].is_null(), "{report}");
    let labels = Data::new(16, |[x, y, _]| {
        if y > 0.5 {
            f64::NAN
        } else if x < 0.0 {
            2.0
        } else {
            9.0
        }
    });
    folder.put("a.nrrd", labels.nrrd("float"));
    assert_eq!(parse(&run(&folder, &["info", "../a.nrrd", "--json"]))["preset"], "labels");
}

fn opaque(from: f64) -> Value {
    // Below the first point the function is constant: opacity everywhere, even for what would be minus infinity.
    json!({ "transfer_function": { "points": [{ "value": from, "opacity": 1, "albedo": 0.8 }] },
            "medium": { "density": 0.4 }, "lights": [{ "type": "environment", "radiance": 1 }] })
}

/// Nothing is seen where there is no data, nor in the voxel between it and data, whatever the function says; data keep their look.
#[test]
fn nan_has_no_opacity_and_takes_none_from_data() {
    let folder = Folder::new();
    let rows = |nan: bool| {
        Data::of_dims([32, 16, 16], move |[x, ..]| if x < 0.0 && nan { f64::NAN } else { 3.0 + x })
    };
    // What is left of the body: from the first voxel of data on.
    let cut = json!([{ "type": "plane", "point": [16, 0, 0], "normal": [-1, 0, 0] }]);
    for kind in ["float", "double"] {
        for interpolation in ["linear", "nearest"] {
            for way in ways() {
                let of = |nan: bool| {
                    folder.put("a.nrrd", rows(nan).nrrd(kind));
                    let mut patch = opaque(-1e9);
                    patch["volume"] = json!({ "interpolation": interpolation });
                    if !nan || interpolation == "nearest" {
                        patch["clip"] = cut.clone();
                    }
                    picture(&folder, "a.nrrd", &patch, way)
                };
                let (found, expected) = (of(true), of(false));
                assert!(mean(&expected)[0] > 0.05);
                let off = apart(&found, &expected);
                assert!(off < 0.05, "{kind}, {interpolation}: {off} apart with {way:?}");
                let total = (mean(&found)[0] / mean(&expected)[0] - 1.0).abs();
                assert!(total < 0.02, "{kind}, {interpolation}: {total} off with {way:?}");
            }
        }
    }
}
