//! Environment maps: what valid files mean, and which errors broken ones give.

use std::fs;
use std::path::Path;

use common::{folder, for_damaged_copies, rewrite};
use exr::prelude::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Vec2, WritableImage, f16};
use tyndall::math::Rgb;
use tyndall_formats::image::{ImageError, read_map};

mod common;

/// A 2 x 2 file whose channels hold the given values, row by row.
fn write_exr(path: &Path, channels: &[(&str, [f32; 4])]) {
    write_exr_in(path, Encoding::SMALL_LOSSLESS, channels);
}

fn write_exr_in(path: &Path, encoding: Encoding, channels: &[(&str, [f32; 4])]) {
    let half = |values: [f32; 4]| FlatSamples::F16(values.into_iter().map(f16::from_f32).collect());
    let list = channels.iter().map(|(name, values)| AnyChannel::new(*name, half(*values)));
    let image = Image::from_encoded_channels((2, 2), encoding, AnyChannels::sort(list.collect()));
    image.write().to_file(path).expect("a new map");
}

fn write_hdr(path: &Path, header: &str, pixels: &[u8]) {
    fs::write(path, [header.as_bytes(), pixels].concat()).expect("a new map");
}

const HEADER: &str = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n";

#[test]
fn exr_maps_keep_their_rows_and_their_first_layer() {
    let path = folder("map_exr").join("a.EXR");
    let [r, g, b] = [[0.0, 1.0, 2.0, 3.0], [0.5, 0.25, 0.0, 8.0], [16.0, 0.0, 1.0, 0.125]];
    let expected: Vec<_> = (0..4).map(|i| Rgb::new(r[i], g[i], b[i])).collect();
    write_exr(&path, &[("R", r), ("G", g), ("B", b), ("A", [0.5; 4]), ("a.R", b), ("a.G", b), ("a.B", b)]);
    let map = read_map(&path).unwrap();
    assert_eq!((map.width, map.height, &map.pixels), (2, 2, &expected));
    write_exr(&path, &[("sun.R", r), ("sun.G", g), ("sun.B", b), ("Z", [1.0; 4])]);
    assert_eq!(read_map(&path).unwrap().pixels, expected);
    write_exr(&path, &[("Y", r), ("Z", g)]);
    let message = read_map(&path).unwrap_err().to_string();
    assert!(message.contains("Y, Z") && message.contains("expected R, G and B"), "{message}");
}

#[test]
fn a_texel_that_is_not_a_radiance_is_named() {
    let path = folder("map_texel").join("a.exr");
    for (value, shown) in [(-1.0, "-1.0"), (f32::NAN, "NaN"), (f32::INFINITY, "inf")] {
        write_exr(&path, &[("R", [0.0; 4]), ("G", [0.0, 0.0, value, 0.0]), ("B", [0.0; 4])]);
        let error = read_map(&path).unwrap_err();
        assert!(matches!(error, ImageError::Texel { x: 0, y: 1, .. }), "{error}");
        assert!(error.to_string().contains(&format!("texel (0, 1) is [0.0, {shown}, 0.0]")), "{error}");
    }
}

#[test]
fn radiance_pixels_share_an_exponent() {
    let path = folder("map_plain").join("a.hdr");
    let pixels = [128, 64, 0, 129, 1, 2, 3, 136, 255, 255, 255, 0, 0, 0, 1, 128];
    let file = |orientation: &str, keys: &str| {
        write_hdr(&path, &format!("#?RGBE\n{keys}FORMAT=32-bit_rle_rgbe\n\n{orientation}\n"), &pixels);
        read_map(&path).unwrap().pixels
    };
    let [a, b, c, d] =
        [Rgb::new(1.0, 0.5, 0.0), Rgb::new(1.0, 2.0, 3.0), Rgb::BLACK, Rgb::new(0.0, 0.0, 1.0 / 256.0)];
    assert_eq!(file("-Y 2 +X 2", ""), [a, b, c, d]);
    assert_eq!(file("+Y 2 +X 2", ""), [c, d, a, b]);
    assert_eq!(file("-Y 2 -X 2", ""), [b, a, d, c]);
    assert_eq!(file("-Y 2 +X 2", "EXPOSURE=2\nEXPOSURE= 0.25\n")[1], b * 2.0);
    assert_eq!(file("-Y 2 +X 2", "COLORCORR=1 2 4\n")[1], Rgb::new(1.0, 1.0, 0.75));
}

