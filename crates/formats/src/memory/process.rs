//! Limits of the process itself, as `ulimit` sets them.

use super::field;
use std::path::Path;

/// Bytes that the process may still allocate; `None` if it is not limited, or the system does not report it.
pub(super) fn left(root: &Path) -> Option<u64> {
    let read = |name: &str| std::fs::read_to_string(root.join("proc/self").join(name)).ok();
    let limits = read("limits")?;
    let [space, data] = ["Max address space", "Max data size"].map(|name| soft_limit(&limits, name));
    if space.is_none() && data.is_none() {
        return None;
    }
    let status = read("status")?;
    let left = |limit: Option<u64>, used: &str| {
        Some(limit?.saturating_sub(field(&status, used)?.saturating_mul(1024)))
    };
    [left(space, "VmSize:"), left(data, "VmData:")].into_iter().flatten().min()
}

/// The limit in force of this name; `None` if there is none.
fn soft_limit(limits: &str, name: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_limit_counts_less_what_is_used() {
        let folder = tempfile::tempdir().unwrap();
        let process = folder.path().join("proc/self");
        std::fs::create_dir_all(&process).unwrap();
        std::fs::write(process.join("status"), "VmPeak: 900 kB\nVmSize:\t  100 kB\nVmData: 30 kB\n").unwrap();
        for (space, data, expected) in [
            ("unlimited", "unlimited", None),
            ("204800", "unlimited", Some(100 << 10)),
            ("unlimited", "40960", Some(10 << 10)),
            ("204800", "40960", Some(10 << 10)),
            ("5", "unlimited", Some(0)),
        ] {
            let text = format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max data size             {data}            unlimited            bytes     \n\
                 Max address space         {space}            unlimited            bytes     \n"
            );
            std::fs::write(process.join("limits"), text).unwrap();
            assert_eq!(left(folder.path()), expected, "{space}, {data}");
        }
    }
}
