//! What a live session runs on.

use std::sync::Arc;
use tyndall::simd::Level;

/// What a live session runs on.
#[derive(Clone, Debug)]
pub struct Options {
    /// Threads that load, build and render.
    pub threads: Arc<rayon::ThreadPool>,
    /// Vector instructions.
    pub level: Level,
    /// Whether edits are to come, so that it pays to keep what makes them fast.
    pub edits: bool,
}

impl Options {
    /// A thread for each processor, the widest vector instructions, ready for edits.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn new() -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = Arc::new(rayon::ThreadPoolBuilder::new().build()?);
        Ok(Self { threads, level: Level::best(), edits: true })
    }
}
