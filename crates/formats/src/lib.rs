//! Reads volumes and maps, writes pictures.

pub mod image;
