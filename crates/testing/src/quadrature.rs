//! Adaptive quadrature in one and two dimensions, for the known answers that estimators are tested against.
//!
//! Each piece is integrated by the 15-point Kronrod rule; its difference from the embedded 7-point Gauss rule bounds
//! the error, and the worst piece is halved until the total error is small enough \[Piessens83\]. Kinks, jumps
//! and narrow peaks are resolved by ever smaller pieces. A peak that falls between all points of the first rule is
//! missed: split the range where a peak is known to be.

/// Positive abscissae of the Kronrod rule on [-1, 1], outermost first; those at odd indices are the Gauss rule's.
const ABSCISSAE: [f64; 7] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
];
/// Weights of the Kronrod rule at these abscissae, and at 0.
const KRONROD: ([f64; 7], f64) = (
    [
        0.022_935_322_010_529_224,
        0.063_092_092_629_978_55,
        0.104_790_010_322_250_19,
        0.140_653_259_715_525_92,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
    ],
    0.209_482_141_084_727_82,
);
/// Weights of the Gauss rule at its abscissae, and at 0.
const GAUSS: ([f64; 3], f64) =
    ([0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9], 0.417_959_183_673_469_4);

/// The inner integral of a double one has this fraction of the tolerance, or the outer one would refine its errors.
const INNER_SHARE: f64 = 0.1;

/// The largest acceptable error, the greater of `absolute` and `relative`, and the most work allowed to reach it.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// In units of the integral.
    pub absolute: f64,
    /// As a share of the integral's value.
    pub relative: f64,
    /// Number of pieces after which to give up. A jump takes about 50, one for each bit of its position.
    pub most_pieces: usize,
}

impl Default for Tolerance {
    /// Far below any sampling error, well above the rounding of double precision.
    fn default() -> Self {
        Self { absolute: 1e-12, relative: 1e-9, most_pieces: 1000 }
    }
}

impl Tolerance {
    fn allows(self, integral: Integral) -> bool {
        // An infinite error is within a share of an infinite value, but that is no answer.
        integral.error.is_finite()
            && integral.error <= self.absolute.max(self.relative * integral.value.abs())
    }
}

/// An integral and its possible error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integral {
    /// The value.
    pub value: f64,
    /// Estimate of its error, usually far too high.
    pub error: f64,
}

/// Integral of `f` over a range, to the default [`Tolerance`].
///
/// ```
/// let transmitted = tyndall_testing::quadrature::integrate(|t| (-t * t).exp(), [0.0, 10.0]);
/// assert!((transmitted - std::f64::consts::PI.sqrt() / 2.0).abs() < 1e-9);
/// ```
///
/// # Panics
/// If the tolerance is not reached: `f` is not finite, or is computed in single precision (its rounding looks like
/// endless detail; [`integrate_to`] accepts a wider tolerance).
#[track_caller]
#[must_use]
pub fn integrate(f: impl Fn(f64) -> f64, range: [f64; 2]) -> f64 {
    reached(integrate_to(Tolerance::default(), f, range))
}

/// Integral of `f(x, y)` over a rectangle, to the default [`Tolerance`].
///
/// # Panics
/// As [`integrate`].
#[track_caller]
#[must_use]
pub fn integrate_2d(f: impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    reached(integrate_2d_to(Tolerance::default(), f, x, y))
}

/// Integral of `f` over a range; its error shows whether the tolerance was reached.
#[must_use]
pub fn integrate_to(tolerance: Tolerance, f: impl Fn(f64) -> f64, range: [f64; 2]) -> Integral {
    adapt(tolerance, |x| Integral { value: f(x), error: 0.0 }, range)
}

/// Integral of `f(x, y)` over a rectangle: `y` is the inner integral, `x` the outer.
#[must_use]
pub fn integrate_2d_to(
    tolerance: Tolerance,
    f: impl Fn(f64, f64) -> f64,
    x: [f64; 2],
    y: [f64; 2],
) -> Integral {
    let width = (x[1] - x[0]).abs();
    let inner = Tolerance {
        absolute: INNER_SHARE * tolerance.absolute / width.max(f64::MIN_POSITIVE),
        relative: INNER_SHARE * tolerance.relative,
        ..tolerance
    };
    adapt(tolerance, |x| integrate_to(inner, |y| f(x, y), y), x)
}

#[track_caller]
fn reached(integral: Integral) -> f64 {
    assert!(
        Tolerance::default().allows(integral),
        "the quadrature stopped at {} with an error of {}; is the integrand finite, and in double precision?",
        integral.value,
        integral.error
    );
    integral.value
}

