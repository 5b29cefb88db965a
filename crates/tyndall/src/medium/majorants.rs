//! Opacity bounds per cell and the walk of a ray through the cells (3D-DDA \[Amanatides87\]).

use super::{Track, emptiness};
use crate::math::cast;
use crate::transfer::TransferFunction;
use crate::volume::Volume;
use rayon::prelude::*;

/// Smallest and largest opacity per cell. Independent of the density, so that scaling it costs nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct MajorantGrid {
    dims: [i32; 3],
    edge: f32,
    opacities: Vec<[f32; 2]>,
    /// Per cell the distance, in cells, to the nearest cell with matter (chessboard metric), so that rays can skip the
    /// empty cells between; 0 where there is matter. Padded, since SIMD kernels may read a few bytes past a cell's.
    empty: Vec<u8>,
}

/// The segment of a track inside one cell, or across several empty ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellStretch {
    /// Distance where it begins.
    pub start: f32,
    /// Distance where it ends.
    pub end: f32,
    /// Smallest opacity in the cell.
    pub least: f32,
    /// Largest opacity in the cell.
    pub most: f32,
    /// The cell's number, x fastest; that of the first if there are several.
    pub cell: usize,
}

impl MajorantGrid {
    /// Bounds for cells of `edge` voxels (0: one cell around everything), in parallel on the current pool.
    #[must_use]
    pub fn new(volume: &Volume, transfer: &TransferFunction, edge: usize) -> Self {
        let cells = volume.cells_of(edge);
        let opacities: Vec<[f32; 2]> =
            cells.ranges().par_iter().map(|&values| transfer.opacity_range(values)).collect();
        let empty = emptiness::extents(cells.dims(), &opacities);
        Self {
            dims: cells.dims().map(|n| cast::fit_u32(n).cast_signed()),
            edge: cells.edge() as f32,
            empty: empty.into_iter().chain([0; 3]).collect(),
            opacities,
        }
    }

    /// `[smallest, largest]` opacity per cell, x fastest.
    #[must_use]
    pub fn opacities(&self) -> &[[f32; 2]] {
        &self.opacities
    }

    /// Cells along each axis.
    pub(super) fn dims(&self) -> [i32; 3] {
        self.dims
    }

    /// Voxels along a cell's edge.
    #[must_use]
    pub fn edge(&self) -> f32 {
        self.edge
    }

    /// Voxels along a cell's edge, as a whole number.
    pub(crate) fn voxels(&self) -> usize {
        cast::index(self.edge)
    }

    /// Per cell the distance, in cells, to the nearest cell with matter (chessboard metric); 0 where there is matter.
    pub(super) fn empty(&self) -> &[u8] {
        &self.empty
    }

    /// The cells along a track in order; consecutive empty ones are merged as far as the distance to matter allows.
    #[inline(always)]
    #[must_use]
    pub fn walk(&self, track: &Track) -> CellWalk<'_> {
        CellWalk::new(self, track)
    }

    /// The cells along a track in order, one by one. Segments with matter are those of [`Self::walk`] to the last bit,
    /// so that results computed along them do not depend on empty space beside the ray.
    #[inline(always)]
    #[must_use]
    pub fn walk_singly(&self, track: &Track) -> CellWalk<'_, false> {
        CellWalk::new(self, track)
    }
}

/// Goes along a track cell by cell; if it `LEAPS`, over several empty ones at once. The segments join without gaps.
#[derive(Clone, Debug)]
pub struct CellWalk<'a, const LEAPS: bool = true> {
    grid: &'a MajorantGrid,
    axes: [Axis; 3],
    start: f32,
    length: f32,
}

/// What a walk knows along one axis, in cells.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Where the track begins, and where it goes.
    entry: f32,
    direction: f32,
    inverse: f32,
    sign: i32,
    /// Cells of the grid.
    cells: i32,
    /// The current cell.
    position: i32,
    /// Where the track leaves it.
    next: f32,
}

