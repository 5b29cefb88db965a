//! The chi-square test must pass a correct sampler, except one time in a hundred, and reject a slightly wrong one.

use std::f32::consts::TAU;
use std::f64::consts::PI;
use tyndall_testing::{ChiSquare, Fault, SplitMix};

/// Henyey-Greenstein about an axis, in its textbook form.
fn henyey_greenstein(g: f32, axis: [f32; 3]) -> impl FnMut([f32; 2]) -> Option<[f32; 3]> {
    move |[a, b]| {
        let part = (1.0 - g * g) / (1.0 - g + 2.0 * g * a);
        let cos_theta = ((1.0 + g * g - part * part) / (2.0 * g)).clamp(-1.0, 1.0);
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        let (x, y) = (sin_theta * (TAU * b).cos(), sin_theta * (TAU * b).sin());
        let [s, t] = across(axis);
        Some([0, 1, 2].map(|i| x * s[i] + y * t[i] + cos_theta * axis[i]))
    }
}

fn henyey_greenstein_pdf(g: f64, axis: [f32; 3]) -> impl Fn([f32; 3]) -> f64 {
    move |w| {
        let cos_theta: f64 = (0..3).map(|i| f64::from(w[i]) * f64::from(axis[i])).sum();
        0.25 / PI * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5)
    }
}

