//! Items with a position, in the cells of a grid: sorted by cell, with marks on the cells where they changed.

mod grid;
mod marks;
mod sorted;

pub(crate) use grid::CellGrid;
pub(crate) use marks::ChangeMarks;
pub(crate) use sorted::{CellSort, CellStarts, KEY_BYTES, SortedAddresses, SortedItems};

use crate::math::Vec3;

/// An item with a position.
pub(crate) trait Positioned: Send + Sync {
    /// In index space.
    fn position(&self) -> Vec3;
}
