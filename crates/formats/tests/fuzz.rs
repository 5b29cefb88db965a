//! Random damage to valid files of every kind that is read: the result is a value or an error, never a panic, a hang,
//! or more memory than the file justifies.
//!
//! By default each test runs for two seconds; `BOLERO_RANDOM_TEST_TIME_MS` makes it longer. A failure prints the
//! smallest damage that causes it and a seed, with which `BOLERO_RANDOM_SEED` reproduces it. If the whole process
//! dies, the file that caused it stays in the temporary folder, below `tyndall-fuzz-...`.

mod valid;

use bolero::{TypeGenerator, check};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tyndall_formats::image::{PictureState, read_map, read_metadata, read_state};
use tyndall_formats::volume::{Endian, Loaded, RawLayout, ReadError, SampleType, read, read_raw};
use tyndall_testing::damage::Edit;
use tyndall_testing::within_limits;

/// How long each test runs unless the environment says otherwise.
const USUALLY: Duration = Duration::from_secs(2);

/// A damaged file from a list; some are compressed afterwards, so that the damage is in the decompressed data.
#[derive(Debug, TypeGenerator)]
struct Damaged {
    file: u8,
    #[generator(bolero::generator::produce_with::<Vec<Edit>>().len(0..6_usize))]
    edits: Vec<Edit>,
    gzip: bool,
}

impl Damaged {
    /// Writes the damaged file to the folder and returns its path.
    fn put(&self, files: &[(&str, Vec<u8>)], words: &[&str], folder: &Path) -> PathBuf {
        let (name, bytes) = &files[usize::from(self.file) % files.len()];
        let mut bytes = bytes.clone();
        self.edits.iter().for_each(|edit| edit.apply(&mut bytes, words));
        if self.gzip && name.ends_with(".gz") {
            bytes = valid::gzip(&bytes);
        }
        let path = folder.join(name);
        rewrite(&path, &bytes);
        path
    }

    /// Restores the undamaged file.
    fn restore(&self, files: &[(&str, Vec<u8>)], path: &Path) {
        rewrite(path, &files[usize::from(self.file) % files.len()].1);
    }
}

/// A folder that is deleted at the end of the test.
fn folder() -> tempfile::TempDir {
    tempfile::Builder::new().prefix("tyndall-fuzz-").tempdir().expect("a folder")
}

/// Deletes and rewrites a file; overwriting it in place can make the file system wait for the disk each time.
fn rewrite(path: &Path, bytes: &[u8]) {
    if path.exists() {
        std::fs::remove_file(path).expect("the last file can go");
    }
    std::fs::write(path, bytes).expect("a new file");
}

/// Damages the files, one at a time, and calls `try_file` on each.
fn for_damaged(files: &[(&str, Vec<u8>)], words: &[&str], try_file: impl Fn(&Path)) {
    let folder = folder();
    let folder = folder.path();
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).expect("a file");
    }
    let try_file = std::panic::AssertUnwindSafe(&try_file);
    check!().with_type::<Damaged>().with_test_time(USUALLY).with_iterations(usize::MAX).for_each(|damaged| {
        let path = damaged.put(files, words, folder);
        within_limits(|| try_file(&path));
        // Other files of the folder may refer to it.
        damaged.restore(files, &path);
    });
}

/// Asserts that the message is readable and names the file, or the other one of its pair.
fn helpful(error: &dyn std::fmt::Display, path: &Path) {
    let message = error.to_string();
    let name = path.file_stem().expect("a name").to_string_lossy();
    assert!(message.contains(&*name), "{message:?} does not name {name}");
    assert!(message.len() < 2000 && !message.chars().any(char::is_control), "{message:?}");
}

/// Asserts what the renderer requires of a loaded volume.
fn sound(read: Result<Loaded, ReadError>, path: &Path) {
    match read {
        Ok(Loaded { volume, .. }) => {
            let grid = volume.grid();
            assert_eq!(grid.dims().iter().product::<usize>(), grid.len());
            let [low, high] = volume.value_range();
            assert!(low.is_finite() && high.is_finite() && low <= high, "{low} to {high}");
            let [robust_low, robust_high] = volume.robust_range();
            assert!(low <= robust_low && robust_low <= robust_high && robust_high <= high);
            assert!(grid.spacing().iter().all(|s| s.is_finite() && *s > 0.0), "{:?}", grid.spacing());
            assert!(grid.origin().iter().all(|x| x.is_finite()), "{:?}", grid.origin());
            assert!(grid.world_corners().iter().all(|p| p.is_finite()), "{:?}", grid.world_corners());
        }
        Err(error) => helpful(&error, path),
    }
}

