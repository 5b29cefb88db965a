//! Which values determine a cell's opacity bounds: a flight that crosses a cell depends on these, not on all values in
//! the cell.
//!
//! A flight records the groups that attain a cell's majorant. While their opacity is unchanged, other groups can only
//! raise the majorant; an edit that raises it queries the groups that attained the old one. A flight that matches
//! neither query has read unchanged majorants. The smallest opacity, which transmittance estimates also use, is
//! recorded the same way.

use super::touched::around;
use crate::integrator::Limits;
use crate::medium::Medium;
use crate::transfer::{HistoryGroups, Historygram, TransferFunction};
use crate::volume::{Cells, ValueBins};
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::sync::Arc;

/// Bounds of an opacity's rounding error, relative and absolute; because of this margin a few too many groups count as
/// attaining a bound.
const ROUNDING: (f32, f32) = (1e-4, 1e-6);

/// Cells that are computed at once: some tenths of a millisecond's work.
const PIECE: usize = 1 << 12;

/// For each majorant cell, the groups that determine its limits.
#[derive(Debug, Default)]
pub(super) struct Bounds(Vec<Attained>);

/// Groups of values that attain the opacity limits of a cell.
#[derive(Clone, Copy, Debug, Zeroable)]
struct Attained {
    least: Historygram,
    /// For an empty cell, all groups of values that can occur in it.
    most: Historygram,
}

impl Bounds {
    /// Whether they have not been computed yet.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The groups on which a cell's majorant depends.
    #[inline(always)]
    pub fn most(&self, cell: usize) -> Historygram {
        self.0[cell].most
    }

    /// The groups on which both limits of a cell depend.
    #[inline(always)]
    pub fn limits(&self, cell: usize) -> Historygram {
        let Attained { least, most } = self.0[cell];
        least | most
    }
}

/// The bounds of a medium being computed, piece by piece, so that a stop takes effect soon and the work can be resumed.
#[derive(Debug)]
pub(super) struct BoundsInProgress {
    medium: Medium,
    /// The range of values in each cell; `None` if the groups in each cell are known already.
    values: Option<Arc<Cells>>,
    limits: GroupLimits,
    bounds: Bounds,
    /// What each piece must be queried for, see [`MovedBounds`]; `None` until it is computed.
    moved: Vec<Option<MovedBounds>>,
}

/// The groups to query because a cell's bound moved, besides those whose opacity an edit changed. For empty cells the latter suffice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct MovedBounds {
    /// The groups that attained the smallest opacity of cells where it falls.
    pub sunk: Historygram,
    /// The groups that attained the majorant of cells where it rises.
    pub raised: Historygram,
}

impl MovedBounds {
    fn with(self, other: Self) -> Self {
        Self { sunk: self.sunk | other.sunk, raised: self.raised | other.raised }
    }
}

impl BoundsInProgress {
    /// The bounds of a medium, with nothing computed yet; `with_groups` if the groups in each cell are to be computed too.
    pub fn new(groups: &HistoryGroups, medium: &Medium, with_groups: bool) -> Self {
        let cells = medium.majorants().opacities().len();
        Self {
            medium: medium.clone(),
            values: with_groups.then(|| medium.volume().cells_of(medium.majorants().voxels())),
            limits: GroupLimits::new(groups, medium.transfer()),
            bounds: Bounds(bytemuck::zeroed_vec(cells)),
            moved: vec![None; cells.div_ceil(PIECE)],
        }
    }

    /// Whether these are the bounds of a medium.
    pub fn is_of(&self, medium: &Medium) -> bool {
        self.medium.shares_matter(medium)
    }

