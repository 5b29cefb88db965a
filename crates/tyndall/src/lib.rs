//! Tyndall renders volumes under real global illumination and stays interactive while they are edited.
//!
//! This crate is the renderer: it knows no file, window, server, Python or GPU. Modules follow the
//! concepts of the field, and imports run one way, from [`math`] up to the session.

pub mod math;
pub mod sampling;
pub mod transfer;
pub mod volume;
pub mod scattering;
