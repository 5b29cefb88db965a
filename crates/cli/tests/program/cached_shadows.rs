//! Pictures of `raymarch` with cached shadows against those with exact ones.

use crate::data::{Data, Way, blocks, picture};
use crate::environment_maps::put_map;
use crate::support::{Ended, Folder, json as parse, written};
use serde_json::{Value, json};
use tyndall::film::Image;
use tyndall::integrator::Method;
use tyndall::integrator::raymarch::RayMarch;
use tyndall::simd::Level;
use tyndall_live::document::apply;

/// Largest difference of a picture's light, and half that of the median of its blocks, where matter is smooth from texel to texel.
const SMOOTH: f64 = 0.01;
/// The same where matter begins from one voxel to the next, and light falls to three quarters within half a voxel.
const STEEP: f64 = 0.015;

/// Blocks with less light than this, relative to the brightest, are not compared: they show the object's edge.
const DARK: f64 = 0.02;

/// By how much the light of pictures differs, relative to the exact one.
#[derive(Clone, Copy, Debug)]
struct Apart {
    mean: f64,
    median: f64,
}

impl Apart {
    fn of(cached: &Image, exact: &Image) -> Self {
        let [cached, exact] = [cached, exact].map(blocks);
        let sum = |blocks: &[f64]| blocks.iter().sum::<f64>();
        let brightest = exact.iter().copied().fold(0.0, f64::max);
        let lit = cached.iter().zip(&exact).filter(|(_, exact)| **exact > DARK * brightest);
        let mut apart: Vec<f64> = lit.map(|(cached, exact)| (cached / exact - 1.0).abs()).collect();
        apart.sort_by(f64::total_cmp);
        assert!(brightest > 0.0, "a black picture");
        Self { mean: sum(&cached) / sum(&exact) - 1.0, median: apart[apart.len() / 2] }
    }
}

/// Scenes whose pictures are compared, and what was found.
struct Cases {
    folder: Folder,
    found: Vec<(String, Apart, f64)>,
}

impl Cases {
    fn new() -> Self {
        Self { folder: Folder::new(), found: Vec::new() }
    }

    /// Renders the file `a.nrrd` of these bytes with a patch; pictures may differ up to a limit.
    fn compare(&mut self, name: &str, file: &[u8], patch: &Value, limit: f64) {
        self.folder.put("a.nrrd", file);
        let [cached, exact] = ["cached", "exact"].map(|shadows| shown(&self.folder, patch, shadows));
        self.found.push((name.to_owned(), Apart::of(&cached, &exact), limit));
    }

    fn assert_alike(&self) {
        for (name, Apart { mean, median }, limit) in &self.found {
            println!("{name}: mean {:+.2} %, median {:.2} %, limit {limit}", 100.0 * mean, 100.0 * median);
        }
        for (name, apart, limit) in &self.found {
            assert!(apart.mean.abs() < *limit && apart.median < 2.0 * limit, "{name}: {apart:?}");
        }
    }
}

fn with_raymarch(patch: &Value) -> Value {
    apply(patch, &json!({ "render": { "integrator": RayMarch::NAME } }))
}

fn shown(folder: &Folder, patch: &Value, shadows: &str) -> Image {
    let usual = json!({
        "film": { "size": [64, 64] },
        "render": { "samples": 1, "raymarch": { "light_samples": 16, "shadows": shadows } },
    });
    let way = Way { method: RayMarch::NAME, level: Level::best() };
    picture(folder, "a.nrrd", &apply(&usual, patch), way)
}

const EDGE: u16 = 32;
/// The middle of such a cube of voxels.
const MIDDLE: [f64; 3] = [15.5; 3];

/// A ball, and a smaller one above it, of values that fall from 200 in the middle to 0, or do so at the edge.
fn balls(is_soft: bool) -> impl Fn([f64; 3]) -> f64 {
    move |[x, y, z]| {
        let ball = |middle: [f64; 3], radius: f64| {
            let [x, y, z] = [x - middle[0], y - middle[1], z - middle[2]];
            let inwards = (1.0 - (x * x + y * y + z * z).sqrt() / radius).max(0.0);
            if is_soft { inwards } else { f64::from(u8::from(inwards > 0.0)) }
        };
        200.0 * ball([-0.15, -0.25, -0.15], 0.7).max(ball([0.45, 0.55, 0.5], 0.35))
    }
}

const KINDS: [(&str, bool); 2] = [("soft", true), ("steep", false)];

