//! Limits on the time and memory spent on one input.

use std::time::{Duration, Instant};

/// A broken file is rejected in well under a second; the rest allows for busy machines.
const LONGEST: Duration = Duration::from_secs(5);

/// Memory for one small input, in bytes.
const MOST_MEMORY: u64 = 1 << 30;

/// Runs `work` and checks that it takes less than 5 seconds and, on Linux, that the process's resident memory stays
/// below 1 GiB.
///
/// # Panics
/// If it exceeds either.
pub fn within_limits<T>(work: impl FnOnce() -> T) -> T {
    // Resets the peak to what is resident now; where the system refuses, earlier peaks count too.
    drop(std::fs::write("/proc/self/clear_refs", "5"));
    let begun = Instant::now();
    let done = work();
    let took = begun.elapsed();
    assert!(took < LONGEST, "took {took:?}, expected at most {LONGEST:?}");
    if let Some(peak) = peak_memory() {
        assert!(peak < MOST_MEMORY, "took {} MiB, expected at most {}", peak >> 20, MOST_MEMORY >> 20);
    }
    done
}

/// The largest resident memory of this process in bytes; `None` where the system does not report it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    // A single test, since the memory is that of the whole process.
    #[test]
    #[cfg(target_os = "linux")]
    #[should_panic(expected = "MiB, expected at most 1024")]
    fn little_work_is_within_limits_and_much_memory_is_noticed() {
        assert_eq!(within_limits(|| 3), 3);
        within_limits(|| std::hint::black_box(vec![1_u8; 1100 << 20]).len());
    }
}
