//! The estimators against answers that are known without them: tables, closed forms, quadrature.
//!
//! Bugs that were planted to see these tests fail are listed in CORRECTNESS.md.

mod emission;
mod furnace;
mod lights;
mod scenes;
mod semi_infinite;
mod single_scattering;
mod slab;
mod threads;
mod transmittance;
