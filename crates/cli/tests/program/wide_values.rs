//! Values that single precision does not tell apart are refused by name, or noted; never is one taken for the other silently.

use crate::data::Data;
use crate::support::{Ended, Folder};
use serde_json::{Value, json};

const LOW: f64 = 16_777_216.0;

/// Two labels side by side in nothing.
fn labels(low: f64) -> Data {
    Data::new(16, move |[x, y, _]| {
        if y.abs() > 0.7 {
            low - 7.0
        } else if x < 0.0 {
            low
        } else {
            low + 1.0
        }
    })
}

fn render(folder: &Folder, points: Option<&Value>) -> Ended {
    let mut scene =
        json!({ "volume": { "path": "a.nrrd" }, "film": { "size": [8, 8] }, "render": { "samples": 1 } });
    if let Some(points) = points {
        scene["transfer_function"] = json!({ "points": points });
    }
    folder.put("scene.json", scene.to_string());
    folder.run(&["render", "../scene.json"])
}

fn points(values: &[f64]) -> Value {
    values.iter().map(|value| json!({ "value": value, "opacity": 0.5 })).collect()
}

#[test]
fn labels_that_single_precision_confuses_are_refused_by_name() {
    let folder = Folder::new();
    let one_each = points(&[LOW - 7.0, LOW, LOW + 1.0]);
    let halves = points(&[LOW - 0.5, LOW - 0.5, LOW + 0.5, LOW + 0.5, LOW + 1.5]);
    for kind in ["uint", "int", "double"] {
        folder.put("a.nrrd", labels(LOW).nrrd(kind));
        for (points, names) in [
            (Some(&one_each), ["16777216", "16777217"]),
            (Some(&points(&[LOW, LOW + 0.5])), ["16777216", "16777216.5"]),
            (None, ["16777216", "16777217"]),
        ] {
            let Ended { status, stderr, .. } = render(&folder, points);
            assert_eq!(status, Some(1), "{kind}: {stderr}");
            assert!(names.iter().all(|name| stderr.contains(name)), "{kind}: {stderr}");
            assert!(stderr.contains("single precision") && stderr.contains("transfer_function."), "{stderr}");
        }
        // What cannot be refused for its points is noted.
        let Ended { status, stderr, .. } = render(&folder, Some(&points(&[LOW - 2.0, LOW + 100.0])));
        assert_eq!(status, Some(0), "{kind}: {stderr}");
        assert!(stderr.contains("note: the data are from 16777209 to 16777217"), "{kind}: {stderr}");
        // Far enough below, all are told apart.
        folder.put("a.nrrd", labels(LOW - 10.0).nrrd(kind));
        let Ended { status, stderr, .. } =
            render(&folder, Some(&points(&[LOW - 17.0, LOW - 10.0, LOW - 9.0])));
        assert_eq!((status, stderr.as_str()), (Some(0), ""), "{kind}");
        assert_eq!(render(&folder, None).status, Some(0), "{kind}");
    }
    // Points at halves are quoted as they were given.
    let Ended { status, stderr, .. } = render(&folder, Some(&halves));
    assert_eq!(status, Some(1), "{stderr}");
    assert!(!stderr.contains("a third point"), "{stderr}");
    assert!(stderr.contains("16777215.5") || stderr.contains("16777216.5"), "{stderr}");
}

#[test]
fn double_precision_that_is_lost_is_noted_and_near_points_are_a_jump() {
    let folder = Folder::new();
    folder.put("a.nrrd", Data::new(8, |[x, ..]| 5e6 + 1e-3 * x).nrrd("double"));
    let Ended { status, stderr, .. } = render(&folder, Some(&points(&[5e6, 5e6 + 1.0])));
    assert!(status == Some(0) && stderr.contains("note: the data are from 4999999.9"), "{stderr}");
    folder.put("a.nrrd", Data::new(8, |[x, ..]| x).nrrd("double"));
    let near = points(&[0.5, 0.5 + 1e-12, 0.75]);
    let Ended { status, stderr, .. } = render(&folder, Some(&near));
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    let Ended { status, stderr, .. } = render(&folder, Some(&points(&[0.5, 0.5 + 1e-12, 0.5 + 2e-12])));
    assert_eq!(status, Some(1), "{stderr}");
    assert!(stderr.contains("0.500000000001 and 0.500000000002"), "{stderr}");
}
