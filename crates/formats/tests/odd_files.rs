//! Files that other programs write and read, though they are not quite as their format says: each is read, with a note where something
//! was left out.

use common::folder;
use compressed::{bzip2, gzip, zlib};
use std::fs;
use std::path::Path;
use tyndall::volume::Voxels;
use tyndall_formats::volume::{Endian, Loaded, RawLayout, ReadError, SampleType, read, read_raw};
use tyndall_testing::within_limits;

#[allow(dead_code, reason = "each file of tests uses what it needs")]
mod common;
#[path = "valid/compressed.rs"]
mod compressed;

/// 4 x 3 x 2 samples of a byte.
fn samples() -> Vec<u8> {
    (0..24).map(|v| v * 5).collect()
}

fn nrrd(encoding: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: {encoding}\n\n");
    [header.as_bytes(), data].concat()
}

const META: &str = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\n";

fn metaimage(entries: &str, data: &[u8]) -> Vec<u8> {
    [format!("{META}{entries}ElementDataFile = LOCAL\n").as_bytes(), data].concat()
}

/// With an sform of voxels of 1 mm; the samples come after an extension.
fn nifti(extension: usize, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 352 + extension];
    bytes[..4].copy_from_slice(&348_i32.to_le_bytes());
    for (i, n) in [3_u8, 4, 3, 2].into_iter().enumerate() {
        bytes[40 + 2 * i] = n;
    }
    (bytes[70], bytes[72], bytes[254]) = (2, 8, 1);
    let offset: f32 = (352 + extension).to_string().parse().expect("a number");
    bytes[108..112].copy_from_slice(&offset.to_le_bytes());
    for place in [280, 300, 320] {
        bytes[place..place + 4].copy_from_slice(&1_f32.to_le_bytes());
    }
    bytes[344..348].copy_from_slice(b"n+1\0");
    [&bytes, data].concat()
}

fn numpy(header_length: usize, data: &[u8]) -> Vec<u8> {
    let text = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3, 4), }";
    let text = text.to_owned() + &" ".repeat(header_length - 1 - text.len()) + "\n";
    let length = u32::try_from(text.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x02\x00", &length[..], text.as_bytes(), data].concat()
}

fn load(path: &Path, bytes: &[u8]) -> Result<Loaded, ReadError> {
    fs::write(path, bytes).expect("a file");
    read(path)
}

/// The notes on a file that must hold [`samples`].
fn notes(path: &Path, bytes: &[u8], what: &str) -> Vec<String> {
    let Loaded { volume, notes, .. } = load(path, bytes).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(volume.voxels(), Voxels::U8(samples()), "{what}");
    notes
}

#[test]
fn what_follows_compressed_samples_is_no_damage() {
    let folder = folder("tails");
    let [first, second] = [&samples()[..9], &samples()[9..]].map(gzip);
    let files: [(&str, Vec<u8>); 8] = [
        ("a.nii.gz", gzip(&nifti(0, &samples()))),
        ("members.nii.gz", [gzip(&nifti(0, &[])), gzip(&samples())].concat()),
        ("a.nrrd", nrrd("gzip", &gzip(&samples()))),
        ("members.nrrd", nrrd("gzip", &[first, second].concat())),
        ("bz2.nrrd", nrrd("bzip2", &bzip2(&samples()))),
        ("members-bz2.nrrd", nrrd("bzip2", &[bzip2(&samples()[..5]), bzip2(&samples()[5..])].concat())),
        ("a.mha", metaimage("CompressedData = True\n", &zlib(&samples()))),
        ("gzip.mha", metaimage("CompressedData = True\n", &gzip(&samples()))),
    ];
    for (name, file) in files {
        let path = folder.join(name);
        assert!(notes(&path, &file, name).is_empty(), "{name}");
        for tail in [&b"\0"[..], &[0; 512], b"\n", b"signed by nobody", &[0x1f], &[0xff; 100_000]] {
            let what = format!("{name} and {} bytes", tail.len());
            let notes = notes(&path, &[&file[..], tail].concat(), &what);
            let [note] = &notes[..] else { panic!("{what}: {notes:?}") };
            let expected = format!("{} bytes after the end of the compressed data", tail.len());
            assert!(note.contains(&expected) && note.contains(name), "{what}: {note}");
        }
    }
}

