//! Sorting items by grid cell.

use super::{CellGrid, Positioned};
use crate::math::cast;
use rayon::prelude::*;
use std::ops::Range;

/// The index at which each cell's items begin in the sorted order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellStarts(Vec<u32>);

impl CellStarts {
    /// The range of items in the cells `x0` to `x1` of a row along x, which is contiguous.
    #[inline(always)]
    pub fn row(&self, grid: &CellGrid, [x0, x1]: [usize; 2], y: usize, z: usize) -> Range<usize> {
        let first = self.0[grid.number([x0, y, z])];
        let end = self.0[grid.number([x1, y, z]) + 1];
        first as usize..end as usize
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// Items of several lists, sorted by cell, then by list, then by position in the list, so that sums in this order do
/// not depend on when the items were computed.
#[derive(Debug)]
pub(crate) struct SortedItems {
    keys: Vec<u64>,
    pub starts: CellStarts,
}

/// Where an item is in the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ItemAddress {
    pub list: usize,
    pub index: usize,
}

/// A sorting key consists, from the lowest bit, of the index in a list, the list, and the cell.
const INDEX_BITS: u32 = 20;
const LIST_BITS: u32 = 20;

/// Bytes per item during sorting.
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

    /// Number of items.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// The addresses of the items in sorted order.
    pub fn addresses(&self) -> impl IndexedParallelIterator<Item = ItemAddress> {
        self.keys.par_iter().map(|&key| ItemAddress {
            list: cast::low_u32(key >> INDEX_BITS & ((1 << LIST_BITS) - 1)) as usize,
            index: cast::low_u32(key & ((1 << INDEX_BITS) - 1)) as usize,
        })
    }
}
