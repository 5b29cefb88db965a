//! The spatial history \[Jonsson12, sec. 4.3.2\]: marks where items appeared, moved or vanished, queried by
//! computations that read items within reach.

use super::Positioned;
use super::grid::CellGrid;
use crate::math::Vec3;
use crate::volume::Cells;
use bytemuck::Pod;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// Positions at which items changed, marked by many threads concurrently.
#[derive(Debug)]
pub(crate) struct ChangeMarks {
    kind: MarkKind,
    any: AtomicBool,
    /// Number of marked positions, and the number above which every position counts as marked.
    marks: AtomicUsize,
    enough: usize,
}

#[derive(Debug)]
enum MarkKind {
    /// No marks are kept.
    Off,
    /// A bit for each cell of the grid from which a changed item is within reach, and one for each majorant cell, which
    /// is tested first.
    Cells { grid: CellGrid, near: Vec<AtomicU64>, coarse: Arc<Cells>, near_coarse: Vec<AtomicU64> },
    /// 64 bits per axis, as in the paper: saturates soon.
    Axes { grid: CellGrid, axes: [AtomicU64; 3] },
}

impl ChangeMarks {
    fn of(kind: MarkKind, enough: usize) -> Self {
        Self { kind, any: AtomicBool::new(false), marks: AtomicUsize::new(0), enough }
    }

    /// Records no marks.
    pub fn off() -> Self {
        Self::of(MarkKind::Off, usize::MAX)
    }

    /// Records marks in cells.
    pub fn cells(grid: CellGrid, coarse: Arc<Cells>, enough: usize) -> Self {
        let bits = |count: usize| (0..count.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        let (near, near_coarse) = (bits(grid.len()), bits(coarse.ranges().len()));
        Self::of(MarkKind::Cells { grid, near, coarse, near_coarse }, enough)
    }

    /// Records marks along each axis.
    pub fn axes(grid: CellGrid, enough: usize) -> Self {
        Self::of(MarkKind::Axes { grid, axes: Default::default() }, enough)
    }

    /// Forgets all marks.
    pub fn clear(&mut self) {
        if std::mem::take(self.any.get_mut()) {
            match &mut self.kind {
                MarkKind::Off => {}
                MarkKind::Cells { near, near_coarse, .. } => {
                    near.iter_mut().chain(near_coarse).for_each(|word| *word.get_mut() = 0);
                }
                MarkKind::Axes { axes, .. } => axes.iter_mut().for_each(|word| *word.get_mut() = 0),
            }
        }
        *self.marks.get_mut() = 0;
    }

    /// Whether anything is marked.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// Whether so many positions are marked that every position counts as marked.
    pub fn everywhere(&self) -> bool {
        self.marks.load(Ordering::Relaxed) > self.enough
    }

    /// Marks the old and new items from the first one on that differs or counts as changed `otherwise`.
    pub fn mark_difference<P: Positioned + Pod>(&self, old: &[P], new: &[P], otherwise: impl Fn(&P) -> bool) {
        let same =
            |(old, new): (&P, &P)| bytemuck::bytes_of(old) == bytemuck::bytes_of(new) && !otherwise(new);
        let same = old.iter().zip(new).take_while(|&pair| same(pair)).count();
        self.mark_all(&old[same..]);
        self.mark_all(&new[same..]);
    }

    /// Marks the positions of items.
    pub fn mark_all(&self, things: &[impl Positioned]) {
        if matches!(self.kind, MarkKind::Off) || things.is_empty() {
            return;
        }
        self.any.store(true, Ordering::Relaxed);
        if self.marks.fetch_add(things.len(), Ordering::Relaxed) <= self.enough {
            things.iter().for_each(|thing| self.mark(thing.position()));
        }
    }

    /// Marks a position in index space.
    fn mark(&self, position: Vec3) {
        match &self.kind {
            MarkKind::Off => {}
            MarkKind::Cells { grid, near, coarse, near_coarse } => {
                grid.neighbours(grid.cell(grid.to_metric(position))).for_each(|i| set(near, i));
                coarse.cells_within(position, grid.index_reach()).for_each(|i| set(near_coarse, i));
            }
            MarkKind::Axes { grid, axes } => {
                let bins = grid.axis_bins(grid.to_metric(position));
                for (axis, bin) in axes.iter().zip(bins) {
                    axis.fetch_or(1 << bin, Ordering::Relaxed);
                }
            }
        }
    }

    /// Whether a marked position may be within reach of a majorant cell.
    #[inline]
    pub fn near_cell(&self, cell: usize) -> bool {
        match &self.kind {
            MarkKind::Off => false,
            MarkKind::Cells { near_coarse, .. } => is_set(near_coarse, cell),
            MarkKind::Axes { .. } => true,
        }
    }

    /// Whether a marked position may be within reach of the way between two positions in index space.
    #[inline]
    pub fn near(&self, ends: [Vec3; 2]) -> bool {
        match &self.kind {
            MarkKind::Off => false,
            MarkKind::Cells { grid, near, .. } => {
                let [a, b] = ends.map(|position| grid.cell(grid.to_metric(position)));
                let along = |axis: usize| a[axis].min(b[axis])..=a[axis].max(b[axis]);
                let row = |y: usize, z: usize| along(0).any(|x| is_set(near, grid.number([x, y, z])));
                along(2).any(|z| along(1).any(|y| row(y, z)))
            }
            MarkKind::Axes { grid, axes } => {
                let [a, b] = ends.map(|position| grid.axis_reach(grid.to_metric(position)));
                let mask = |axis: usize| {
                    let both = a[axis] | b[axis];
                    u64::MAX << both.trailing_zeros() & u64::MAX >> both.leading_zeros()
                };
                (0..3).all(|axis| axes[axis].load(Ordering::Relaxed) & mask(axis) != 0)
            }
        }
    }
}

fn set(words: &[AtomicU64], i: usize) {
    let (word, bit) = (&words[i / 64], 1 << (i % 64));
    // Most bits are already set, and reading is cheaper than writing.
    if word.load(Ordering::Relaxed) & bit == 0 {
        word.fetch_or(bit, Ordering::Relaxed);
    }
}

#[inline]
fn is_set(words: &[AtomicU64], i: usize) -> bool {
    words[i / 64].load(Ordering::Relaxed) >> (i % 64) & 1 == 1
}
