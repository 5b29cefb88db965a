//! Where the texels of an environment map are in the world, as docs/scene.md says.

use crate::support::{Folder, decode, run, written};
use tyndall::film::Tone;
use tyndall::integrator::METHODS;
use tyndall_formats::image::{Metadata, Picture, write};

/// Texels in a row; half as many rows.
const WIDTH: usize = 16;

/// A map that is black but for two columns and two rows around a place, given in parts of its width and height.
pub fn put_map(folder: &Folder, [x, y]: [f64; 2]) {
    let height = WIDTH / 2;
    let near = |texel: usize, count: usize, place: f64| {
        let apart = ((texel as f64 + 0.5) / count as f64 - place).abs();
        // The left edge is the right one.
        apart.min(if count == WIDTH { 1.0 - apart } else { apart }) * (count as f64) < 1.1
    };
    let texel = |i: usize| {
        // The top row is one point, and so is the bottom row.
        let is_pole = y == 0.0 || y == 1.0;
        if near(i / WIDTH, height, y) && (is_pole || near(i % WIDTH, WIDTH, x)) {
            [9.0, 9.0, 9.0, 1.0]
        } else {
            [0.0; 4]
        }
    };
    let rgba = (0..WIDTH * height).map(texel).collect();
    let [width, height] = [WIDTH, height].map(|n| u32::try_from(n).expect("a small map"));
    let picture = Picture { width, height, rgba, ..Picture::default() };
    write(&folder.at("map.exr"), &picture, &Tone::default(), &Metadata::default()).expect("a map");
}

/// A solid ball of 8 voxels, in an anatomical space or another.
fn put_ball(folder: &Folder, space: &str) {
    let is_inside = |i: usize| {
        let apart: i32 = [i % 8, i / 8 % 8, i / 64]
            .map(|n| (2 * i32::try_from(n).expect("small") - 7).pow(2))
            .iter()
            .sum();
        apart < 45
    };
    let data: Vec<u8> = (0..512).map(|i| u8::from(is_inside(i))).collect();
    let header = format!(
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 8 8 8\n{space}space directions: (1,0,0) (0,1,0) (0,0,1)\n\
         space origin: (-3.5,-3.5,-3.5)\nencoding: raw\n\n"
    );
    folder.put("ball.nrrd", [header.as_bytes(), &data].concat());
}

/// How much brighter the half of the ball is that a direction points to: seen from the side, with the direction upwards.
fn brighter(folder: &Folder, method: &str, toward: [i32; 3], rotation: i32) -> f64 {
    let from = if toward[0] == 0 { [20, 0, 0] } else { [0, 20, 0] };
    folder.put(
        "scene.toml",
        format!(
            "volume.path = 'ball.nrrd'\nmedium.density = 4\nmedium.gradient_factor = 1000\nlights = [{{ type = 'environment', map = 'map.exr', visible = false, rotation = {rotation} }}]\n\
             transfer_function.points = [{{ value = 0.4, opacity = 0 }}, {{ value = 0.6, opacity = 1, surface = 1 }}]\n\
             camera = {{ type = 'orthographic', position = {from:?}, target = [0, 0, 0], up = {toward:?}, height = 8 }}\n\
             film = {{ size = [16, 16], tone = 'linear' }}\n"
        ),
    );
    let few = ["--set", "render.photon.photons=4000", "--samples", "8", "-q", "-o", "a.png"];
    run(folder, &[&["render", "../scene.toml", "--integrator", method], &few[..]].concat());
    let (_, _, pixels) = decode(&written(folder, "a.png"));
    let sum = |half: &[u8]| half.iter().map(|&code| f64::from(code)).sum::<f64>();
    let (top, bottom) = pixels.split_at(pixels.len() / 2);
    assert!(sum(top) + sum(bottom) > 500.0, "{method}, {toward:?}: a black picture");
    (sum(top) + 1.0) / (sum(bottom) + 1.0)
}

#[test]
fn a_bright_place_of_the_map_lights_from_where_the_page_says() {
    // Places of the map, and directions with y up, and in anatomical data, with z up.
    let table: [([f64; 2], [i32; 3], [i32; 3]); 6] = [
        ([0.5, 0.0], [0, 1, 0], [0, 0, 1]),
        ([0.5, 1.0], [0, -1, 0], [0, 0, -1]),
        ([0.5, 0.5], [0, 0, -1], [0, 1, 0]),
        ([0.75, 0.5], [1, 0, 0], [1, 0, 0]),
        ([0.0, 0.5], [0, 0, 1], [0, -1, 0]),
        ([0.25, 0.5], [-1, 0, 0], [-1, 0, 0]),
    ];
    let folder = Folder::new();
    for (space, anatomical) in [("space dimension: 3\n", false), ("space: left-posterior-superior\n", true)] {
        put_ball(&folder, space);
        for method in METHODS {
            for (place, y_up, z_up) in table {
                put_map(&folder, place);
                let toward = if anatomical { z_up } else { y_up };
                let found = brighter(&folder, method.name, toward, 0);
                assert!(found > 2.0, "{}, {place:?} from {toward:?}, {space}: {found}", method.name);
            }
        }
        // Turned by 90 degrees, the middle is where the left quarter was.
        put_map(&folder, [0.5, 0.5]);
        let found = brighter(&folder, METHODS[0].name, [-1, 0, 0], 90);
        assert!(found > 2.0, "turned, {space}: {found}");
    }
}
