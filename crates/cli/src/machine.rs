//! What a run takes from the machine: threads, vector instructions, and the user's Ctrl-C.

use crate::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tyndall::simd::Level;

/// The widest vector instructions, or those that `TYNDALL_SIMD` names.
pub fn vector_instructions() -> Result<Level, Failure> {
    match std::env::var_os("TYNDALL_SIMD") {
        None => Ok(Level::best()),
        Some(name) => name.to_string_lossy().parse().map_err(|e| {
            Failure::usage(format!("TYNDALL_SIMD: {e}; name one of these, or unset it to use the best"))
        }),
    }
}

/// The program's own threads.
pub fn pool(threads: Option<u16>) -> Result<Arc<rayon::ThreadPool>, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .build()
        .map(Arc::new)
        .map_err(|e| Failure::usage(format!("--threads: {e}")))
}

/// Ctrl-C: while there is no picture to save it ends the program at once; later the first requests an early end, and
/// the second ends at once.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    picture_begun: Arc<AtomicBool>,
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Installs the handler.
    pub fn listen() -> Self {
        let interrupt = Self::default();
        let heard = interrupt.clone();
        // Without a handler Ctrl-C still ends the program, but saves no picture.
        drop(ctrlc::set_handler(move || {
            if !heard.picture_begun.load(Ordering::Relaxed) || heard.requested.swap(true, Ordering::Relaxed) {
                let _nothing_half_written = tyndall_formats::atomic::abandon();
                std::process::exit(130);
            }
        }));
        interrupt
    }

    /// From now on there is a picture to save: the first Ctrl-C only requests an end.
    pub fn picture_begins(&self) {
        self.picture_begun.store(true, Ordering::Relaxed);
    }

    /// Whether an end was requested.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// The flag itself, for sessions to poll.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.requested.clone()
    }
}
