//! How view rays are divided into segments.

use crate::math::cast;

/// The range of a segment's steps: a ray's steps are divided evenly among its segments.
pub(super) fn steps_of(segment: usize, per_ray: usize, count: i32) -> [i32; 2] {
    let border = |segment: usize| {
        let steps = i64::from(count) * segment as i64 / per_ray as i64;
        i32::try_from(steps).unwrap_or(i32::MAX)
    };
    [border(segment), border(segment + 1)]
}

/// The distances along the track at which a range of steps begins and ends.
pub(super) fn ends(steps: [i32; 2], step: f32) -> [f32; 2] {
    steps.map(|k| k as f32 * step)
}

/// The segment that a step is in.
pub(super) fn segment_of(step: i32, per_ray: usize, count: i32) -> usize {
    let number = ((i64::from(step) + 1) * per_ray as i64 - 1) / i64::from(count.max(1));
    usize::try_from(number).unwrap_or(0).min(per_ray - 1)
}

/// Fraction of a gather due at the beginning of a segment: evenly distributed over neighbouring pixels and segments, by
/// a lattice of irrational steps.
pub(super) fn due_in([x, y]: [u32; 2], segment: usize) -> f32 {
    let along = cast::fit_u32(segment).wrapping_mul(0x9e37_79b9);
    let turn = x.wrapping_mul(0xc13f_a9a9).wrapping_add(y.wrapping_mul(0x91e1_0da5)).wrapping_add(along);
    (turn >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathers_are_due_evenly_over_neighbouring_pixels() {
        for (x, y, segment) in [(0, 0, 0), (0, 0, 1), (500, 301, 6), (4000, 3, 19)] {
            let pixels = (0..64).map(|i| [x + i % 8, y + i / 8]);
            let mut due: Vec<f32> = pixels.map(|pixel| due_in(pixel, segment)).collect();
            due.sort_by(f32::total_cmp);
            for (i, due) in due.iter().enumerate() {
                assert!((due - (i as f32 + 0.5) / 64.0).abs() < 0.06, "{i}: {due}");
            }
        }
    }

    #[test]
    fn every_step_is_in_the_segment_that_has_it() {
        for (per_ray, count) in [(1, 7), (7, 3), (7, 700), (20, 333), (5, 0)] {
            let mut next = 0;
            for segment in 0..per_ray {
                let [from, to] = steps_of(segment, per_ray, count);
                assert_eq!(from, next);
                for step in from..to {
                    assert_eq!(segment_of(step, per_ray, count), segment, "{step} of {count}");
                }
                next = to;
            }
            assert_eq!(next, count);
        }
    }
}
