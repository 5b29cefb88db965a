//! How far a cell's neighbourhood is all alike: a chessboard distance transform \[Rosenfeld66\].

/// Per cell the largest number `r`, up to 255, such that every cell of the grid within `r` to each side has
/// the same opacity, smallest as largest; 0 for a cell that varies inside.
///
/// Two sweeps over the 13 neighbours before and after a cell are exact in this metric: between a cell and
/// the nearest one unlike it all cells are like it.
pub(super) fn reach(dims: [usize; 3], opacities: &[[f32; 2]]) -> Vec<u8> {
    let [nx, ny, nz] = dims;
    // Distance to the nearest cell unlike this one; what lies outside the grid is never met.
    let mut distance = vec![u8::MAX; opacities.len()];
    let place = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
    let mut visit = |i: usize, sign: isize| {
        if opacities[i][0] != opacities[i][1] {
            distance[i] = 1;
            return;
        }
        let [x, y, z] = place(i);
        for (dx, dy, dz) in BEFORE {
            let at = |c: usize, d: isize, n: usize| c.checked_add_signed(d * sign).filter(|&c| c < n);
            let (Some(x), Some(y), Some(z)) = (at(x, dx, nx), at(y, dy, ny), at(z, dz, nz)) else { continue };
            let j = x + nx * (y + ny * z);
            let through = if opacities[j] == opacities[i] { distance[j].saturating_add(1) } else { 1 };
            distance[i] = distance[i].min(through);
        }
    };
    (0..opacities.len()).for_each(|i| visit(i, 1));
    (0..opacities.len()).rev().for_each(|i| visit(i, -1));
    distance.into_iter().map(|d| d - 1).collect()
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

    /// By looking at every cell within every radius.
    fn by_definition(dims: [usize; 3], opacities: &[[f32; 2]], i: usize) -> u8 {
        let place = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let here = place(i);
        let alike = |j: usize| opacities[j] == opacities[i] && opacities[j][0] == opacities[j][1];
        let apart = |j: usize| (0..3).map(|a| place(j)[a].abs_diff(here[a])).max().unwrap();
        let nearest = (0..opacities.len()).filter(|&j| !alike(j)).map(apart).min();
        nearest.map_or(254, |d| u8::try_from(d.max(1) - 1).unwrap())
    }

    #[test]
    fn the_sweeps_agree_with_the_definition() {
        let mut random = SplitMix::new(3);
        for dims in [[9, 7, 8], [1, 12, 5], [16, 3, 1], [1, 1, 1]] {
            for rarity in [3, 40, 400] {
                let cells = dims.iter().product::<usize>();
                let mut opacities = vec![[0.25, 0.25]; cells];
                for o in &mut opacities {
                    match random.bits() % rarity {
                        0 => *o = [0.0, 0.0],
                        1 => *o = [0.1, 0.9],
                        _ => {}
                    }
                }
                let found = reach(dims, &opacities);
                for (i, &r) in found.iter().enumerate() {
                    assert_eq!(r, by_definition(dims, &opacities, i), "cell {i} of {dims:?}");
                }
            }
        }
    }
}
