//! Raw samples: a file without a header, whose layout the user states.

use super::error::ReadError;
use super::layout::{Axis, Layout, Samples};
use super::sample_type::{Endian, SampleType};
use super::stream::{self, Coding, Start};
use super::{Loaded, Parsed};
use std::path::Path;
use tyndall::volume::{Grid, Space, ValueMap};

/// What a raw file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLayout {
    /// Voxels along x, y and z; x is fastest in the file.
    pub dims: [usize; 3],
    /// Type of the samples.
    pub dtype: SampleType,
    /// Order of their bytes.
    pub endian: Endian,
    /// Bytes before the first sample.
    pub offset: u64,
    /// Distance between voxel centres, in world units.
    pub spacing: [f64; 3],
    /// World position of the centre of voxel (0, 0, 0); if `None`, the box is centred on the world origin.
    pub origin: Option<[f64; 3]>,
}

/// Reads a file that holds only samples, after `offset` bytes that are skipped.
///
/// # Errors
/// [`ReadError`] if the file cannot be read or is shorter than the layout requires, or if the layout is impossible.
pub fn read_raw(path: &Path, raw: &RawLayout) -> Result<Loaded, ReadError> {
    let grid = match raw.origin {
        None => Grid::centred(raw.dims, raw.spacing),
        Some(origin) => {
            let direction = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            Grid::new(raw.dims, raw.spacing, direction, origin, Space::Plain)
        }
    };
    let grid = grid.map_err(|source| ReadError::Grid { path: path.into(), source })?;
    let axes = raw.dims.map(|n| (n, Axis::Space)).to_vec();
    let layout = Layout::new(path, "dims", axes, raw.dtype, raw.endian)?;
    let file = stream::open(path)?;
    let samples = stream::samples(path, file, Coding::Raw, Start::After(raw.offset), layout.bytes())?;
    let Samples { voxels, notes } = layout.read(path, samples)?;
    Parsed { grid, voxels, values: ValueMap::IDENTITY, channels: 1, times: 1, notes }.load(path)
}

#[cfg(test)]
mod tests {
    use super::super::tests::folder_with;
    use super::*;
    use tyndall::volume::Voxels;

    fn layout() -> RawLayout {
        RawLayout {
            dims: [3, 2, 1],
            dtype: SampleType::I16,
            endian: Endian::Big,
            offset: 3,
            spacing: [1.0, 2.0, 3.0],
            origin: None,
        }
    }

    #[test]
    fn samples_after_an_offset_are_centred_unless_an_origin_is_given() {
        let mut bytes = vec![9_u8; 3];
        bytes.extend([-1_i16, 2, 300, -400, 5, 6].iter().flat_map(|v| v.to_be_bytes()));
        let (_folder, path) = folder_with("a.raw", &bytes);
        let loaded = read_raw(&path, &layout()).unwrap();
        assert_eq!(loaded.volume.voxels(), Voxels::I16(vec![-1, 2, 300, -400, 5, 6]));
        assert_eq!(loaded.volume.grid().origin(), [-1.0, -1.0, 0.0]);
        let told = RawLayout { origin: Some([1.0, 2.0, 3.0]), ..layout() };
        assert_eq!(read_raw(&path, &told).unwrap().volume.grid().origin(), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_layout_larger_than_the_file_is_refused_at_once() {
        let (_folder, path) = folder_with("a.raw", &[0; 14]);
        let short = read_raw(&path, &layout()).unwrap_err();
        assert!(matches!(short, ReadError::Short { found: 11, expected: 12, .. }), "{short}");
        let vast = RawLayout { dims: [1 << 24, 1 << 24, 1], ..layout() };
        assert!(matches!(read_raw(&path, &vast), Err(ReadError::Short { .. })));
        let none = RawLayout { dims: [0, 1, 1], ..layout() };
        assert!(matches!(read_raw(&path, &none), Err(ReadError::Grid { .. })));
        let past = RawLayout { offset: u64::MAX, ..layout() };
        assert!(matches!(read_raw(&path, &past), Err(ReadError::Short { found: 0, .. })));
    }
}
