//! Presets that find their thresholds in the histogram.

use super::{Profile, glossy, labels, matter};
use crate::math::{Rgb, cast};
use crate::transfer::Point;
use crate::volume::Volume;

const STONE: [f32; 3] = [0.86, 0.74, 0.58];
const WHITE: [f32; 3] = [0.97, 0.97, 0.97];

/// The threshold between two classes of values by Otsu's criterion \[Otsu79\], as a share of the range:
/// the one that separates the classes' means most, weighted by their sizes.
fn otsu(profile: &Profile) -> f64 {
    let counts = &profile.histogram.counts;
    let total: f64 = counts.iter().map(|&n| n as f64).sum();
    let moment: f64 = counts.iter().enumerate().map(|(i, &n)| i as f64 * n as f64).sum();
    let (mut below, mut below_moment) = (0.0, 0.0);
    // Between well-separated classes the criterion is flat: the middle of the flat part is the natural threshold.
    let (mut best, mut first, mut last) = (-1.0, 0, 0);
    for (i, &n) in counts.iter().enumerate() {
        below += n as f64;
        below_moment += i as f64 * n as f64;
        let above = total - below;
        if below == 0.0 || above <= 0.0 {
            continue;
        }
        let gap = below_moment / below - (moment - below_moment) / above;
        let separation = below * above * gap * gap;
        if separation > best * (1.0 + 1e-9) {
            (best, first) = (separation, i);
        }
        if separation >= best * (1.0 - 1e-9) {
            last = i;
        }
    }
    if best < 0.0 { 0.0 } else { (0.5 * (first + last) as f64 + 1.0) / counts.len() as f64 }
}

/// Whether nearly all values lie near the two ends of the range: a segmented or binary volume.
pub(super) fn is_two_phase(profile: &Profile) -> bool {
    let counts = &profile.histogram.counts;
    let tenth = counts.len() / 10;
    let total: u64 = counts.iter().sum();
    let low: u64 = counts[..tenth].iter().sum();
    let high: u64 = counts[counts.len() - tenth..].iter().sum();
    let share = |n: u64| n as f64 / total as f64;
    share(low) > 0.05 && share(high) > 0.05 && share(low) + share(high) > 0.8
}

/// What a preset shows of data of a single value, which has no threshold: nothing of background, and of anything else its densest
/// matter, among the points that it would have.
pub(super) fn of_one_value(points: &[Point], value: f64) -> Point {
    let densest = points.iter().max_by(|a, b| a.optics.opacity.total_cmp(&b.optics.opacity));
    let mut optics = densest.map(|point| point.optics).unwrap_or_default();
    if Volume::is_background(value) {
        optics.opacity = 0.0;
    }
    Point { value: cast::single(value), optics }
}

/// Keeps thresholds distinct where single precision would not.
fn ascending(mut points: Vec<Point>) -> Vec<Point> {
    for i in 1..points.len() {
        let before = points[i - 1].value;
        if points[i].value <= before {
            points[i].value = before.next_up();
        }
    }
    points
}

/// Values of magnetic resonance have no units: the threshold `t` between air and tissue takes their place, and what is left above it.
pub(super) fn mri(profile: &Profile) -> Vec<Point> {
    let t = otsu(profile);
    let above = |share: f64| profile.at(t + share * (1.0 - t));
    ascending(vec![
        glossy(profile.at(0.9 * t), 0.0, [0.66, 0.34, 0.25], 0.4, 0.3),
        glossy(above(0.13), 0.3, [0.75, 0.40, 0.30], 0.6, 0.3),
        glossy(above(0.32), 0.8, [0.88, 0.58, 0.46], 0.7, 0.3),
        glossy(above(0.57), 1.0, [0.96, 0.86, 0.74], 0.7, 0.3),
        glossy(profile.at(1.0), 1.0, [0.97, 0.93, 0.85], 0.7, 0.3),
    ])
}

pub(super) fn mri_glass(profile: &Profile) -> Vec<Point> {
    const GLASS: [f32; 3] = [0.45, 0.66, 0.95];
    let t = otsu(profile);
    let above = |share: f64| profile.at(t + share * (1.0 - t));
    ascending(vec![
        glossy(profile.at(0.8 * t), 0.0, GLASS, 0.2, 0.2),
        glossy(above(0.06), 0.02, GLASS, 0.8, 0.2),
        glossy(above(0.16), 0.001, [0.60, 0.66, 0.90], 0.3, 0.2),
        glossy(above(0.38), 0.004, [0.90, 0.50, 0.40], 0.3, 0.2),
        glossy(above(0.48), 0.05, [0.95, 0.70, 0.52], 0.6, 0.25),
        glossy(profile.at(1.0), 0.06, [0.98, 0.86, 0.70], 0.7, 0.25),
    ])
}

