//! Damaged files of every kind give an error or a volume: no panic, no endless loop, no more memory than
//! the file justifies. The damage is the same in every run.

use compressed::{bzip2, gzip, zlib};
use std::path::Path;
use tyndall_formats::volume::{Endian, RawLayout, SampleType, read, read_raw};
use tyndall_testing::within_limits;

#[path = "valid/compressed.rs"]
mod compressed;

/// 4 x 3 x 2 samples of two bytes.
fn samples() -> Vec<u8> {
    (0..48).map(|v| v * 5).collect()
}

fn nifti(version: usize) -> Vec<u8> {
    let (size, behind) = if version == 1 { (348_i32, 352) } else { (540_i32, 544) };
    let mut bytes = vec![0; behind];
    bytes[..4].copy_from_slice(&size.to_le_bytes());
    for (i, n) in [3_u8, 4, 3, 2].into_iter().enumerate() {
        bytes[if version == 1 { 40 + 2 * i } else { 16 + 8 * i }] = n;
    }
    if version == 1 {
        bytes[70] = 4;
        bytes[108..112].copy_from_slice(&352_f32.to_le_bytes());
        bytes[252] = 1;
        bytes[344..347].copy_from_slice(b"n+1");
    } else {
        bytes[12] = 4;
        bytes[168..170].copy_from_slice(&544_u16.to_le_bytes());
        bytes[344] = 1;
        bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    }
    [bytes, samples()].concat()
}

/// A small valid file of every kind.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let nrrd = |encoding: &str, data: &[u8]| {
        let head = format!(
            "NRRD0005\ntype: int16\ndimension: 3\nspace: RAS\nsizes: 4 3 2\nkinds: domain domain domain\n\
             space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (1,2,3)\nendian: big\nencoding: {encoding}\n\n"
        );
        [head.as_bytes(), data].concat()
    };
    let meta = |more: &str, data: &[u8]| {
        let head = format!(
            "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n\
             TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = 1 2 3\n{more}ElementDataFile = LOCAL\n"
        );
        [head.as_bytes(), data].concat()
    };
    let words = "7 ".repeat(24);
    let python = "{'descr': '<i2', 'fortran_order': True, 'shape': (2, 3, 4), }       \n";
    let length = u16::try_from(python.len()).expect("a short header").to_le_bytes();
    vec![
        ("raw.nrrd", nrrd("raw", &samples())),
        ("gzip.nrrd", nrrd("gzip", &gzip(&samples()))),
        ("bzip2.nrrd", nrrd("bzip2", &bzip2(&samples()))),
        ("ascii.nrrd", nrrd("ascii", words.as_bytes())),
        ("one.nii", nifti(1)),
        ("two.nii", nifti(2)),
        ("one.nii.gz", gzip(&nifti(1))),
        ("raw.mha", meta("", &samples())),
        ("zlib.mha", meta("CompressedData = True\n", &zlib(&samples()))),
        ("ascii.mha", meta("BinaryData = False\n", words.as_bytes())),
        ("fortran.npy", [b"\x93NUMPY\x01\x00", &length[..], python.as_bytes(), &samples()].concat()),
    ]
}

fn try_reading(path: &Path, bytes: &[u8]) -> bool {
    std::fs::write(path, bytes).expect("a writable folder");
    read(path).is_ok()
}

#[test]
fn every_file_is_valid_before_it_is_damaged() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        std::fs::write(folder.path().join(name), &bytes).unwrap();
        let loaded = read(&folder.path().join(name)).unwrap();
        assert_eq!(loaded.volume.grid().dims(), [4, 3, 2], "{name}");
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        let path = folder.path().join(name);
        for length in 0..bytes.len() {
            let read = try_reading(&path, &bytes[..length]);
            // The space after the last word may be missing.
            let complete = name.starts_with("ascii") && length + 1 >= bytes.len();
            assert!(!read || complete, "{name} cut to {length} of {} bytes was read", bytes.len());
        }
    }
}

