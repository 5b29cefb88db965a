//! How much memory is left, so that a volume too large to fit is refused instead of ending the process.

/// Bytes that can be allocated without swapping; `None` where the system does not report it.
#[must_use]
pub fn available() -> Option<u64> {
    let system =
        field(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?.checked_mul(1024)?;
    Some(container().map_or(system, |limit| limit.min(system)))
}

/// Bytes left to the process's control group, where one limits it.
fn container() -> Option<u64> {
    let number = |name: &str| {
        std::fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?.trim().parse::<u64>().ok()
    };
    let reclaimable = std::fs::read_to_string("/sys/fs/cgroup/memory.stat")
        .ok()
        .and_then(|text| field(&text, "inactive_file"))
        .unwrap_or(0);
    let used = number("memory.current")?.saturating_sub(reclaimable);
    Some(number("memory.max")?.saturating_sub(used))
}

/// The number after `name`, on the line that begins with it.
fn field(text: &str, name: &str) -> Option<u64> {
    let mut lines = text.lines().map(str::split_whitespace);
    lines.find_map(|mut words| (words.next() == Some(name)).then(|| words.next()?.parse().ok())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_found_by_its_whole_name() {
        let text = "MemTotal: 16 kB\nMemAvailable:    7 kB\ninactive_file 5\n";
        assert_eq!(field(text, "MemAvailable:"), Some(7));
        assert_eq!(field(text, "inactive_file"), Some(5));
        assert_eq!(field(text, "Mem"), None);
    }
}
