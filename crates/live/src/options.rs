//! Options of a live session.

use std::sync::Arc;
use tyndall::simd::Level;

/// What a live session runs on, and whether edits are expected.
#[derive(Clone, Debug)]
pub struct Options {
    /// Threads that load, build and render.
    pub threads: Arc<rayon::ThreadPool>,
    /// The vector instruction set.
    pub level: Level,
    /// Whether edits are expected, so that data that speeds them up is kept.
    pub edits: bool,
}

impl Options {
    /// One thread per processor, the widest vector instructions, ready for edits.
    ///
    /// # Errors
    /// If the system cannot start the threads.
    pub fn new() -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = Arc::new(rayon::ThreadPoolBuilder::new().build()?);
        Ok(Self { threads, level: Level::best(), edits: true })
    }
}