#[test]
fn changed_bytes_give_an_error_or_a_volume() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        let path = folder.path().join(name);
        let mut refused = 0;
        for at in 0..bytes.len() {
            let values = [0, b'9', bytes[at] ^ 0x80, 0xff, b'-', bytes[at].wrapping_add(1)];
            let mut damaged = bytes.clone();
            damaged[at] = values[at % values.len()];
            refused += usize::from(!try_reading(&path, &damaged));
        }
        assert!(refused > 0, "no damage to {name} was ever noticed");
    }
}

#[test]
fn scrambled_files_give_an_error_or_a_volume() {
    let folder = tempfile::tempdir().unwrap();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        usize::try_from(state >> 33).unwrap() % below
    };
    for (name, bytes) in files() {
        let path = folder.path().join(name);
        for _ in 0..200 {
            let mut damaged = bytes.clone();
            for _ in 0..=random(6) {
                let at = random(damaged.len());
                match random(3) {
                    0 => damaged[at] = u8::try_from(random(256)).unwrap(),
                    1 => drop(damaged.remove(at)),
                    _ => damaged.insert(at, b"0123456789-. \n\0\xff:,=()"[random(21)]),
                }
            }
            try_reading(&path, &damaged);
        }
    }
}

#[test]
fn a_raw_file_is_refused_unless_it_is_long_enough() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.raw");
    let layout = RawLayout {
        dims: [4, 3, 2],
        dtype: SampleType::I16,
        endian: Endian::Big,
        offset: 3,
        spacing: [1.0; 3],
        origin: None,
    };
    for length in 0..60 {
        std::fs::write(&path, vec![1; length]).unwrap();
        assert_eq!(read_raw(&path, &layout).is_ok(), length >= 51, "{length} bytes");
    }
}

/// An NRRD file with the given encoding, sizes and encoded samples.
fn packed(encoding: &str, sizes: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {sizes}\nencoding: {encoding}\n\n");
    [head.as_bytes(), data].concat()
}

/// A header that needs only the beginning of a long stream costs only that; one that needs more than the stream can
/// hold is refused before decompression.
#[test]
fn a_compressed_gibibyte_costs_no_more_than_is_read_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nrrd");
    let zeros = vec![0; 1 << 26];
    for (encoding, data) in [("gzip", gzip(&zeros)), ("bzip2", bzip2(&zeros))] {
        let many = data.repeat(16);
        std::fs::write(&path, packed(encoding, "8 1 1", &many)).unwrap();
        assert_eq!(within_limits(|| read(&path)).unwrap().volume.grid().dims(), [8, 1, 1], "{encoding}");
        std::fs::write(&path, packed(encoding, "16777216 16777216 1", &many)).unwrap();
        let error = within_limits(|| read(&path)).unwrap_err().to_string();
        assert!(error.contains("cannot hold") || error.contains("bytes of memory"), "{error}");
    }
    // The header states a gibibyte; the stream holds a sixteenth of it.
    std::fs::write(&path, packed("gzip", "1024 1024 1024", &gzip(&zeros))).unwrap();
    let error = within_limits(|| read(&path)).unwrap_err().to_string();
    assert!(error.contains("cannot hold"), "{error}");
}

#[test]
fn a_header_of_many_lines_is_read_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nrrd");
    let head = format!("NRRD0004\n{}data file: a.raw\n", "a:\n".repeat(300_000));
    std::fs::write(&path, head).unwrap();
    let error = within_limits(|| read(&path)).unwrap_err();
    assert!(error.to_string().contains("sizes") || error.to_string().contains("dimension"), "{error}");
}

#[test]
fn names_of_slices_are_counted_before_they_are_built() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nhdr");
    for range in ["0 16777215 1", "0 -9223372036854775808 -1"] {
        let head = format!(
            "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 1 16777216\nencoding: raw\ndata file: %d.raw {range}\n"
        );
        std::fs::write(&path, head).unwrap();
        let error = within_limits(|| read(&path)).unwrap_err().to_string();
        assert!(error.contains("data file: found `%d.raw 0"), "{error}");
    }
}
