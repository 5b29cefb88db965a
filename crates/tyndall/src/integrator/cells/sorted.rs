//! Sorting items by grid cell, in pieces, so that a stop takes effect soon and the work can be resumed.

use super::{CellGrid, Positioned};
use crate::integrator::{Limits, drop_elsewhere};
use crate::math::cast;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// The index at which each cell's items begin in the sorted order.
#[derive(Clone, Debug, Default, PartialEq)]
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
#[derive(Debug, PartialEq)]
pub(crate) struct SortedItems {
    pub items: SortedAddresses,
    pub starts: CellStarts,
}

/// Where sorted items are in their lists.
#[derive(Debug, PartialEq)]
pub(crate) struct SortedAddresses(Vec<u64>);

/// Where an item is in the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ItemAddress {
    pub list: usize,
    pub index: usize,
}

/// A sorting key consists, from the lowest bit, of the index in a list, the list, and the cell.
const INDEX_BITS: u32 = 20;
const LIST_BITS: u32 = 20;

/// Bytes per item during sorting: a key in its block, and one in the result.
pub(crate) const KEY_BYTES: u64 = 16;

/// Maximum number of items that are sorted as one block, unless a single list has more: about a millisecond's work.
const BLOCK: usize = 1 << 15;

/// Maximum number of items of a range of cells, unless a single cell has more.
const RANGE: u32 = 1 << 12;

/// Cells that are counted up at once: some tenths of a millisecond's work.
const PIECE: usize = 1 << 16;

impl SortedAddresses {
    /// Number of items.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The address of the `i`-th item in sorted order.
    #[inline]
    pub fn address(&self, i: usize) -> ItemAddress {
        let key = self.0[i];
        ItemAddress {
            list: cast::low_u32(key >> INDEX_BITS & ((1 << LIST_BITS) - 1)) as usize,
            index: cast::low_u32(key & ((1 << INDEX_BITS) - 1)) as usize,
        }
    }
}

/// A sort in progress. First each block of lists is sorted by itself, and the items of each cell are counted; then each range of
/// cells merges its items from all blocks.
#[derive(Debug)]
pub(crate) struct CellSort {
    blocks: Vec<Block>,
    counts: Vec<AtomicU32>,
    ranges: Vec<CellRange>,
    /// The index at which each cell begins, as far as it has been computed.
    starts: Vec<u32>,
    /// The result; empty until the ranges are known.
    keys: Vec<u64>,
}

/// Lists that are sorted together.
#[derive(Debug)]
struct Block {
    lists: Range<usize>,
    /// `None` until they are sorted.
    keys: Option<Vec<u64>>,
}

/// A range of cells, whose items are contiguous in the result.
#[derive(Debug)]
struct CellRange {
    cells: Range<usize>,
    items: usize,
    sorted: bool,
}

impl CellSort {
    /// Starts a sort of lists of these lengths.
    ///
    /// # Panics
    /// If there are more than 2^20 lists, or items in one.
    pub fn new(grid: &CellGrid, lengths: impl IntoIterator<Item = usize>) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        let (mut items, mut first, mut end) = (0, 0, 0);
        for length in lengths {
            assert!(length < 1 << INDEX_BITS, "{length} items");
            if items > 0 && items + length > BLOCK {
                blocks.push(Block { lists: first..end, keys: None });
                (items, first) = (0, end);
            }
            items += length;
            end += 1;
        }
        assert!(end < 1 << LIST_BITS, "{end} lists");
        blocks.push(Block { lists: first..end, keys: None });
        let counts = bytemuck::zeroed_vec(grid.len());
        Self { blocks, counts, starts: Vec::new(), keys: Vec::new(), ranges: Vec::new() }
    }

    /// Continues the sort, in parallel on the current pool; `None` if stopped first. The lists must be the same in every call.
    pub fn go_on<P: Positioned>(
        &mut self,
        grid: &CellGrid,
        lists: &[&[P]],
        limits: &Limits,
    ) -> Option<SortedItems> {
        let Self { blocks, counts, .. } = self;
        blocks.par_iter_mut().with_max_len(1).filter(|block| block.keys.is_none()).for_each(|block| {
            if !limits.stop().reached() {
                block.sort(grid, lists, counts);
            }
        });
        if self.blocks.iter().any(|block| block.keys.is_none()) {
            return None;
        }
        if self.ranges.is_empty() {
            if !self.count_up(limits) {
                return None;
            }
            self.divide();
        }
        self.sort_ranges(limits);
        self.ranges.iter().all(|range| range.sorted).then(|| SortedItems {
            items: SortedAddresses(std::mem::take(&mut self.keys)),
            starts: CellStarts(std::mem::take(&mut self.starts)),
        })
    }

    /// Computes the index at which each cell begins; false if stopped first.
    fn count_up(&mut self, limits: &Limits) -> bool {
        let stop = limits.stop();
        if self.starts.is_empty() {
            self.starts.reserve_exact(self.counts.len() + 1);
            self.starts.push(0);
        }
        let mut sum = self.starts[self.starts.len() - 1];
        for counts in self.counts[self.starts.len() - 1..].chunks(PIECE) {
            if stop.reached_now() {
                return false;
            }
            self.starts.extend(counts.iter().map(|count| {
                sum += count.load(Ordering::Relaxed);
                sum
            }));
        }
        true
    }

    /// Divides the cells into ranges.
    fn divide(&mut self) {
        drop_elsewhere(std::mem::take(&mut self.counts));
        self.keys = vec![0; self.starts[self.starts.len() - 1] as usize];
        let mut first = 0;
        while first + 1 < self.starts.len() {
            let begins = self.starts[first];
            let most = self.starts[first..].partition_point(|&start| start - begins <= RANGE) - 1;
            let cells = first..first + most.max(1);
            let items = (self.starts[cells.end] - begins) as usize;
            first = cells.end;
            self.ranges.push(CellRange { cells, items, sorted: items == 0 });
        }
    }

    fn sort_ranges(&mut self, limits: &Limits) {
        let blocks = &self.blocks;
        let mut rest = &mut self.keys[..];
        let mut work = Vec::new();
        for range in &mut self.ranges {
            let (keys, after) = rest.split_at_mut(range.items);
            rest = after;
            if !range.sorted {
                work.push((range, keys));
            }
        }
        work.into_par_iter().with_max_len(1).for_each(|(range, keys)| {
            if !limits.stop().reached() {
                range.gather(blocks, keys);
            }
        });
    }
}

