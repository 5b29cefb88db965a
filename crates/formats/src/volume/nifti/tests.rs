use super::super::error::ReadError;
use super::super::tests::folder_with;
use super::super::{Loaded, read};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use tyndall::volume::{Space, ValueMap, Voxels};

/// Writes entries at given positions, in either byte order.
struct Writer {
    bytes: Vec<u8>,
    big: bool,
}

impl Writer {
    fn put<const N: usize>(&mut self, at: usize, little: [u8; N]) -> &mut Self {
        let mut bytes = little;
        if self.big {
            bytes.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&bytes);
        self
    }
    fn i16(&mut self, at: usize, v: i16) -> &mut Self {
        self.put(at, v.to_le_bytes())
    }
    fn f32(&mut self, at: usize, v: f32) -> &mut Self {
        self.put(at, v.to_le_bytes())
    }
}

/// A 2 x 3 x 1 volume of i16 with voxels of 2 x 3 x 4, slope 0.5 and intercept -7.
fn version_1(big: bool, mark: &[u8; 4]) -> Writer {
    let mut w = Writer { bytes: vec![0; 352], big };
    w.put(0, 348_i32.to_le_bytes()).i16(40, 3).i16(42, 2).i16(44, 3).i16(46, 1).i16(70, 4).i16(72, 16);
    w.f32(76, 1.0).f32(80, 2.0).f32(84, 3.0).f32(88, 4.0).f32(112, 0.5).f32(116, -7.0);
    w.f32(108, if mark == b"n+1\0" { 352.0 } else { 0.0 });
    w.bytes[123] = 2;
    w.bytes[344..348].copy_from_slice(mark);
    w
}

fn samples(big: bool) -> Vec<u8> {
    let bytes = |v: &i16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    [1_i16, -2, 300, -400, 5, 6].iter().flat_map(bytes).collect()
}

fn load(writer: &Writer) -> Result<Loaded, ReadError> {
    let (_folder, path) = folder_with("a.nii", &[&writer.bytes[..], &samples(writer.big)].concat());
    read(&path)
}

