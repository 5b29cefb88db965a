//! Which values a cell's opacity bounds come from: a flight that crosses a cell depends on these, not on all values in
//! the cell.
//!
//! A flight notes the groups that attain a cell's majorant. As long as their opacity stays, the majorant can only rise,
//! by other groups; an edit that does so asks for the groups that attained the old one. A flight that neither meets has
//! read the same majorants. The smallest opacity, which transmittance estimates also use, is recorded the same way.

use super::touched::around;
use crate::medium::{MajorantGrid, Medium};
use crate::transfer::{HistoryGroups, Historygram, TransferFunction};
use crate::volume::ValueBins;
use rayon::prelude::*;

/// Bound of an opacity's rounding error, relative and absolute; with it a few groups too many count as attaining a
/// bound.
const ROUNDING: (f32, f32) = (1e-4, 1e-6);

/// Of each majorant cell what its limits come from.
#[derive(Debug)]
pub(super) struct Bounds(Vec<Attained>);

/// Groups of values that attain the limits of a cell.
#[derive(Clone, Copy, Debug)]
struct Attained {
    least: Historygram,
    /// Of an empty cell all groups that it can yield.
    most: Historygram,
}

impl Bounds {
    /// Of a medium; `cells` says what groups each majorant cell can yield.
    pub fn new(groups: &HistoryGroups, cells: &[Historygram], medium: &Medium) -> Self {
        let limits = limits(groups, medium.transfer());
        let (share, absolute) = ROUNDING;
        let groups_where = |attains: &dyn Fn([f32; 2]) -> bool| {
            let bits = limits.iter().enumerate().map(|(group, &limits)| u128::from(attains(limits)) << group);
            Historygram::from_bits(bits.fold(0, |bits, bit| bits | bit))
        };
        let of_cell = |(&cell, &[least, most]): (&Historygram, &[f32; 2])| Attained {
            least: cell & groups_where(&|[lo, _]| lo <= least * (1.0 + share) + absolute),
            most: cell & groups_where(&|[_, hi]| most <= 0.0 || hi >= most * (1.0 - share) - absolute),
        };
        Self(cells.par_iter().zip(medium.majorants().opacities()).map(of_cell).collect())
    }

    /// What a flight depends on when it reads a cell's majorant.
    #[inline(always)]
    pub fn most(&self, cell: usize) -> Historygram {
        self.0[cell].most
    }

    /// What reading both limits of a cell depends on.
    #[inline(always)]
    pub fn limits(&self, cell: usize) -> Historygram {
        let Attained { least, most } = self.0[cell];
        least | most
    }

    /// What must be queried in addition to the groups whose opacity an edit changed: groups of cells whose smallest
    /// opacity falls or whose majorant rises. For empty cells the changed groups suffice.
    pub fn moved(&self, old: &MajorantGrid, new: &MajorantGrid) -> [Historygram; 2] {
        let mut query = [Historygram::EMPTY; 2];
        for ((old, new), attained) in old.opacities().iter().zip(new.opacities()).zip(&self.0) {
            if new[0] < old[0] {
                query[0] |= attained.least;
            }
            if old[1] > 0.0 && new[1] > old[1] {
                query[1] |= attained.most;
            }
        }
        query
    }
}

/// Smallest and largest opacity of each group's values.
fn limits(groups: &HistoryGroups, transfer: &TransferFunction) -> Vec<[f32; 2]> {
    let mut limits = vec![[f32::INFINITY, 0.0_f32]; usize::from(groups.count())];
    for bin in 0..ValueBins::COUNT {
        let [least, most] = transfer.opacity_range(around(transfer, bin));
        let [lo, hi] = &mut limits[usize::from(groups.of_bins()[bin])];
        (*lo, *hi) = (lo.min(least), hi.max(most));
    }
    limits
}
