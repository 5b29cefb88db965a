//! Which values determine a cell's opacity bounds: a flight that crosses a cell depends on these, not on all values in
//! the cell.
//!
//! A flight records the groups that attain a cell's majorant. While their opacity is unchanged, other groups can only
//! raise the majorant; an edit that raises it queries the groups that attained the old one. A flight that matches
//! neither query has read unchanged majorants. The smallest opacity, which transmittance estimates also use, is
//! recorded the same way.

use super::touched::around;
use crate::medium::{MajorantGrid, Medium};
use crate::transfer::{HistoryGroups, Historygram, TransferFunction};
use crate::volume::ValueBins;
use rayon::prelude::*;

/// Bounds of an opacity's rounding error, relative and absolute; because of this margin a few too many groups count as
/// attaining a bound.
const ROUNDING: (f32, f32) = (1e-4, 1e-6);

/// For each majorant cell, the groups that determine its limits.
#[derive(Debug)]
pub(super) struct Bounds(Vec<Attained>);

/// Groups of values that attain the opacity limits of a cell.
#[derive(Clone, Copy, Debug)]
struct Attained {
    least: Historygram,
    /// For an empty cell, all groups of values that can occur in it.
    most: Historygram,
}

impl Bounds {
    /// The bounds of a medium; `cells` gives the groups of values that can occur in each majorant cell.
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

    /// Groups that an edit must query besides those whose opacity it changed: groups of cells whose smallest opacity
    /// falls, and of cells whose majorant rises. For empty cells the changed groups suffice.
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
