//! Random numbers and the warps that turn them into directions and points.
//!
//! Every number comes from a counter, never from shared state: a path that is traced again draws the
//! same numbers, on any thread.

pub(crate) mod address;
mod discrete;
mod light_path;
mod philox;
mod sampler;
mod stream;
pub mod warp;

pub use address::{BOUNCES, PATHS, PIXELS};
pub use discrete::{Choice, Discrete};
pub use light_path::LightPathSampler;
pub use philox::philox;
pub use sampler::{BounceSample, PathSampler};
pub use stream::Stream;
