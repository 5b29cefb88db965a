//! How far values spread inside a small box, for opacity that peaks between the values of neighbouring samples.
//!
//! The values of a linear field in a box are distributed about the one in its middle; here they count as evenly distributed, with the
//! same variance. Their mean opacity then follows from the integrals of the opacity, however narrow its peaks are.

use super::Medium;
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Share of the robust range of values that they change by within a voxel, where they are steep.
const STEEP: f32 = 0.5;

/// Changes count as at most this many robust ranges, so that no square overflows.
const MOST_CHANGE: f32 = 1e9;

impl Medium {
    /// Whether opacity may rise and fall between values that many voxels apart.
    pub(crate) fn may_peak_within(&self, voxels: f32) -> bool {
        let width = self.volume.robust_width();
        self.interpolates && self.transfer.narrowest_peak() < voxels * STEEP * width
    }

    /// Half the width of the spread of values about an index-space position per lane, in a box with edges of so many voxels.
    #[inline(always)]
    pub(crate) fn half_spread<S: Lanes>(&self, simd: S, position: [S::f32s; 3], edges: [f32; 3]) -> S::f32s {
        let width = self.volume.robust_width().max(f32::MIN_POSITIVE);
        let mut sum = S::f32s::splat(simd, 0.0);
        for axis in 0..3 {
            let (mut before, mut behind) = (position, position);
            before[axis] -= 0.5 * edges[axis];
            behind[axis] += 0.5 * edges[axis];
            let change = self.volume.value_lanes(simd, behind) - self.volume.value_lanes(simd, before);
            let change = (change.abs() * (1.0 / width)).min(MOST_CHANGE);
            sum = change.mul_add(change, sum);
        }
        // Each axis adds the twelfth of its squared change to the variance, an even spread the third of its squared half width.
        sum.sqrt() * (0.5 * width)
    }
}
