//! Free flight and transmittance through matter that varies from place to place.
//!
//! Both walk the cells of the [`MajorantGrid`](super::MajorantGrid) and know of each the smallest and
//! the largest extinction. Where these agree the cell is homogeneous and nothing is looked up. A step too
//! short for single precision still goes on by the last place, so that no walk stands still.

use super::{CellStretch, Medium, Track};
use crate::math::{Vec3, cast};
use crate::sampling::Stream;
use std::ops::ControlFlow;

/// Below this weight a transmittance estimate lives on by chance: darker ones are not worth their look-ups.
const ROULETTE_WEIGHT: f32 = 0.1;

/// Optical thickness of the control after which the same holds.
const ROULETTE_DEPTH: f32 = 2.5;

/// A real collision of a free flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// World distance inside the medium, along the track.
    pub t: f32,
    /// Where, in index space.
    pub place: Vec3,
    /// The data value there.
    pub value: f32,
}

impl Medium {
    /// Flies to the next real collision, or out of the medium (`None`): delta tracking
    /// \[Woodcock65\] with local majorants \[Yue10\].
    ///
    /// `first` is the optical depth to the first tentative collision, exponentially distributed; the
    /// numbers of later ones come from `stream`.
    #[inline]
    #[must_use]
    pub fn free_flight(&self, track: &Track, first: f32, stream: &mut Stream) -> Option<Collision> {
        let mut depth = first;
        let end = self.majorants.walk(track, |cell| {
            let majorant = cell.most * self.density;
            let mut t = cell.start;
            // False at once in an empty cell, where the step is infinite or 0/0.
            while t + depth / majorant < cell.end {
                t = (t + depth / majorant).max(t.next_up());
                let place = track.at(t);
                let level = stream.uniform() * cell.most;
                let value = self.volume.value(place);
                // Below the smallest opacity the collision is real whatever stands there.
                if level < cell.least || level < self.transfer.opacity(value) {
                    return ControlFlow::Break(Collision { t, place, value });
                }
                depth = stream.exponential();
            }
            depth = (depth - (cell.end - t) * majorant).max(0.0);
            ControlFlow::Continue(())
        });
        end.break_value()
    }

    /// An unbiased estimate of the transmittance along a track: residual ratio tracking \[Novak14\], in
    /// which each cell's smallest extinction is the control and is integrated exactly.
    #[inline]
    #[must_use]
    pub fn transmittance(&self, track: &Track, stream: &mut Stream) -> f32 {
        let mut transmittance = 1.0_f32;
        let mut control = 0.0_f32;
        let mut depth = stream.exponential();
        let end = self.majorants.walk(track, |cell| {
            if control > ROULETTE_DEPTH {
                if stream.uniform() >= (-ROULETTE_DEPTH).exp() {
                    return ControlFlow::Break(());
                }
                control -= ROULETTE_DEPTH;
            }
            control += cell.least * self.density * (cell.end - cell.start);
            let spread = cell.most - cell.least;
            let majorant = spread * self.density;
            let mut t = cell.start;
            while t + depth / majorant < cell.end {
                t = (t + depth / majorant).max(t.next_up());
                let residual = self.transfer.opacity(self.volume.value(track.at(t))) - cell.least;
                transmittance *= 1.0 - (residual / spread).clamp(0.0, 1.0);
                if transmittance < ROULETTE_WEIGHT {
                    if stream.uniform() * ROULETTE_WEIGHT >= transmittance {
                        return ControlFlow::Break(());
                    }
                    transmittance = ROULETTE_WEIGHT;
                }
                depth = stream.exponential();
            }
            depth = (depth - (cell.end - t) * majorant).max(0.0);
            ControlFlow::Continue(())
        });
        if end.is_break() { 0.0 } else { transmittance * (-control).exp() }
    }

    /// Optical thickness along a track by the midpoint rule on one grid of steps per track. Steps in
    /// empty cells are skipped, which changes nothing; stops where it passes `enough`.
    #[inline]
    #[must_use]
    pub fn optical_thickness(&self, track: &Track, step: f32, enough: f32) -> f32 {
        let mut thickness = 0.0;
        let _ = self.march(track, step, |_, width, place| {
            thickness += self.sigma_t(place) * width;
            if thickness > enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        thickness
    }

    /// Visits the midpoints of the steps of a track that may hold matter, nearest first, with the
    /// distance, the step's width and the index-space place.
    ///
    /// Step `k` covers `[k step, (k+1) step]`, the last one what is left. The grid does not depend on
    /// the transfer function, so skipping leaves every sample where it was.
    #[inline]
    pub fn march<B>(
        &self,
        track: &Track,
        step: f32,
        mut visit: impl FnMut(f32, f32, Vec3) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let whole = cast::index(track.length / step);
        let rest = (track.length - whole as f32 * step).max(0.0);
        // A sliver of the last bit would be a step of no width.
        let steps = whole + usize::from(rest > 1e-4 * step);
        let mut k = 0;
        let midpoint =
            |k: usize| if k < whole { (k as f32 + 0.5) * step } else { whole as f32 * step + 0.5 * rest };
        self.majorants.walk(track, |cell: CellStretch| {
            if cell.most <= 0.0 {
                // To the last step whose midpoint may lie in this cell; the loop below corrects it.
                k = k.max(cast::index(cell.end / step - 0.5)).min(steps);
                while k < steps && midpoint(k) < cell.end {
                    k += 1;
                }
                return ControlFlow::Continue(());
            }
            while k < steps && midpoint(k) < cell.end {
                let t = midpoint(k);
                let width = if k < whole { step } else { rest };
                k += 1;
                visit(t, width, track.at(t))?;
            }
            ControlFlow::Continue(())
        })
    }
}
