//! What photons within a radius have met there: the mean opacity of a small sphere.

use super::grid::CellGrid;
use crate::math::{Mat3, Vec3};
use crate::medium::{MOST_LANES, MarchNotes, Medium};
use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::f32::consts::PI;

/// Share of the flux that the slope may take away at most: at a flat skin it takes 0.7.
const MOST_LEAN: f32 = 0.75;

/// Points of a sphere, opposite ones in pairs, spread evenly through it: the mean over them and the middle is exact where
/// opacity is linear.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kernel {
    /// About the middle, in index space.
    x: [f32; MOST_LANES],
    y: [f32; MOST_LANES],
    z: [f32; MOST_LANES],
    /// The same in metric space, in radii.
    u: [f32; MOST_LANES],
    v: [f32; MOST_LANES],
    w: [f32; MOST_LANES],
}

impl Kernel {
    pub fn new(grid: &CellGrid) -> Self {
        let zero = [0.0; MOST_LANES];
        let mut kernel = Self { x: zero, y: zero, z: zero, u: zero, v: zero, w: zero };
        let pairs = MOST_LANES / 2;
        for pair in 0..pairs {
            let share = (pair as f32 + 0.5) / pairs as f32;
            // Equal volumes, and a golden-angle spiral down one half; neighbours on it are at unlike radii.
            let radius = ((pair * 3 % pairs) as f32 + 0.5).cbrt() / (pairs as f32).cbrt();
            let (sin, cos) = (pair as f32 * PI * (3.0 - 5.0_f32.sqrt())).sin_cos();
            let across = (1.0 - share * share).sqrt();
            let q = Vec3::new(across * cos, across * sin, share) * radius;
            for (lane, q) in [(2 * pair, q), (2 * pair + 1, -q)] {
                let p = grid.in_ball(q);
                (kernel.u[lane], kernel.v[lane], kernel.w[lane]) = (q.x, q.y, q.z);
                (kernel.x[lane], kernel.y[lane], kernel.z[lane]) = (p.x, p.y, p.z);
            }
        }
        kernel
    }

    /// The matter about a place of index space, whose own opacity is given.
    #[inline(always)]
    pub fn matter<S: Lanes>(
        &self,
        simd: S,
        medium: &Medium,
        place: Vec3,
        own: f32,
        lane: usize,
        notes: &mut impl MarchNotes<S>,
    ) -> Matter {
        let zero = S::f32s::splat(simd, 0.0);
        let mut sum = S::f32s::splat(simd, 0.0);
        let (mut sx, mut sy, mut sz) = (zero, zero, zero);
        let (mut xx, mut yy, mut zz) = (zero, zero, zero);
        let (mut xy, mut xz, mut yz) = (zero, zero, zero);
        let mut first = 0;
        while first < MOST_LANES {
            let x = S::f32s::from_slice(simd, &self.x[first..first + S::WIDTH]);
            let y = S::f32s::from_slice(simd, &self.y[first..first + S::WIDTH]);
            let z = S::f32s::from_slice(simd, &self.z[first..first + S::WIDTH]);
            let about = [x + place.x, y + place.y, z + place.z];
            let inside = medium.contains_lanes(simd, about);
            let value = medium.volume().value_lanes(simd, about);
            notes.values_about(simd, lane, inside, value);
            let opacity = medium.transfer().opacity_lanes(simd, value);
            let opacity = inside.select(opacity, zero);
            let x = S::f32s::from_slice(simd, &self.u[first..first + S::WIDTH]);
            let y = S::f32s::from_slice(simd, &self.v[first..first + S::WIDTH]);
            let z = S::f32s::from_slice(simd, &self.w[first..first + S::WIDTH]);
            sum += opacity;
            let (ox, oy, oz) = (opacity * x, opacity * y, opacity * z);
            sx += ox;
            sy += oy;
            sz += oz;
            xx = ox.mul_add(x, xx);
            yy = oy.mul_add(y, yy);
            zz = oz.mul_add(z, zz);
            xy = ox.mul_add(y, xy);
            xz = ox.mul_add(z, xz);
            yz = oy.mul_add(z, yz);
            first += S::WIDTH;
        }
        let n = (MOST_LANES + 1) as f32;
        let mean = (total(sum.as_slice()) + own) / n;
        let lean = Vec3::new(total(sx.as_slice()), total(sy.as_slice()), total(sz.as_slice())) / n;
        let (xx, yy, zz) = (total(xx.as_slice()) / n, total(yy.as_slice()) / n, total(zz.as_slice()) / n);
        let (xy, xz, yz) = (total(xy.as_slice()) / n, total(xz.as_slice()) / n, total(yz.as_slice()) / n);
        let e = 0.02 * mean;
        let spread =
            Mat3::from_cols(Vec3::new(xx + e, xy, xz), Vec3::new(xy, yy + e, yz), Vec3::new(xz, yz, zz + e));
        let slope = spread.inverse() * lean;
        let slope = slope * (MOST_LEAN * mean / slope.dot(lean).max(MOST_LEAN * mean));
        Matter { opacity: mean - slope.dot(lean), slope }
    }
}

/// Moments of the opacity about a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matter {
    pub opacity: f32,
    /// Per radius.
    pub slope: Vec3,
}

#[inline(always)]
fn total(lanes: &[f32]) -> f32 {
    lanes.iter().sum()
}