impl Axis {
    #[inline(always)]
    fn new(entry: f32, direction: f32, cells: i32) -> Self {
        let sign = i32::from(direction > 0.0) - i32::from(direction < 0.0);
        let position = cast::floor_i32(entry).clamp(0, cells - 1);
        let axis = Self { entry, direction, inverse: direction.recip(), sign, cells, position, next: 0.0 };
        Self { next: axis.exit(position), ..axis }
    }

    /// Where the track leaves the cells up to `last`; the outermost cells extend to the track's end.
    #[inline(always)]
    fn exit(&self, last: i32) -> f32 {
        let border = last + i32::from(self.sign > 0);
        if self.sign != 0 && border > 0 && border < self.cells {
            (border as f32 - self.entry) * self.inverse
        } else {
            f32::INFINITY
        }
    }

    /// Where the track leaves the cell that is `ahead` cells on.
    #[inline(always)]
    fn exit_ahead(&self, ahead: i32) -> f32 {
        self.exit(self.position + ahead * self.sign)
    }

    #[inline(always)]
    fn enter(&mut self, position: i32) {
        self.position = position;
        self.next = self.exit(position);
    }

    /// Moves past exactly those borders that come before another axis's border at distance `leave`. At equal distances
    /// the border of the higher axis comes first, as in [`nearest`]; `higher` says that this axis is the higher one.
    #[inline(always)]
    fn leap(&mut self, leave: f32, higher: bool) {
        if self.sign == 0 {
            return;
        }
        let there = self.entry + self.direction * leave;
        let position = cast::floor_i32(there).clamp(0, self.cells - 1);
        let inside = there - position as f32;
        let unsure = ROUNDING * self.cells as f32;
        let is_sure = inside > unsure && inside < 1.0 - unsure;
        self.enter(if is_sure { position } else { self.place_beside(position, leave, higher) });
    }

    /// [`Self::leap`] to a cell near `guess`: beside a border, a position and the distance to the border round
    /// differently, and the distance decides.
    #[cold]
    #[inline(never)]
    fn place_beside(self, guess: i32, leave: f32, higher: bool) -> i32 {
        let is_passed = |exit: f32| exit < leave || (exit == leave && higher);
        let mut position = if (guess - self.position) * self.sign < 0 { self.position } else { guess };
        while position != self.position && !is_passed(self.exit(position - self.sign)) {
            position -= self.sign;
        }
        while is_passed(self.exit(position)) {
            position += self.sign;
        }
        position
    }
}

/// Bound on the rounding error of a position, per cell along the axis: four times what the few roundings of a position
/// and of the distance to a border can add up to.
const ROUNDING: f32 = 4e-6;

impl<'a, const LEAPS: bool> CellWalk<'a, LEAPS> {
    // A shadow ray is often only a few cells long: a call would cost it a few percent.
    #[inline(always)]
    fn new(grid: &'a MajorantGrid, track: &Track) -> Self {
        let per_cell = 1.0 / grid.edge;
        let entry = track.ray.origin * per_cell;
        let direction = track.ray.direction * per_cell;
        let axis = |a: usize| Axis::new(entry[a], direction[a], grid.dims[a]);
        Self { grid, axes: [axis(0), axis(1), axis(2)], start: 0.0, length: track.length }
    }
}

impl<const LEAPS: bool> Iterator for CellWalk<'_, LEAPS> {
    type Item = CellStretch;

    // Must be inlined into SIMD kernels.
    #[inline(always)]
    fn next(&mut self) -> Option<CellStretch> {
        while self.start < self.length {
            let [x, y, z] = &self.axes;
            let (nx, ny) = (x.cells as isize, y.cells as isize);
            let cell =
                (x.position as isize + nx * (y.position as isize + ny * z.position as isize)).cast_unsigned();
            // Cells beyond this one that are surely empty.
            let ahead = if LEAPS { i32::from(self.grid.empty[cell].max(1)) - 1 } else { 0 };
            let (through, leave) = if ahead == 0 {
                nearest([x.next, y.next, z.next])
            } else {
                nearest([x.exit_ahead(ahead), y.exit_ahead(ahead), z.exit_ahead(ahead)])
            };
            let start = self.start;
            let end = leave.min(self.length);
            if end < self.length {
                // Not indexed by `through`, so that everything stays in registers.
                for axis in 0..3 {
                    let along = &mut self.axes[axis];
                    if axis == through {
                        along.enter(along.position + along.sign * (ahead + 1));
                    } else if ahead > 0 {
                        along.leap(leave, axis > through);
                    }
                }
            }
            if end > start {
                self.start = end;
                let [least, most] = self.grid.opacities[cell];
                return Some(CellStretch { start, end, least, most, cell });
            }
        }
        None
    }
}