    /// Continues, in parallel on the current pool; `before` has the medium of an edit's old scene and its bounds, and must be the
    /// same in every call. `cells` has the groups of values that can occur in each cell.
    /// Returns what an edit must query, or `None` if stopped first.
    pub fn go_on(
        &mut self,
        groups: &HistoryGroups,
        cells: &mut [Historygram],
        before: Option<(&Medium, &Bounds)>,
        limits: &Limits,
    ) -> Option<MovedBounds> {
        let Self { medium, values, limits: of_groups, bounds, moved } = self;
        let (bins, opacities) = (medium.transfer().bins(), medium.majorants().opacities());
        let pieces = (bounds.0.par_chunks_mut(PIECE), cells.par_chunks_mut(PIECE), moved.par_iter_mut());
        pieces.into_par_iter().enumerate().with_max_len(1).for_each(|(piece, (attained, cells, moved))| {
            if moved.is_some() || limits.stop().reached() {
                return;
            }
            let first = piece * PIECE;
            let mut query = MovedBounds::default();
            for (i, (attained, in_cell)) in attained.iter_mut().zip(cells).enumerate() {
                let (cell, new) = (first + i, opacities[first + i]);
                if let Some((old_medium, old_bounds)) = before {
                    let (old, of_old) = (old_medium.majorants().opacities()[cell], old_bounds.0[cell]);
                    if new[0] < old[0] {
                        query.sunk |= of_old.least;
                    }
                    if old[1] > 0.0 && new[1] > old[1] {
                        query.raised |= of_old.most;
                    }
                }
                if let Some(values) = &*values {
                    let [lo, hi] = values.ranges()[cell];
                    *in_cell = groups.between(bins.bin(lo), bins.bin(hi));
                }
                *attained = of_groups.attained(*in_cell, new);
            }
            *moved = Some(query);
        });
        moved.iter().copied().try_fold(MovedBounds::default(), |all, moved| Some(all.with(moved?)))
    }

    /// The bounds, once they are complete.
    pub fn finished(self) -> Bounds {
        self.bounds
    }
}

/// The smallest and the largest opacity of each group's values, sorted, so that few comparisons find all groups that attain
/// a bound.
#[derive(Debug)]
struct GroupLimits {
    /// The groups' smallest opacities, ascending.
    least: Vec<f32>,
    /// Element `n`: the set of the `n` groups with the smallest of these.
    first_least: Vec<Historygram>,
    /// The groups' largest opacities, ascending.
    most: Vec<f32>,
    /// Element `n`: the set of all groups but the first `n` of these.
    but_first_most: Vec<Historygram>,
}

impl GroupLimits {
    fn new(groups: &HistoryGroups, transfer: &TransferFunction) -> Self {
        let mut limits = vec![[f32::INFINITY, 0.0_f32]; usize::from(groups.count())];
        for bin in 0..ValueBins::COUNT {
            let [least, most] = transfer.opacity_range(around(transfer, bin));
            let [lo, hi] = &mut limits[usize::from(groups.of_bins()[bin])];
            (*lo, *hi) = (lo.min(least), hi.max(most));
        }
        let sorted = |end: usize| {
            let of_group = |(group, limits): (usize, &[f32; 2])| (limits[end], 1_u128 << group);
            let mut sorted: Vec<(f32, u128)> = limits.iter().enumerate().map(of_group).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            sorted
        };
        let (least, most) = (sorted(0), sorted(1));
        let joined = |bits: &mut u128, bit: u128| {
            *bits |= bit;
            Some(Historygram::from_bits(*bits))
        };
        let first = |sorted: &[(f32, u128)]| {
            let bits = std::iter::once(0).chain(sorted.iter().map(|limit| limit.1));
            bits.scan(0, |bits, bit| joined(bits, bit)).collect::<Vec<_>>()
        };
        let first_least = first(&least);
        let reversed: Vec<_> = most.iter().rev().copied().collect();
        let but_first_most = first(&reversed).into_iter().rev().collect();
        let values = |sorted: Vec<(f32, u128)>| sorted.into_iter().map(|limit| limit.0).collect();
        Self { least: values(least), first_least, most: values(most), but_first_most }
    }

    /// The groups that attain the limits of a cell, out of those that can occur in it.
    #[inline]
    fn attained(&self, in_cell: Historygram, [least, most]: [f32; 2]) -> Attained {
        let (share, absolute) = ROUNDING;
        let low = least * (1.0 + share) + absolute;
        let low = self.first_least[self.least.partition_point(|&lo| lo <= low)];
        let high = most * (1.0 - share) - absolute;
        let high = if most <= 0.0 { 0 } else { self.most.partition_point(|&hi| hi < high) };
        Attained { least: in_cell & low, most: in_cell & self.but_first_most[high] }
    }
}