#[test]
fn data_files_beside_a_header_may_have_tails_too() {
    let folder = folder("tails_beside");
    for (number, half) in samples().chunks(12).enumerate() {
        fs::write(folder.join(format!("{number}.gz")), [&gzip(half)[..], b"\n"].concat()).expect("a file");
    }
    let header = String::from_utf8(nrrd("gzip", &[])).expect("text").trim_end().to_owned();
    let notes = notes(&folder.join("a.nhdr"), format!("{header}\ndata file: %d.gz 0 1\n").as_bytes(), "two");
    let [note] = &notes[..] else { panic!("{notes:?}") };
    assert!(note.contains("0.gz and 1 other file: 1 bytes after"), "{note}");
}

/// Sizes of headers with tracked frames or segmentations, which other programs write and read.
#[test]
fn a_header_may_be_as_long_as_its_file() {
    let folder = folder("long_headers");
    let lines = |line: &str| line.repeat((2 << 20) / line.len());
    let long_line = "x".repeat(2 << 20);
    let with_pairs = |pairs: &str| {
        let text = String::from_utf8(nrrd("raw", &[])).expect("text");
        [text.replace("encoding", &format!("{pairs}encoding")).as_bytes(), &samples()].concat()
    };
    let frame = "Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
    for (name, file) in [
        ("pairs.nrrd", with_pairs(&lines("Segment1_Name:=left ventricle\n"))),
        ("pair.nrrd", with_pairs(&format!("text:={long_line}\n"))),
        ("comment.nrrd", with_pairs(&format!("# {long_line}\n"))),
        ("fields.nrrd", with_pairs(&lines("old field: 3\n"))),
        ("frames.mha", metaimage(&lines(frame), &samples())),
        ("frame.mha", metaimage(&format!("Comment = {long_line}\n"), &samples())),
        ("extension.nii", nifti(2 << 20, &samples()[..])),
        ("extension.nii.gz", gzip(&nifti(2 << 20, &samples()))),
        ("header.npy", numpy(2 << 20, &samples())),
    ] {
        assert_eq!(notes(&folder.join(name), &file, name), [""; 0], "{name}");
    }
}

#[test]
fn a_header_takes_no_more_memory_than_a_line_of_it() {
    let folder = folder("hostile_headers");
    let many = |line: &str| line.repeat((32 << 20) / line.len());
    for (name, file) in [
        ("fields.nrrd", format!("NRRD0004\n{}", many("a:b\n"))),
        ("line.nrrd", format!("NRRD0004\n{}", many("a"))),
        (
            "list.nhdr",
            format!(
                "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 1\nencoding: raw\ndata file: LIST\n{}",
                many("a\n")
            ),
        ),
        ("fields.mha", format!("NDims = 3\n{}", many("a=b\n"))),
        ("list.mhd", format!("{META}ElementDataFile = LIST\n{}", many("a\n"))),
        ("sizes.nrrd", format!("NRRD0004\nsizes: {}\n\n", many("1 "))),
        ("sizes.mha", format!("NDims = 3\nDimSize = {}\n", many("1 "))),
    ] {
        let path = folder.join(name);
        fs::write(&path, file).expect("a file");
        let error = within_limits(|| read(&path)).expect_err(name);
        assert!(error.to_string().contains(name), "{error}");
    }
    // A length of 4 GiB that is not there.
    let path = folder.join("short.npy");
    let error = within_limits(|| load(&path, b"\x93NUMPY\x02\x00\xff\xff\xff\xff{")).expect_err("a cut file");
    assert!(error.to_string().contains("`4294967295`"), "{error}");
}

/// As `MetaIO` reads them: the first of `=` and `:` ends the key.
#[test]
fn keys_of_metaimages_may_end_with_a_colon() {
    let folder = folder("colons");
    let with_colons =
        META.replace(" =", ":") + "Comment: a = b\nElementSpacing: 1 2 3\nElementDataFile: LOCAL\n";
    for name in ["a.mha", "a"] {
        let path = folder.join(name);
        let Loaded { volume, .. } =
            load(&path, &[with_colons.as_bytes(), &samples()].concat()).expect("a volume");
        assert_eq!(
            (volume.voxels(), volume.grid().spacing()),
            (Voxels::U8(samples()), [1.0, 2.0, 3.0]),
            "{name}"
        );
    }
    let mixed = [META.as_bytes(), b"Name = C:\\scan\nElementDataFile: LOCAL\n", &samples()].concat();
    assert!(notes(&folder.join("mixed.mha"), &mixed, "mixed").is_empty());
}