/// The axis whose border comes first, and where.
#[inline]
fn nearest(borders: [f32; 3]) -> (usize, f32) {
    let axis = if borders[0] < borders[1] {
        if borders[0] < borders[2] { 0 } else { 2 }
    } else if borders[1] < borders[2] {
        1
    } else {
        2
    };
    (axis, borders[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Ray, Vec3};
    use tyndall_testing::SplitMix;

    /// Random cells, few or most of them empty.
    fn grid(random: &mut SplitMix) -> MajorantGrid {
        let dims = [(); 3].map(|()| 1 + (random.bits() % 24) as usize);
        let rarity = 1 + random.bits() % 60;
        let opacity = |random: &mut SplitMix| f32::from(u8::from(random.bits().is_multiple_of(rarity)));
        let opacities: Vec<_> = (0..dims.iter().product()).map(|_| [0.0, opacity(random)]).collect();
        let empty = emptiness::extents(dims, &opacities).into_iter().chain([0; 3]).collect();
        MajorantGrid { dims: dims.map(|n| cast::fit_u32(n).cast_signed()), edge: 8.0, opacities, empty }
    }

    /// Between random points, or through edges and corners of cells as nearly as rounding allows.
    fn track(random: &mut SplitMix, grid: &MajorantGrid) -> Track {
        let size = Vec3::new(grid.dims[0] as f32, grid.dims[1] as f32, grid.dims[2] as f32) * grid.edge;
        let corner = |p: Vec3| (p / grid.edge).round() * grid.edge;
        let [mut from, mut to] = [(); 2].map(|()| Vec3::from_array(random.uniforms()) * size);
        let kind = random.bits() % 3;
        if kind > 0 {
            to = corner(to);
        }
        if kind > 1 {
            from = corner(from);
        }
        let way = to - from;
        let length = grid.dims.iter().sum::<i32>() as f32 * grid.edge;
        Track { ray: Ray::new(from, way / way.length().max(1e-3)), length, before: 0.0, shift: 0.0 }
    }

    #[test]
    fn leaps_change_no_bit_of_the_stretches_with_matter() {
        let mut random = SplitMix::new(1987);
        let (mut leaps, mut with_matter) = (0, 0);
        for _ in 0..2000 {
            let grid = grid(&mut random);
            for _ in 0..50 {
                let track = track(&mut random, &grid);
                let matter = |cell: &CellStretch| cell.most > 0.0;
                let singly: Vec<_> = grid.walk_singly(&track).collect();
                let leaping: Vec<_> = grid.walk(&track).collect();
                leaps += singly.len() - leaping.len();
                let stretches = |all: &[CellStretch]| all.iter().copied().filter(matter).collect::<Vec<_>>();
                assert_eq!(stretches(&leaping), stretches(&singly), "{track:?}");
                with_matter += stretches(&singly).len();
                for stretches in [&singly, &leaping] {
                    assert!(stretches.windows(2).all(|pair| pair[0].end == pair[1].start));
                    let ends = stretches.first().zip(stretches.last());
                    assert!(ends.is_none_or(|(a, b)| a.start == 0.0 && b.end == track.length));
                }
            }
        }
        assert!(leaps > 100_000 && with_matter > 50_000, "{leaps}, {with_matter}");
    }
}