impl Block {
    fn sort<P: Positioned>(&mut self, grid: &CellGrid, lists: &[&[P]], counts: &[AtomicU32]) {
        let mut keys = Vec::new();
        for list in self.lists.clone() {
            for (index, item) in lists[list].iter().enumerate() {
                let cell = grid.number(grid.cell(grid.to_metric(item.position())));
                counts[cell].fetch_add(1, Ordering::Relaxed);
                keys.push(((cell as u64) << LIST_BITS | list as u64) << INDEX_BITS | index as u64);
            }
        }
        keys.sort_unstable();
        self.keys = Some(keys);
    }
}

impl CellRange {
    fn gather(&mut self, blocks: &[Block], keys: &mut [u64]) {
        let first_key = |cell: usize| (cell as u64) << (LIST_BITS + INDEX_BITS);
        let (low, high) = (first_key(self.cells.start), first_key(self.cells.end));
        let mut filled = 0;
        for block in blocks.iter().filter_map(|block| block.keys.as_ref()) {
            let first = block.partition_point(|&key| key < low);
            let mine = &block[first..];
            let mine = &mine[..mine.partition_point(|&key| key < high)];
            keys[filled..filled + mine.len()].copy_from_slice(mine);
            filled += mine.len();
        }
        keys.sort_unstable();
        self.sorted = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::sampling::Stream;
    use crate::volume::Grid;
    use std::sync::atomic::AtomicBool;
    use std::time::{Duration, Instant};

    impl Positioned for Vec3 {
        fn position(&self) -> Vec3 {
            *self
        }
    }

    /// Lists of any length, some empty, and a cell with more items than a range.
    fn lists() -> Vec<Vec<Vec3>> {
        let mut stream = Stream::new(5, [0; 3]);
        let list = |length: usize| {
            let mut item = || {
                let place = Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
                if stream.uniform() < 0.2 { Vec3::splat(7.0) } else { place * 15.0 }
            };
            (0..length).map(|_| item()).collect()
        };
        [0, 1, 40_000, 700, 0, 33_000, 12]
            .into_iter()
            .chain((0..300).map(|i| i * 7 % 900))
            .map(list)
            .collect()
    }

    #[test]
    fn items_are_sorted_by_cell_list_and_index_however_often_the_sort_is_stopped() {
        let volume = Grid::centred([16; 3], [1.0; 3]).unwrap();
        let grid = CellGrid::new(&volume, 1.1, 1.0);
        let lists = lists();
        let lists: Vec<&[Vec3]> = lists.iter().map(Vec::as_slice).collect();
        let mut expected: Vec<(usize, usize, usize)> = Vec::new();
        for (list, items) in lists.iter().enumerate() {
            let cell = |item: &Vec3| grid.number(grid.cell(grid.to_metric(*item)));
            expected.extend(items.iter().enumerate().map(|(index, item)| (cell(item), list, index)));
        }
        expected.sort_unstable();
        let cancel = AtomicBool::new(false);
        let sort = || CellSort::new(&grid, lists.iter().map(|list| list.len()));
        let whole = sort().go_on(&grid, &lists, &Limits { cancel: &cancel, deadline: None }).unwrap();
        for (i, (cell, list, index)) in expected.iter().enumerate() {
            assert_eq!(whole.items.address(i), ItemAddress { list: *list, index: *index });
            let starts = &whole.starts.0;
            assert!((starts[*cell] as usize..starts[cell + 1] as usize).contains(&i), "item {i}");
        }
        assert_eq!((whole.items.len(), whole.starts.0.len()), (expected.len(), grid.len() + 1));
        let (mut stopped, mut slices) = (sort(), 0);
        let sorted = loop {
            slices += 1;
            let deadline = Some(Instant::now() + Duration::from_micros(300));
            if let Some(sorted) = stopped.go_on(&grid, &lists, &Limits { cancel: &cancel, deadline }) {
                break sorted;
            }
            assert!(slices < 10_000, "no progress");
        };
        assert!(slices > 1, "never stopped");
        assert_eq!(sorted, whole);
        let none =
            CellSort::new(&grid, []).go_on::<Vec3>(&grid, &[], &Limits { cancel: &cancel, deadline: None });
        assert_eq!(none.unwrap().items.len(), 0);
    }
}
