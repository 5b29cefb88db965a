//! The order of paths: within each block of paths that are stratified together, those with similar starts are adjacent.

use super::PathNumbers;
use crate::integrator::Limits;
use crate::math::cast;
use crate::sampling::LightPathSampler;
use rayon::prelude::*;
use std::ops::Range;

/// Number of paths that are ordered together.
pub(super) const BLOCK: u32 = LightPathSampler::STRATIFIED;

/// Keys that are computed at once: some tenths of a millisecond's work.
const PIECE: usize = 1 << 11;

/// The order of a block being found, in steps, so that a stop takes effect soon and the work can be resumed.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockOrder {
    /// Of each path a code of its start, and its number in the lower half.
    keys: Vec<u64>,
    /// Pieces whose keys are known.
    known: Vec<bool>,
}

impl BlockOrder {
    /// Continues, in parallel on the current pool; returns the paths in order, or `None` if stopped first. The paths must be the
    /// same in every call until then.
    pub fn go_on(&mut self, paths: Range<u32>, numbers: &PathNumbers, limits: &Limits) -> Option<Vec<u32>> {
        if self.keys.is_empty() {
            self.keys = vec![0; paths.len()];
            self.known = vec![false; paths.len().div_ceil(PIECE)];
        }
        let pieces = self.keys.par_chunks_mut(PIECE).zip(&mut self.known).enumerate();
        pieces.with_max_len(1).for_each(|(piece, (keys, known))| {
            if *known || limits.stop().reached() {
                return;
            }
            let first = paths.start + cast::fit_u32(piece * PIECE);
            for (path, key) in (first..).zip(keys) {
                *key = u64::from(morton(numbers.of(path).emission())) << u32::BITS | u64::from(path);
            }
            *known = true;
        });
        if self.known.contains(&false) || limits.stop().reached() {
            return None;
        }
        let mut keys = std::mem::take(&mut self.keys);
        // About a millisecond's work.
        keys.par_sort_unstable();
        Some(keys.into_iter().map(cast::low_u32).collect())
    }
}

/// The Morton code of four numbers in [0, 1): similar numbers have similar codes.
fn morton(u: [f32; 4]) -> u32 {
    let steps = u.map(|u| cast::low_u32(cast::index(u * 256.0) as u64));
    let bit = |i: u32| {
        let of = |k: usize| (steps[k] >> i & 1) << (3 - k);
        of(0) | of(1) | of(2) | of(3)
    };
    (0..8).rev().fold(0, |key, i| key << 4 | bit(i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;
    use std::time::{Duration, Instant};

    #[test]
    fn paths_are_ordered_by_their_starts_however_often_that_is_stopped() {
        let numbers = PathNumbers { seed: 3, pass: 0, stream: 7 };
        let cancel = AtomicBool::new(false);
        // On one thread, so that there are many slices.
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        for paths in [0..BLOCK, BLOCK..BLOCK + 5000, 2 * BLOCK..2 * BLOCK + 1] {
            let mut expected: Vec<u32> = paths.clone().collect();
            expected.sort_by_key(|&path| (morton(numbers.of(path).emission()), path));
            let (mut order, mut slices) = (BlockOrder::default(), 0);
            let found = loop {
                slices += 1;
                let deadline = Some(Instant::now() + Duration::from_micros(100));
                let limits = Limits { cancel: &cancel, deadline };
                if let Some(found) = one.install(|| order.go_on(paths.clone(), &numbers, &limits)) {
                    break found;
                }
                assert!(slices < 10_000, "no progress");
            };
            assert!(paths.len() < 10_000 || slices > 1, "never stopped");
            assert_eq!(found, expected);
        }
    }
}
