use super::super::error::ReadError;
use super::super::tests::folder_with;
use super::super::{Loaded, read};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use tyndall::volume::{Space, Voxels};

fn file(header: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0005\n{header}\n\n").as_bytes(), data].concat()
}

fn load(header: &str, data: &[u8]) -> Result<Loaded, ReadError> {
    let (_folder, path) = folder_with("a.nrrd", &file(header, data));
    read(&path)
}

fn gzip(data: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

const SMALL: &str = "type: int16\ndimension: 3\nsizes: 2 3 1\n";

fn samples() -> Vec<u8> {
    [1_i16, -2, 300, -400, 5, 6].iter().flat_map(|v| v.to_be_bytes()).collect()
}

#[test]
fn every_encoding_gives_the_same_samples() {
    let expected = Voxels::I16(vec![1, -2, 300, -400, 5, 6]);
    let mut bzip = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    bzip.write_all(&samples()).unwrap();
    let stored: [(&str, Vec<u8>); 5] = [
        ("endian: big\nencoding: raw", samples()),
        ("endian: big\r\nencoding: gzip\r", gzip(&samples())),
        ("Endian: big\nENCODING: bz2", bzip.finish().unwrap()),
        ("encoding: ascii", b"1 -2\n300, -400 5 6".to_vec()),
        (
            "# comment\nkey:=value: more\nbyte skip: -1\nendian: big\nencoding: raw",
            [vec![7; 5], samples()].concat(),
        ),
    ];
    for (encoding, data) in stored {
        let crlf = encoding.contains('\r');
        let header = format!("{SMALL}{encoding}");
        let mut bytes = file(&header, &data);
        if crlf {
            bytes =
                [header.replace('\n', "\r\n").replace("\r\r", "\r").as_bytes(), b"\n\r\n", &data].concat();
            bytes.splice(0..0, b"NRRD0005\r\n".iter().copied());
        }
        let (_folder, path) = folder_with("a.nrrd", &bytes);
        assert_eq!(read(&path).unwrap().volume.voxels(), expected, "{encoding}");
    }
}

#[test]
fn anatomical_spaces_come_to_lps_and_others_stay() {
    let header = |space: &str| {
        format!(
            "type: uchar\ndimension: 3\nspace: {space}\nsizes: 1 2 1\nencoding: raw\n\
             space directions: (0,2,0) (3,0,0) (0,0,-4)\nspace origin: (10,20,30)"
        )
    };
    let cases = [
        ("left-posterior-superior", [1.0, 1.0], Space::Anatomical),
        ("RAS", [-1.0, -1.0], Space::Anatomical),
        ("left-anterior-superior", [1.0, -1.0], Space::Anatomical),
        ("scanner-xyz", [1.0, 1.0], Space::Plain),
    ];
    for (name, [sx, sy], space) in cases {
        let loaded = load(&header(name), &[1, 2]).unwrap();
        let grid = loaded.volume.grid();
        assert_eq!(grid.spacing(), [2.0, 3.0, 4.0], "{name}");
        assert_eq!(grid.origin(), [sx * 10.0, sy * 20.0, 30.0], "{name}");
        assert_eq!(grid.direction(), [[0.0, sx, 0.0], [sy, 0.0, 0.0], [0.0, 0.0, -1.0]], "{name}");
        assert_eq!(grid.space(), space, "{name}");
    }
    assert!(matches!(load(&header("sideways"), &[1, 2]), Err(ReadError::Header { .. })));
}

#[test]
fn the_first_channel_at_the_first_time_is_read() {
    let data: Vec<u8> = (0..24).collect();
    let rgb = "type: uchar\ndimension: 4\nsizes: 3 2 2 2\nencoding: raw\nspace: LPS\nkinds: RGB-color domain domain domain\n\
               space directions: none (1,0,0) (0,1,0) (0,0,5)";
    let loaded = load(rgb, &data).unwrap();
    assert_eq!(loaded.volume.voxels(), Voxels::U8((0..8).map(|v| 3 * v).collect()));
    assert_eq!((loaded.channels, loaded.times, loaded.notes.len()), (3, 1, 1));
    assert_eq!(loaded.volume.grid().spacing(), [1.0, 1.0, 5.0]);
    let series = "type: uchar\ndimension: 4\nsizes: 2 2 2 3\nencoding: raw\nspacings: 1 2 3 0.5";
    let loaded = load(series, &data).unwrap();
    assert_eq!(loaded.volume.voxels(), Voxels::U8((0..8).collect()));
    assert_eq!((loaded.channels, loaded.times), (1, 3));
    assert_eq!(loaded.volume.grid().spacing(), [1.0, 2.0, 3.0]);
}

#[test]
fn axis_mins_and_maxs_place_the_first_sample() {
    let header = "type: uchar\ndimension: 2\nsizes: 4 2\nencoding: raw\n\
                  axis mins: 10 -1\naxis maxs: 18 1\ncenterings: cell node";
    let loaded = load(header, &[0; 8]).unwrap();
    assert_eq!(loaded.volume.grid().dims(), [4, 2, 1]);
    assert_eq!(loaded.volume.grid().spacing(), [2.0, 2.0, 1.0]);
    assert_eq!(loaded.volume.grid().origin(), [11.0, -1.0, 0.0]);
    assert_eq!(loaded.volume.grid().space(), Space::Plain);
}

#[test]
fn samples_may_lie_in_one_or_many_files_beside_the_header() {
    let header =
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 4\nencoding: raw\nline skip: 1\ndata file: ";
    let (folder, path) = folder_with("a.nhdr", b"");
    for (name, data) in [("all", 0..8), ("p05", 0..4), ("p07", 4..8)] {
        let bytes: Vec<u8> = b"a line\n".iter().copied().chain(data).collect();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    for files in ["all", "p%02d 5 7 2", "LIST\np05\np07\n", "LIST 3\np05\np07"] {
        std::fs::write(&path, format!("{header}{files}")).unwrap();
        assert_eq!(read(&path).unwrap().volume.voxels(), Voxels::U8((0..8).collect()), "{files}");
    }
    for files in ["none", "p%02d 5 7 1", "LIST", "LIST\nall\np05\np07", "p05"] {
        std::fs::write(&path, format!("{header}{files}")).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("a.nhdr") && message.contains("data file"), "{files}: {message}");
    }
}

#[test]
fn what_cannot_be_read_is_named() {
    let cases = [
        ("type: int64\ndimension: 1\nsizes: 1\nencoding: raw", "int64"),
        ("type: block\ndimension: 1\nsizes: 1\nencoding: raw", "block"),
        ("type: short\ndimension: 1\nsizes: 1\nencoding: raw", "endian"),
        ("type: uchar\ndimension: 1\nsizes: 1\nencoding: hex", "hex"),
        ("type: uchar\ndimension: 2\nsizes: 1\nencoding: raw", "sizes"),
        ("type: uchar\ndimension: 2\nsizes: 0 1\nencoding: raw", "sizes"),
        ("type: uchar\ndimension: 2\nsizes: -1 1\nencoding: raw", "sizes"),
        ("type: uchar\ndimension: 99\nsizes: 1\nencoding: raw", "dimension"),
        ("type: uchar\ndimension: 2\nsizes: 9223372036854775807 99\nencoding: raw", "16777216"),
        ("dimension: 2\nsizes: 1 1\nencoding: raw", "type"),
        ("type: uchar\ndimension: 1\nsizes: 1\nencoding: gzip\nbyte skip: -1", "skipping"),
        ("type: uchar\ndimension: 1\nsizes: 1\nencoding: ascii", "damaged"),
        ("nonsense", "header line"),
    ];
    for (header, word) in cases {
        let message = load(header, b"x").unwrap_err().to_string();
        assert!(message.contains(word) && message.contains("a.nrrd"), "{header}: {message}");
    }
}

#[test]
fn a_header_that_lies_costs_nothing_and_a_bomb_stops() {
    let vast = "type: uchar\ndimension: 3\nsizes: 16777216 16777216 8\nencoding: ";
    assert!(matches!(load(&format!("{vast}raw"), &[1]), Err(ReadError::Short { found: 1, .. })));
    let refused = load(&format!("{vast}gzip"), &gzip(&[1]));
    assert!(matches!(refused, Err(ReadError::Damaged { .. })));
    let bomb = gzip(&vec![0; 1 << 22]);
    let loaded = load("type: uchar\ndimension: 1\nsizes: 9\nencoding: gzip", &bomb).unwrap();
    assert_eq!(loaded.volume.grid().dims(), [9, 1, 1]);
    let short = load("type: uchar\ndimension: 2\nsizes: 4096 1025\nencoding: gzip", &bomb);
    assert!(matches!(short, Err(ReadError::Short { found: 4_194_304, expected: 4_198_400, .. })));
}

#[test]
fn a_wrong_checksum_is_seen() {
    let mut data = gzip(&[1, 2, 3, 4]);
    let checksum = data.len() - 8;
    data[checksum] ^= 1;
    let damaged = load("type: uchar\ndimension: 1\nsizes: 4\nencoding: gzip", &data);
    assert!(matches!(damaged, Err(ReadError::Damaged { .. })));
}