#[test]
fn radiance_runs_are_expanded() {
    let path = folder("map_runs").join("a.hdr");
    // Red: a run of 8; green: 3 values and a run of 5; blue: a run of 8 zeros; exponents: value by value.
    let by_channel = [
        &[2, 2, 0, 8, 136, 1][..],
        &[3, 7, 8, 9, 133, 4],
        &[136, 0],
        &[8, 136, 136, 136, 136, 136, 136, 136, 136],
    ]
    .concat();
    write_hdr(&path, &format!("{HEADER}-Y 1 +X 8\n"), &by_channel);
    let greens = [7.0, 8.0, 9.0, 4.0, 4.0, 4.0, 4.0, 4.0];
    assert_eq!(read_map(&path).unwrap().pixels, greens.map(|g| Rgb::new(1.0, g, 0.0)));

    // The older coding: one pixel, repeated 2 times and then 1 x 256 times; then another pixel.
    let old = [5, 0, 0, 136, 1, 1, 1, 2, 1, 1, 1, 1, 9, 9, 9, 136];
    write_hdr(&path, &format!("{HEADER}-Y 1 +X 260\n"), &old);
    let pixels = read_map(&path).unwrap().pixels;
    assert_eq!(pixels[..259], vec![Rgb::new(5.0, 0.0, 0.0); 259]);
    assert_eq!(pixels[259], Rgb::splat(9.0));
}

#[test]
fn errors_of_broken_radiance_files_say_where() {
    let path = folder("map_broken").join("a.hdr");
    let long = HEADER.replace("\n\n", &format!("\n{}\n\n", "x".repeat(2 << 20)));
    for (header, pixels, part) in [
        ("GIF89a\n", &[][..], "#?"),
        ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", &[0; 4], "32-bit_rle_xyze"),
        ("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n", &[0; 4], "exposure"),
        ("#?RADIANCE\nEXPOSURE=x\n\n-Y 1 +X 1\n", &[0; 4], "exposure `x x x`"),
        (&format!("{HEADER}+X 1 -Y 1\n"), &[0; 4], "orientation `+X 1 -Y 1`"),
        (&format!("{HEADER}-Y 0 +X 1\n"), &[0; 4], "at least one"),
        (&format!("{HEADER}-Y 4000000000 +X 4000000000\n"), &[0; 4], "at most"),
        (&format!("{HEADER}-Y 16000 +X 16000\n"), &[0; 4], "for 16000 x 16000 pixels"),
        (&format!("{HEADER}-Y 2 +X 1\n"), &[0; 6], "line 1 of 2"),
        (&format!("{HEADER}-Y 1 +X 8\n"), &[2, 2, 0, 9], "length of 9"),
        (&format!("{HEADER}-Y 1 +X 8\n"), &[2, 2, 0, 8, 137, 1], "run of 9"),
        (&format!("{HEADER}-Y 1 +X 8\n"), &[2, 2, 0, 8, 0, 0], "run of 0"),
        (&format!("{HEADER}-Y 1 +X 2\n"), &[1, 1, 1, 2], "after 0 pixels"),
        (&format!("{HEADER}-Y 1 +X 2\n"), &[5, 1, 1, 2, 1, 1, 1, 2], "run of 2 after 1"),
        (&HEADER[..20], &[], "ends inside its header"),
        (&long, &[0; 4], "ends inside its header"),
    ] {
        write_hdr(&path, header, pixels);
        let message = read_map(&path).unwrap_err().to_string();
        assert!(message.contains("a.hdr") && message.contains(part), "{message}, expected {part}");
    }
    write_hdr(&path, "#?RADIANCE\nEXPOSURE=1e-40\n\n-Y 1 +X 1\n", &[9, 9, 9, 250]);
    assert!(matches!(read_map(&path), Err(ImageError::Texel { x: 0, y: 0, .. })));

    let pixels =
        [[2, 2, 0, 8, 136, 1, 136, 2, 136, 3, 136, 128], [2, 2, 0, 8, 136, 1, 136, 2, 136, 3, 136, 128]];
    let whole = [format!("{HEADER}-Y 2 +X 8\n").as_bytes(), pixels.as_flattened()].concat();
    for length in 0..whole.len() {
        rewrite(&path, &whole[..length]);
        assert!(read_map(&path).is_err(), "cut at {length}");
    }
    fs::write(&path, &whole).unwrap();
    read_map(&path).unwrap();
    for_damaged_copies(&whole, &path, |path| drop(read_map(path)));
}

