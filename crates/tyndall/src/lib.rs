//! Tyndall renders volumes with full global illumination and stays interactive while they are edited.
//!
//! This crate is the renderer: it knows nothing of files, documents, windows, servers, Python or GPUs. Modules follow
//! the concepts of the field, and dependencies run one way: from [`math`] at the bottom to [`session`] at the top.
//! Programs that open files and edit scenes start from `tyndall_live::LiveSession`; its crate page has short examples.

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
