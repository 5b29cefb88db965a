//! Sorting by the cell of a grid.

use super::{CellGrid, Positioned};
use crate::math::cast;
use rayon::prelude::*;
use std::ops::Range;

/// Where each cell's items begin among those sorted by cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellStarts(Vec<u32>);

impl CellStarts {
    /// The range of items in the cells of a row along x, from the first to the last, which lie side by side.
    #[inline(always)]
    pub fn row(&self, grid: &CellGrid, [x0, x1]: [usize; 2], y: usize, z: usize) -> Range<usize> {
        let first = self.0[grid.number([x0, y, z])];
        let end = self.0[grid.number([x1, y, z]) + 1];
        first as usize..end as usize
    }

    /// Bytes kept.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// Items of several lists in the order of their cells, then of the lists, then as they stand in their list, so that
/// what is added up in this order does not depend on what was computed when.
#[derive(Debug)]
pub(crate) struct SortedItems {
    keys: Vec<u64>,
    pub starts: CellStarts,
}

/// An item among the lists that were sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ItemAddress {
    pub list: usize,
    pub index: usize,
}

/// Bits of a sorting key for the index in a list, then for the list, then for the cell.
const INDEX_BITS: u32 = 20;
const LIST_BITS: u32 = 20;

/// Bytes of an item while it is sorted.
pub(crate) const KEY_BYTES: u64 = 8;

impl SortedItems {
    /// Sorts all items of some lists, in parallel on the current pool.
    ///
    /// # Panics
    /// If there are more than 2^20 lists, or items in one.
    pub fn new<P: Positioned>(grid: &CellGrid, lists: &[&[P]]) -> Self {
        assert!(lists.len() < 1 << LIST_BITS, "{} lists", lists.len());
        let mut keys: Vec<u64> = lists
            .par_iter()
            .enumerate()
            .flat_map_iter(|(list, items)| {
                assert!(items.len() < 1 << INDEX_BITS, "{} items", items.len());
                items.iter().enumerate().map(move |(index, item)| {
                    let cell = grid.number(grid.cell(grid.to_metric(item.position())));
                    ((cell as u64) << LIST_BITS | list as u64) << INDEX_BITS | index as u64
                })
            })
            .collect();
        keys.par_sort_unstable();

        let cell = |key: u64| key >> (LIST_BITS + INDEX_BITS);
        let mut starts = Vec::with_capacity(grid.len() + 1);
        for (i, &key) in keys.iter().enumerate() {
            while starts.len() as u64 <= cell(key) {
                starts.push(cast::fit_u32(i));
            }
        }
        starts.resize(grid.len() + 1, cast::fit_u32(keys.len()));
        Self { keys, starts: CellStarts(starts) }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// The items in their order.
    pub fn addresses(&self) -> impl IndexedParallelIterator<Item = ItemAddress> {
        self.keys.par_iter().map(|&key| ItemAddress {
            list: cast::low_u32(key >> INDEX_BITS & ((1 << LIST_BITS) - 1)) as usize,
            index: cast::low_u32(key & ((1 << INDEX_BITS) - 1)) as usize,
        })
    }
}