#[test]
fn a_file_that_exists_is_a_file_whatever_its_name() {
    let folder = folder("percent");
    for name in ["75% 0.75 B26f.raw", "slice%03d.raw 1 2 1", "%d 1 2", "100%"] {
        fs::write(folder.join(name), samples()).expect("a file");
        let header = String::from_utf8(nrrd("raw", &[])).expect("text").trim_end().to_owned();
        let detached = format!("{header}\ndata file: {name}\n");
        assert!(notes(&folder.join("a.nhdr"), detached.as_bytes(), name).is_empty());
        let detached = format!("{META}ElementDataFile = {name}\n");
        assert!(notes(&folder.join("a.mhd"), detached.as_bytes(), name).is_empty());
        // Once it is gone, its name is what the message tells.
        fs::remove_file(folder.join(name)).expect("the file");
        let error = load(&folder.join("a.mhd"), detached.as_bytes()).expect_err(name).to_string();
        assert!(
            error.contains(name.split(' ').next().expect("a word")) || error.contains("data file"),
            "{error}"
        );
    }
    let error =
        load(&folder.join("a.mhd"), format!("{META}ElementDataFile = 75% 0.75 B26f.raw\n").as_bytes());
    let error = error.expect_err("no such file").to_string();
    assert!(error.contains("75% 0.75 B26f.raw: cannot be read"), "{error}");
    // Volumes themselves too.
    assert!(notes(&folder.join("75% 0.75 1 B26f.nrrd"), &nrrd("raw", &samples()), "a volume").is_empty());
    for (number, half) in samples().chunks(12).enumerate() {
        fs::write(folder.join(format!("s{number}%.raw")), half).expect("a file");
    }
    let pattern = format!("{META}ElementDataFile = s%d%.raw 0 1 1\n");
    assert!(notes(&folder.join("a.mhd"), pattern.as_bytes(), "a pattern").is_empty());
}

fn raw(dims: [usize; 3], dtype: SampleType, offset: u64) -> RawLayout {
    RawLayout { dims, dtype, endian: Endian::Little, offset, spacing: [1.0; 3], origin: None }
}

/// The only note, which names the sizes found and stated.
fn surplus(notes: &[String], found: &str, stated: &str, what: &str) {
    let [note] = notes else { panic!("{what}: {notes:?}") };
    let expected = format!("found {found} of sample data where {stated} are stated");
    assert!(note.contains(&expected), "{what}: {note}");
}

#[test]
fn samples_left_over_are_noted_with_both_sizes() {
    let folder = folder("surplus");
    let more: Vec<u8> = samples().into_iter().chain(100..112).collect();
    // 16-bit samples declared as bytes; one slice too few; a wrong offset; and as it should be.
    let path = folder.join("a.raw");
    fs::write(&path, &more).expect("a file");
    for (layout, found, stated) in [
        (raw([3, 3, 2], SampleType::U8, 0), "36 bytes", "18"),
        (raw([4, 3, 2], SampleType::U8, 0), "36 bytes", "24"),
        (raw([4, 3, 2], SampleType::U8, 4), "32 bytes", "24"),
        (raw([2, 2, 2], SampleType::U16, 0), "36 bytes", "16"),
    ] {
        surplus(&read_raw(&path, &layout).expect("a volume").notes, found, stated, "raw");
    }
    assert!(read_raw(&path, &raw([3, 3, 2], SampleType::U16, 0)).expect("a volume").notes.is_empty());

    let words = |samples: &[u8]| samples.iter().map(u8::to_string).collect::<Vec<_>>().join(" ");
    let (text, exact) = (words(&more), words(&samples()));
    for (name, file, found) in [
        ("raw.nrrd", nrrd("raw", &more), "36 bytes"),
        ("gzip.nrrd", nrrd("gzip", &gzip(&more)), "36 bytes"),
        ("members.nrrd", nrrd("gzip", &gzip(&samples()).repeat(2)), "48 bytes"),
        ("bzip2.nrrd", nrrd("bzip2", &bzip2(&more)), "36 bytes"),
        ("text.nrrd", nrrd("ascii", text.as_bytes()), "36 numbers"),
        ("a.nii", nifti(0, &more), "36 bytes"),
        ("a.nii.gz", gzip(&nifti(0, &more)), "36 bytes"),
        ("a.mha", metaimage("", &more), "36 bytes"),
        ("zlib.mha", metaimage("CompressedData = True\n", &zlib(&more)), "36 bytes"),
        ("text.mha", metaimage("BinaryData = False\n", text.as_bytes()), "36 numbers"),
        ("a.npy", numpy(128, &more), "36 bytes"),
    ] {
        surplus(&notes(&folder.join(name), &file, name), found, "24", name);
    }
    for (name, file) in [
        ("at-end.mha", metaimage("HeaderSize = -1\n", &more[12..])),
        ("text.nrrd", nrrd("ascii", format!("{exact} \n\n").as_bytes())),
    ] {
        let Loaded { notes, .. } = load(&folder.join(name), &file).expect(name);
        assert!(notes.is_empty(), "{name}: {notes:?}");
    }
}

