//! Histories: which data values a computation has read, and the queries of an edit to them \[Jonsson12, sec. 4.2\].

mod bounds;
mod packed;
mod touched;

pub(crate) use bounds::Moved;
pub(crate) use packed::PackedHistories;
pub(crate) use touched::Touched;

use super::disposal::drop_elsewhere;
use super::{Edited, Limits};
use crate::medium::{FlightNotes, Medium};
use crate::transfer::{Grouping, HistoryGroups, Historygram};
use crate::volume::ValueBins;
use bounds::{Bounds, BoundsInProgress};

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

/// The history entries that reading a medium produces. Those of majorant cells are computed in pieces, so that a stop takes effect
/// soon, and must be complete before anything is recorded.
#[derive(Debug)]
pub(crate) struct Reading {
    pub groups: HistoryGroups,
    /// For each majorant cell, the groups of values that can occur in it.
    pub cells: Vec<Historygram>,
    bounds: Bounds,
    /// The bounds that will replace them; `None` if they are complete.
    next: Option<BoundsInProgress>,
}

impl Reading {
    /// For a medium whose values are divided into this many groups; nothing is computed for its cells yet.
    pub fn new(medium: &Medium, groups: u8, grouping: Grouping) -> Self {
        let groups = HistoryGroups::new(medium.volume(), groups, grouping);
        let cells = bytemuck::zeroed_vec(medium.majorants().opacities().len());
        let next = Some(BoundsInProgress::new(&groups, medium, true));
        Self { groups, cells, bounds: Bounds::default(), next }
    }

    /// Whether it can be used.
    pub fn is_complete(&self) -> bool {
        self.next.is_none()
    }

    /// Continues to compute what a new one lacks; false if stopped first.
    pub fn complete(&mut self, limits: &Limits) -> bool {
        self.go_on(None, limits).is_some()
    }

    /// Updates to the new scene of an edit that leaves the volume and the size of the cells unchanged; returns what flights must be
    /// queried for besides the groups whose opacity changed. `None` if stopped first: the next call must have the same old
    /// scene, and may have another new one.
    pub fn update(&mut self, edit: &Edited, limits: &Limits) -> Option<Moved> {
        let Edited { old, new, difference } = *edit;
        let outdated = match &self.next {
            Some(next) => !next.is_of(&new.medium),
            None => !difference.transfer.opacity.is_empty(),
        };
        if outdated {
            self.next = Some(BoundsInProgress::new(&self.groups, &new.medium, self.bounds.is_empty()));
        }
        self.go_on(Some(&old.medium), limits)
    }

    fn go_on(&mut self, old: Option<&Medium>, limits: &Limits) -> Option<Moved> {
        let Some(next) = &mut self.next else { return Some(Moved::default()) };
        let before = old.filter(|_| !self.bounds.is_empty()).map(|old| (old, &self.bounds));
        let moved = next.go_on(&self.groups, &mut self.cells, before, limits)?;
        if let Some(next) = self.next.take() {
            drop_elsewhere(std::mem::replace(&mut self.bounds, next.finished()));
        }
        Some(moved)
    }

    /// The history entry for reading the optical properties of a value.
    #[inline(always)]
    pub fn of(&self, bins: ValueBins, value: f32) -> Historygram {
        self.groups.of(bins.bin(value))
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
