//! Reads volumes and maps, writes pictures.

pub mod atomic;
pub mod image;
pub mod memory;
pub mod volume;
