//! The two ends of a step, and what lies between them.

use super::Medium;
use crate::simd::Lanes;
use crate::transfer::{Between, OpacityLanes};
use fearless_simd::prelude::*;

/// Halvings of a step in the search for the border between two voxels that are not interpolated.
const HALVINGS: usize = 6;

/// The ends of a step per lane.
pub(super) struct StepEnds<S: Lanes> {
    values: [S::f32s; 2],
    opacities: [OpacityLanes<S>; 2],
    /// The share of the step before the value changes, where values are not interpolated.
    border: S::f32s,
}

impl<S: Lanes> StepEnds<S> {
    #[inline(always)]
    pub fn new(simd: S, values: [S::f32s; 2], opacities: [OpacityLanes<S>; 2]) -> Self {
        Self { values, opacities, border: S::f32s::splat(simd, 0.5) }
    }

    /// Finds where the value changes in some lanes' steps between two positions.
    #[inline(always)]
    pub fn find_border(
        &mut self,
        simd: S,
        medium: &Medium,
        [from, to]: [[S::f32s; 3]; 2],
        lanes: S::mask32s,
    ) {
        let [first, second] = self.values;
        let differ = lanes & !first.simd_eq(second);
        if !differ.any_true() {
            return;
        }
        let ([x, y, z], [u, v, w]) = (from, to);
        let mut border = S::f32s::splat(simd, 0.5);
        let mut half = 0.25;
        for _ in 0..HALVINGS {
            let position =
                [(u - x).mul_add(border, x), (v - y).mul_add(border, y), (w - z).mul_add(border, z)];
            let value = medium.volume.value_lanes(simd, position);
            border = value.simd_eq(first).select(border + half, border - half);
            half *= 0.5;
        }
        // No lane's bits may depend on what is in the others.
        self.border = differ.select(border, self.border);
    }

    /// Mean opacity of the step.
    #[inline(always)]
    pub fn mean(&self, simd: S, medium: &Medium) -> S::f32s {
        let [from, to] = self.opacities;
        if medium.interpolates {
            from.mean(simd, to)
        } else {
            (to.opacity - from.opacity).mul_add(-self.border + 1.0, from.opacity)
        }
    }

    /// Where in a lane's step a share of its matter has been met.
    #[inline(always)]
    pub fn place(&self, medium: &Medium, lane: usize, share: f32) -> Between {
        let values = [self.values[0].as_slice()[lane], self.values[1].as_slice()[lane]];
        if medium.interpolates {
            return medium.transfer.between(values, share);
        }
        let [from, to] = self.opacities;
        let opacities = [from.opacity.as_slice()[lane], to.opacity.as_slice()[lane]];
        Between::beside(values, opacities, self.border.as_slice()[lane], share)
    }
}
