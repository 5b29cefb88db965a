//! Freeing large values where nobody waits for it.

/// Drops a value on a thread of its own: to return memory to the system takes milliseconds for tens of megabytes.
pub(crate) fn drop_elsewhere<T: Send + 'static>(old: T) {
    // If there can be no further thread, the closure is dropped here, and the value with it.
    drop(std::thread::Builder::new().spawn(move || drop(old)));
}
