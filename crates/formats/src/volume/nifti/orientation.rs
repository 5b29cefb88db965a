//! Where NIfTI voxels are placed: by the sform, else the qform, else voxel sizes alone.
//!
//! NIfTI's world is RAS; ours is LPS: the first two coordinates change sign.

use super::super::error::ReadError;
use super::super::placement;
use super::header::Header;
use std::path::Path;
use tyndall::volume::{Grid, Space};

/// Rows of the matrix from index to world (RAS); the last column is the position of voxel (0, 0, 0).
type Rows = [[f64; 4]; 3];

/// The sform wins over the qform, as in nibabel; one that places nothing (a zero or singular matrix, numbers that are not finite) counts as
/// absent, as in ITK.
pub(super) fn grid(path: &Path, header: &Header, notes: &mut Vec<String>) -> Result<Grid, ReadError> {
    let dims = [header.dims[0], header.dims[1], header.dims[2]];
    let unit = millimetres(header.units, notes);
    let to_lps = [-unit, -unit, unit];
    let placed = |rows: &Rows| {
        let column = |j: usize| -> [f64; 3] { std::array::from_fn(|i| to_lps[i] * rows[i][j]) };
        placement::grid(path, dims, std::array::from_fn(|j| Some(column(j))), column(3), Space::Anatomical)
    };
    let sform = (header.sform_code > 0).then_some(header.sform);
    let qform = (header.qform_code > 0).then(|| by_quaternion(header));
    let [of_sform, of_qform] = [sform, qform].map(|rows| rows.and_then(|rows| placed(&rows).ok()));
    let unusable = |name: &str, code: i32| format!("the {name} (code {code}) is singular or not finite: ");
    if let Some(grid) = of_sform {
        if sform.zip(qform).is_some_and(|(sform, qform)| differ(&sform, &qform, dims)) {
            notes.push("sform and qform disagree: the sform was used".into());
        }
        return Ok(grid);
    }
    let mut found = String::new();
    if sform.is_some() {
        found.push_str(&unusable("sform", header.sform_code));
    }
    if let Some(grid) = of_qform {
        if !found.is_empty() {
            notes.push(found + "the qform was used");
        }
        return Ok(grid);
    }
    if qform.is_some() {
        found.push_str(&unusable("qform", header.qform_code));
    }
    if found.is_empty() {
        found.push_str("no sform and no qform: ");
    }
    notes.push(found + "the volume was centred, with index x running to the left as in Analyze files");
    placed(&by_size(header, dims))
}

/// Method 2 of the standard: a unit quaternion whose first component is implied, voxel sizes, and the
/// sign of `pixdim[0]` for the third axis.
fn by_quaternion(header: &Header) -> Rows {
    let [mut b, mut c, mut d] = header.quaternion;
    let norm2 = b * b + c * c + d * d;
    // Rounding in the file may bring (b, c, d) to a length of one or more: this is a half turn.
    let a = if 1.0 - norm2 < 1e-7 {
        let norm = norm2.sqrt();
        [b, c, d] = [b / norm, c / norm, d / norm];
        0.0
    } else {
        (1.0 - norm2).sqrt()
    };
    let rotation = [
        [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
        [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
        [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
    ];
    let mut sizes = voxel_sizes(header);
    if header.pixdim[0] < 0.0 {
        sizes[2] = -sizes[2];
    }
    std::array::from_fn(|i| {
        let [x, y, z] = std::array::from_fn(|j| rotation[i][j] * sizes[j]);
        [x, y, z, header.quaternion_offset[i]]
    })
}

/// Voxel sizes alone: the box is centred on the world origin, index x runs from right to left.
fn by_size(header: &Header, dims: [usize; 3]) -> Rows {
    let [x, y, z] = voxel_sizes(header);
    let steps = [-x, y, z];
    std::array::from_fn(|i| {
        let mut row = [0.0; 4];
        row[i] = steps[i];
        row[3] = -0.5 * (dims[i] as f64 - 1.0) * steps[i];
        row
    })
}

/// Absolute voxel sizes; one that is zero or not finite counts as 1.
fn voxel_sizes(header: &Header) -> [f64; 3] {
    std::array::from_fn(|i| {
        let size = header.pixdim[i + 1].abs();
        if size.is_finite() && size > 0.0 { size } else { 1.0 }
    })
}

/// Whether any corner of the box differs by more than a tenth of a voxel.
fn differ(a: &Rows, b: &Rows, dims: [usize; 3]) -> bool {
    // A column is the step between voxels along one axis.
    let voxel = (0..3).map(|j| a[0][j].hypot(a[1][j]).hypot(a[2][j])).fold(f64::INFINITY, f64::min);
    (0..3).any(|i| {
        let far: f64 = (0..3).map(|j| (a[i][j] - b[i][j]).abs() * (dims[j] as f64 - 1.0)).sum();
        far + (a[i][3] - b[i][3]).abs() > 0.1 * voxel
    })
}

/// Millimetres per unit of the file; units that are not stated are millimetres.
fn millimetres(units: u8, notes: &mut Vec<String>) -> f64 {
    match units & 7 {
        1 => {
            notes.push("lengths converted from metres to millimetres".into());
            1e3
        }
        3 => {
            notes.push("lengths converted from micrometres to millimetres".into());
            1e-3
        }
        _ => 1.0,
    }
}
