//! Small valid files of every kind that is read, in several variants, and fragments of headers to insert.

mod compressed;

pub use compressed::gzip;
use compressed::{bzip2, zlib};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, WritableImage, f16};
use std::io::Cursor;
use tyndall::film::Tone;
use tyndall::film::{StateLayer, StateValues};
use tyndall_formats::image::{Metadata, Picture, write};

/// A file's name and content.
type File = (&'static str, Vec<u8>);

pub const NRRD_WORDS: &[&str] = &[
    "type: double\n",
    "type: float\n",
    "type: uchar\n",
    "encoding: gzip\n",
    "encoding: bzip2\n",
    "encoding: ascii\n",
    "encoding: hex\n",
    "endian: little\n",
    "dimension: 4\n",
    "dimension: 1\n",
    "sizes: 1 1 24\n",
    "sizes: 4 3 2 1\n",
    "space: LPS\n",
    "space: left-handed\n",
    "space dimension: 2\n",
    "space directions: none (1,0,0) (0,1,0)\n",
    "space directions: (0,0,0) (0,0,0) (0,0,0)\n",
    "space directions: (1e300,0,0) (0,1e-300,0) (0,0,nan)\n",
    "space origin: (nan,0,0)\n",
    "spacings: nan 1 2\n",
    "axis mins: 0 0 0\n",
    "axis maxs: 1e308 0 -1\n",
    "centerings: node cell ???\n",
    "kinds: RGB-color domain time\n",
    "byte skip: -1\n",
    "byte skip: 9999999999999\n",
    "line skip: 1000000000000\n",
    "data file: LIST\n",
    "data file: raw.nrrd\n",
    "data file: a%99999999d 0 9 1\n",
    "data file: a%d 0 9999999999 1\n",
    "key:=value\n",
    "# comment\n",
    "\n",
    "old min: 3\n",
    "block size: 4\n",
];

pub const META_WORDS: &[&str] = &[
    "NDims = 2\n",
    "NDims = 99\n",
    "DimSize = 24 1 1\n",
    "ElementType = MET_DOUBLE\n",
    "ElementType = MET_FLOAT\n",
    "ElementNumberOfChannels = 3\n",
    "ElementNumberOfChannels = 0\n",
    "CompressedData = True\n",
    "BinaryData = False\n",
    "ElementByteOrderMSB = True\n",
    "HeaderSize = -1\n",
    "HeaderSize = 99999999999999999\n",
    "HeaderSize = -2\n",
    "ElementDataFile = LIST\n",
    "ElementDataFile = raw.mha\n",
    "ElementDataFile = a%d 1 99999999999 1\n",
    "ElementDataFile = %9999999999d 0 1 1\n",
    "ElementSpacing = 0 0 0\n",
    "ElementSpacing = -1 nan 1e308\n",
    "TransformMatrix = 0 0 0 0 0 0 0 0 0\n",
    "TransformMatrix = 1e300 1 1 1 1e-300 1 1 1 1\n",
    "Offset = inf 0 0\n",
    "AnatomicalOrientation = RAI\n",
    "AnatomicalOrientation = RRR\n",
    "ElementToIntensityFunctionSlope = 0\n",
    "ElementToIntensityFunctionOffset = 1e308\n",
    "CompressedDataSize = 1\n",
    "\n",
    "=",
    "CenterOfRotation = 0 0 0\n",
];

pub const NUMPY_WORDS: &[&str] = &[
    "'descr': '<f8'",
    "'<f4'",
    "'|u1'",
    "'>i2'",
    "'<f2'",
    "'<c16'",
    "'fortran_order': False",
    "'shape': (1, 1, 24)",
    "()",
    "(0,)",
    "(24,)",
    "(2, 3, 2, 2)",
    "(1, 1, 2, 3, 4)",
    "(1, 1, 1, 1, 1, 1)",
    "'",
    "\"",
    "{",
    "}",
    "True",
    ",",
    "\u{e9}",
];

pub const MAP_WORDS: &[&str] = &[
    "EXPOSURE=0\n",
    "EXPOSURE=-1\n",
    "EXPOSURE=1e-300\n",
    "COLORCORR=0 nan 1\n",
    "FORMAT=32-bit_rle_xyze\n",
    "\n",
    "-Y 2 +X 2\n",
    "+Y 99999 -X 99999\n",
    "-Y 18446744073709551615 +X 1\n",
    "-Y 1 +X 32767\n",
    "\u{2}\u{2}\u{0}\u{8}",
    "channels\0",
    "dataWindow\0",
    "compression\0",
    "tiles\0",
    "lineOrder\0",
    "R\0",
    "type\0",
];

pub const PICTURE_WORDS: &[&str] = &[
    "iTXt",
    "tEXt",
    "zTXt",
    "IHDR",
    "IDAT",
    "tyndall:scene\0",
    "tyndall 1/1\n",
    "tyndall 2/1\n",
    "tyndall 1/99999\n",
    "\u{0}\u{0}\u{0}\u{ff}",
    "{\"tyndall:scene\": \"",
    "\\u0000",
    "\"}",
    "string\0",
    "type\0",
];

/// 4 x 3 x 2 samples of two bytes.
fn samples() -> Vec<u8> {
    (0..48).map(|v| v * 5).collect()
}

/// 24 single-precision samples, two of which are not finite.
fn floats() -> Vec<u8> {
    let value = |i: u8| [f32::NAN, f32::NEG_INFINITY, f32::from(i)][usize::from(i).min(2)];
    (0..24).flat_map(|i| value(i).to_le_bytes()).collect()
}

pub fn nrrd() -> Vec<File> {
    let nrrd = |more: &str, data: &[u8]| {
        let head = format!("NRRD0005\n# made for tests\ndimension: 3\nsizes: 4 3 2\n{more}\n\n");
        [head.as_bytes(), data].concat()
    };
    let placed = "type: int16\nspace: RAS\nkinds: domain domain domain\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n\
                  space origin: (1,2,3)\nendian: big\nencoding: ";
    let channels = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 4 2 2\nkinds: RGB-color domain domain domain\n\
                    spacings: nan 1 2 3\naxis mins: nan 0 0 0\ncenterings: ??? node cell cell\nencoding: raw\n\n";
    vec![
        ("raw.nrrd", nrrd(&format!("{placed}raw"), &samples())),
        ("gzip.nrrd", nrrd(&format!("{placed}gzip"), &gzip(&samples()))),
        ("bzip2.nrrd", nrrd(&format!("{placed}bzip2"), &bzip2(&samples()))),
        ("ascii.nrrd", nrrd(&format!("{placed}ascii"), "7 ".repeat(24).as_bytes())),
        ("float.nrrd", nrrd("type: float\nspacings: 1 2 3\nendian: little\nencoding: raw", &floats())),
        ("skip.nrrd", nrrd("type: int16\nendian: big\nbyte skip: -1\nencoding: raw", &samples())),
        ("channels.nrrd", [channels.as_bytes(), &samples()].concat()),
        ("list.nhdr", nrrd("type: uchar\nendian: big\nencoding: raw\ndata file: LIST\na.raw\nb.raw", &[])),
        ("pattern.nhdr", nrrd("type: uchar\nencoding: raw\ndata file: %d.raw 1 2 1", &[])),
        ("a.raw", samples()),
        ("b.raw", samples()),
        ("1.raw", samples()),
        ("2.raw", samples()),
    ]
}

pub fn nifti() -> Vec<File> {
    let one = nifti_file(1);
    let mut placed = one.clone();
    // Quaternion and matrix rows, with slope, intercept and units.
    placed[252..256].copy_from_slice(&[1, 0, 2, 0]);
    for (at, value) in
        [(76, 1.0_f32), (80, 2.0), (84, 0.5), (88, 3.0), (112, 2.0), (116, -5.0), (256, 0.1), (268, 9.0)]
    {
        placed[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    for row in 0..3 {
        let at = 280 + 16 * row + 4 * row;
        placed[at..at + 4].copy_from_slice(&1.5_f32.to_le_bytes());
    }
    placed[123] = 2;
    let mut pair = placed[..348].to_vec();
    pair[344..348].copy_from_slice(b"ni1\0");
    pair[108..112].copy_from_slice(&0_f32.to_le_bytes());
    vec![
        ("one.nii", one),
        ("placed.nii", placed.clone()),
        ("two.nii", nifti_file(2)),
        ("within.nii.gz", placed.clone()),
        ("whole.nii", gzip(&placed)),
        ("pair.hdr", pair),
        ("pair.img", samples()),
    ]
}

fn nifti_file(version: usize) -> Vec<u8> {
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

pub fn metaimage() -> Vec<File> {
    let meta = |more: &str, data: &[u8]| {
        let head = format!(
            "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n\
             TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\nElementSpacing = 1 2 3\n{more}\n"
        );
        [head.as_bytes(), data].concat()
    };
    let local = "ElementDataFile = LOCAL";
    vec![
        (
            "raw.mha",
            meta(&format!("AnatomicalOrientation = RAI\nElementByteOrderMSB = True\n{local}"), &samples()),
        ),
        ("zlib.mha", meta(&format!("CompressedData = True\n{local}"), &zlib(&samples()))),
        ("ascii.mha", meta(&format!("BinaryData = False\n{local}"), "7 ".repeat(24).as_bytes())),
        (
            "end.mha",
            meta(&format!("HeaderSize = -1\nElementToIntensityFunctionSlope = 2\n{local}"), &samples()),
        ),
        ("list.mhd", meta("ElementDataFile = LIST\na.raw\nb.raw", &[])),
        ("pattern.mhd", meta("ElementNumberOfChannels = 2\nElementDataFile = %d.raw 1 2 1", &[])),
        ("a.raw", samples()),
        ("b.raw", samples()),
        ("1.raw", samples()),
        ("2.raw", samples()),
    ]
}

pub fn numpy() -> Vec<File> {
    let array = |version: u8, descr: &str, order: &str, shape: &str, data: &[u8]| {
        let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}       \n");
        let length = u32::try_from(text.len()).expect("a short header").to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [b"\x93NUMPY", &[version, 0][..], length, text.as_bytes(), data].concat()
    };
    vec![
        ("c.npy", array(1, "<i2", "False", "(2, 3, 4)", &samples())),
        ("fortran.npy", array(2, ">u2", "True", "(2, 3, 4)", &samples())),
        ("half.npy", array(3, "<f2", "True", "(24,)", &samples())),
        ("float.npy", array(1, "<f4", "False", "(1, 1, 3, 8)", &floats())),
        ("channels.npy", array(1, "|i1", "False", "(2, 2, 2, 2, 3)", &samples())),
    ]
}

/// A picture of four pixels in every kind, with long and short metadata texts.
pub fn pictures() -> Vec<File> {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = Picture {
        width: 2,
        height: 2,
        rgba: vec![[0.2, 0.3, 0.4, 1.0]; 4],
        variance: Some(vec![[0.1; 3]; 4]),
        depth: Some(vec![1.0; 4]),
        transparent: true,
        state: vec![
            StateLayer { name: "samples".to_owned(), values: StateValues::Whole(vec![7; 4]) },
            StateLayer { name: "node.0.R".to_owned(), values: StateValues::Float(vec![0.5; 4]) },
        ],
    };
    let mut metadata = Metadata::default();
    metadata.insert(Metadata::SCENE, format!("{{\"volume\": {{\"path\": \"Schädel{}\"}}}}", " ".repeat(300)));
    metadata.insert(Metadata::SEED, "7");
    ["a.png", "a.jpg", "a.tif", "a.exr"]
        .into_iter()
        .map(|name| {
            let path = folder.path().join(name);
            write(&path, &picture, &Tone::default(), &metadata).expect("a picture");
            (name, std::fs::read(path).expect("a picture"))
        })
        .collect()
}

pub fn maps() -> Vec<File> {
    let head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nCOLORCORR=1 1 2\n\n";
    let plain = [128, 64, 0, 129, 1, 2, 3, 136, 255, 255, 255, 0, 1, 1, 1, 1];
    let mut runs = Vec::new();
    for _line in 0..2 {
        runs.extend([2, 2, 0, 8]);
        for channel in 0..4_u8 {
            runs.extend([128 + 5, 100 + channel, 3, 1, 2, 3]);
        }
    }
    let exr = |encoding| {
        let half = |scale: f32| {
            FlatSamples::F16((0..64_u8).map(|i| f16::from_f32(f32::from(i + 9) * scale)).collect())
        };
        let channels =
            [("R", 0.5), ("G", 1.0), ("B", 2.0)].map(|(name, scale)| AnyChannel::new(name, half(scale)));
        let image =
            Image::from_encoded_channels((8, 8), encoding, AnyChannels::sort(channels.into_iter().collect()));
        let mut file = Cursor::new(Vec::new());
        image.write().to_buffered(&mut file).expect("writing to memory");
        file.into_inner()
    };
    vec![
        ("plain.hdr", [head.as_bytes(), b"-Y 2 +X 2\n", &plain].concat()),
        ("runs.hdr", [head.as_bytes(), b"+Y 2 -X 8\n", &runs].concat()),
        ("zip.exr", exr(Encoding::SMALL_LOSSLESS)),
        ("tiles.exr", exr(Encoding::FAST_LOSSLESS)),
        (
            "piz.exr",
            exr(Encoding { compression: exr::prelude::Compression::PIZ, ..Encoding::SMALL_LOSSLESS }),
        ),
        ("plain.exr", exr(Encoding::UNCOMPRESSED)),
        (
            "b44.exr",
            exr(Encoding { compression: exr::prelude::Compression::B44, ..Encoding::SMALL_LOSSLESS }),
        ),
        (
            "pxr.exr",
            exr(Encoding { compression: exr::prelude::Compression::PXR24, ..Encoding::SMALL_LOSSLESS }),
        ),
    ]
}