#[test]
fn files_are_valid_before_they_are_damaged() {
    let folder = folder();
    let put = |files: Vec<(&'static str, Vec<u8>)>| {
        files.iter().for_each(|(name, bytes)| rewrite(&folder.path().join(name), bytes));
        files
            .into_iter()
            .map(|(name, _)| folder.path().join(name))
            .filter(|path| path.extension() != Some("raw".as_ref()))
    };
    for path in [valid::nrrd(), valid::nifti(), valid::metaimage(), valid::numpy()].into_iter().flat_map(put)
    {
        assert!(read(&path).unwrap().volume.grid().len() >= 8, "{}", path.display());
    }
    put(valid::maps()).for_each(|path| drop(read_map(&path).unwrap()));
    put(valid::pictures()).for_each(|path| assert!(read_metadata(&path).unwrap().is_some()));
}

#[test]
fn damaged_nrrd() {
    for_damaged(&valid::nrrd(), valid::NRRD_WORDS, |path| sound(read(path), path));
}

#[test]
fn damaged_nifti() {
    for_damaged(&valid::nifti(), &[], |path| sound(read(path), path));
}

#[test]
fn damaged_metaimage() {
    for_damaged(&valid::metaimage(), valid::META_WORDS, |path| sound(read(path), path));
}

#[test]
fn damaged_numpy() {
    for_damaged(&valid::numpy(), valid::NUMPY_WORDS, |path| sound(read(path), path));
}

#[test]
fn damaged_maps() {
    for_damaged(&valid::maps(), valid::MAP_WORDS, |path| match read_map(path) {
        Ok(map) => assert_eq!(map.pixels.len(), map.width * map.height),
        Err(error) => helpful(&error, path),
    });
}

#[test]
fn damaged_pictures() {
    for_damaged(&valid::pictures(), valid::PICTURE_WORDS, |path| {
        if let Err(error) = read_metadata(path) {
            helpful(&error, path);
        }
        match read_state(path) {
            Ok(PictureState { size: [width, height], layers }) => {
                let pixels = width as usize * height as usize;
                assert!(layers.iter().all(|layer| layer.values.len() == pixels), "{layers:?}");
            }
            Err(error) => helpful(&error, path),
        }
    });
}

/// A layout that a user may state for a raw file.
#[derive(Debug, TypeGenerator)]
struct Stated {
    dims: [u8; 3],
    vast: [bool; 3],
    dtype: u8,
    big: bool,
    offset: u64,
    far: bool,
    spacing: [u64; 3],
    origin: Option<[u64; 3]>,
    length: u16,
}

#[test]
fn any_raw_layout() {
    let folder = folder();
    let path = folder.path().join("a.raw");
    check!().with_type::<Stated>().with_test_time(USUALLY).with_iterations(usize::MAX).for_each(|stated| {
        let axis = |i: usize| {
            let n = usize::from(stated.dims[i] % 12);
            if stated.vast[i] && n > 6 { n << 40 } else { n }
        };
        let number =
            |bits: u64| if bits & 3 == 0 { f64::from_bits(bits) } else { (bits % 1000) as f64 / 100.0 };
        let raw = RawLayout {
            dims: [axis(0), axis(1), axis(2)],
            dtype: SampleType::ALL[usize::from(stated.dtype) % 8],
            endian: if stated.big { Endian::Big } else { Endian::Little },
            offset: if stated.far { stated.offset } else { stated.offset % 64 },
            spacing: stated.spacing.map(number),
            origin: stated.origin.map(|origin| origin.map(number)),
        };
        let bytes: Vec<u8> = (0..stated.length % 8192).map(|i| i.to_le_bytes()[0].wrapping_mul(37)).collect();
        rewrite(&path, &bytes);
        within_limits(|| sound(read_raw(&path, &raw), &path));
    });
}
