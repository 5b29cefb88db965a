//! Pictures written and read back, each kind by an independent reader; errors of broken files and destinations.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use common::{folder, for_damaged_copies, rewrite};
use tyndall::film::tone::{ToneCurve, quantize};
use tyndall::film::{Backdrop, StateLayer, StateValues, Tone};
use tyndall::math::Rgb;
use tyndall_formats::image::{
    ImageError, Metadata, Picture, PictureState, encode_png, read_metadata, read_state, write,
};

mod common;

const DISPLAY: Tone = Tone { curve: ToneCurve::Agx, stops: 0.5, backdrop: None };
const KINDS: [&str; 6] = ["png", "jpg", "JPEG", "tif", "TIFF", "exr"];

/// Every pixel has a different colour, opacity and layer values.
fn picture(transparent: bool) -> Picture {
    let pixels = || (0..12_u8).map(f32::from);
    Picture {
        width: 4,
        height: 3,
        rgba: pixels().map(|i| [0.07 * i, 1.0 / (i + 1.0), 0.2, (i + 1.0) / 12.0]).collect(),
        variance: Some(pixels().map(|i| [1e-9 * i, i / 3.0, f32::MIN_POSITIVE]).collect()),
        depth: Some(pixels().map(|i| if i == 5.0 { f32::INFINITY } else { 100.0 - i / 7.0 }).collect()),
        transparent,
        ..Picture::default()
    }
}

fn metadata(scene: &str) -> Metadata {
    let mut metadata = Metadata::default();
    metadata.insert(Metadata::SCENE, scene);
    metadata.insert(Metadata::VERSION, "0.1.0");
    metadata.insert(Metadata::SEED, "18446744073709551615");
    metadata.insert(Metadata::SAMPLES, "64");
    metadata
}

fn small() -> Metadata {
    metadata(r#"{"volume": {"path": "Kopf \"α\".nrrd"}}"#)
}

fn entries(metadata: &Metadata) -> Vec<(&str, &str)> {
    let mut entries: Vec<_> = metadata.iter().collect();
    entries.sort_unstable();
    entries
}

/// What an 8-bit kind should hold for one pixel.
fn shown([r, g, b, alpha]: [f32; 4], transparent: bool) -> Vec<u8> {
    let share = if transparent { alpha } else { 1.0 };
    let colour = DISPLAY.curve.map(Rgb::new(r, g, b) / share, DISPLAY.stops).to_array();
    let mut bytes = colour.map(quantize).to_vec();
    if transparent {
        bytes.push(quantize(alpha));
    }
    bytes
}

fn expected(picture: &Picture) -> Vec<u8> {
    picture.rgba.iter().flat_map(|&pixel| shown(pixel, picture.transparent)).collect()
}

#[test]
fn exr_holds_every_layer_exactly_in_one_part() {
    let path = folder("exr_layers").join("a.exr");
    let picture = picture(true);
    write(&path, &picture, &DISPLAY, &small()).unwrap();

    let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
    assert_eq!(file.layer_data.len(), 1, "parts");
    let channels = &file.layer_data[0].channel_data.list;
    let names: Vec<_> = channels.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "depth.Z", "variance.B", "variance.G", "variance.R"]);
    let samples = |name: &str| -> Vec<f32> {
        let channel = channels.iter().find(|channel| channel.name.eq(name)).unwrap();
        match &channel.sample_data {
            exr::prelude::FlatSamples::F32(samples) => samples.clone(),
            _ => panic!("{name} is not 32-bit float"),
        }
    };
    for (index, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        assert_eq!(
            samples(name),
            picture.rgba.iter().map(|pixel| pixel[index]).collect::<Vec<_>>(),
            "{name}"
        );
    }
    for (index, name) in ["variance.R", "variance.G", "variance.B"].into_iter().enumerate() {
        let variance = picture.variance.as_ref().unwrap();
        assert_eq!(samples(name), variance.iter().map(|pixel| pixel[index]).collect::<Vec<_>>(), "{name}");
    }
    assert_eq!(Some(samples("depth.Z")), picture.depth);
}

#[test]
fn missing_layers_are_not_written() {
    let path = folder("exr_bare").join("a.exr");
    write(&path, &Picture { variance: None, depth: None, ..picture(false) }, &DISPLAY, &small()).unwrap();
    let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
    assert_eq!(file.layer_data[0].channel_data.list.len(), 4);
}

#[test]
fn the_same_picture_is_the_same_bytes() {
    let folder = folder("same_bytes");
    for kind in KINDS {
        // Eight files, since a random order of four attributes can repeat by chance.
        let files = (0..8).map(|index| {
            let path = folder.join(format!("{index}.{kind}"));
            write(&path, &picture(true), &DISPLAY, &small()).unwrap();
            fs::read(&path).unwrap()
        });
        let files: Vec<_> = files.collect();
        assert!(files.iter().all(|file| *file == files[0]), "{kind}");
    }
}

