//! How far around a cell everything is empty: a chessboard distance transform \[Rosenfeld66\].

use rayon::prelude::*;

/// Per cell the chessboard distance, in cells, to the nearest cell with matter, up to 255; 0 for a cell with matter
/// itself. Everything outside the grid is empty. In parallel on the current pool.
///
/// That distance is the largest of the three along the axes. It is minimized axis by axis: over the cells of a line,
/// each pass takes the minimum of the larger of the distance along the line and what the earlier passes found for the
/// cell.
pub(super) fn extents(dims: [usize; 3], opacities: &[[f32; 2]]) -> Vec<u8> {
    let matter = |opacity: &[f32; 2]| if opacity[1] > 0.0 { 0 } else { u8::MAX };
    let mut distance: Vec<u8> = opacities.iter().map(matter).collect();
    let mut stride = 1;
    for cells in dims {
        let found = &distance;
        distance = (0..found.len())
            .into_par_iter()
            .with_min_len(LEAST)
            .map(|i| along(found, Line { i, position: i / stride % cells, cells, stride }))
            .collect();
        stride *= cells;
    }
    distance
}

/// Fewest cells that a thread takes: some tens of microseconds of work.
const LEAST: usize = 2048;

/// A cell and its line along an axis.
#[derive(Clone, Copy)]
struct Line {
    i: usize,
    position: usize,
    /// Cells along the axis.
    cells: usize,
    /// Index step from a cell to the next.
    stride: usize,
}

/// The minimum, over the cells of a line, of the larger of the distance along it and the distance found so far.
fn along(found: &[u8], line: Line) -> u8 {
    let Line { i, position, cells, stride } = line;
    let mut nearest = found[i];
    for away in 1..usize::from(u8::MAX) {
        if away >= usize::from(nearest) || (away > position && position + away >= cells) {
            break;
        }
        let before = (away <= position).then(|| found[i - away * stride]);
        let after = (position + away < cells).then(|| found[i + away * stride]);
        for there in before.into_iter().chain(after) {
            nearest = nearest.min(there.max(u8::try_from(away).unwrap_or(u8::MAX)));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_testing::SplitMix;

    /// Brute force over all cells.
    fn by_definition(dims: [usize; 3], opacities: &[[f32; 2]], i: usize) -> u8 {
        let coordinates = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let here = coordinates(i);
        let apart = |j: usize| (0..3).map(|a| coordinates(j)[a].abs_diff(here[a])).max().unwrap();
        let full = (0..opacities.len()).filter(|&j| opacities[j][1] > 0.0);
        full.map(apart).min().map_or(u8::MAX, |d| u8::try_from(d).unwrap())
    }

    #[test]
    fn the_sweeps_agree_with_the_definition() {
        let mut random = SplitMix::new(3);
        for dims in [[9, 7, 8], [1, 12, 5], [16, 3, 1], [1, 1, 1]] {
            for rarity in [3, 40, 400] {
                let cells = dims.iter().product::<usize>();
                let mut opacities = vec![[0.0, 0.0]; cells];
                for o in &mut opacities {
                    match random.bits() % rarity {
                        0 => *o = [0.5, 0.5],
                        1 => *o = [0.0, 0.9],
                        _ => {}
                    }
                }
                let found = extents(dims, &opacities);
                for (i, &extent) in found.iter().enumerate() {
                    assert_eq!(extent, by_definition(dims, &opacities, i), "cell {i} of {dims:?}");
                }
            }
        }
    }
}