/// Their look, with lights.
fn look(is_soft: bool, lights: &[Value]) -> Value {
    let point = |value: i32, opacity: f64| json!({ "value": value, "opacity": opacity, "albedo": [0.9, 0.7, 0.5], "surface": if is_soft { 0.0 } else { 0.6 } });
    let ends = if is_soft { [0, 200] } else { [50, 150] };
    json!({
        "transfer_function": { "points": [point(ends[0], 0.0), point(ends[1], 1.0)] },
        "medium": { "density": 0.5 },
        "lights": lights,
    })
}

fn sun(direction: [f64; 3], angle: f64) -> Value {
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    json!({ "type": "directional", "direction": direction.map(|x| x / length), "irradiance": [3, 3, 2], "angle": angle })
}

fn sky() -> Value {
    json!({ "type": "environment", "radiance": [0.4, 0.5, 0.6] })
}

fn point(position: [f64; 3], intensity: f64) -> Value {
    json!({ "type": "point", "position": position, "intensity": intensity })
}

fn sphere(position: [f64; 3], radius: f64) -> Value {
    json!({ "type": "sphere", "position": position, "radius": radius, "radiance": 9 })
}

#[test]
fn every_kind_of_light() {
    let mut cases = Cases::new();
    put_map(&cases.folder, [0.6, 0.3]);
    let lights = [
        ("sun", vec![sun([-1.0, -1.2, -0.8], 0.0)]),
        ("wide sun", vec![sun([-1.0, -1.2, -0.8], 40.0)]),
        ("sun along an axis", vec![sun([0.0, -1.0, 0.0], 0.0)]),
        ("sun along a diagonal", vec![sun([-1.0, -1.0, -1.0], 0.0)]),
        ("sun from behind", vec![sun([1.0, 0.3, 0.9], 0.0)]),
        ("sky", vec![sky()]),
        ("map", vec![json!({ "type": "environment", "map": "map.exr" })]),
        ("point", vec![point([50.0, 45.0, 40.0], 3000.0)]),
        ("point at a face", vec![point([24.0, 32.0, 24.0], 300.0)]),
        (
            "rect",
            vec![
                json!({ "type": "rect", "position": [45, 50, 30], "target": MIDDLE, "size": [20, 12], "radiance": 5 }),
            ],
        ),
        (
            "disk",
            vec![
                json!({ "type": "disk", "position": [20, 55, 40], "target": MIDDLE, "radius": 9, "radiance": 5 }),
            ],
        ),
        ("sphere", vec![sphere([48.0, 40.0, 40.0], 6.0)]),
        (
            "several",
            vec![
                point([50.0, 45.0, 40.0], 2000.0),
                sun([-1.0, -1.2, 0.8], 0.0),
                sky(),
                sphere([-20.0, 40.0, 40.0], 6.0),
            ],
        ),
    ];
    for (kind, is_soft) in KINDS {
        let file = Data::new(EDGE, balls(is_soft)).nrrd("uchar");
        for (name, lights) in &lights {
            let limit = match (*name, is_soft) {
                (_, true) => SMOOTH,
                // Only what has passed through much matter is seen.
                ("sun from behind", false) => 0.08,
                (_, false) => STEEP,
            };
            cases.compare(&format!("{kind}, {name}"), &file, &look(is_soft, lights), limit);
        }
    }
    cases.assert_alike();
}

/// A shell of matter, thin enough to see light inside.
fn shell([x, y, z]: [f64; 3]) -> f64 {
    let r = (x * x + y * y + z * z).sqrt();
    200.0 * (1.0 - (r - 0.65).abs() / 0.2).max(0.0)
}

#[test]
fn lights_in_a_hole_of_the_matter() {
    let mut cases = Cases::new();
    let file = Data::new(EDGE, shell).nrrd("short");
    let at = [14.0, 16.5, 15.2];
    for (name, light) in [
        ("point", point(at, 300.0)),
        ("point on a texel", point(MIDDLE, 300.0)),
        ("sphere", sphere(at, 2.0)),
        ("point in matter", point([24.0, 16.5, 15.2], 300.0)),
    ] {
        cases.compare(
            &format!("{name} in a shell"),
            &file,
            &look(true, std::slice::from_ref(&light)),
            SMOOTH,
        );
        let open = json!({ "clip": [{ "type": "plane", "point": MIDDLE, "normal": [1, 0.4, 1] }] });
        cases.compare(
            &format!("{name} in half a shell"),
            &file,
            &apply(&look(true, &[light]), &open),
            SMOOTH,
        );
    }
    cases.assert_alike();
}