#[test]
fn png_shows_the_tone_mapped_picture() {
    for transparent in [false, true] {
        let picture = picture(transparent);
        let bytes = encode_png(&picture, &DISPLAY, &small()).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let about = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((about.width, about.height), (4, 3));
        assert_eq!(pixels, expected(&picture), "transparent {transparent}");
    }
}

#[test]
fn tiff_shows_the_tone_mapped_picture() {
    let folder = folder("tiff_pixels");
    for transparent in [false, true] {
        let path = folder.join(format!("{transparent}.tif"));
        let picture = picture(transparent);
        write(&path, &picture, &DISPLAY, &small()).unwrap();
        let mut decoder = tiff::decoder::Decoder::new(fs::File::open(&path).unwrap()).unwrap();
        assert_eq!(decoder.dimensions().unwrap(), (4, 3));
        let tiff::decoder::DecodingResult::U8(pixels) = decoder.read_image().unwrap() else {
            panic!("not 8 bit");
        };
        assert_eq!(pixels, expected(&picture), "transparent {transparent}");
        let extra = decoder.find_tag_unsigned_vec::<u16>(tiff::tags::Tag::ExtraSamples).unwrap();
        assert_eq!(extra, transparent.then_some(vec![2]), "2 marks straight opacity");
    }
}

#[test]
fn jpeg_shows_a_transparent_picture_over_white() {
    let path = folder("jpeg_pixels").join("a.jpg");
    // One colour per 8 x 8 block, which JPEG keeps nearly exactly.
    let block = |x: usize| if x < 8 { [0.5, 0.1, 0.02, 0.5] } else { [0.02, 0.3, 0.4, 1.0] };
    let rgba: Vec<_> = (0..16 * 8).map(|i| block(i % 16)).collect();
    let picture = Picture { width: 16, height: 8, rgba, transparent: true, ..Picture::default() };
    write(&path, &picture, &DISPLAY, &small()).unwrap();
    let mut decoder = zune_jpeg::JpegDecoder::new(Cursor::new(fs::read(&path).unwrap()));
    let pixels = decoder.decode().unwrap();
    assert_eq!(decoder.dimensions().unwrap(), (16, 8));
    for (index, (pixel, linear)) in pixels.chunks(3).zip(&picture.rgba).enumerate() {
        let paper = 1.0 - linear[3];
        let toned = DISPLAY.curve.map(Rgb::new(linear[0], linear[1], linear[2]), DISPLAY.stops);
        let expected = toned.to_array().map(|light| quantize(paper + light));
        let difference = pixel.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(difference <= 3, "pixel {index}: {pixel:?}, expected {expected:?}");
    }
}

/// The pixels of a picture of 8 bits, three bytes each.
fn opaque_pixels(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).expect("a file");
    match path.extension().and_then(|kind| kind.to_str()).expect("a kind") {
        "png" => {
            let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a PNG");
            let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
            reader.next_frame(&mut pixels).expect("pixels");
            pixels
        }
        "jpg" => zune_jpeg::JpegDecoder::new(Cursor::new(bytes)).decode().expect("a JPEG"),
        _ => match tiff::decoder::Decoder::new(Cursor::new(bytes))
            .expect("a TIFF")
            .read_image()
            .expect("pixels")
        {
            tiff::decoder::DecodingResult::U8(pixels) => pixels,
            _ => panic!("not 8 bit"),
        },
    }
}

