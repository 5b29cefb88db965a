//! Presets for labels: numbers of parts, each with a look of its own and nothing between them.

use crate::math::{Rgb, cast};
use crate::transfer::{Optics, Point};

/// A function that gives each of some whole values, ascending, its own optics, and shows nothing else.
pub(super) fn each(values: &[f64], optics: impl Fn(usize) -> Optics) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    let clear = |optics: Optics| Optics { opacity: 0.0, ..optics };
    for (i, &value) in values.iter().enumerate() {
        let optics = optics(i);
        let start = cast::single(value - 0.5);
        // Beyond 2^23 halves round; the value itself always has the part's look.
        let end = cast::single(value + 0.5).max(cast::single(value).next_up());
        match points.last_mut() {
            // The end of a neighbour's stretch: it jumps straight to this one.
            Some(last) if last.value >= start => last.optics = optics,
            _ => points.extend([clear(optics), optics].map(|optics| Point { value: start, optics })),
        }
        points.extend([optics, clear(optics)].map(|optics| Point { value: end, optics }));
    }
    points
}

/// Every label as a solid in a colour of its own.
pub(super) fn labels(values: &[f64]) -> Vec<Point> {
    /// At the density of a bare volume light enters parts by an eightieth of the diagonal: they look solid, and light that is sampled
    /// once per step still reaches what is seen of them, also in small volumes.
    const SOLID: f32 = 0.4;
    each(values, |i| Optics { opacity: SOLID, albedo: color(values[i]), ..Optics::default() })
}

/// A veil in one of `colors` for each label, denser the larger it is.
pub(super) fn veils(values: &[f64], colors: &[[f32; 3]], opacity: impl Fn(usize) -> f32) -> Vec<Point> {
    each(values, |i| {
        let layer = i * colors.len() / values.len();
        Optics {
            opacity: opacity(layer),
            albedo: Rgb::from(colors[layer]),
            surface: 0.6,
            ..Optics::default()
        }
    })
}

/// The colour of a label, which depends on nothing else, so that a part has the same in every file: hue, saturation and brightness are
/// the numbers of a sequence that keeps away from its earlier members \[Roberts18\].
fn color(label: f64) -> Rgb {
    // Powers of the inverse of the root of x^4 = x + 1.
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_7];
    let [hue, saturation, brightness] = STEPS.map(|step| cast::single((label * step).rem_euclid(1.0)));
    let (saturation, brightness) = (0.45 + 0.5 * saturation, 0.55 + 0.42 * brightness);
    let channel = |shift: f32| {
        let along = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        brightness * (1.0 - saturation * (1.0 - along.clamp(0.0, 1.0)))
    };
    Rgb::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::TransferFunction;

    #[test]
    fn every_label_is_solid_and_nothing_else_is() {
        for values in
            [vec![1.0, 3.0], vec![5.0, 117.0], vec![1.0, 2.0, 3.0, 9.0], vec![8_388_609.0, 16_777_216.0]]
        {
            let function = TransferFunction::new(labels(&values)).unwrap();
            for &value in &values {
                let optics = function.optics(cast::single(value));
                assert_eq!((optics.opacity, optics.albedo), (0.4, color(value)), "{value} of {values:?}");
                assert_eq!(function.opacity(cast::single(value)), 0.4, "{value} of {values:?}");
            }
            for other in [-1.0, 0.0, 4.0, 7.0, 118.0, 2e7] {
                assert_eq!(function.opacity(other), 0.0, "{other} of {values:?}");
            }
        }
    }

    #[test]
    fn labels_have_distinct_colors() {
        let mut labels: Vec<f64> = (1..=200).map(f64::from).collect();
        // As atlases of the brain number their parts.
        labels.extend((1001..=1035).chain(2001..=2035).chain(11_101..=11_175).map(f64::from));
        for (i, &a) in labels.iter().enumerate() {
            for &b in &labels[..i] {
                let [p, q] = [a, b].map(|label| color(label).to_array());
                let apart = (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f32::max);
                assert!(apart > 0.01, "{a} and {b}: {p:?} and {q:?}");
            }
            assert!(color(a).to_array().iter().all(|c| (0.02..=0.98).contains(c)), "{a}: {:?}", color(a));
        }
        for (a, b) in [(1.0, 3.0), (1.0, 8.0), (5.0, 117.0), (1.0, 2.0), (2.0, 3.0)] {
            let [p, q] = [a, b].map(|label| color(label).to_array());
            assert!((0..3).any(|c| (p[c] - q[c]).abs() > 0.15), "{a} and {b}: {p:?} and {q:?}");
        }
    }
}
