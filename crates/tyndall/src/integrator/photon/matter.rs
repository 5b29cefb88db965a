//! How much matter photons have met where they are gathered.
//!
//! Photons lie where light collides, also where it is then absorbed: their flux in a part of space estimates the
//! integral of extinction times fluence over it. \[Jonsson12, eq. 8\] divides by the scattering at the position alone,
//! which is wrong at every albedo but 1, and at the skin of matter, where half of the sphere holds none. Here fluence
//! is taken to be linear about the position, `a + b x`, and fitted to the flux and its first moment, as local
//! regression does at a border \[Fan92\]: with the moments `m0`, `m1`, `m2` of the extinction that is `a = sum (1 - c
//! x) flux / (m0 - c m1)`, `c = m2^-1 m1`.
//!
//! Matter denser than the position counts as dense as the position, and its photons for so much less: else what the
//! points miss of a dense neighbour, and the flux there, would light up all the thin matter about it.

use super::kernel::GatherRegion;
use crate::math::{Mat3, Vec3};
use crate::medium::{MOST_LANES, MarchNotes, Medium};
use crate::simd::Lanes;
use fearless_simd::prelude::*;

/// Share of the flux that the slope may take away at most: at a flat skin it takes 0.7. More of it would leave noise.
const MOST_LEAN: f32 = 0.75;

/// Second moment added along each axis, as a share of the opacity times the squared reach, so that thin sheets have an
/// inverse.
const LEAST_SPREAD: f32 = 0.02;

/// Matter thinner than this scatters nothing that single precision can represent.
const LEAST_OPACITY: f32 = 1e-30;

/// Weights of photons by the fit to moments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matter {
    /// Opacity by which the weighted flux is to be divided.
    pub opacity: f32,
    /// A photon's weight falls by so much per radius.
    pub slope: Vec3,
    /// Mean position of matter relative to the query, in metric space.
    pub lean: Vec3,
}

impl Matter {
    /// About a position of index space, whose own opacity is given and positive; `to_index` takes metric vectors to
    /// index space.
    #[inline(always)]
    pub fn about<S: Lanes>(
        simd: S,
        medium: &Medium,
        (position, own, lane): (Vec3, f32, usize),
        to_index: &Mat3,
        kernel: &impl GatherRegion,
        notes: &mut impl MarchNotes<S>,
    ) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        let (mut sum, mut sx, mut sy, mut sz) = (zero, zero, zero, zero);
        let (mut xx, mut yy, mut zz) = (zero, zero, zero);
        let (mut xy, mut xz, mut yz) = (zero, zero, zero);
        let Mat3 { x_axis: i, y_axis: j, z_axis: k } = *to_index;
        let most = S::f32s::splat(simd, own);
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
            notes.values_about(simd, lane, inside, value);
            let opacity = medium.transfer().opacity_lanes(simd, value).min(most);
            let opacity = inside.select(opacity, zero);
            let (ox, oy, oz) = (opacity * x, opacity * y, opacity * z);
            (sum, sx, sy, sz) = (sum + opacity, sx + ox, sy + oy, sz + oz);
            (xx, yy, zz) = (ox.mul_add(x, xx), oy.mul_add(y, yy), oz.mul_add(z, zz));
            (xy, xz, yz) = (ox.mul_add(y, xy), ox.mul_add(z, xz), oy.mul_add(z, yz));
            first += S::WIDTH;
        }
        // The position itself is one of the points: there is matter, but for rounding.
        let mean = (total(sum.as_slice()) + own) / (MOST_LANES + 1) as f32;
        if mean < LEAST_OPACITY {
            return Self { opacity: 0.0, slope: Vec3::ZERO, lean: Vec3::ZERO };
        }
        // Over the mean, which may be small, and its powers smaller than any number.
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
