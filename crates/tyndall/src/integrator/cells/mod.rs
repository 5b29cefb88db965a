//! Items with a position, in the cells of a grid: sorted by cell, and marked cell by cell where they changed.

mod grid;
mod marks;
mod sorted;

pub(crate) use grid::CellGrid;
pub(crate) use marks::ChangeMarks;
pub(crate) use sorted::{CellSort, CellStarts, KEY_BYTES, SortedItems};

use crate::math::Vec3;

/// An item at one position.
pub(crate) trait Positioned: Send + Sync {
    /// In index space.
    fn position(&self) -> Vec3;
}
