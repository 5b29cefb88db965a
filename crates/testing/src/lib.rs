//! Statistical tests and picture comparison: numbers in, verdict out. This crate does not depend on the renderer.
//!
//! A Monte Carlo estimator is a random variable, so "equal within a tolerance" is not a test of it: a tolerance
//! wide enough for the noise hides the bug, and a narrow one fails by chance. The tests here instead compute how
//! likely the observed numbers would be if the code were right \[Subr07\], and reject at a chosen [`SIGNIFICANCE`].
//!
//! | to test | use |
//! | --- | --- |
//! | a sampler of directions against its pdf | [`ChiSquare::directions`] |
//! | distances, or any number with a known distribution | [`ChiSquare::against_cdf`] |
//! | a choice among a few options | [`ChiSquare::discrete`] |
//! | an estimate against a known answer | [`Mean::against`], then [`ZTest::assert`] or [`ZTest::assert_within`] |
//! | a picture against another | [`Picture::compare`], then [`Comparison::assert`] |
//! | the known answer itself, where it is an integral | [`quadrature`] |
//! | that no input breaks a reader | [`damage`], [`within_limits`] |
//!
//! Seeds are fixed, so a test that passes keeps passing. A test of many things at once (ten mean cosines, all pixels
//! of a picture) states how many, and the significance of each is corrected so that the whole has [`SIGNIFICANCE`].
//!
//! # A new sampler's test
//! ```
//! use std::f64::consts::PI;
//! use tyndall_testing::ChiSquare;
//!
//! // Directions on the upper hemisphere, in proportion to the cosine of the angle to the normal z.
//! let sample = |[a, b]: [f32; 2]| {
//!     let (sin, phi) = (a.sqrt(), std::f32::consts::TAU * b);
//!     Some([sin * phi.cos(), sin * phi.sin(), (1.0 - a).sqrt()])
//! };
//! let pdf = |w: [f32; 3]| f64::from(w[2].max(0.0)) / PI;
//! ChiSquare::default().directions(sample, pdf).assert();
//!
//! // The test would have noticed a forgotten cosine.
//! let uniform = |w: [f32; 3]| if w[2] > 0.0 { 0.5 / PI } else { 0.0 };
//! assert!(!ChiSquare::default().directions(sample, uniform).passes());
//! ```
//!
//! # A new estimator's test
//! ```
//! use tyndall_testing::{Mean, SplitMix};
//!
//! // The transmittance of a slab of optical depth 1, by counting the photons that get through.
//! let mut random = SplitMix::new(1);
//! let crosses = |_| if -(1.0 - random.uniform()).ln() > 1.0 { 1.0 } else { 0.0 };
//! let transmittance: Mean = (0..4_000_000).map(crosses).collect();
//! transmittance.against((-1.0_f64).exp()).assert_within(3.0, 1e-3);
//! ```

mod cast;
mod chi_square;
mod comparison;
pub mod damage;
mod failure;
mod fit;
mod limits;
mod picture;
pub mod quadrature;
mod significance;
mod sphere_grid;
mod split_mix;
mod z_test;

pub use chi_square::ChiSquare;
pub use comparison::{Comparison, Worst};
pub use fit::{Fault, Fit};
pub use limits::within_limits;
pub use picture::Picture;
pub use significance::{SIGNIFICANCE, sidak};
pub use split_mix::SplitMix;
pub use z_test::{Mean, ZTest};

/// Relative rounding error allowed in a number that was stored in single precision: a few units in the last place.
///
/// Without it an estimator free of noise, whose standard error is zero, would have to be exact to the last bit.
pub const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;
