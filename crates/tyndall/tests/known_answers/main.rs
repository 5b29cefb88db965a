//! The estimators against independently known answers: tables, closed forms, quadrature.
//!
//! Bugs that were planted to check that these tests fail are listed in docs/planted-bugs.md.

#![expect(
    clippy::cast_possible_truncation,
    reason = "constants of known size go from double to single precision"
)]
#![expect(clippy::unwrap_used, reason = "what the tests build is right by construction")]

mod coverage;
mod emission;
mod emit;
mod fluence;
mod furnace;
mod levels;
mod lights;
mod photon;
mod scenes;
mod seeds;
mod semi_infinite;
mod single_scattering;
mod slab;
mod threads;
mod transmittance;
