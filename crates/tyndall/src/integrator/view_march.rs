//! Marching view rays through matter, front to back: the opacity of each step, and when nothing behind is visible.

use crate::medium::{MarchNotes, PacketMarch, PacketSample};
use crate::simd::{Lanes, one_minus_exp};
use fearless_simd::prelude::*;

/// Transmittance below which matter behind is no longer visible.
pub(crate) const OPAQUE: f32 = 1e-4;

/// Opacity and depth accumulated by a packet of view rays, one ray per lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coverage<S: Lanes> {
    /// 1 - transmittance.
    pub alpha: S::f32s,
    /// Sum of the sample distances inside the medium, weighted by what each sample adds to `alpha`.
    pub depth: S::f32s,
}

impl<S: Lanes> Coverage<S> {
    /// Nothing met yet.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        Self { alpha: zero, depth: zero }
    }
}

/// Computes the light that a packet's samples contribute to their rays.
pub(crate) trait Shader<S: Lanes, N> {
    /// Shades a sample of each ray. `covered` is the share that the viewer sees of it, 0 in lanes without a sample.
    /// Returns false to stop before the samples count.
    fn shade(&mut self, simd: S, sample: &PacketSample<S>, covered: S::f32s, notes: &mut N) -> bool;
}

/// Marches until all rays have ended or are opaque. If the shader stops the march, returns the steps at which to
/// resume; their samples are shaded again.
#[inline(always)]
pub(crate) fn composite<S: Lanes, N: MarchNotes<S>, H: Shader<S, N>>(
    simd: S,
    march: &mut PacketMarch<S>,
    seen: &mut Coverage<S>,
    shader: &mut H,
    notes: &mut N,
) -> Option<S::i32s> {
    let most = S::f32s::splat(simd, 1.0 - OPAQUE);
    march.active &= seen.alpha.simd_lt(most);
    loop {
        let k = march.step();
        let sample = march.next(notes)?;
        // The remaining transmittance is 1 minus the sum of all shares so far.
        let covered = one_minus_exp(simd, sample.thickness) * (-seen.alpha + 1.0);
        if !shader.shade(simd, &sample, covered, notes) {
            return Some(k);
        }
        seen.alpha += covered;
        seen.depth += sample.t * covered;
        march.active &= seen.alpha.simd_lt(most);
    }
}
