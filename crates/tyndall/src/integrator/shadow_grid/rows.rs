//! Rows of numbers, read in lanes.

use crate::simd::Lanes;
use fearless_simd::prelude::*;
use std::ops::Range;

/// What a row of rays meets at a plane.
#[derive(Clone, Debug)]
pub(super) struct RowExtinction {
    /// Rays that may meet matter.
    pub rays: Range<usize>,
    /// Extinction at each ray's crossing; 0 for other rays.
    pub extinction: Vec<f32>,
}

impl RowExtinction {
    /// Of so many rays that meet nothing.
    pub fn new(rays: usize) -> Self {
        Self { rays: 0..0, extinction: vec![0.0; rays] }
    }

    pub fn clear(&mut self) {
        self.extinction[self.rays.clone()].fill(0.0);
        self.rays = 0..0;
    }
}

/// Numbers of a row from an index on; 0 past its end.
#[inline(always)]
pub(super) fn load<S: Lanes>(simd: S, row: &[f32], first: usize) -> S::f32s {
    match row.get(first..first + S::WIDTH) {
        Some(numbers) => S::f32s::from_slice(simd, numbers),
        None => S::f32s::from_fn(simd, |lane| row.get(first + lane).copied().unwrap_or(0.0)),
    }
}

/// Between an entry of a table and the next.
#[inline(always)]
pub(super) fn between<S: Lanes>(simd: S, table: &[f32], entry: S::u32s, share: S::f32s) -> S::f32s {
    let (a, b) = (simd.numbers(table, entry), simd.numbers(table, entry + 1));
    (b - a).mul_add(share, a)
}

/// Between two rows.
#[inline(always)]
pub(super) fn mix_rows<S: Lanes>(simd: S, [a, b]: [&[f32]; 2], share: f32, out: &mut [f32]) {
    let width = S::WIDTH;
    let whole = out.len() / width * width;
    for i in (0..whole).step_by(width) {
        let from = S::f32s::from_slice(simd, &a[i..i + width]);
        let to = S::f32s::from_slice(simd, &b[i..i + width]);
        let mixed = (to - from).mul_add(S::f32s::splat(simd, share), from);
        mixed.store_slice(&mut out[i..i + width]);
    }
    for i in whole..out.len() {
        out[i] = (b[i] - a[i]).mul_add(share, a[i]);
    }
}
