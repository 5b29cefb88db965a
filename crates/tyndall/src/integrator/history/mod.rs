//! Histories: which data values a computation has read, and the queries of an edit to them \[Jonsson12, sec. 4.2\].

mod bounds;
mod packed;
mod touched;

pub(crate) use packed::PackedHistories;
pub(crate) use touched::Touched;

use crate::medium::{FlightNotes, Medium};
use crate::transfer::{Grouping, HistoryGroups, Historygram};
use crate::volume::ValueBins;
use bounds::Bounds;

/// What a light path or one of its vertices depends on: opacities of the values read in flight, and albedo and surface
/// of the values at scatterings. Both accumulate along the path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Past {
    pub flight: Historygram,
    pub scatter: Historygram,
}

impl Past {
    pub const NOTHING: Self = Self { flight: Historygram::EMPTY, scatter: Historygram::EMPTY };

    /// Whether any of the values in `query` are in it.
    #[inline]
    pub fn meets(&self, query: &Self) -> bool {
        self.flight.meets(query.flight) || self.scatter.meets(query.scatter)
    }

    pub fn is_empty(&self) -> bool {
        *self == Self::NOTHING
    }

    pub fn add(&mut self, other: &Self) {
        self.flight |= other.flight;
        self.scatter |= other.scatter;
    }
}

/// The history entries that reading a medium produces.
#[derive(Debug)]
pub(crate) struct Reading {
    pub groups: HistoryGroups,
    /// For each majorant cell, the groups of values that can occur in it.
    pub cells: Vec<Historygram>,
    bounds: Bounds,
}

impl Reading {
    /// For a medium whose values are divided into this many groups.
    pub fn new(medium: &Medium, groups: u8, grouping: Grouping) -> Self {
        let volume = medium.volume();
        let groups = HistoryGroups::new(volume, groups, grouping);
        let bins = medium.transfer().bins();
        let of_cell = |&[lo, hi]: &[f32; 2]| groups.between(bins.bin(lo), bins.bin(hi));
        let cells: Vec<_> =
            volume.cells_of(medium.majorants().voxels()).ranges().iter().map(of_cell).collect();
        let bounds = Bounds::new(&groups, &cells, medium);
        Self { groups, cells, bounds }
    }

    /// The history entry for reading the optical properties of a value.
    #[inline(always)]
    pub fn of(&self, bins: ValueBins, value: f32) -> Historygram {
        self.groups.of(bins.bin(value))
    }

    /// Updates to a medium with other opacities; returns what flights must be queried for besides the groups whose
    /// opacity changed, see [`Bounds::moved`].
    pub fn update(&mut self, old: &Medium, new: &Medium) -> [Historygram; 2] {
        let moved = self.bounds.moved(old.majorants(), new.majorants());
        self.bounds = Bounds::new(&self.groups, &self.cells, new);
        moved
    }

    /// A recorder of what a path reads, starting with what it has read so far.
    #[inline(always)]
    pub fn writer<'a>(&'a self, medium: &'a Medium, past: Past) -> Writer<'a> {
        Writer { reading: self, bins: medium.transfer().bins(), past }
    }
}

/// Records what a path reads.
#[derive(Debug)]
pub(crate) struct Writer<'a> {
    reading: &'a Reading,
    bins: ValueBins,
    pub past: Past,
}

impl Writer<'_> {
    /// The history entry for reading the optical properties of a value.
    #[inline(always)]
    pub fn read(&self, value: f32) -> Historygram {
        self.reading.of(self.bins, value)
    }
}

impl FlightNotes for Writer<'_> {
    #[inline(always)]
    fn most(&mut self, cell: usize) {
        self.past.flight |= self.reading.bounds.most(cell);
    }

    #[inline(always)]
    fn limits(&mut self, cell: usize) {
        self.past.flight |= self.reading.bounds.limits(cell);
    }

    #[inline(always)]
    fn value(&mut self, value: f32) {
        self.past.flight |= self.read(value);
    }
}
