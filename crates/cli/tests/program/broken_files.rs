//! Broken volumes and maps in every format give one message that names the file and the fault, promptly and without
//! allocating the memory that the file claims to need.

use crate::fault::{Fault, LONGEST, MOST_MEMORY, SCENE, file};
use crate::support::{Ended, Folder};
use std::io::Write;

/// An NRRD file of a few bytes.
fn nrrd(fields: &str, samples: &[u8]) -> Vec<u8> {
    [format!("NRRD0004\n{fields}\nendian: little\n\n").as_bytes(), samples].concat()
}

#[test]
fn a_broken_volume_is_named() {
    let samples = [7; 8];
    for (fields, says) in [
        ("type: uchar\ndimension: 3\nsizes: 9 9 9\nencoding: raw", "8 bytes of samples, expected 729"),
        ("type: uchar\ndimension: 3\nsizes: 1000000 1000000 1000000\nencoding: raw", "8 bytes of samples"),
        ("type: uchar\ndimension: 3\nsizes: 0 1 2\nencoding: raw", "sizes"),
        ("type: block\ndimension: 3\nsizes: 2 2 2\nencoding: raw", "type"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: gzip", "cut short"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspacings: 0 1 1", "spacing"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspacings: inf 1 1", "spacing"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspacings: 1e308 1 1", "spacing"),
        (
            "type: uchar\ndimension: 3\nspace: LPS\nsizes: 2 2 2\nencoding: raw\nspace directions: (1,0,0) (2,0,0) (0,0,1)",
            "direction",
        ),
        (
            "type: uchar\ndimension: 3\nspace: LPS\nsizes: 2 2 2\nencoding: raw\nspace directions: (1,0,0) (0,nan,0) (0,0,1)",
            "space directions",
        ),
        (
            "type: uchar\ndimension: 3\nspace: LPS\nsizes: 2 2 2\nencoding: raw\nspace origin: (inf,0,0)",
            "space origin",
        ),
        ("type: uchar\ndimension: 3\nsizes: 2 2\nencoding: raw", "sizes"),
        ("type: uchar\ndimension: 3\nsizes: -2 2 2\nencoding: raw", "sizes"),
        ("type: uchar\ndimension: 99999999999\nsizes: 2 2 2\nencoding: raw", "dimension"),
        ("type: uchar\ndimension: 3\nsizes: 18446744073709551615 2 2\nencoding: raw", "16777216"),
        ("type: double\ndimension: 3\nsizes: 16777216 16777216 16777216\nencoding: raw", "overflows"),
        ("type: uchar\ndimension: 3\nsizes: 2000000 2000000 2000000\nencoding: gzip", "cannot hold"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: bzip2", "samples are damaged"),
        ("type: uchar\ndimension: 3\nsizes: 1000000 1000000 1000000\nencoding: ascii", "bytes of memory"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nbyte skip: 9999999999999", "0 bytes"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nline skip: 9999999999999", "0 bytes"),
        (
            "type: uchar\ndimension: 3\nsizes: 1 1 16777216\nencoding: raw\ndata file: %d 1 16777216 1",
            "data file",
        ),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: .", "a folder"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: /dev/zero", "a device"),
        ("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: b.raw", "b.raw"),
    ] {
        file("../a.nrrd", nrrd(fields, &samples), &["a.nrrd", says]);
    }
    let vast = nrrd("type: double\ndimension: 1\nsizes: 1\nencoding: raw", &1e99_f64.to_le_bytes());
    file("../a.nrrd", vast, &["a.nrrd", "rescale"]);
    file("../a.nrrd", "", &["a.nrrd", "empty"]);
    file("../a.nrrd", "NRRD0004\n", &["a.nrrd", "end of the header"]);
    file("../a.nrrd", [b"NRRD0004\n".to_vec(), b"a:\n".repeat(300_000)].concat(), &["a.nrrd", "header"]);
    file("../a.npy", b"\x93NUMPY\x01", &["a.npy", "header"]);
    file("../a.nii.gz", b"\x1f\x8b\x08 and so on", &["a.nii.gz", "sizeof_hdr"]);
    file("../a.mha", "NDims = 3\nDimSize = 2 2\n", &["a.mha", "DimSize"]);
    file("../a.txt", "hello", &["a.txt", "NRRD", "NIfTI", "MetaImage", "NumPy"]);
}