/// Halves the worst piece until the rule's own error is small enough.
fn adapt(tolerance: Tolerance, f: impl Fn(f64) -> Integral, range: [f64; 2]) -> Integral {
    let mut pieces = vec![Piece::new(&f, range)];
    loop {
        let rule = Integral {
            value: pieces.iter().map(|piece| piece.value).sum(),
            error: pieces.iter().map(|piece| piece.error).sum(),
        };
        let worst =
            (0..pieces.len()).max_by(|&a, &b| pieces[a].error.total_cmp(&pieces[b].error)).unwrap_or(0);
        let [start, end] = pieces[worst].range;
        let middle = 0.5 * (start + end);
        let indivisible = middle == start || middle == end;
        if tolerance.allows(rule)
            || !rule.error.is_finite()
            || indivisible
            || pieces.len() >= tolerance.most_pieces
        {
            let inherited: f64 = pieces.iter().map(|piece| piece.inherited).sum();
            return Integral { value: rule.value, error: rule.error + inherited };
        }
        pieces[worst] = Piece::new(&f, [start, middle]);
        pieces.push(Piece::new(&f, [middle, end]));
    }
}

/// A part of the range, integrated by one application of the rule.
struct Piece {
    range: [f64; 2],
    value: f64,
    /// Difference between the two rules.
    error: f64,
    /// The integral of the integrand's own error.
    inherited: f64,
}

impl Piece {
    fn new(f: impl Fn(f64) -> Integral, range: [f64; 2]) -> Self {
        let (middle, half) = (0.5 * (range[0] + range[1]), 0.5 * (range[1] - range[0]));
        let center = f(middle);
        let (mut kronrod, mut gauss) = (KRONROD.1 * center.value, GAUSS.1 * center.value);
        let mut inherited = KRONROD.1 * center.error;
        for (i, abscissa) in ABSCISSAE.iter().enumerate() {
            let (left, right) = (f(middle - half * abscissa), f(middle + half * abscissa));
            kronrod += KRONROD.0[i] * (left.value + right.value);
            inherited += KRONROD.0[i] * (left.error + right.error);
            if i % 2 == 1 {
                gauss += GAUSS.0[i / 2] * (left.value + right.value);
            }
        }
        let error = (half * (kronrod - gauss)).abs();
        Self { range, value: half * kronrod, error, inherited: half.abs() * inherited }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    #[track_caller]
    fn assert_close(value: f64, expected: f64) {
        assert!((value - expected).abs() <= 1e-9 * expected.abs(), "{value}, expected {expected}");
    }

    #[test]
    fn one_application_is_exact_up_to_the_degree_of_the_rules() {
        for degree in (0..=22).step_by(2) {
            let exact = 2.0 / f64::from(degree + 1);
            let power = |x: f64| Integral { value: x.powi(degree), error: 0.0 };
            let piece = Piece::new(power, [-1.0, 1.0]);
            assert!((piece.value - exact).abs() < 1e-15, "degree {degree}: {} for {exact}", piece.value);
            // Gauss with 7 points is exact up to degree 13, so the two rules differ only from 14 on.
            assert_eq!(piece.error > 1e-8, degree > 13, "degree {degree}: {}", piece.error);
        }
    }

    #[test]
    fn kinks_jumps_and_peaks() {
        assert_close(integrate(|x| (x - 0.3).abs(), [0.0, 1.0]), 0.29);
        assert_close(integrate(|x| if x < 0.3 { 1.0 } else { 5.0 }, [0.0, 1.0]), 3.8);
        let lorentz = |x: f64| 1e-3 / (x * x + 1e-6);
        assert_close(integrate(lorentz, [-1.0, 2.0]), (1e3_f64).atan() + (2e3_f64).atan());
        assert_close(integrate(|x| -x.exp(), [1.0, 0.0]), 1.0_f64.exp() - 1.0);
    }

    #[test]
    fn a_double_integral_with_a_curved_edge() {
        let disk = |x: f64, y: f64| (1.0 - x * x - y * y).max(0.0).sqrt();
        assert_close(integrate_2d(disk, [0.0, 1.0], [0.0, 1.0]), PI / 6.0);
        assert_close(integrate_2d(|t, phi| t.sin() * phi, [0.0, FRAC_PI_2], [0.0, TAU]), TAU * PI);
        assert_eq!(integrate_2d(|_, _| 0.0, [0.0, 1.0], [0.0, 1.0]), 0.0);
    }

    #[test]
    fn a_failed_integration_is_reported() {
        let pole = integrate_to(Tolerance::default(), |x| 1.0 / (x - 0.3).powi(2), [0.0, 1.0]);
        assert!(!Tolerance::default().allows(pole), "{pole:?}");
        assert!(integrate_to(Tolerance::default(), |_| f64::NAN, [0.0, 1.0]).error.is_nan());
        // The error of the inner integral is passed on to the outer one.
        let inner = integrate_2d_to(Tolerance::default(), |_, y| 1.0 / y, [0.0, 1.0], [0.0, 1.0]);
        assert!(!Tolerance::default().allows(inner), "{inner:?}");
    }

    #[test]
    #[should_panic(expected = "the quadrature stopped")]
    fn a_known_answer_is_never_silently_wrong() {
        let _ = integrate(|x| (1.0 / x).sin() / x, [0.0, 1.0]);
    }
}