/// Paper behind the matter is white in every kind, whatever is done to the light; OpenEXR keeps it linear.
#[test]
fn a_backdrop_is_shown_as_it_is_in_every_kind() {
    let folder = folder("backdrop");
    // One colour per 8 x 8 block, which JPEG keeps nearly exactly: nothing, half covered, covered.
    let blocks = [[1.0, 0.25, 1.0, 0.0], [0.6, 0.225, 0.5, 0.5], [0.3, 0.2, 0.1, 1.0]];
    let rgba: Vec<_> = (0..24 * 8).map(|i| blocks[i % 24 / 8]).collect();
    let picture = Picture { width: 24, height: 8, rgba, ..Picture::default() };
    let backdrop = Some(Backdrop { color: Rgb::new(1.0, 0.25, 1.0), in_radiance: true });
    for curve in [ToneCurve::Agx, ToneCurve::Linear, ToneCurve::Reinhard, ToneCurve::Aces] {
        let tone = Tone { curve, stops: -1.5, backdrop };
        // sRGB(0.25) is 137 of 255; the light of the second block is (0.1, 0.1, 0).
        let toned = |light: [f32; 3]| curve.map(light.into(), -1.5).to_array();
        let of = |toned: [f32; 3], seen: f32| -> [u8; 3] {
            let paper = [1.0, 137.0 / 255.0, 1.0];
            std::array::from_fn(|c| quantize(paper[c] * seen + toned[c]))
        };
        let expected = [of([0.0; 3], 1.0), of(toned([0.1, 0.1, 0.0]), 0.5), of(toned([0.3, 0.2, 0.1]), 0.0)];
        for kind in ["png", "jpg", "tif"] {
            let path = folder.join(format!("a.{kind}"));
            write(&path, &picture, &tone, &small()).unwrap();
            for (index, pixel) in opaque_pixels(&path).chunks(3).enumerate() {
                let expected = expected[index % 24 / 8];
                let difference = pixel.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max().unwrap();
                let loss = if kind == "jpg" { 3 } else { 1 };
                assert!(difference <= loss, "{kind}, {curve:?}, {index}: {pixel:?}, expected {expected:?}");
            }
        }
    }
    let path = folder.join("a.exr");
    write(&path, &picture, &Tone { backdrop, ..Tone::default() }, &small()).unwrap();
    let map = tyndall_formats::image::read_map(&path).unwrap();
    assert_eq!(map.pixels[8].to_array(), [0.6, 0.225, 0.5]);
}

#[test]
fn metadata_come_back_from_every_kind() {
    let folder = folder("metadata");
    let long = format!("{{\"name\": \"{}\"}}", "Schädel 頭蓋骨 💀 \\\"".repeat(10_000));
    assert!(long.len() > 200_000);
    for kind in KINDS {
        for (name, metadata) in [("small", small()), ("long", metadata(&long)), ("none", Metadata::default())]
        {
            let path = folder.join(format!("{name}.{kind}"));
            write(&path, &picture(false), &DISPLAY, &metadata).unwrap();
            let read = read_metadata(&path).unwrap();
            assert_eq!(entries(&read.clone().unwrap_or_default()), entries(&metadata), "{name}.{kind}");
            assert_eq!(read.is_none(), name == "none", "{name}.{kind}");
        }
    }
}

#[test]
fn other_programs_comments_are_no_metadata() {
    let folder = folder("foreign");
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.add_itxt_chunk("Software".to_owned(), "another".to_owned()).unwrap();
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
    fs::write(folder.join("a.png"), &bytes).unwrap();
    assert_eq!(read_metadata(&folder.join("a.png")).unwrap(), None);

    let mut file = Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut file).unwrap();
    let mut image = encoder.new_image::<tiff::encoder::colortype::Gray8>(1, 1).unwrap();
    image.encoder().write_tag(tiff::tags::Tag::ImageDescription, "ImageJ=1.53").unwrap();
    image.write_data(&[0]).unwrap();
    fs::write(folder.join("a.tif"), file.into_inner()).unwrap();
    assert_eq!(read_metadata(&folder.join("a.tif")).unwrap(), None);
}

/// The error message of a failed write; also asserts that nothing was left behind in the folder.
fn refused(path: &Path) -> String {
    let list = |folder: &Path| fs::read_dir(folder).map(Iterator::count).unwrap_or(0);
    let folder = path.parent().expect("a path with a folder");
    let before = list(folder);
    let error = write(path, &picture(false), &DISPLAY, &small()).expect_err("a place that refuses");
    let message = error.to_string();
    assert_eq!(list(folder), before, "left behind: {message}");
    assert!(message.contains(&tyndall::message::path_name(path)), "{message}");
    message
}

#[test]
fn an_unwritable_path_is_named_with_a_fix() {
    let folder = folder("refused");
    assert!(refused(&folder.join("missing/a.png")).contains("create the folder"));
    assert!(refused(&folder.join("a.bmp")).contains(".png, .jpg, .jpeg, .tif, .tiff or .exr"));
    assert!(refused(&folder.join("a")).contains("no extension"));

    fs::create_dir(folder.join("folder.png")).unwrap();
    assert!(refused(&folder.join("folder.png")).contains("add a file name"));
    fs::write(folder.join("file"), "").unwrap();
    assert!(refused(&folder.join("file/a.exr")).contains("is not a folder"));

    // Only the last step, the move to the destination, fails.
    assert!(refused(&folder.join(format!("{}.png", "a".repeat(300)))).contains("shorter name"));

    let protected = folder.join("protected.png");
    fs::write(&protected, "mine").unwrap();
    let mut permissions = fs::metadata(&protected).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&protected, permissions).unwrap();
    assert!(refused(&protected).contains("may write to"));
    assert_eq!(fs::read(&protected).unwrap(), b"mine");
}

