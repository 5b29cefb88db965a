//! The ABC microfacet model of Löw, Kronander, Ynnerman and Unger \[Low12\].

use super::coat::Half;
use crate::math::cast;

/// Why an ABC distribution is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BrdfError {
    /// The width is out of range.
    #[error("abc: b is {0}, expected 0 < b <= 1e8; measured gloss has 100 to 1e6")]
    B(f32),
    /// The fall-off is out of range.
    #[error("abc: c is {0}, expected 0 <= c <= 1000; measured gloss has 0.1 to 2")]
    C(f32),
}

/// Microfacets distributed by `D(h) = A / (1 + B (1 - n . h))^C` \[Low12, eq. 15\], where
/// `f_r = base + F(k . h) D(h) G / (4 (n . w_in) (n . w_out))`.
///
/// B sets how narrow the lobe is and C how slowly it falls off. The paper fits A per material, at
/// any scale; here A follows from `integral of D(h) (n . h) dh = 1`, which makes `D` a
/// distribution of facets, and the factor 1/4 of mirroring is explicit. The paper's diffuse
/// term is constant; here it is the coupled one of \[Ashikhmin00\], since a constant one plus a Fresnel term
/// reflects more than it receives at grazing. With the V-groove `G` \[Torrance67\] both together are
/// reciprocal and reflect at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Abc {
    b: f32,
    c: f32,
    /// A: `D` at `n`, \[1/sr\].
    peak: f32,
    /// Density over facets at `n` when `D` alone is sampled, \[1/sr\].
    drawn_peak: f32,
    /// `(1 + B)^(1 - C) - 1`.
    span: f32,
}

impl Abc {
    /// From B, the inverse width, and C, the fall-off.
    ///
    /// # Errors
    /// [`BrdfError`] unless `0 < b <= 1e8` and `0 <= c <= 1000`.
    pub fn new(b: f32, c: f32) -> Result<Self, BrdfError> {
        if !(0.0 < b && b <= 1e8) {
            return Err(BrdfError::B(b));
        }
        if !(0.0..=1000.0).contains(&c) {
            return Err(BrdfError::C(c));
        }
        let (b64, c64) = (f64::from(b), f64::from(c));
        let tau = std::f64::consts::TAU;
        Ok(Self {
            b,
            c,
            peak: cast::single(1.0 / (tau * projected_area(b64, c64))),
            drawn_peak: cast::single(b64 / (tau * power_integral(b64, c64))),
            span: cast::single(((1.0 - c64) * b64.ln_1p()).exp_m1()),
        })
    }

    /// B.
    #[must_use]
    pub fn b(&self) -> f32 {
        self.b
    }

    /// C.
    #[must_use]
    pub fn c(&self) -> f32 {
        self.c
    }

    /// The specular term without its Fresnel factor.
    #[inline]
    pub(super) fn eval(&self, half: Half, cos_in: f32, cos_out: f32) -> f32 {
        // V-grooves [Torrance67]: one side of a groove hides part of the other.
        let open = 2.0 * (1.0 - half.drop) * cos_in.min(cos_out) / half.cos;
        self.peak * self.fall_off(half.drop) * open.min(1.0) / (4.0 * cos_in * cos_out)
    }

    /// Samples `1 - n . h` of a facet from `D`, whose integral can be inverted.
    #[inline]
    pub(super) fn draw_drop(&self, u: f32) -> f32 {
        let power = 1.0 - self.c;
        let log = if power == 0.0 { u * self.b.ln_1p() } else { (u * self.span).ln_1p() / power };
        (log.exp_m1() / self.b).min(1.0)
    }

    /// Density of the mirrored direction, \[1/sr\].
    #[inline]
    pub(super) fn pdf(&self, half: Half) -> f32 {
        self.drawn_peak * self.fall_off(half.drop) / (4.0 * half.cos)
    }

    /// `(1 + B drop)^-C`.
    #[inline]
    fn fall_off(&self, drop: f32) -> f32 {
        (-self.c * (self.b * drop).ln_1p()).exp()
    }
}

/// `integral of s^-p ds` from 1 to `1 + b`.
fn power_integral(b: f64, p: f64) -> f64 {
    let log = b.ln_1p();
    if p == 1.0 { log } else { ((1.0 - p) * log).exp_m1() / (1.0 - p) }
}

/// `integral of (1 - x) (1 + b x)^-c dx` from 0 to 1: with `s = 1 + b x` it is a difference of two powers.
fn projected_area(b: f64, c: f64) -> f64 {
    if b < 0.01 {
        // The powers cancel; their binomial series, whose terms shrink like (b c)^k / k!, does not.
        let mut factor = 1.0;
        let term = |k: u32| {
            let k = f64::from(k);
            let value = factor / ((k + 1.0) * (k + 2.0));
            factor *= -b * (c + k) / (k + 1.0);
            value
        };
        return (0..64).map(term).sum();
    }
    ((1.0 + b) * power_integral(b, c) - power_integral(b, c - 1.0)) / (b * b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral over drops, on a grid that is dense where the distribution is.
    fn over_facets(abc: &Abc, f: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        (0..n)
            .map(|i| {
                let t = (f64::from(i) + 0.5) / f64::from(n);
                let x = t.powi(6);
                let d = f64::from(abc.fall_off(cast::single(x)));
                std::f64::consts::TAU * d * f(x) * 6.0 * t.powi(5) / f64::from(n)
            })
            .sum()
    }

    #[test]
    fn facets_cover_the_surface_once() {
        for b in [1e-6, 0.009, 0.011, 1.0, 300.0, 1e5, 1e8] {
            for c in [0.0, 0.08, 0.999_999, 1.0, 1.5, 2.0, 7.0, 1000.0] {
                let abc = Abc::new(b, c).unwrap();
                let area = f64::from(abc.peak) * over_facets(&abc, |x| 1.0 - x);
                assert!((area - 1.0).abs() < 2e-4, "b {b}, c {c}: facets cover {area}");
                let drawn = f64::from(abc.drawn_peak) * over_facets(&abc, |_| 1.0);
                assert!((drawn - 1.0).abs() < 2e-4, "b {b}, c {c}: draws sum to {drawn}");
            }
        }
    }

    #[test]
    fn draws_stay_in_range_at_the_ends() {
        for (b, c) in [(1e-6, 0.0), (1e8, 1000.0), (1e8, 0.0), (1e3, 1.0)] {
            let abc = Abc::new(b, c).unwrap();
            for u in [0.0, 1e-7, 0.5, 1.0 - f32::EPSILON / 2.0] {
                let drop = abc.draw_drop(u);
                assert!((0.0..=1.0).contains(&drop), "b {b}, c {c}, u {u}: {drop}");
            }
        }
    }

    #[test]
    fn bad_shapes_are_refused_by_name() {
        for b in [0.0, -1.0, 2e8, f32::NAN, f32::INFINITY] {
            let message = Abc::new(b, 1.0).unwrap_err().to_string();
            assert!(message.contains(&format!("b is {b}")), "{message}");
        }
        for c in [-0.1, 1001.0, f32::NAN, f32::INFINITY] {
            let message = Abc::new(100.0, c).unwrap_err().to_string();
            assert!(message.contains(&format!("c is {c}")), "{message}");
        }
    }
}
