//! The query with which an edit tests histories.

use super::Past;
use crate::scene::{Difference, Scene};
use crate::transfer::{BinSet, HistoryGroups, Historygram, TransferFunction};
use crate::volume::ValueBins;

/// The query with which an edit tests histories \[Jonsson12, sec. 4.2\], for edits that leave volume, clips and random
/// numbers unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Touched {
    /// Values whose change may alter a path.
    pub paths: Past,
    /// Values whose change is visible along a view ray.
    pub view: Historygram,
    /// Values whose albedo multiplies scattered light, where nothing else of a view ray changed.
    pub colors: Historygram,
    /// Values with non-zero opacity before or after the edit.
    pub matter: Historygram,
    /// Whether paths from glowing matter may start differently.
    pub glow: bool,
}

impl Touched {
    pub fn new(groups: &HistoryGroups, old: &Scene, new: &Scene, difference: &Difference) -> Self {
        let transfers = [old.medium.transfer(), new.medium.transfer()];
        let bins_where = |is: &dyn Fn(&TransferFunction, usize) -> bool| {
            let mut set = BinSet::EMPTY;
            let bins = (0..ValueBins::COUNT).filter(|&bin| transfers.iter().any(|t| is(t, bin)));
            bins.for_each(|bin| set.insert(bin));
            groups.query(&set)
        };
        let matter = bins_where(&|transfer, bin| transfer.opacity_range(around(transfer, bin))[1] > 0.0);
        let transfer = &difference.transfer;
        let opacity = groups.query(&transfer.opacity);
        let flight = if difference.density.is_some() { matter | opacity } else { opacity };
        let [mut scatter, mut surfaces] =
            [&transfer.scattering, &transfer.surfaces].map(|bins| groups.query(bins));
        if difference.phase || difference.surfaces {
            (scatter, surfaces) = (Historygram::ALL, Historygram::ALL);
        }
        // Nothing scatters where there is no matter.
        let (scatter, surfaces) = (scatter & matter, surfaces & matter);
        let glowing = bins_where(&|transfer, bin| transfer.emission_bound(around(transfer, bin)) > 0.0);
        let emission = groups.query(&transfer.emission);
        // The weight of a cell depends on all matter in it, including matter that does not glow.
        let positions = [old, new].map(|scene| scene.lights.emission());
        let moved = matches!(positions, [Some(old), Some(new)] if !old.same_cells(new));
        Self {
            paths: Past { flight, scatter },
            view: flight | surfaces | (emission & matter),
            colors: scatter,
            matter,
            glow: moved || !emission.is_empty() || flight.meets(glowing),
        }
    }
}

/// An interval that contains all values of a bin, despite rounding.
pub(super) fn around(transfer: &TransferFunction, bin: usize) -> [f32; 2] {
    let bins = transfer.bins();
    let lo = if bin == 0 { f32::MIN } else { bins.value(bin as f32 - 0.01) };
    let hi = if bin + 1 == ValueBins::COUNT { f32::MAX } else { bins.value(bin as f32 + 1.01) };
    [lo, hi]
}