#[test]
fn light_that_falls_on_a_cut() {
    let mut cases = Cases::new();
    let clips = [
        ("plane", json!([{ "type": "plane", "point": MIDDLE, "normal": [1, 0.5, 0.8] }])),
        ("plane along an axis", json!([{ "type": "plane", "point": [17.3, 0, 0], "normal": [1, 0, 0] }])),
        ("box", json!([{ "type": "box", "min": [5.2, 3.3, 4.7], "max": [20.1, 17.6, 18.9] }])),
        (
            "two planes",
            json!([
                { "type": "plane", "point": MIDDLE, "normal": [1, 0, 0.2] },
                { "type": "plane", "point": MIDDLE, "normal": [0, 1, 0.1] },
            ]),
        ),
    ];
    for (kind, is_soft) in KINDS {
        let file = Data::new(EDGE, balls(is_soft)).nrrd("uchar");
        for (name, clip) in &clips {
            for (light, lights) in [
                ("sun", vec![sun([-1.0, -0.8, -0.7], 0.0)]),
                ("sky", vec![sky()]),
                ("point", vec![point([50.0, 40.0, 45.0], 3000.0)]),
            ] {
                let patch = apply(&look(is_soft, &lights), &json!({ "clip": clip }));
                // Just below a cut, light that grazes it falls off within less than a texel.
                let limit = match (light, is_soft) {
                    ("sky", true) => 0.015,
                    ("sky", false) => 0.05,
                    (_, true) => SMOOTH,
                    (_, false) => STEEP,
                };
                cases.compare(&format!("{kind}, {name}, {light}"), &file, &patch, limit);
            }
        }
    }
    cases.assert_alike();
}

