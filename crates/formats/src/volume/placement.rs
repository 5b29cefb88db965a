//! Builds a [`Grid`] from the steps between voxels that a file states.

use super::error::ReadError;
use std::path::Path;
use tyndall::volume::{Grid, Space};

type Vector = [f64; 3];

/// The grid whose index axis `j` advances by `steps[j]` in the world. Axes that the file lacks have one
/// voxel and no step: they get a unit step perpendicular to the others.
pub(super) fn grid(
    path: &Path,
    dims: [usize; 3],
    mut steps: [Option<Vector>; 3],
    origin: Vector,
    space: Space,
) -> Result<Grid, ReadError> {
    for axis in 0..3 {
        // The step of a single voxel is arbitrary; a zero step is treated as none.
        if dims[axis] == 1 && steps[axis].is_some_and(|v| length(v) == 0.0) {
            steps[axis] = None;
        }
    }
    for axis in 0..3 {
        if steps[axis].is_none() {
            steps[axis] = Some(perpendicular(steps[(axis + 1) % 3], steps[(axis + 2) % 3]));
        }
    }
    let steps = steps.map(Option::unwrap_or_default);
    let spacing = steps.map(length);
    let direction =
        std::array::from_fn(|row| std::array::from_fn(|column| steps[column][row] / spacing[column]));
    Grid::new(dims, spacing, direction, origin, space)
        .map_err(|source| ReadError::Grid { path: path.into(), source })
}

/// A unit vector perpendicular to those given and, where that leaves a choice, to a world axis.
fn perpendicular(next: Option<Vector>, after: Option<Vector>) -> Vector {
    match (next, after) {
        (Some(a), Some(b)) => normalised(cross(a, b)),
        (Some(v), None) | (None, Some(v)) => {
            // The axis along which `v` has its smallest component is the most perpendicular to it.
            let shortest = (0..3).min_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs())).unwrap_or(2);
            let mut axis = [0.0; 3];
            axis[shortest] = 1.0;
            normalised(cross(v, axis))
        }
        (None, None) => [1.0, 0.0, 0.0],
    }
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length(v: Vector) -> f64 {
    v[0].hypot(v[1]).hypot(v[2])
}

fn normalised(v: Vector) -> Vector {
    let length = length(v);
    v.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_axes_are_perpendicular_to_the_others() {
        let made = |steps, dims| grid(Path::new("test"), dims, steps, [0.0; 3], Space::Plain);
        let plane = made([Some([2.0, 0.0, 0.0]), Some([0.0, 0.0, 3.0]), None], [4, 5, 1]).unwrap();
        assert_eq!(plane.spacing(), [2.0, 3.0, 1.0]);
        assert_eq!(plane.direction(), [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]);
        let zero = made([Some([2.0, 0.0, 0.0]), Some([0.0, 3.0, 0.0]), Some([0.0; 3])], [4, 5, 1]).unwrap();
        assert_eq!(zero.spacing(), [2.0, 3.0, 1.0]);
        assert!(made([Some([0.0, 1.0, 1.0]), None, None], [9, 1, 1]).is_ok());
        assert_eq!(made([None, None, None], [1, 1, 1]).unwrap().spacing(), [1.0; 3]);
        assert!(made([Some([0.0; 3]), None, None], [9, 1, 1]).is_err());
    }
}
