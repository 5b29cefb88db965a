//! A volume far from its file's origin, as surveys have, gives the picture and the bounds of the same volume at the origin.

use crate::data::{Data, mean, picture, ways};
use crate::support::{Folder, json as parse, run};
use serde_json::{Value, json};

/// Origins and spacings of surveys.
const PLACES: [([f64; 3], f64); 4] = [
    ([500_000.0, 4_500_000.0, 0.0], 0.25),
    ([500_000.0, 4_500_000.0, 0.0], 0.05),
    ([500_000.0, 4_500_000.0, 0.0], 0.01),
    ([8e7, -8e7, 8e7], 1.0),
];

const EDGE: u16 = 16;

fn body(origin: [f64; 3], spacing: f64) -> Data {
    let value = |[x, y, z]: [f64; 3]| if x * x + y * y + z * z < 0.5 { 150.0 + 60.0 * x } else { 0.0 };
    Data { spacing, origin, ..Data::new(EDGE, value) }
}

/// A MetaImage file.
fn metaimage(data: &Data) -> Vec<u8> {
    let Data { dims: [nx, ny, nz], spacing: s, origin: [ox, oy, oz], .. } = data;
    let head = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {nx} {ny} {nz}\nElementType = MET_UCHAR\nElementSpacing = {s} {s} {s}\n\
         Offset = {ox} {oy} {oz}\nElementDataFile = LOCAL\n"
    );
    [head.as_bytes(), &data.bytes("uchar")].concat()
}

/// Lights, a camera and a clip around the volume, at positions of its file, in voxels from its origin.
fn scene(file: &str, origin: [f64; 3], spacing: f64) -> Value {
    let at = |p: [f64; 3]| json!([0, 1, 2].map(|a| origin[a] + spacing * p[a]));
    let mut scene = json!({
        "volume": { "path": file },
        "transfer_function": { "points": [{ "value": 60, "opacity": 0 }, { "value": 120, "opacity": 1, "surface": 0.5 }] },
        "medium": { "density": 0.7 / spacing },
        "lights": [
            { "type": "sphere", "position": at([-20.0, 20.0, 30.0]), "radius": 4.0 * spacing, "radiance": 30 },
            { "type": "rect", "position": at([30.0, 20.0, 20.0]), "target": at([8.0, 8.0, 8.0]),
              "size": [8.0 * spacing, 8.0 * spacing], "radiance": 9 },
            { "type": "disk", "position": at([0.0, 40.0, 8.0]), "target": at([8.0, 8.0, 8.0]),
              "radius": 5.0 * spacing, "radiance": 9 },
            { "type": "point", "position": at([10.0, -20.0, 30.0]), "intensity": 500.0 * spacing * spacing },
        ],
        "clip": [
            { "type": "plane", "point": at([8.0, 8.0, 8.0]), "normal": [1, 0.2, 0] },
            { "type": "box", "min": at([-1.0, 3.0, -1.0]), "max": at([17.0, 17.0, 17.0]) },
        ],
        "camera": { "position": at([40.0, 20.0, 50.0]), "target": at([7.5, 7.5, 7.5]), "fov": 30 },
    });
    if file.ends_with("raw") {
        scene["volume"]["raw"] = json!({ "dims": [EDGE, EDGE, EDGE], "dtype": "u8", "spacing": [spacing, spacing, spacing], "origin": origin });
    }
    scene
}

#[test]
fn pictures_do_not_depend_on_the_origin() {
    let folder = Folder::new();
    for way in ways() {
        for (origin, spacing) in PLACES {
            let shown = |file: &str, origin: [f64; 3], camera: bool| {
                let data = body(origin, spacing);
                let bytes = match file {
                    "a.nrrd" => data.nrrd("uchar"),
                    "a.mha" => metaimage(&data),
                    _ => data.bytes("uchar"),
                };
                folder.put(file, bytes);
                let mut scene = scene(file, origin, spacing);
                if !camera {
                    scene.as_object_mut().expect("a table").remove("camera");
                }
                folder.put("scene.json", scene.to_string());
                mean(&picture(&folder, "scene.json", &json!({ "render": { "samples": 4 } }), way))
            };
            for camera in [true, false] {
                let near = shown("a.nrrd", [0.0; 3], camera);
                assert!(near[0] > 0.005, "{near:?} with {way:?}");
                let files: &[&str] = if camera { &["a.nrrd", "a.mha", "a.raw"] } else { &["a.nrrd"] };
                for file in files {
                    let off = (shown(file, origin, camera)[0] / near[0] - 1.0).abs();
                    assert!(off < 5e-3, "{file} at {origin:?}, spacing {spacing}: {off} off with {way:?}");
                }
            }
        }
    }
}

#[test]
fn bounds_are_exact() {
    let folder = Folder::new();
    for (origin, spacing) in PLACES {
        folder.put("a.nrrd", body(origin, spacing).nrrd("uchar"));
        folder.put("a.mha", metaimage(&body(origin, spacing)));
        for file in ["../a.nrrd", "../a.mha"] {
            let report = parse(&run(&folder, &["info", file, "--json"]));
            for axis in 0..3 {
                assert_eq!(report["origin"][axis], origin[axis], "{report}");
                for (corner, side) in [(0, -0.5), (1, f64::from(EDGE) - 0.5)] {
                    let found = report["bounds"][corner][axis].as_f64().expect("a number");
                    let expected = origin[axis] + side * spacing;
                    assert!(
                        (found - expected).abs() < 1e-6 * spacing,
                        "{file}: {found}, expected {expected}"
                    );
                }
            }
            let text = String::from_utf8(run(&folder, &["info", file])).expect("UTF-8");
            let size = spacing * f64::from(EDGE);
            assert!(text.contains(&format!("size       {size} x {size} x {size}")), "{text}");
        }
    }
}
