//! When to stop in the middle of work.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Polled by integrators after every scattering, so that stopping takes microseconds: whether the work was cancelled or
/// its deadline has passed. Each task has its own, since it counts how often it was polled.
#[derive(Clone, Debug)]
pub struct Stop<'a> {
    cancel: &'a AtomicBool,
    deadline: Option<Instant>,
    asked: Cell<u32>,
    expired: Cell<bool>,
}

/// When work must end; each task, on any thread, creates its own [`Stop`] from it.
#[derive(Clone, Copy, Debug)]
pub struct Limits<'a> {
    /// Set by another thread to stop soon.
    pub cancel: &'a AtomicBool,
    /// Time at which to stop.
    pub deadline: Option<Instant>,
}

impl<'a> Limits<'a> {
    /// The stop of one task.
    #[must_use]
    pub fn stop(&self) -> Stop<'a> {
        Stop::when(self.cancel, self.deadline)
    }
}

/// Number of polls per clock reading: reading the clock takes about 30 ns, a scattering takes hundreds.
const QUESTIONS: u32 = 16;

/// Never set.
static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Stop<'a> {
    /// Stops when `cancel` is set, or at the deadline.
    #[must_use]
    pub fn when(cancel: &'a AtomicBool, deadline: Option<Instant>) -> Self {
        Self { cancel, deadline, asked: Cell::new(0), expired: Cell::new(false) }
    }

    /// Never stops.
    #[must_use]
    pub fn never() -> Self {
        Self::when(&NEVER, None)
    }

    /// Whether to stop now; once true, it stays true.
    #[inline]
    #[must_use]
    pub fn reached(&self) -> bool {
        if self.expired.get() || self.cancel.load(Ordering::Relaxed) {
            return true;
        }
        if self.deadline.is_none() {
            return false;
        }
        let asked = self.asked.replace(self.asked.get().wrapping_add(1));
        asked.is_multiple_of(QUESTIONS) && self.reached_now()
    }

    /// The same for work that polls seldom: reads the clock each time.
    #[must_use]
    pub fn reached_now(&self) -> bool {
        let expired = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
        self.expired.set(self.expired.get() || expired);
        self.expired.get() || self.cancel.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_deadline_and_a_cancellation_are_seen() {
        assert!(!Stop::never().reached() && !Stop::never().reached_now());
        let cancel = AtomicBool::new(false);
        assert!(Stop::when(&cancel, Some(Instant::now())).reached());
        let stop = Stop::when(&cancel, Some(Instant::now() + Duration::from_secs(3600)));
        assert!((0..100).all(|_| !stop.reached() && !stop.reached_now()));
        cancel.store(true, Ordering::Relaxed);
        assert!(stop.reached());
        let soon = Instant::now() + Duration::from_millis(2);
        let stop = Stop::when(&NEVER, Some(soon));
        while !stop.reached() {}
        assert!(Instant::now() >= soon && stop.reached() && stop.reached_now());
        // Seen by the first of these polls, and by the sixteenth of the others at the latest.
        let soon = Instant::now() + Duration::from_millis(2);
        let stop = Stop::when(&NEVER, Some(soon));
        assert!(!stop.reached());
        while Instant::now() < soon {}
        assert!(stop.reached_now() && stop.reached());
    }
}
