//! The spatial history \[Jonsson12, sec. 4.3.2\]: where photons appeared, moved or vanished, which view-ray segments ask
//! for the places that they gather from.

use super::grid::CellGrid;
use super::paths::Photon;
use crate::math::Vec3;
use crate::volume::Cells;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// Places whose photons changed, marked by many threads at once.
#[derive(Debug)]
pub(super) struct Changed {
    kind: Kind,
    any: AtomicBool,
    /// Places marked, and how many make it not worth asking for one.
    marks: AtomicUsize,
    enough: usize,
}

#[derive(Debug)]
enum Kind {
    /// Nobody asks.
    Off,
    /// A bit for each cell of the grid from which a changed photon can be gathered.
    /// And one for each majorant cell, which is asked first.
    Cells { grid: CellGrid, near: Vec<AtomicU64>, coarse: Arc<Cells>, near_coarse: Vec<AtomicU64> },
    /// Of each axis 64 bits, the paper's way: saturates soon.
    Axes { grid: CellGrid, axes: [AtomicU64; 3] },
}

impl Changed {
    fn of(kind: Kind, enough: usize) -> Self {
        Self { kind, any: AtomicBool::new(false), marks: AtomicUsize::new(0), enough }
    }

    /// Marks nothing.
    pub fn off() -> Self {
        Self::of(Kind::Off, usize::MAX)
    }

    /// Marks cells.
    pub fn cells(grid: CellGrid, coarse: Arc<Cells>, enough: usize) -> Self {
        let bits = |count: usize| (0..count.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        let (near, near_coarse) = (bits(grid.len()), bits(coarse.ranges().len()));
        Self::of(Kind::Cells { grid, near, coarse, near_coarse }, enough)
    }

    /// Marks places along each axis.
    pub fn axes(grid: CellGrid, enough: usize) -> Self {
        Self::of(Kind::Axes { grid, axes: Default::default() }, enough)
    }

    /// Forgets all marks.
    pub fn clear(&mut self) {
        if std::mem::take(self.any.get_mut()) {
            match &mut self.kind {
                Kind::Off => {}
                Kind::Cells { near, near_coarse, .. } => {
                    near.iter_mut().chain(near_coarse).for_each(|word| *word.get_mut() = 0);
                }
                Kind::Axes { axes, .. } => axes.iter_mut().for_each(|word| *word.get_mut() = 0),
            }
        }
        *self.marks.get_mut() = 0;
    }

    /// Whether anything is marked.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// Whether so many places are marked that every place is to count as marked.
    pub fn everywhere(&self) -> bool {
        self.marks.load(Ordering::Relaxed) > self.enough
    }

    /// Marks where the interactions of a path are others than they were, or lie in matter that is.
    pub fn mark_difference(&self, old: &[Photon], new: &[Photon], matter_changed: impl Fn(&Photon) -> bool) {
        let same = |(old, new): (&Photon, &Photon)| {
            bytemuck::bytes_of(old) == bytemuck::bytes_of(new) && !matter_changed(new)
        };
        let same = old.iter().zip(new).take_while(|&pair| same(pair)).count();
        self.mark_all(&old[same..]);
        self.mark_all(&new[same..]);
    }

    /// Marks where photons are.
    pub fn mark_all(&self, photons: &[Photon]) {
        if matches!(self.kind, Kind::Off) || photons.is_empty() {
            return;
        }
        self.any.store(true, Ordering::Relaxed);
        if self.marks.fetch_add(photons.len(), Ordering::Relaxed) <= self.enough {
            photons.iter().for_each(|photon| self.mark(photon.index_place()));
        }
    }

    /// Marks a place of index space.
    fn mark(&self, place: Vec3) {
        match &self.kind {
            Kind::Off => {}
            Kind::Cells { grid, near, coarse, near_coarse } => {
                grid.neighbours(grid.cell(grid.to_metric(place))).for_each(|i| set(near, i));
                coarse.cells_within(place, grid.index_reach()).for_each(|i| set(near_coarse, i));
            }
            Kind::Axes { grid, axes } => {
                let bins = grid.axis_bins(grid.to_metric(place));
                for (axis, bin) in axes.iter().zip(bins) {
                    axis.fetch_or(1 << bin, Ordering::Relaxed);
                }
            }
        }
    }

    /// Whether a gather somewhere in a majorant cell may meet a marked place.
    #[inline]
    pub fn near_cell(&self, cell: usize) -> bool {
        match &self.kind {
            Kind::Off => false,
            Kind::Cells { near_coarse, .. } => is_set(near_coarse, cell),
            Kind::Axes { .. } => true,
        }
    }

    /// Whether a gather at a place of index space may meet a marked one.
    #[inline]
    pub fn near(&self, place: Vec3) -> bool {
        match &self.kind {
            Kind::Off => false,
            Kind::Cells { grid, near, .. } => is_set(near, grid.number(grid.cell(grid.to_metric(place)))),
            Kind::Axes { grid, axes } => {
                let masks = grid.axis_reach(grid.to_metric(place));
                axes.iter().zip(masks).all(|(axis, mask)| axis.load(Ordering::Relaxed) & mask != 0)
            }
        }
    }
}

fn set(words: &[AtomicU64], i: usize) {
    let (word, bit) = (&words[i / 64], 1 << (i % 64));
    // Most are set already, and reading is cheaper than writing.
    if word.load(Ordering::Relaxed) & bit == 0 {
        word.fetch_or(bit, Ordering::Relaxed);
    }
}

#[inline]
fn is_set(words: &[AtomicU64], i: usize) -> bool {
    words[i / 64].load(Ordering::Relaxed) >> (i % 64) & 1 == 1
}