pub(super) fn solid(profile: &Profile) -> Vec<Point> {
    if let Some(values) = profile.labels {
        // Whatever its number, no part is background.
        let border = cast::single(values[0] - 0.5);
        return vec![matter(border, 0.0, STONE, 0.7), matter(border, 1.0, STONE, 0.7)];
    }
    let t = otsu(profile);
    ascending(vec![
        matter(profile.at(t - 0.08), 0.0, STONE, 0.7),
        matter(profile.at(t + 0.08), 1.0, STONE, 0.7),
    ])
}

/// The share of the range up to which values are background.
fn floor(profile: &Profile) -> f64 {
    // The most common value is the background if it is near the bottom, as it usually is.
    let counts = &profile.histogram.counts;
    let mode = (0..counts.len()).max_by_key(|&i| counts[i]).unwrap_or(0) as f64 / counts.len() as f64;
    if mode < 0.3 { mode + 0.02 } else { 0.0 }
}

pub(super) fn cloud(profile: &Profile) -> Vec<Point> {
    let floor = profile.at(floor(profile));
    ascending(vec![matter(floor, 0.0, WHITE, 0.0), matter(profile.at(1.0), 1.0, WHITE, 0.0)])
}

/// A stain as under a bright-field microscope, which takes the more light the more there is of it.
pub(super) fn stain(profile: &Profile) -> Vec<Point> {
    let floor = floor(profile);
    let at = |share: f64| profile.at(floor + (1.0 - floor) * share);
    ascending(vec![
        matter(at(0.0), 0.0, [0.86, 0.56, 0.70], 0.0),
        matter(at(0.15), 0.02, [0.82, 0.44, 0.62], 0.0),
        matter(at(0.4), 0.15, [0.55, 0.25, 0.55], 0.2),
        matter(at(0.7), 0.5, [0.30, 0.14, 0.44], 0.3),
        matter(at(1.0), 1.0, [0.18, 0.08, 0.32], 0.3),
    ])
}

/// Glow of a dye whose concentration is the value, in matter that scatters little.
pub(super) fn fluorescence(profile: &Profile) -> Vec<Point> {
    /// Shares of the values above the background, with opacity and radiance.
    const DYE: [(f64, f32, [f32; 3]); 5] = [
        (0.0, 0.0, [0.0, 0.02, 0.05]),
        (0.2, 0.04, [0.01, 0.10, 0.22]),
        (0.45, 0.25, [0.03, 0.55, 0.50]),
        (0.75, 0.7, [0.25, 1.5, 0.9]),
        (1.0, 1.0, [1.6, 2.4, 1.5]),
    ];
    const ALBEDO: [f32; 3] = [0.2; 3];
    let floor = floor(profile);
    let point = |(share, opacity, emission): (f64, f32, [f32; 3])| {
        let mut point = matter(profile.at(floor + (1.0 - floor) * share), opacity, ALBEDO, 0.0);
        point.optics.emission = Rgb::from(emission);
        point
    };
    ascending(DYE.map(point).to_vec())
}

pub(super) fn layers(profile: &Profile) -> Vec<Point> {
    const COLORS: [[f32; 3]; 4] =
        [[0.35, 0.55, 0.90], [0.40, 0.80, 0.50], [0.95, 0.75, 0.30], [0.92, 0.35, 0.25]];
    let opacity = |i: usize| (0.06 * 2.5_f32.powi(cast::fit_u32(i).cast_signed())).min(1.0);
    if let Some(values) = profile.labels {
        return labels::veils(values, &COLORS, opacity);
    }
    let t = 0.7 * otsu(profile);
    let layer = |(i, color): (usize, &[f32; 3])| {
        let middle = t + (1.0 - t) * (i as f64 + 0.5) / COLORS.len() as f64;
        let half = (1.0 - t) * 0.06;
        [
            matter(profile.at(middle - half), 0.0, *color, 0.6),
            matter(profile.at(middle), opacity(i), *color, 0.6),
            matter(profile.at(middle + half), 0.0, *color, 0.6),
        ]
    };
    ascending(COLORS.iter().enumerate().flat_map(layer).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Histogram;

    #[test]
    fn the_threshold_falls_between_two_humps() {
        let hump = |i: i32, at: i32, n: f64| n * (-f64::from((i - at).pow(2)) / 200.0).exp();
        let count = |i| cast::index(cast::single(hump(i, 20, 9e5) + hump(i, 150, 1e5))) as u64;
        let counts = (0..256).map(count).collect();
        let profile = Profile { histogram: &Histogram { range: [0.0, 1.0], counts }, labels: None };
        let t = otsu(&profile);
        assert!((0.2..0.5).contains(&t), "{t}");
        assert!(!is_two_phase(&profile));
    }

    #[test]
    fn two_values_are_separated_in_the_middle() {
        let mut counts = vec![0; 256];
        (counts[0], counts[255]) = (500, 500);
        let profile = Profile { histogram: &Histogram { range: [0.0, 1.0], counts }, labels: None };
        assert!((otsu(&profile) - 0.5).abs() < 0.01);
        assert!(is_two_phase(&profile));
    }
}
