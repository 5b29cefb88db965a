use super::super::error::ReadError;
use super::super::tests::folder_with;
use super::super::{Loaded, read};
use flate2::{Compression, write::ZlibEncoder};
use std::io::Write;
use tyndall::volume::{Space, ValueMap, Voxels};

const SMALL: &str = "ObjectType = Image\nNDims = 3\nDimSize = 2 3 1\nElementType = MET_SHORT\n";

fn load(header: &str, data: &[u8]) -> Result<Loaded, ReadError> {
    let bytes = [header.as_bytes(), b"ElementDataFile = LOCAL\n", data].concat();
    let (_folder, path) = folder_with("a.mha", &bytes);
    read(&path)
}

fn samples() -> Vec<u8> {
    [1_i16, -2, 300, -400, 5, 6].iter().flat_map(|v| v.to_be_bytes()).collect()
}

fn zlib(data: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn every_encoding_gives_the_same_samples() {
    let stored: [(&str, Vec<u8>); 5] = [
        ("BinaryDataByteOrderMSB = True\n", samples()),
        ("ElementByteOrderMSB = True\nHeaderSize = -1\n", [vec![9; 7], samples()].concat()),
        ("BinaryDataByteOrderMSB = True\r\nCompressedData = True\r\n", zlib(&samples())),
        ("BinaryData = False\n", b"1 -2 300\n-400 5 6".to_vec()),
        ("", samples().chunks(2).flat_map(|b| [b[1], b[0]]).collect()),
    ];
    for (encoding, data) in stored {
        let volume = load(&format!("{SMALL}{encoding}"), &data).unwrap().volume;
        assert_eq!(volume.voxels(), Voxels::I16(vec![1, -2, 300, -400, 5, 6]), "{encoding}");
    }
}

#[test]
fn the_matrix_holds_the_directions_axis_by_axis() {
    let header = format!(
        "{SMALL}TransformMatrix = 0 1 0 0 0 1 1 0 0\nElementSpacing = 2 3 4\nOffset = 1 2 3\n\
         AnatomicalOrientation = PSR\nElementToIntensityFunctionSlope = 2\n"
    );
    let volume = load(&header, &samples()).unwrap().volume;
    let grid = volume.grid();
    assert_eq!(grid.direction(), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!((grid.spacing(), grid.origin()), ([2.0, 3.0, 4.0], [1.0, 2.0, 3.0]));
    assert_eq!(grid.space(), Space::Anatomical);
    assert_eq!(volume.value_map(), ValueMap { slope: 2.0, intercept: 0.0 });
    let plain = load(&format!("{SMALL}Position = 1 2 3\nElementSize = 2 3 4\n"), &samples()).unwrap().volume;
    assert_eq!(plain.grid().spacing(), [2.0, 3.0, 4.0]);
    assert_eq!(plain.grid().space(), Space::Plain);
}

#[test]
fn the_first_channel_at_the_first_time_is_read() {
    let header = "NDims = 4\nDimSize = 2 1 1 3\nElementNumberOfChannels = 2\nElementType = MET_UCHAR_ARRAY\n";
    let loaded = load(header, &(0..12).collect::<Vec<u8>>()).unwrap();
    assert_eq!(loaded.volume.voxels(), Voxels::U8(vec![0, 2]));
    assert_eq!((loaded.channels, loaded.times), (2, 3));
}

#[test]
fn samples_may_lie_in_one_or_many_files() {
    let (folder, path) = folder_with("a.mhd", b"");
    for (name, data) in [("all", 0..8), ("p05", 0..4), ("p07", 4..8)] {
        std::fs::write(folder.path().join(name), data.collect::<Vec<u8>>()).unwrap();
    }
    let header =
        "ObjectType = Image\nNDims = 3\nDimSize = 2 1 4\nElementType = MET_UCHAR\nElementDataFile = ";
    for files in ["all", "p%02d 5 7 2", "LIST\np05\np07\n", "LIST 3\np05\np07"] {
        std::fs::write(&path, format!("{header}{files}")).unwrap();
        assert_eq!(read(&path).unwrap().volume.voxels(), Voxels::U8((0..8).collect()), "{files}");
    }
    for files in ["none", "LIST", "p%02d 5 7", "p05"] {
        std::fs::write(&path, format!("{header}{files}")).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("a.mhd"), "{files}: {message}");
    }
}

#[test]
fn what_cannot_be_read_is_named() {
    let cases = [
        ("NDims = 3\n", "DimSize"),
        ("NDims = 0\n", "NDims"),
        ("NDims = 3\nDimSize = 1 1\n", "DimSize"),
        ("NDims = 1\nDimSize = -4\n", "DimSize"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_LONG_LONG\n", "MET_LONG_LONG"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_STRING\n", "ElementType"),
        ("NDims = 1\nDimSize = 4\nElementSpacing = 0\nElementType = MET_UCHAR\n", "spacing"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_UCHAR\nElementNumberOfChannels = 0\n", "DimSize"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_UCHAR\nBinaryData = maybe\n", "True or False"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_UCHAR\nCompressedData = True\n", "damaged"),
        ("NDims = 1\nDimSize = 4\nElementType = MET_UCHAR\n", "3 bytes"),
        ("ObjectType = Image\nnonsense\n", "header line"),
    ];
    for (header, word) in cases {
        let message = load(header, b"xyz").unwrap_err().to_string();
        assert!(message.contains(word) && message.contains("a.mha"), "{header}: {message}");
    }
}