/// Voxels that are no cubes, and axes that are turned, flipped and exchanged.
#[test]
fn grids_of_any_shape() {
    let mut cases = Cases::new();
    let (sin, cos) = 0.5_f64.sin_cos();
    let shapes = [
        ("slices", [32, 32, 12], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]),
        ("turned", [32; 3], [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]),
        ("flipped", [32; 3], [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        ("exchanged", [24, 40, 16], [[0.0, 0.0, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        ("sheared", [32; 3], [[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.0, 0.4, 1.0]]),
    ];
    for (kind, is_soft) in KINDS {
        for (name, dims, axes) in shapes {
            let data = Data::of_dims(dims, balls(is_soft));
            let middle: [f64; 3] =
                std::array::from_fn(|i| (0..3).map(|a| 0.5 * (f64::from(dims[a]) - 1.0) * axes[a][i]).sum());
            let beside = [middle[0] + 35.0, middle[1] + 30.0, middle[2] + 25.0];
            for (light, lights) in [
                ("sun and sky", vec![sun([-1.0, -1.2, -0.8], 0.0), sky()]),
                ("point", vec![point(beside, 3000.0)]),
            ] {
                let cut = json!({ "clip": [{ "type": "plane", "point": middle, "normal": [0.3, 0, 1] }] });
                let patch = look(is_soft, &lights);
                let file = data.nrrd_along("uchar", axes);
                // Where a voxel is longer, more light is lost from texel to texel.
                let limits = match (name, is_soft) {
                    ("slices" | "exchanged", true) => [SMOOTH, 0.025],
                    (_, true) => [SMOOTH, 0.015],
                    ("slices" | "exchanged", false) => [0.025, 0.08],
                    (_, false) => [0.02, 0.03],
                };
                cases.compare(&format!("{kind}, {name}, {light}"), &file, &patch, limits[0]);
                cases.compare(
                    &format!("{kind}, {name}, {light}, cut"),
                    &file,
                    &apply(&patch, &cut),
                    limits[1],
                );
            }
        }
    }
    cases.assert_alike();
}

#[test]
fn every_way_to_scatter() {
    let mut cases = Cases::new();
    let glossy = json!({ "type": "ashikhmin-shirley" });
    let lights = [sun([-1.0, -1.2, -0.8], 10.0), sky(), point([50.0, 45.0, 40.0], 2000.0)];
    for (kind, is_soft) in KINDS {
        let file = Data::new(EDGE, balls(is_soft)).nrrd("uchar");
        for (name, patch) in [
            ("nearest", json!({ "volume": { "interpolation": "nearest" } })),
            ("forwards", json!({ "medium": { "phase": { "type": "henyey-greenstein", "g": 0.5 } } })),
            ("backwards", json!({ "medium": { "phase": { "type": "schlick", "k": -0.5 } } })),
            ("glossy", json!({ "medium": { "brdf": glossy, "gradient_factor": 100 } })),
            ("matt", json!({ "medium": { "gradient_factor": 1000 } })),
            ("thin", json!({ "medium": { "density": 0.05 } })),
            ("dense", json!({ "medium": { "density": 2 } })),
        ] {
            let limit = match (name, is_soft) {
                (_, true) => SMOOTH,
                // Nearly two thirds of the light are lost within two texels.
                ("dense", false) => 0.12,
                (_, false) => STEEP,
            };
            cases.compare(&format!("{kind}, {name}"), &file, &apply(&look(is_soft, &lights), &patch), limit);
        }
    }
    cases.assert_alike();
}

#[test]
fn few_voxels() {
    let mut cases = Cases::new();
    for dims in [[32, 32, 1], [1, 32, 32], [32, 1, 32], [32, 2, 1], [1, 1, 1], [2, 2, 2], [3, 1, 5]] {
        let file = Data::of_dims(dims, |[x, y, z]| 100.0 + 50.0 * x + 30.0 * y + 20.0 * z).nrrd("uchar");
        let middle = dims.map(|n| 0.5 * (f64::from(n) - 1.0));
        let beside = [middle[0] + 30.0, middle[1] + 25.0, middle[2] + 40.0];
        for (name, lights) in [
            ("sun", vec![sun([-1.0, -1.2, -0.8], 0.0)]),
            ("sky", vec![sky()]),
            ("point", vec![point(beside, 3000.0)]),
        ] {
            // Between the faces are few texels.
            cases.compare(&format!("{dims:?}, {name}"), &file, &look(true, &lights), 0.05);
        }
    }
    cases.assert_alike();
}

/// Light of a picture by the program, its message, and its memory in bytes.
fn run_for_light(folder: &Folder, patch: &Value) -> (f64, String, u64) {
    let scene = apply(&json!({ "volume": { "path": "a.nrrd" } }), &with_raymarch(patch));
    folder.put("scene.json", scene.to_string());
    let Ended { status, stderr, memory, .. } =
        folder.run(&["render", "../scene.json", "--stats", "stats.json", "--threads", "2"]);
    assert_eq!(status, Some(0), "{stderr}");
    let light = parse(&written(folder, "stats.json"))["mean_radiance"][1].as_f64().expect("a number");
    (light, stderr, memory)
}

fn with_light_samples(patch: &Value, count: u32) -> Value {
    apply(patch, &json!({ "render": { "samples": 1, "raymarch": { "light_samples": count } } }))
}

/// Where light points leave room for a coarse grid only, a note says so; the picture is still close.
#[test]
fn so_many_light_points_that_the_grid_is_coarse() {
    let folder = Folder::new();
    let balls = balls(true);
    folder.put("a.nrrd", Data::new(48, |p| 1.0 + balls(p)).nrrd("uchar"));
    let less = json!({ "film": { "size": [24, 24], "background": 0 }, "medium": { "density": 0.3 } });
    let patch = apply(&look(true, &[sky()]), &less);
    let (fine, stderr, _) = run_for_light(&folder, &with_light_samples(&patch, 64));
    assert_eq!(stderr, "");
    let (coarse, stderr, memory) = run_for_light(&folder, &with_light_samples(&patch, 4096));
    assert!(stderr.contains("wider than a voxel") && stderr.contains("light_samples"), "{stderr}");
    assert!(memory < 700 << 20, "{} MiB", memory >> 20);
    assert!((coarse / fine - 1.0).abs() < SMOOTH, "{coarse} for {fine}");
}

/// Where light points leave no room for any grid, every shadow ray is marched, and a note says so.
#[test]
fn so_many_light_points_that_there_is_no_grid() {
    let folder = Folder::new();
    folder.put("a.nrrd", Data::new(24, balls(true)).nrrd("uchar"));
    let less = json!({ "film": { "size": [4, 4], "background": 0 }, "medium": { "density": 0.5 } });
    let lamp = point([50.0, 45.0, 40.0], 3000.0);
    // Turned away from the volume, they cost little.
    let away = json!({ "type": "rect", "position": [60, 0, 0], "target": [90, 0, 0], "size": [9, 9], "radiance": 5 });
    let lights = [vec![lamp.clone()], vec![away; 257]].concat();
    let exact = json!({ "render": { "raymarch": { "shadows": "exact" } } });
    let alone = with_light_samples(&apply(&apply(&look(true, &[lamp]), &less), &exact), 4096);
    let (expected, stderr, _) = run_for_light(&folder, &alone);
    assert_eq!(stderr, "");
    let all = with_light_samples(&apply(&look(true, &lights), &less), 4096);
    let (light, stderr, memory) = run_for_light(&folder, &all);
    assert!(stderr.contains("marches every shadow ray") && stderr.contains("light_samples"), "{stderr}");
    assert!(memory < 256 << 20, "{} MiB", memory >> 20);
    assert_eq!(light.to_bits(), expected.to_bits(), "{light} for {expected}");
}
