//! From the rays that cross a plane to the texels in it.

use super::bricks::EDGE;
use super::step::Crossings;
use crate::math::cast;
use std::ops::Range;

/// Transmittances at a brick's texels in a plane.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlaneOfBrick {
    /// Row by row along v; in the bytes of a word along u, lowest first.
    pub kept: [u64; EDGE],
    /// Bytes of ones for the texels that the fan reaches; the others are zeros.
    pub reached: [u64; EDGE],
}

/// Transmittances of the rays of a fan to the planes of a slab.
#[derive(Clone, Copy, Debug)]
pub(super) struct PassedRays<'a> {
    /// Row by row of rays, and in it plane by plane.
    pub bytes: &'a [u8],
    /// Rays along u and v.
    pub rays: [usize; 2],
    /// The plane's number in the slab.
    pub plane: usize,
}

impl<'a> PassedRays<'a> {
    #[inline(always)]
    fn row(&self, j: usize) -> &'a [u8] {
        self.bytes.get((j * EDGE + self.plane) * self.rays[0]..).unwrap_or(&[])
    }
}

/// How rays cross a plane, along u and v.
#[derive(Clone, Copy, Debug)]
pub(super) enum RayGrid {
    /// Rays of a distant point are as far from each other as texels.
    Parallel {
        /// Number of the last ray before the first texel.
        before: [usize; 2],
        /// Share of the ray after it there, in parts of 256.
        share: [u16; 2],
    },
    /// Rays of a near point.
    Spread([Crossings; 2]),
}

impl RayGrid {
    /// Of rays that begin before the first texel and are as far from each other as texels.
    pub fn parallel([at_u, at_v]: [Crossings; 2]) -> Self {
        let before = [cast::index(-at_u.first), cast::index(-at_v.first)];
        let share = [part(-at_u.first - before[0] as f32), part(-at_v.first - before[1] as f32)];
        Self::Parallel { before, share }
    }

    /// Transmittances at a brick's texels, between those of the four rays around each. `brick` is where it is along u and v; `reached` tells
    /// which texels of a row are reached by rays of a near point.
    #[inline(always)]
    pub fn texels(
        &self,
        passed: &PassedRays,
        [brick_u, brick_v]: [usize; 2],
        reached: impl Fn(usize) -> Range<usize>,
    ) -> PlaneOfBrick {
        let [u, v] = [brick_u * EDGE, brick_v * EDGE];
        let [rays, rows] = passed.rays;
        match self {
            Self::Parallel { before: [i, j], share: [share_u, share_v] } => {
                let (mut around, mut next) = ([0; EDGE + 1], [0; EDGE + 1]);
                for k in 0..=EDGE {
                    let row = passed.row(j + v + k);
                    around[k] = word(row, i + u);
                    next[k] = u64::from(row.get(i + u + EDGE).copied().unwrap_or(0));
                }
                let left = between_rows(&around, *share_v);
                let last = between_rows(&next, *share_v);
                let mut right = [0; EDGE];
                for k in 0..EDGE {
                    right[k] = left[k] >> 8 | last[k] << 56;
                }
                PlaneOfBrick { kept: mix(&left, &right, *share_u), reached: [u64::MAX; EDGE] }
            }
            Self::Spread([at_u, at_v]) => {
                let mut plane = PlaneOfBrick::default();
                for k in 0..EDGE {
                    let lower = (((v + k) as f32 - at_v.first) * at_v.inverse).clamp(0.0, (rows - 2) as f32);
                    let j = cast::index(lower);
                    let (a, b, share_v) = (passed.row(j), passed.row(j + 1), lower - j as f32);
                    let reached = reached(v + k);
                    for texel in u.max(reached.start)..(u + EDGE).min(reached.end) {
                        let along =
                            ((texel as f32 - at_u.first) * at_u.inverse).clamp(0.0, (rays - 2) as f32);
                        let i = cast::index(along);
                        let between =
                            |i: usize| f32::from(a[i]) + (f32::from(b[i]) - f32::from(a[i])) * share_v;
                        let (left, right) = (between(i), between(i + 1));
                        let kept = cast::index((right - left) * (along - i as f32) + left + 0.5) as u64;
                        plane.kept[k] |= kept << (8 * (texel - u));
                        plane.reached[k] |= 0xFF << (8 * (texel - u));
                    }
                }
                plane
            }
        }
    }
}

/// Eight bytes of a row, the first one lowest; 0 where there are not so many.
#[inline(always)]
fn word(row: &[u8], first: usize) -> u64 {
    row.get(first..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// A share in parts of 256.
fn part(share: f32) -> u16 {
    cast::round_u16(share * 256.0)
}

/// Between neighbouring rows, by the second's share in parts of 256.
#[inline(always)]
fn between_rows(rows: &[u64; EDGE + 1], share: u16) -> [u64; EDGE] {
    let (mut a, mut b) = ([0; EDGE], [0; EDGE]);
    a.copy_from_slice(&rows[..EDGE]);
    b.copy_from_slice(&rows[1..]);
    mix(&a, &b, share)
}

/// Between the bytes of words, by the second's share in parts of 256; rounded.
#[inline(always)]
fn mix(a: &[u64; EDGE], b: &[u64; EDGE], share: u16) -> [u64; EDGE] {
    let (a, b): (&[u16; 4 * EDGE], &[u16; 4 * EDGE]) = (bytemuck::cast_ref(a), bytemuck::cast_ref(b));
    let mut mixed = [0; 4 * EDGE];
    for i in 0..mixed.len() {
        let lower = (a[i] & 0xFF) * (256 - share) + (b[i] & 0xFF) * share + 128;
        let upper = (a[i] >> 8) * (256 - share) + (b[i] >> 8) * share + 128;
        mixed[i] = lower >> 8 | upper & 0xFF00;
    }
    bytemuck::cast(mixed)
}
