//! What a program may take for one input.

use std::time::{Duration, Instant};

/// A broken file is refused in well under a second; the rest is for machines that do other work besides.
const LONGEST: Duration = Duration::from_secs(5);

/// Memory for one small input, in bytes.
const MOST_MEMORY: u64 = 1 << 30;

/// Runs `work` and holds it to 5 seconds and, on Linux, to 1 GiB of the process's resident memory.
///
/// # Panics
/// If it takes more of either.
pub fn within_limits<T>(work: impl FnOnce() -> T) -> T {
    // Sets the peak back to what is resident now; where the system refuses, peaks of the past count too.
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

/// The largest resident memory of this process in bytes; `None` where the system does not tell.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    // One test, since the memory is that of the whole process.
    #[test]
    #[cfg(target_os = "linux")]
    #[should_panic(expected = "MiB, expected at most 1024")]
    fn little_work_is_within_limits_and_much_memory_is_noticed() {
        assert_eq!(within_limits(|| 3), 3);
        within_limits(|| std::hint::black_box(vec![1_u8; 1100 << 20]).len());
    }
}
