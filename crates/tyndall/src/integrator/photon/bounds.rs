//! From which values the majorants of cells come: a flight that crosses a cell depends on these, not on all that the cell holds.
//!
//! A flight notes the groups that attain a cell's majorant. As long as their opacity stays, the majorant can only rise, by other
//! groups; an edit that does so asks for the groups that attained the old one. A flight that neither meets has read the
//! same majorants.

use crate::medium::{MajorantGrid, Medium};
use crate::transfer::{HistoryGroups, Historygram, TransferFunction};
use crate::volume::ValueBins;
use rayon::prelude::*;

/// What rounding may do to an opacity at most, as a share and by itself; more groups than need be attain a majorant then.
const ROUNDING: (f32, f32) = (1e-4, 1e-6);

/// Of each majorant cell what a flight that crosses it depends on: the groups that attain its largest opacity, and of an empty
/// cell all that it can yield.
#[derive(Debug)]
pub(super) struct Bounds(Vec<Historygram>);

impl Bounds {
    /// Of a medium; `cells` says what groups each majorant cell can yield.
    pub fn new(groups: &HistoryGroups, cells: &[Historygram], medium: &Medium) -> Self {
        let largest = largest(groups, medium.transfer());
        let (share, absolute) = ROUNDING;
        let of_cell = |(&cell, &[_, most]): (&Historygram, &[f32; 2])| {
            let of = |(group, &largest): (usize, &f32)| {
                u128::from(most <= 0.0 || largest >= most * (1.0 - share) - absolute) << group
            };
            cell & Historygram::from_bits(largest.iter().enumerate().map(of).fold(0, |bits, bit| bits | bit))
        };
        Self(cells.par_iter().zip(medium.majorants().opacities()).map(of_cell).collect())
    }

    /// What a flight that crosses a cell depends on.
    #[inline(always)]
    pub fn of(&self, cell: usize) -> Historygram {
        self.0[cell]
    }

    /// What is to be asked for beside the groups whose opacity an edit changed, where majorants rise; of empty cells those groups
    /// are enough.
    pub fn raised(&self, old: &MajorantGrid, new: &MajorantGrid) -> Historygram {
        let opacities = old.opacities().iter().zip(new.opacities());
        let raised = opacities.zip(&self.0).filter(|((old, new), _)| old[1] > 0.0 && new[1] > old[1]);
        raised.fold(Historygram::EMPTY, |query, (_, &attained)| query | attained)
    }
}

/// Largest opacity of each group's values.
fn largest(groups: &HistoryGroups, transfer: &TransferFunction) -> Vec<f32> {
    let mut largest = vec![0.0_f32; usize::from(groups.count())];
    for bin in 0..ValueBins::COUNT {
        let [_, most] = transfer.opacity_range(super::edit::around(transfer, bin));
        let of_group = &mut largest[usize::from(groups.of_bins()[bin])];
        *of_group = of_group.max(most);
    }
    largest
}
