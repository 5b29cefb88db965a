//! Sorting by the cell of a grid, in pieces, so that a stop is heard soon and work goes on from there.

use super::{CellGrid, Positioned};
use crate::integrator::Limits;
use crate::math::cast;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Where each cell's items begin among those sorted by cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellStarts(Vec<u32>);

impl CellStarts {
    /// The range of items in the cells of a row along x, from the first to the last, which are consecutive.
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

/// Items of several lists in the order of their cells, then of the lists, then as they stand in their list, so that what is
/// added up in this order does not depend on what was computed when.
#[derive(Debug, PartialEq)]
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

/// Bytes of an item while it is sorted: it stands in its block and in the whole.
pub(crate) const KEY_BYTES: u64 = 16;

/// Items of lists that are sorted together at first: a millisecond's work.
const BLOCK: usize = 1 << 15;

/// Items of a range of cells, unless a single cell has more.
const RANGE: u32 = 1 << 12;

impl SortedItems {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// The `i`-th item.
    #[inline]
    pub fn address(&self, i: usize) -> ItemAddress {
        let key = self.keys[i];
        ItemAddress {
            list: cast::low_u32(key >> INDEX_BITS & ((1 << LIST_BITS) - 1)) as usize,
            index: cast::low_u32(key & ((1 << INDEX_BITS) - 1)) as usize,
        }
    }
}

/// A sort that is under way: first each block of lists by itself, while the items of each cell are counted; then ranges of cells,
/// each of which takes its items from all blocks.
#[derive(Debug)]
pub(crate) struct CellSort {
    blocks: Vec<Block>,
    counts: Vec<AtomicU32>,
    ranges: Vec<CellRange>,
    /// Empty until the ranges are known.
    keys: Vec<u64>,
    starts: Vec<u32>,
}

/// Lists that are sorted together.
#[derive(Debug)]
struct Block {
    lists: Range<usize>,
    /// `None` until they are sorted.
    keys: Option<Vec<u64>>,
}

/// Cells whose items are consecutive in the end.
#[derive(Debug)]
struct CellRange {
    cells: Range<usize>,
    items: usize,
    sorted: bool,
}

impl CellSort {
    /// A sort of lists of these lengths.
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
        let counts = std::iter::repeat_with(AtomicU32::default).take(grid.len()).collect();
        Self { blocks, counts, ranges: Vec::new(), keys: Vec::new(), starts: Vec::new() }
    }

    /// Goes on, in parallel on the current pool; `None` if a stop came first. The lists must be the same in every call.
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
        if self.starts.is_empty() {
            self.divide();
        }
        self.sort_ranges(limits);
        self.ranges.iter().all(|range| range.sorted).then(|| SortedItems {
            keys: std::mem::take(&mut self.keys),
            starts: CellStarts(std::mem::take(&mut self.starts)),
        })
    }

    /// Finds where each cell begins, and divides the cells into ranges.
    fn divide(&mut self) {
        let mut sum = 0;
        self.starts.reserve_exact(self.counts.len() + 1);
        self.starts.push(0);
        for count in &self.counts {
            sum += count.load(Ordering::Relaxed);
            self.starts.push(sum);
        }
        self.keys = vec![0; sum as usize];
        self.counts = Vec::new();
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
    fn items_come_by_cell_then_list_then_index_whenever_the_work_was_stopped() {
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
            assert_eq!(whole.address(i), ItemAddress { list: *list, index: *index });
            let starts = &whole.starts.0;
            assert!((starts[*cell] as usize..starts[cell + 1] as usize).contains(&i), "item {i}");
        }
        assert_eq!((whole.len(), whole.starts.0.len()), (expected.len(), grid.len() + 1));
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
        assert_eq!(none.unwrap().len(), 0);
    }
}
