//! Tyndall renders volumes under real global illumination and stays interactive while they are edited.
//!
//! This crate is the renderer: it knows no file, document, window, server, Python or GPU. Modules follow the
//! concepts of the field, and imports run one way, from [`math`] up to the [`session`]. Programs that open files and edit
//! scenes start from `tyndall_live::LiveSession`, whose crate shows both in ten lines.

pub mod camera;
pub mod film;
pub mod integrator;
pub mod light;
pub mod math;
pub mod medium;
pub mod message;
pub mod sampling;
pub mod scattering;
pub mod scene;
pub mod session;
pub mod simd;
pub mod transfer;
pub mod volume;