/// Two unit vectors perpendicular to an axis that is not along x.
fn across([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    let length = y.hypot(z);
    let s = [0.0, z / length, -y / length];
    [s, [y * s[2] - z * s[1], z * s[0] - x * s[2], x * s[1] - y * s[0]]]
}

const POLE: [f32; 3] = [0.0, 0.0, 1.0];
const OBLIQUE: [f32; 3] = [0.48, -0.6, 0.64];

/// Cosine-weighted directions about z by rejection: fails in the part of the square outside the disk.
fn cosine_by_rejection([a, b]: [f32; 2]) -> Option<[f32; 3]> {
    let (x, y) = (2.0 * a - 1.0, 2.0 * b - 1.0);
    let square = x * x + y * y;
    (square < 1.0).then(|| [x, y, (1.0 - square).sqrt()])
}

fn cosine_pdf(w: [f32; 3]) -> f64 {
    f64::from(w[2].max(0.0)) / PI
}

#[test]
fn peaked_lobes_pass_in_any_direction() {
    let cases = [0.5_f32, -0.8, 0.95, 0.99].map(|g| [POLE, OBLIQUE].map(|axis| (g, axis)));
    for (g, axis) in cases.into_iter().flatten() {
        let test = ChiSquare::among(8);
        test.directions(henyey_greenstein(g, axis), henyey_greenstein_pdf(f64::from(g), axis)).assert();
    }
}

#[test]
fn a_density_in_single_precision_passes() {
    for g in [0.95_f32, 0.99] {
        let pdf = |w: [f32; 3]| {
            let cos_theta: f32 = (0..3).map(|i| w[i] * OBLIQUE[i]).sum();
            let square = 1.0 + g * g - 2.0 * g * cos_theta;
            f64::from((1.0 - g * g) / (2.0 * TAU * square * square.sqrt()))
        };
        ChiSquare::among(2).directions(henyey_greenstein(g, OBLIQUE), pdf).assert();
    }
}

#[test]
fn a_slightly_wrong_density_is_rejected() {
    for axis in [POLE, OBLIQUE] {
        for (drawn, claimed) in [(0.5, 0.52), (0.95, 0.952), (0.99, 0.9905)] {
            let fit = ChiSquare::default()
                .directions(henyey_greenstein(drawn, axis), henyey_greenstein_pdf(claimed, axis));
            assert!(fit.fault.is_none(), "not by statistics: {fit}");
            assert!(fit.p_value < 1e-10, "{drawn} passes for {claimed}: {fit}");
        }
    }
}

#[test]
fn the_shape_inside_a_peak_is_tested() {
    // The inner third of the lobe is sampled uniformly: within one cell of the undivided grid.
    let mut sample = henyey_greenstein(0.95, POLE);
    let edge = 0.999_f32;
    let flattened = move |[a, b, c]: [f32; 3]| {
        let w = sample([a, b])?;
        let cos_theta = edge + (1.0 - edge) * c;
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        let inside = [sin_theta * (TAU * b).cos(), sin_theta * (TAU * b).sin(), cos_theta];
        Some(if w[2] > edge { inside } else { w })
    };
    let fit = ChiSquare::default().directions(flattened, henyey_greenstein_pdf(0.95, POLE));
    assert!(fit.fault.is_none() && fit.p_value < 1e-10, "{fit}");
}

#[test]
fn failed_samples_are_counted_as_a_cell() {
    let share = PI / 4.0;
    ChiSquare::default().directions(cosine_by_rejection, |w| share * cosine_pdf(w)).assert();
    let forgotten = ChiSquare::default().directions(cosine_by_rejection, cosine_pdf);
    assert!(matches!(forgotten.fault, Some(Fault::Mass { .. })), "{forgotten}");
    // Three more failures in a thousand are within the tolerance of the mass, so only the cell detects them.
    let fails_more = |[a, b, c]: [f32; 3]| if c < 0.003 { None } else { cosine_by_rejection([a, b]) };
    let fit = ChiSquare { rows: 2, columns: 2, ..ChiSquare::default() }
        .directions(fails_more, |w| share * cosine_pdf(w));
    assert!(!fit.passes(), "{fit}");
}

#[test]
fn mass_density_and_directions_are_checked() {
    let fault = |scale: f64, stretch: f32| {
        let sample = |u: [f32; 2]| henyey_greenstein(0.5, POLE)(u).map(|w| w.map(|x| x * stretch));
        ChiSquare::default().directions(sample, |w| scale * henyey_greenstein_pdf(0.5, POLE)(w)).fault
    };
    assert_eq!(fault(1.0, 1.0), None);
    assert_eq!(fault(1.0005, 1.0), None);
    assert!(matches!(fault(1.002, 1.0), Some(Fault::Mass { .. })));
    assert!(matches!(fault(0.998, 1.0), Some(Fault::Mass { .. })));
    assert!(matches!(fault(-1.0, 1.0), Some(Fault::Density(_))));
    assert!(matches!(fault(f64::NAN, 1.0), Some(Fault::Density(_))));
    assert_eq!(fault(1.0, 1.01), Some(Fault::Stray(1_000_000)));
    assert_eq!(fault(1.0, f32::NAN), Some(Fault::Stray(1_000_000)));
}

#[test]
fn a_rare_sample_at_zero_density_is_detected() {
    let disk = |[a, b]: [f32; 2]| {
        let (sin, phi) = (a.sqrt(), TAU * b);
        [sin * phi.cos(), sin * phi.sin(), (1.0 - a).sqrt()]
    };
    let leaks = |[a, b, c]: [f32; 3]| {
        let [x, y, z] = disk([a, b]);
        Some([x, y, if c < 1e-5 { -z } else { z }])
    };
    let fit = ChiSquare::default().directions(leaks, cosine_pdf);
    assert!(matches!(fit.fault, Some(Fault::Impossible(1..50))), "{fit}");
}

#[test]
fn correct_samplers_are_rejected_one_time_in_a_hundred() {
    let p_values = (0..200).map(|seed| {
        let test = ChiSquare { samples: 50_000, rows: 8, columns: 8, seed, ..ChiSquare::default() };
        test.directions(henyey_greenstein(0.5, OBLIQUE), henyey_greenstein_pdf(0.5, OBLIQUE)).p_value
    });
    let p_values: Vec<f64> = p_values.collect();
    let rejected = p_values.iter().filter(|&&p| p < 0.01).count();
    // 2 on average; 8 or more occur one time in a thousand.
    assert!(rejected < 8, "{rejected} of 200");
    // Nor are there too few rejections: the p-values are uniform.
    ChiSquare::default().against_cdf(p_values, |p| p.clamp(0.0, 1.0), 10).assert();
}

#[test]
fn distances_that_end_in_the_medium_and_those_that_leave_it() {
    let (sigma_t, depth) = (1.5, 2.0_f64);
    let draw = |sigma_t: f64| {
        let mut random = SplitMix::new(5);
        (0..200_000).map(move |_| {
            let t = -(1.0 - random.uniform()).ln() / sigma_t;
            if t < depth { t } else { f64::INFINITY }
        })
    };
    let cdf = |t: f64| 1.0 - (-sigma_t * t.min(depth)).exp();
    ChiSquare::default().against_cdf(draw(sigma_t), cdf, 50).assert();
    assert!(!ChiSquare::default().against_cdf(draw(1.02 * sigma_t), cdf, 50).passes());
    // Correct within the medium, but too few leave it.
    let kept = draw(sigma_t).enumerate().filter(|(i, t)| t.is_finite() || i % 10 > 0).map(|(_, t)| t);
    assert!(!ChiSquare::default().against_cdf(kept, cdf, 50).passes());
    let negative = draw(sigma_t).map(|t| if t > 1.999 && t.is_finite() { -t } else { t });
    let fit = ChiSquare::default().against_cdf(negative, cdf, 50);
    assert!(matches!(fit.fault, Some(Fault::Stray(_))), "{fit}");
}

#[test]
fn lobes_that_end_in_a_jump_or_a_kink_pass_in_any_direction() {
    let mut random = SplitMix::new(2);
    for _ in 0..20 {
        // An axis anywhere but along x, and the cosine at which the cone of uniform directions ends.
        let [a, b, c] = random.uniforms();
        let (cos_theta, phi) = (1.8 * a - 0.9, TAU * b);
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        let axis = [cos_theta, sin_theta * phi.cos(), sin_theta * phi.sin()];
        let edge = 1.9 * c - 0.95;
        let about = |cos_theta: f32, u: f32| {
            let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
            let (x, y) = (sin_theta * (TAU * u).cos(), sin_theta * (TAU * u).sin());
            let [s, t] = across(axis);
            Some([0, 1, 2].map(|i| x * s[i] + y * t[i] + cos_theta * axis[i]))
        };
        let along = |w: [f32; 3]| -> f64 { (0..3).map(|i| f64::from(w[i]) * f64::from(axis[i])).sum() };

        let even =
            |w: [f32; 3]| if along(w) > f64::from(edge) { 0.5 / PI / (1.0 - f64::from(edge)) } else { 0.0 };
        let cone = ChiSquare::among(40).directions(|[a, b]: [f32; 2]| about(1.0 - a * (1.0 - edge), b), even);
        assert!(cone.passes(), "cone of {edge} about {axis:?}: {cone}");
        let cosine = |w: [f32; 3]| along(w).max(0.0) / PI;
        let hemisphere =
            ChiSquare::among(40).directions(|[a, b]: [f32; 2]| about((1.0 - a).sqrt(), b), cosine);
        assert!(hemisphere.passes(), "hemisphere about {axis:?}: {hemisphere}");
    }
}

#[test]
fn choices() {
    let mut random = SplitMix::new(9);
    let mut counts = [0; 3];
    for _ in 0..100_000 {
        let u = random.uniform();
        counts[usize::from(u > 0.2) + usize::from(u > 0.5)] += 1;
    }
    ChiSquare::default().discrete(&[0.2, 0.3, 0.5], &counts).assert();
    assert!(!ChiSquare::default().discrete(&[0.21, 0.29, 0.5], &counts).passes());
    let fit = ChiSquare::default().discrete(&[0.5, 0.5, 0.0], &[5000, 4999, 1]);
    assert_eq!(fit.fault, Some(Fault::Impossible(1)));
    let fit = ChiSquare::default().discrete(&[0.2, 0.3, 0.4], &counts);
    assert!(matches!(fit.fault, Some(Fault::Mass { .. })), "{fit}");
}

#[test]
fn the_message_says_where() {
    let fit =
        ChiSquare::default().directions(henyey_greenstein(0.5, POLE), henyey_greenstein_pdf(0.55, POLE));
    let message = fit.to_string();
    assert!(message.contains("rejected below 1.000e-2; worst: cos_theta "), "{message}");
}