/// A NumPy array of eight bytes.
fn npy(descr: &str, shape: &str) -> Vec<u8> {
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let length = u16::try_from(text.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\0", &length[..], text.as_bytes(), &[7; 8]].concat()
}

#[test]
fn a_broken_array_is_named() {
    for (descr, shape, says) in [
        ("<f4", "(2, 2, 2)", "8 bytes of samples, expected 32"),
        ("|u1", "(1000000, 1000000, 1000000)", "8 bytes of samples"),
        ("<f8", "(4294967296, 4294967296, 4294967296)", "shape"),
        ("|u1", "(0, 2, 2)", "shape"),
        ("|u1", "(-2, 2, 2)", "shape"),
        ("|u1", "(2, 2, 2, 2, 2, 2)", "shape"),
        ("<c16", "(2, 2)", "c16"),
        ("|O", "(2, 2)", "|O"),
    ] {
        file("../a.npy", npy(descr, shape), &["a.npy", says]);
    }
    file("../a.npy", b"\x93NUMPY\x02\0\xff\xff\xff\xff", &["a.npy", "header length"]);
}

/// NIfTI of 2 x 2 x 2 bytes, with changes to its header.
fn nifti(version: u8, changes: &[(usize, &[u8])]) -> Vec<u8> {
    let (size, behind) = if version == 1 { (348_u32, 352) } else { (540, 544) };
    let mut bytes = vec![0; behind];
    bytes[..4].copy_from_slice(&size.to_le_bytes());
    for axis in 0..4 {
        bytes[if version == 1 { 40 + 2 * axis } else { 16 + 8 * axis }] = [3, 2, 2, 2][axis];
        let one = 1.0_f64;
        match version {
            1 => bytes[76 + 4 * axis..80 + 4 * axis].copy_from_slice(&1.0_f32.to_le_bytes()),
            _ => bytes[104 + 8 * axis..112 + 8 * axis].copy_from_slice(&one.to_le_bytes()),
        }
    }
    if version == 1 {
        bytes[70] = 2;
        bytes[344..347].copy_from_slice(b"n+1");
    } else {
        bytes[12] = 2;
        bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    }
    for (at, new) in changes {
        bytes[*at..at + new.len()].copy_from_slice(new);
    }
    [bytes, vec![7; 8]].concat()
}

#[test]
fn a_broken_nifti_is_named() {
    let most = i64::MAX.to_le_bytes();
    let nan = f32::NAN.to_le_bytes();
    type Case<'a> = (u8, &'a [(usize, &'a [u8])], &'static str);
    let changes: [Case; 11] = [
        (1, &[(42, &[255, 127, 255, 127, 255, 127])], "8 bytes of samples, expected 35181150961663"),
        (1, &[(42, &[0, 0])], "dim"),
        (1, &[(42, &[255, 255])], "dim"),
        (1, &[(40, &[9, 0])], "dim"),
        (1, &[(70, &[99, 0])], "datatype"),
        (1, &[(70, &[32, 0])], "complex64"),
        (1, &[(108, &nan)], "vox_offset"),
        (2, &[(24, &most)], "16777216 voxels"),
        (2, &[(24, &most), (32, &most), (40, &most)], "16777216 voxels"),
        (2, &[(24, &(-1_i64).to_le_bytes())], "dim"),
        (2, &[(168, &most)], "0 bytes of samples"),
    ];
    for (version, changes, says) in changes {
        file("../a.nii", nifti(version, changes), &["a.nii", says]);
    }
    file("../a.nii", &nifti(1, &[])[..200], &["a.nii", "header"]);
    file("../a.nii", &nifti(2, &[])[..550], &["a.nii", "6 bytes of samples, expected 8"]);
    file("../a.hdr", nifti(1, &[(344, b"ni1")]), &["a.hdr", "a.img"]);
}

#[test]
fn a_broken_metaimage_is_named() {
    for (fields, says) in [
        ("DimSize = 9 9 9", "8 bytes of samples, expected 729"),
        ("DimSize = 1000000 1000000 1000000", "8 bytes of samples"),
        ("DimSize = 4294967296 4294967296 4294967296", "16777216 voxels"),
        ("DimSize = 2 2 -2", "DimSize"),
        ("DimSize = 2 2 2\nElementSpacing = 0 1 1", "spacing"),
        ("DimSize = 2 2 2\nElementSpacing = 1 -1e400 1", "ElementSpacing"),
        ("DimSize = 2 2 2\nElementSpacing = 1 nan 1", "ElementSpacing"),
        ("DimSize = 2 2 2\nTransformMatrix = 1 0 0 1 0 0 0 0 1", "direction"),
        ("DimSize = 2 2 2\nTransformMatrix = 0 0 0 0 0 0 0 0 0", "spacing"),
        ("DimSize = 2 2 2\nOffset = inf 0 0", "Offset"),
        ("DimSize = 2 2 2\nElementNumberOfChannels = 0", "DimSize"),
        ("DimSize = 2 2 2\nElementNumberOfChannels = 9999999999", "8 bytes"),
        ("DimSize = 2 2 2\nCompressedData = True", "samples"),
        ("DimSize = 2000000 2000000 2000000\nCompressedData = True", "cannot hold"),
        ("DimSize = 2 2 2\nHeaderSize = 99999999999", "0 bytes"),
    ] {
        let text = format!("NDims = 3\n{fields}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n");
        file("../a.mha", [text.as_bytes(), &[7; 8]].concat(), &["a.mha", says]);
    }
}

/// A compressed mebibyte of zeros, repeated `times` times.
fn bomb(packed: &[u8], times: usize) -> Vec<u8> {
    packed.repeat(times)
}

#[test]
fn decompression_bombs_take_no_memory() {
    let zeros = vec![0; 1 << 20];
    let gzip = || {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(&zeros).expect("writing to memory");
        encoder.finish().expect("writing to memory")
    };
    let zlib = || {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(&vec![0; 1 << 26]).expect("writing to memory");
        encoder.finish().expect("writing to memory")
    };
    // The header claims more than the stream can hold: refused before it is decompressed.
    let lies = "type: uchar\ndimension: 3\nsizes: 1000000 1000000 1000000\nencoding: gzip";
    file("../a.nrrd", nrrd(lies, &bomb(&gzip(), 2048)), &["a.nrrd", "cannot hold"]);
    let head = nifti(1, &[(42, &[255, 127, 255, 127, 255, 127])]);
    file("../a.nii.gz", [gzip(), head].concat(), &["a.nii.gz", "sizeof_hdr"]);
    let text = "NDims = 3\nDimSize = 100000 100000 100000\nElementType = MET_UCHAR\nCompressedData = True\n\
                ElementDataFile = LOCAL\n";
    file("../a.mha", [text.as_bytes(), &zlib()].concat(), &["a.mha", "cannot hold"]);

    // The header claims little of a stream of two gibibytes: no more than that is decompressed.
    let folder = Folder::new();
    folder
        .put("a.nrrd", nrrd("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: gzip", &bomb(&gzip(), 2048)));
    let Ended { status, stderr, took, memory, .. } =
        folder.run(&["render", "../a.nrrd", "--size", "4x4", "--samples", "1"]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(took < LONGEST && memory < MOST_MEMORY, "{took:?}, {} MiB", memory >> 20);
}

#[test]
fn a_broken_map_is_named() {
    let scene = format!("{SCENE}lights = [{{ type = 'environment', map = 'a.hdr' }}]\n");
    for (head, says) in [
        ("", "header"),
        ("hello\n", "#?"),
        ("#?RADIANCE\n\n-Y 1000000 +X 1000000\n", "pixels"),
        ("#?RADIANCE\n\n-Y 16384 +X 16384\n", "expected more"),
        ("#?RADIANCE\n\n-Y 0 +X 2\n", "0 pixels"),
        ("#?RADIANCE\n\n-Y -1 +X 2\n", "a.hdr"),
        ("#?RADIANCE\nEXPOSURE=nan\n\n-Y 1 +X 1\n", "exposure"),
        ("#?RADIANCE\nEXPOSURE=1e-30\n\n-Y 1 +X 1\n\u{40}\u{40}\u{40}\u{7f}", "texel (0, 0)"),
        ("#?RADIANCE\n\n-Y 2 +X 2\n", "ends"),
    ] {
        let files = vec![("scene.toml", scene.clone().into_bytes()), ("a.hdr", head.as_bytes().to_vec())];
        let says = vec!["lights.0.map", "a.hdr", says];
        Fault { files, arguments: vec!["render", "../scene.toml"], status: 1, says }.check();
    }
}