/// Also where only the first channel or time step is kept, and in each of several files.
#[test]
fn surplus_is_seen_behind_channels_times_and_in_every_file() {
    let folder = folder("surplus_parts");
    let header = |data: &str| {
        format!(
            "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 3 2 2\nkinds: vector domain domain domain\nencoding: {data}"
        )
    };
    let more: Vec<u8> = (0..30).collect();
    for (name, bytes) in [
        ("raw.nrrd", [header("raw\n\n").as_bytes(), &more].concat()),
        ("gzip.nrrd", [header("gzip\n\n").as_bytes(), &gzip(&more)].concat()),
    ] {
        let Loaded { mut notes, channels, .. } = load(&folder.join(name), &bytes).expect(name);
        assert_eq!(channels, 2);
        notes.retain(|note| !note.contains("channels"));
        surplus(&notes, "30 bytes", "24", name);
    }
    for slice in 0..2 {
        fs::write(folder.join(format!("{slice}.raw")), vec![slice; 20]).expect("a file");
    }
    for (name, text) in [
        ("a.mhd", format!("{META}ElementDataFile = %d.raw 0 1 1\n")),
        (
            "a.nhdr",
            format!(
                "{}\ndata file: LIST\n0.raw\n1.raw\n",
                String::from_utf8(nrrd("raw", &[])).expect("text").trim_end()
            ),
        ),
    ] {
        let notes = load(&folder.join(name), text.as_bytes()).expect(name).notes;
        surplus(&notes, "20 bytes", "12", name);
        assert!(notes[0].contains("0.raw and 1 other file"), "{notes:?}");
    }
}

#[test]
fn an_axis_without_a_direction_may_be_written_as_nan() {
    let folder = folder("nan_axes");
    let data: Vec<u8> = (0..24).collect();
    let file = |none: &str| {
        let header = format!(
            "NRRD0004\ntype: uchar\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 2 2 2\n\
             space directions: {none} (1,0,0) (0,2,0) (0,0,3)\nkinds: vector domain domain domain\nencoding: raw\n\n"
        );
        [header.as_bytes(), &data].concat()
    };
    let expected = load(&folder.join("a.nrrd"), &file("none")).expect("a volume");
    for none in ["(nan,nan,nan)", "(NaN, NaN, NaN)", "( nan , nan,nan )", "(-nan,nan,nan)"] {
        let found =
            load(&folder.join("a.nrrd"), &file(none)).unwrap_or_else(|error| panic!("{none}: {error}"));
        assert_eq!(found.volume.voxels(), expected.volume.voxels(), "{none}");
        assert_eq!(found.volume.grid().spacing(), [1.0, 2.0, 3.0], "{none}");
        assert_eq!(found.channels, 3, "{none}");
    }
    for wrong in ["(nan,0,0)", "(inf,nan,nan)", "()", "(nan,nan,"] {
        let error = load(&folder.join("a.nrrd"), &file(wrong)).expect_err(wrong).to_string();
        assert!(error.contains("space directions"), "{wrong}: {error}");
    }
}
