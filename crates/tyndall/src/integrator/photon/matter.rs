//! How much matter there is where photons are gathered.
//!
//! Photons are stored at every collision, including those where light is then absorbed: their flux in a region
//! estimates the integral of extinction times fluence over it. \[Jonsson12, eq. 8\] divides only by the scattering at
//! the position, which is wrong for every albedo except 1, and at the surface of matter, where half of the sphere is
//! empty. Here fluence is assumed to be linear about the position, `a + b x`, and fitted to the flux and its first
//! moment, as in local regression at a boundary \[Fan92\]: with the moments `m0`, `m1`, `m2` of the extinction,
//! `a = sum (1 - c x) flux / (m0 - c m1)`, `c = m2^-1 m1`.
//!
//! Where opacity peaks between the values at the points, each stands for the mean opacity of the values that spread around it, as
//! far as they do around the position, from point to point.
//!
//! Matter denser than at the position counts as if it had the density at the position, and its photons are scaled down
//! accordingly. Otherwise a dense neighbour that the points miss would light up all the thin matter around it.

use super::gathering::Gathering;
use super::kernel::GatherRegion;
use crate::math::{Mat3, Vec3};
use crate::medium::{MarchNotes, Medium};
use crate::simd::{Lanes, MOST_LANES};
use fearless_simd::prelude::*;

/// Maximum share of the flux that the slope may remove: at a flat surface it removes 0.7. Removing more would leave
/// noise.
const MOST_LEAN: f32 = 0.75;

/// Second moment added along each axis, as a share of the opacity times the squared reach, so that the matrix is
/// invertible for thin sheets.
const LEAST_SPREAD: f32 = 0.02;

/// Matter thinner than this scatters nothing that single precision can represent.
const LEAST_OPACITY: f32 = 1e-30;

/// Weights of photons from the fit to moments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matter {
    /// Opacity by which to divide the weighted flux.
    pub opacity: f32,
    /// Decrease of a photon's weight per radius.
    pub slope: Vec3,
    /// Mean position of matter relative to the gather, in metric space.
    pub lean: Vec3,
}

impl Matter {
    /// About a gather; `to_index` transforms metric vectors to index space.
    #[inline(always)]
    pub fn about<S: Lanes>(
        simd: S,
        medium: &Medium,
        at: &Gathering,
        to_index: &Mat3,
        kernel: &impl GatherRegion,
        notes: &mut impl MarchNotes<S>,
    ) -> Self {
        let Gathering { position, opacity, mean: own, half_spread, lane, .. } = *at;
        let zero = S::f32s::splat(simd, 0.0);
        let (mut sum, mut sx, mut sy, mut sz) = (zero, zero, zero, zero);
        let (mut xx, mut yy, mut zz) = (zero, zero, zero);
        let (mut xy, mut xz, mut yz) = (zero, zero, zero);
        let Mat3 { x_axis: i, y_axis: j, z_axis: k } = *to_index;
        let most = S::f32s::splat(simd, opacity);
        let mut first = 0;
        while first < MOST_LANES {
            let [x, y, z] = kernel.points(simd, first);
            let about = [
                x * i.x + y * j.x + z * k.x + position.x,
                x * i.y + y * j.y + z * k.y + position.y,
                x * i.z + y * j.z + z * k.z + position.z,
            ];
            let inside = medium.contains_lanes(simd, about);
            let value = medium.volume().value_lanes(simd, about);
            let opacity = if half_spread > 0.0 {
                let ends = [value - half_spread, value + half_spread];
                notes.values_between_about(simd, lane, inside, ends);
                let [from, to] = [
                    medium.transfer().read_lanes(simd, ends[0]),
                    medium.transfer().read_lanes(simd, ends[1]),
                ];
                from.mean(simd, to)
            } else {
                notes.values_about(simd, lane, inside, value);
                medium.transfer().opacity_lanes(simd, value)
            };
            let opacity = inside.select(opacity.min(most), zero);
            let (ox, oy, oz) = (opacity * x, opacity * y, opacity * z);
            (sum, sx, sy, sz) = (sum + opacity, sx + ox, sy + oy, sz + oz);
            (xx, yy, zz) = (ox.mul_add(x, xx), oy.mul_add(y, yy), oz.mul_add(z, zz));
            (xy, xz, yz) = (ox.mul_add(y, xy), ox.mul_add(z, xz), oy.mul_add(z, yz));
            first += S::WIDTH;
        }
        // The position itself counts as one of the points, so there is matter, up to rounding.
        let mean = (total(sum.as_slice()) + own) / (MOST_LANES + 1) as f32;
        if mean < LEAST_OPACITY {
            return Self { opacity: 0.0, slope: Vec3::ZERO, lean: Vec3::ZERO };
        }
        // Divided by the mean, since the mean may be small and its powers would underflow.
        let per_mean = 1.0 / (mean * (MOST_LANES + 1) as f32);
        let moment = |lanes: &[f32]| total(lanes) * per_mean;
        let lean = Vec3::new(moment(sx.as_slice()), moment(sy.as_slice()), moment(sz.as_slice()));
        let (xx, yy, zz) = (moment(xx.as_slice()), moment(yy.as_slice()), moment(zz.as_slice()));
        let (xy, xz, yz) = (moment(xy.as_slice()), moment(xz.as_slice()), moment(yz.as_slice()));
        let spread = Mat3::from_cols(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz));
        let slope = (spread + kernel.squared_reach() * LEAST_SPREAD).inverse() * lean;
        let slope = slope * (MOST_LEAN / slope.dot(lean).max(MOST_LEAN));
        Self { opacity: mean * (1.0 - slope.dot(lean)), slope, lean }
    }
}

#[inline(always)]
fn total(lanes: &[f32]) -> f32 {
    lanes.iter().sum()
}