#[test]
fn both_byte_orders_and_gzip_give_the_same() {
    for big in [false, true] {
        let mut w = version_1(big, b"n+1\0");
        w.i16(254, 1).f32(280, 2.0).f32(300, 3.0).f32(320, 4.0).f32(292, 10.0).f32(308, 20.0).f32(324, 30.0);
        let plain = [&w.bytes[..], &samples(big)].concat();
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&plain).unwrap();
        for (name, bytes) in [("a.nii", plain), ("a.nii.gz", encoder.finish().unwrap())] {
            let (_folder, path) = folder_with(name, &bytes);
            let Loaded { volume, notes, .. } = read(&path).unwrap();
            assert_eq!(volume.voxels(), Voxels::I16(vec![1, -2, 300, -400, 5, 6]));
            assert_eq!(volume.value_map(), ValueMap { slope: 0.5, intercept: -7.0 });
            assert_eq!(volume.grid().spacing(), [2.0, 3.0, 4.0]);
            assert_eq!(volume.grid().origin(), [-10.0, -20.0, 30.0]);
            assert_eq!(volume.grid().direction(), [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
            assert_eq!(volume.grid().space(), Space::Anatomical);
            assert!(notes.is_empty(), "{notes:?}");
        }
    }
}

#[test]
fn version_2_is_read_too() {
    for big in [false, true] {
        let mut w = Writer { bytes: vec![0; 544], big };
        w.put(0, 540_i32.to_le_bytes()).i16(12, 4).put(168, 544_i64.to_le_bytes());
        w.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        for (i, n) in [3_i64, 2, 3, 1].into_iter().enumerate() {
            w.put(16 + 8 * i, n.to_le_bytes());
        }
        for (at, v) in [(176, 2.0), (184, 1.0), (400, 1.5), (440, -2.5), (480, 3.5), (424, 9.0)] {
            w.put(at, f64::to_le_bytes(v));
        }
        w.put(348, 2_i32.to_le_bytes()).put(500, 3_i32.to_le_bytes());
        let Loaded { volume, notes, .. } = load(&w).unwrap();
        assert_eq!(volume.voxel([0, 1, 0]), 601.0);
        let grid = volume.grid();
        for (found, expected) in grid.spacing().into_iter().zip([1.5e-3, 2.5e-3, 3.5e-3]) {
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        }
        assert_eq!(grid.direction(), [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert!((grid.origin()[0] + 9e-3).abs() < 1e-12);
        assert_eq!(notes.len(), 1, "{notes:?}");
    }
}

#[test]
fn without_an_sform_the_quaternion_rotates_and_without_either_the_box_is_centred() {
    // A quarter turn about z: b = c = 0, d = sin 45.
    let mut w = version_1(false, b"n+1\0");
    w.i16(252, 1).f32(264, std::f32::consts::FRAC_1_SQRT_2).f32(268, 5.0).f32(76, -1.0);
    let volume = load(&w).unwrap().volume;
    let expected = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    for (found, expected) in volume.grid().direction().iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 1e-6, "{:?}", volume.grid().direction());
    }
    assert_eq!(volume.grid().origin(), [-5.0, 0.0, 0.0]);
    let Loaded { volume, notes, .. } = load(&version_1(false, b"n+1\0")).unwrap();
    assert_eq!(volume.grid().direction(), [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(volume.grid().origin(), [-1.0, 3.0, 0.0]);
    assert_eq!(notes.len(), 1);
}

/// An sform or qform that places nothing counts as absent, and the note says so.
#[test]
fn an_unusable_sform_gives_way_to_the_qform_and_that_to_voxel_sizes() {
    let turned = |w: &mut Writer| {
        w.i16(252, 1).f32(264, std::f32::consts::FRAC_1_SQRT_2).f32(268, 5.0);
    };
    let mut plain = version_1(false, b"n+1\0");
    turned(&mut plain);
    let by_qform = load(&plain).unwrap().volume;
    let by_size = load(&version_1(false, b"n+1\0")).unwrap().volume;
    let rows = |rows: [[f32; 4]; 3]| rows;
    for (what, sform) in [
        ("zero", rows([[0.0; 4]; 3])),
        ("singular", [[1.0, 2.0, 0.0, 0.0], [2.0, 4.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
        ("NaN", [[f32::NAN, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
        ("an infinite offset", [[1.0, 0.0, 0.0, f32::INFINITY], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
    ] {
        let mut w = version_1(false, b"n+1\0");
        w.i16(254, 2);
        for (row, numbers) in sform.iter().enumerate() {
            for (i, &number) in numbers.iter().enumerate() {
                w.f32(280 + 16 * row + 4 * i, number);
            }
        }
        let check = |w: &Writer, grid: &tyndall::volume::Grid, words: &[&str]| {
            let Loaded { volume, notes, .. } = load(w).unwrap_or_else(|error| panic!("{what}: {error}"));
            assert_eq!(volume.grid(), grid, "{what}");
            let [note] = &notes[..] else { panic!("{what}: {notes:?}") };
            assert!(words.iter().all(|word| note.contains(word)), "{what}: {note}");
        };
        check(&w, by_size.grid(), &["sform (code 2)", "centred"]);
        turned(&mut w);
        check(&w, by_qform.grid(), &["sform (code 2)", "qform was used"]);
        w.f32(268, f32::NAN);
        check(&w, by_size.grid(), &["sform (code 2)", "qform (code 1)", "centred"]);
    }
    plain.f32(256, f32::NAN);
    let Loaded { volume, notes, .. } = load(&plain).unwrap();
    assert!(volume.grid() == by_size.grid() && notes[0].contains("qform (code 1)"), "{notes:?}");
}

#[test]
fn a_pair_is_read_from_either_file() {
    let (folder, header) = folder_with("a.hdr", &version_1(true, b"ni1\0").bytes);
    assert!(matches!(read(&header), Err(ReadError::Header { .. })));
    let image = folder.path().join("a.img");
    std::fs::write(&image, samples(true)).unwrap();
    for path in [&header, &image] {
        assert_eq!(read(path).unwrap().volume.voxels().get(3), -400.0);
    }
    std::fs::write(&image, &samples(true)[..5]).unwrap();
    let message = read(&header).unwrap_err().to_string();
    assert!(["a.hdr", "a.img", "5 bytes", "12"].iter().all(|w| message.contains(w)), "{message}");
}

#[test]
fn a_slope_of_zero_is_ignored_and_only_the_red_of_colours_is_read() {
    let mut w = version_1(false, b"n+1\0");
    w.f32(112, 0.0);
    assert_eq!(load(&w).unwrap().volume.value_map(), ValueMap::IDENTITY);
    w.i16(70, 128).i16(44, 2);
    let loaded = load(&w).unwrap();
    assert_eq!((loaded.channels, loaded.times), (3, 1));
    let bytes = samples(false);
    assert_eq!(loaded.volume.voxels(), Voxels::U8(vec![bytes[0], bytes[3], bytes[6], bytes[9]]));
}

#[test]
fn what_cannot_be_read_is_named() {
    type Spoil = fn(&mut Writer);
    let cases: [(Spoil, &str); 9] = [
        (|w| _ = w.i16(70, 1024), "int64"),
        (|w| _ = w.i16(70, 32), "complex64"),
        (|w| _ = w.i16(70, 77), "datatype"),
        (|w| _ = w.i16(42, 0), "dim"),
        (|w| _ = w.i16(42, -3), "dim"),
        (|w| _ = w.i16(40, 8), "dim"),
        (|w| _ = w.f32(108, f32::NAN), "vox_offset"),
        (|w| _ = w.f32(116, f32::NAN), "scl_inter"),
        (|w| w.bytes[344..348].fill(0), "Analyze"),
    ];
    for (spoil, word) in cases {
        let mut w = version_1(false, b"n+1\0");
        spoil(&mut w);
        let message = load(&w).unwrap_err().to_string();
        assert!(message.contains(word) && message.contains("a.nii"), "{word}: {message}");
    }
}
