//! When to stop in the middle of the work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Two flags that integrators look at after every scattering, so that a stop takes microseconds: one that whoever asked for
/// the work may raise, and one that rises at the deadline.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    cancel: Arc<AtomicBool>,
    expired: Arc<AtomicBool>,
}

impl Stop {
    /// Never, but when `cancel` is raised or [`Self::expire`] is called.
    #[must_use]
    pub fn when(cancel: Arc<AtomicBool>) -> Self {
        Self { cancel, expired: Arc::default() }
    }

    /// The time is over.
    pub fn expire(&self) {
        self.expired.store(true, Ordering::Relaxed);
    }

    /// Whether to stop now.
    #[inline]
    #[must_use]
    pub fn reached(&self) -> bool {
        self.cancel.load(Ordering::Relaxed) || self.expired.load(Ordering::Relaxed)
    }
}
