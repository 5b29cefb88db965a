//! Histories: which data values a computation has read, and the queries of an edit to them \[Jonsson12, sec. 4.2\].

mod bounds;
mod packed;
mod touched;

pub(crate) use bounds::MovedBounds;
pub(crate) use packed::PackedHistories;
pub(crate) use touched::Touched;

use super::Limits;
use super::disposal::drop_elsewhere;
use crate::medium::{FlightNotes, Medium};
use crate::transfer::{BinSet, Grouping, HistoryGroups, Historygram};
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

    /// Updates to an edited medium, with the same volume and cells, whose opacity is another in the bins `changed`; returns what
    /// flights must be queried for besides the groups of these bins. `None` if stopped first: the next call must have the same
    /// old medium, and may have another new one.
    pub fn update(
        &mut self,
        [old, new]: [&Medium; 2],
        changed: &BinSet,
        limits: &Limits,
    ) -> Option<MovedBounds> {
        let outdated = self.next.as_ref().map_or(!changed.is_empty(), |next| !next.is_of(new));
        if outdated {
            self.next = Some(BoundsInProgress::new(&self.groups, new, self.bounds.is_empty()));
        }
        self.go_on(Some(old), limits)
    }

    fn go_on(&mut self, old: Option<&Medium>, limits: &Limits) -> Option<MovedBounds> {
        let Some(next) = &mut self.next else { return Some(MovedBounds::default()) };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::medium::MediumSettings;
    use crate::transfer::{Optics, Point, TransferDifference, TransferFunction};
    use crate::volume::procedural::{Field, Kind};
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::{Duration, Instant};

    /// Stopped again and again, and given another new medium in the middle, an update gives the query and the entries of one that never
    /// stops.
    #[test]
    fn an_update_leaves_no_trace_of_stops_and_of_a_medium_that_was_not_reached() {
        let volume = Arc::new(Field::new(Kind::Cloud, [60, 50, 40], 2).volume().expect("a field"));
        let medium = |low: f32, high: f32| {
            let point = |value, opacity| Point { value, optics: Optics { opacity, ..Optics::default() } };
            let points = [(0.1, 0.0), (0.3, low), (0.35, low), (0.45, 0.2), (0.6, high), (0.7, 0.1)];
            let points = points.map(|(value, opacity)| point(value, opacity)).to_vec();
            let transfer = TransferFunction::over(volume.value_bins(), points).expect("a function");
            let settings = MediumSettings { majorant_cell: 1, ..MediumSettings::plain(1.0) };
            Medium::new(volume.clone(), Arc::new(transfer), &settings)
        };
        // Where both groups occur, the first attains the majorant before, and does again at the end, below the second.
        let (old, passing, new) = (medium(0.5, 0.3), medium(0.1, 0.3), medium(0.5, 0.9));
        let cancel = AtomicBool::new(false);
        let never = Limits { cancel: &cancel, deadline: None };
        let mut slices = 0;
        let mut soon = || {
            slices += 1;
            Limits { cancel: &cancel, deadline: Some(Instant::now() + Duration::from_micros(100)) }
        };
        let started = || Reading::new(&old, 64, Grouping::Quantile);
        let (mut whole, mut stopped) = (started(), started());
        assert!(!whole.is_complete() && whole.complete(&never) && whole.is_complete());
        // On one thread, so that there are many slices.
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        while !one.install(|| stopped.complete(&soon())) {}
        let change =
            |old: &Medium, new: &Medium| TransferDifference::between(old.transfer(), new.transfer()).opacity;
        let changed = change(&old, &new);
        let expected = whole.update([&old, &new], &changed, &never).expect("no stop");
        assert!(!expected.raised.is_empty());
        for _ in 0..2 {
            // The first call ends before any piece is computed.
            let moved = one.install(|| stopped.update([&old, &passing], &change(&old, &passing), &soon()));
            assert!(moved.is_none());
        }
        let mut update = || one.install(|| stopped.update([&old, &new], &changed, &soon()));
        let moved = std::iter::repeat_with(&mut update);
        assert_eq!(moved.flatten().next(), Some(expected));
        assert_eq!(whole.cells, stopped.cells);
        for cell in 0..whole.cells.len() {
            let of = |reading: &Reading| [reading.bounds.most(cell), reading.bounds.limits(cell)];
            assert_eq!(of(&whole), of(&stopped), "cell {cell}");
        }
        assert!(slices > 8, "{slices} slices");
    }
}
