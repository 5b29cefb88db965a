//! Random numbers and the warps that turn them into directions and points.

pub mod warp;
