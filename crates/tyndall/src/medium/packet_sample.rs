//! Where the steps of a packet of rays are seen: the sites of their light.

use super::Medium;
use super::site::Site;
use super::step_ends::StepEnds;
use crate::math::{Rgb, Vec3};
use crate::simd::{Lanes, MOST_LANES, log2_unfused, one_minus_exp};
use fearless_simd::prelude::*;
use std::f32::consts::LN_2;

/// The steps that a packet of tracks takes at once, one per lane.
pub(crate) struct PacketSample<S: Lanes> {
    /// World distance of its middle along each track.
    pub t: S::f32s,
    /// World units.
    pub width: S::f32s,
    /// Optical thickness; 0 in lanes that take no step.
    pub thickness: S::f32s,
    /// Ends in index space.
    pub(super) from: [S::f32s; 3],
    pub(super) to: [S::f32s; 3],
    pub(super) ends: StepEnds<S>,
    /// The share of what is visible of the step that lies in front of its site.
    pub(super) within: S::f32s,
}

/// Where steps are seen.
pub(crate) struct SeenLanes<S: Lanes> {
    /// In index space.
    pub position: [S::f32s; 3],
    /// Data values.
    pub value: S::f32s,
    /// The share of what is visible of the step that each stands for; 0 in lanes without a position.
    pub weight: S::f32s,
}

impl<S: Lanes> SeenLanes<S> {
    /// A lane's position in index space.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> Vec3 {
        let [x, y, z] = &self.position;
        Vec3::new(x.as_slice()[lane], y.as_slice()[lane], z.as_slice()[lane])
    }
}

impl<S: Lanes> PacketSample<S> {
    /// How many sites at most a step is seen at.
    pub const SITES: usize = 4;

    /// Where some lanes' steps are seen, at one of their sites; `None` if none of them has that site. Thick steps
    /// have two or four, since light that comes aslant or from behind is spent otherwise than the view: sites stand for equal shares of what is
    /// visible of a step. In constant thin matter the only site is the step's middle.
    #[inline(always)]
    pub fn seen(&self, simd: S, medium: &Medium, lanes: S::mask32s, site: usize) -> Option<SeenLanes<S>> {
        let two = self.thickness.simd_gt(S::f32s::splat(simd, THICK[0]));
        let four = self.thickness.simd_gt(S::f32s::splat(simd, THICK[1]));
        let lanes = match site {
            0 => lanes,
            1 => lanes & two,
            _ => lanes & four,
        };
        if !lanes.any_true() {
            return None;
        }
        let one = S::f32s::splat(simd, 1.0);
        let weight = four.select(one * 0.25, two.select(one * 0.5, one));
        let within = (self.within + site as f32) * weight;
        Some(self.seen_within(simd, medium, lanes, within, weight))
    }

    /// Where some lanes' steps are seen, each at one site only.
    #[inline(always)]
    pub fn seen_once(&self, simd: S, medium: &Medium, lanes: S::mask32s) -> SeenLanes<S> {
        self.seen_within(simd, medium, lanes, self.within, S::f32s::splat(simd, 1.0))
    }

    /// Adds to the radiance of each lane what its step emits, times `covered`; lanes that cover nothing are passed over.
    #[inline(always)]
    pub fn add_emitted(&self, simd: S, medium: &Medium, covered: S::f32s, radiance: &mut [Rgb; MOST_LANES]) {
        let lanes = covered.simd_gt(S::f32s::splat(simd, 0.0));
        for site in 0..Self::SITES {
            let Some(seen) = self.seen(simd, medium, lanes, site) else { break };
            let covered = covered * seen.weight;
            for (lane, radiance) in radiance.iter_mut().enumerate().take(S::WIDTH) {
                let covered = covered.as_slice()[lane];
                if covered > 0.0 {
                    *radiance += medium.transfer.emitted(seen.value.as_slice()[lane]) * covered;
                }
            }
        }
    }

    /// Where the share `within` of what is visible of a step lies in front.
    #[inline(always)]
    fn seen_within(
        &self,
        simd: S,
        medium: &Medium,
        lanes: S::mask32s,
        within: S::f32s,
        weight: S::f32s,
    ) -> SeenLanes<S> {
        let mut share = within;
        // A share of what is visible, not of what there is; both are the same where there is little.
        let thick = self.thickness.simd_gt(S::f32s::splat(simd, THIN));
        if thick.any_true() {
            let behind = -within * one_minus_exp(simd, self.thickness) + 1.0;
            let depth = log2_unfused(simd, behind) * -LN_2;
            share = thick.select(depth / self.thickness, share);
        }
        let Site { share, value } = self.ends.site(simd, medium, share, lanes);
        let ([ox, oy, oz], [tx, ty, tz]) = (self.from, self.to);
        let position =
            [(tx - ox).mul_add(share, ox), (ty - oy).mul_add(share, oy), (tz - oz).mul_add(share, oz)];
        SeenLanes { position, value, weight: lanes.select(weight, S::f32s::splat(simd, 0.0)) }
    }
}

/// Optical thickness up to which a step hides nothing of itself.
const THIN: f32 = 1e-3;
/// Optical thicknesses above which a step is seen at two sites, and at four, since its front and its back are lit differently.
const THICK: [f32; 2] = [0.5, 1.5];