/// Nobody can create files in the kernel's own folders, not even root.
#[cfg(target_os = "linux")]
#[test]
fn an_unwritable_folder_is_named_with_a_fix() {
    let message = refused(Path::new("/sys/kernel/a.png"));
    assert!(message.contains("may write to"), "{message}");
}

#[test]
fn an_old_picture_is_replaced_whole() {
    let folder = folder("replaced");
    let path = folder.join("a.png");
    fs::write(&path, vec![7; 100_000]).unwrap();
    write(&path, &picture(false), &DISPLAY, &small()).unwrap();
    assert_eq!(fs::read(&path).unwrap(), encode_png(&picture(false), &DISPLAY, &small()).unwrap());
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn jpeg_names_its_limit() {
    let path = folder("jpeg_limit").join("a.jpg");
    let picture = Picture { width: 65_536, height: 1, rgba: vec![[0.0; 4]; 65_536], ..Picture::default() };
    let error = write(&path, &picture, &DISPLAY, &small()).unwrap_err();
    assert!(matches!(error, ImageError::TooLarge { width: 65_536, .. }), "{error}");
    assert!(error.to_string().contains(".png"), "{error}");
}

#[test]
fn broken_pictures_are_errors_or_yield_what_they_hold() {
    let folder = folder("broken");
    for kind in ["png", "jpg", "tif", "exr"] {
        let whole = folder.join(format!("whole.{kind}"));
        write(&whole, &picture(true), &DISPLAY, &small()).unwrap();
        let bytes = fs::read(&whole).unwrap();
        let path = folder.join(format!("cut.{kind}"));
        let mut refusals = 0;
        for length in 0..bytes.len() {
            rewrite(&path, &bytes[..length]);
            match read_metadata(&path) {
                Err(error) => {
                    refusals += 1;
                    assert!(error.to_string().contains("cut."), "{error}");
                }
                // The metadata may be complete before the cut.
                Ok(read) => assert_eq!(entries(&read.unwrap()), entries(&small()), "{kind} cut at {length}"),
            }
        }
        assert!(refusals > 200, "{kind}: {refusals} refusals");
        // Any result but a panic is accepted.
        for_damaged_copies(&bytes, &path, |path| drop(read_metadata(path)));
    }
}

#[test]
fn a_file_that_is_not_a_picture_is_reported() {
    let folder = folder("none");
    fs::write(folder.join("a.png"), "text").unwrap();
    assert!(matches!(read_metadata(&folder.join("a.png")), Err(ImageError::NotAPicture { .. })));
    assert!(matches!(read_metadata(&folder), Err(ImageError::Unreadable { .. })));
    assert!(matches!(read_metadata(&folder.join("b.png")), Err(ImageError::Unreadable { .. })));
}

#[test]
fn samples_come_back_to_the_bit_from_openexr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let odd =
        [0.0, -0.0, f32::MIN_POSITIVE, 1e-45, f32::INFINITY, f32::NAN, f32::MAX, 0.1, 0.2, 0.3, 0.4, 0.5];
    let bits = (0..12_u32).map(|i| i.wrapping_mul(0x9e37_79b9) | 0x7f80_0001).collect();
    let state = vec![
        StateLayer { name: "samples".to_owned(), values: StateValues::Whole(bits) },
        StateLayer { name: "node.0.R".to_owned(), values: StateValues::Float(odd.to_vec()) },
    ];
    let with_state = Picture { state: state.clone(), ..picture(false) };
    write(&path, &with_state, &DISPLAY, &small()).unwrap();
    let PictureState { size, mut layers } = read_state(&path).unwrap();
    layers.sort_by_key(|layer| layer.name != "samples");
    assert_eq!(size, [4, 3]);
    let bytes = |layer: &StateLayer| match &layer.values {
        StateValues::Float(values) => values.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
        StateValues::Whole(values) => values.clone(),
    };
    assert_eq!(layers.len(), 2);
    for (read, written) in layers.iter().zip(&state) {
        assert_eq!((&read.name, bytes(read)), (&written.name, bytes(written)));
    }
    // A picture without them has none; the other kinds leave them out.
    write(&path, &picture(false), &DISPLAY, &small()).unwrap();
    assert_eq!(read_state(&path).unwrap(), PictureState { size: [4, 3], layers: Vec::new() });
    let png = folder.path().join("a.png");
    write(&png, &with_state, &DISPLAY, &small()).unwrap();
    assert!(matches!(read_state(&png), Err(ImageError::Malformed { .. })));
}