#[test]
fn broken_exr_maps_are_errors() {
    let folder = folder("map_broken_exr");
    let [whole, path] = [folder.join("whole.exr"), folder.join("cut.exr")];
    write_exr(&whole, &[("R", [1.0; 4]), ("G", [1.0; 4]), ("B", [1.0; 4])]);
    let bytes = fs::read(&whole).unwrap();
    for length in 0..bytes.len() {
        rewrite(&path, &bytes[..length]);
        let error = read_map(&path).unwrap_err();
        assert!(error.to_string().contains("cut.exr"), "{error}");
    }
    for_damaged_copies(&bytes, &path, |path| drop(read_map(path)));
}

/// No memory of the stated size may be allocated for these few bytes, whether in a few large blocks or many small ones.
#[test]
fn an_exr_header_cannot_promise_more_than_the_file_holds() {
    let path = folder("map_huge").join("a.exr");
    let scan_lines = Encoding { blocks: Blocks::ScanLines, ..Encoding::SMALL_LOSSLESS };
    let tiles = Encoding { blocks: Blocks::Tiles(Vec2(64, 64)), ..Encoding::SMALL_LOSSLESS };
    for encoding in [scan_lines, tiles] {
        write_exr_in(&path, encoding, &[("R", [1.0; 4]), ("G", [1.0; 4]), ("B", [1.0; 4])]);
        let bytes = fs::read(&path).unwrap();
        let with_width = |width: i32| {
            let mut bytes = bytes.clone();
            for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
                let name = bytes.windows(window.len()).position(|found| found == window.as_bytes()).unwrap();
                // After the attribute's size: x and y of the first corner, x and y of the last.
                let last_x = name + window.len() + 4 + 8;
                bytes[last_x..last_x + 4].copy_from_slice(&(width - 1).to_le_bytes());
            }
            rewrite(&path, &bytes);
            read_map(&path)
        };
        assert!(with_width(2).is_ok());
        assert!(matches!(with_width(1 << 28), Err(ImageError::TooLarge { width: 0x1000_0000, .. })));
        let message = with_width(1 << 27).unwrap_err().to_string();
        assert!(message.contains("for 134217728 x 2 pixels"), "{message}");
    }
}

#[test]
fn other_kinds_and_places_are_refused() {
    let folder = folder("map_kinds");
    let message = read_map(&folder.join("a.png")).unwrap_err().to_string();
    assert!(message.contains(".exr or .hdr"), "{message}");
    fs::create_dir(folder.join("a.hdr")).unwrap();
    assert!(read_map(&folder.join("a.hdr")).unwrap_err().to_string().contains("name a file inside it"));
    assert!(matches!(read_map(&folder.join("b.exr")), Err(ImageError::Unreadable { .. })));
}

/// A file of 60 KiB whose header states tiles of 64 x 16777280 once took 2 GiB.
#[test]
fn tiles_larger_than_the_picture_are_refused() {
    let path = folder("map_tiles").join("a.exr");
    write_exr_in(&path, Encoding::FAST_LOSSLESS, &[("R", [1.0; 4]), ("G", [1.0; 4]), ("B", [1.0; 4])]);
    let mut bytes = fs::read(&path).unwrap();
    let name = b"tiledesc\0\x09\0\0\0";
    let place = bytes.windows(name.len()).position(|part| part == name).expect("tiles") + name.len();
    assert!(read_map(&path).is_ok());
    bytes[place + 7] = 1;
    rewrite(&path, &bytes);
    let message = read_map(&path).unwrap_err().to_string();
    assert!(message.contains("tiles of 64 x 16777280 for 2 x 2 pixels"), "{message}");
}
