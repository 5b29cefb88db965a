//! How far around a cell all is empty: a chessboard distance transform \[Rosenfeld66\].

/// Per cell how many cells on, to some side, the nearest one with matter is, up to 255; 0 for a cell that has matter itself.
/// What lies outside of the grid is empty.
///
/// Two sweeps over the 13 neighbours before and after a cell are exact in this metric: all cells between a cell and the
/// nearest one with matter are empty.
pub(super) fn extents(dims: [usize; 3], opacities: &[[f32; 2]]) -> Vec<u8> {
    let [nx, ny, nz] = dims;
    let mut distance: Vec<u8> = opacities.iter().map(|o| if o[1] > 0.0 { 0 } else { u8::MAX }).collect();
    let place = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
    let mut visit = |i: usize, sign: isize| {
        if distance[i] == 0 {
            return;
        }
        let [x, y, z] = place(i);
        for (dx, dy, dz) in BEFORE {
            let at = |c: usize, d: isize, n: usize| c.checked_add_signed(d * sign).filter(|&c| c < n);
            let (Some(x), Some(y), Some(z)) = (at(x, dx, nx), at(y, dy, ny), at(z, dz, nz)) else { continue };
            let through = distance[x + nx * (y + ny * z)].saturating_add(1);
            distance[i] = distance[i].min(through);
        }
    };
    (0..opacities.len()).for_each(|i| visit(i, 1));
    (0..opacities.len()).rev().for_each(|i| visit(i, -1));
    distance
}

/// The neighbours that come before a cell in memory.
const BEFORE: [(isize, isize, isize); 13] = [
    (-1, -1, -1),
    (0, -1, -1),
    (1, -1, -1),
    (-1, 0, -1),
    (0, 0, -1),
    (1, 0, -1),
    (-1, 1, -1),
    (0, 1, -1),
    (1, 1, -1),
    (-1, -1, 0),
    (0, -1, 0),
    (1, -1, 0),
    (-1, 0, 0),
];

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_testing::SplitMix;

    /// By looking at every cell.
    fn by_definition(dims: [usize; 3], opacities: &[[f32; 2]], i: usize) -> u8 {
        let place = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let here = place(i);
        let apart = |j: usize| (0..3).map(|a| place(j)[a].abs_diff(here[a])).max().unwrap();
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
