//! How much memory is left, so that what is too large to fit is refused instead of ending the process.

mod groups;
mod process;

use groups::Group;
use std::path::Path;
use std::sync::OnceLock;

/// Bytes that can be allocated without swapping: what the machine has left, or less where a control group or a limit of the process
/// allows less; `None` where the system reports none of these.
#[must_use]
pub fn available() -> Option<u64> {
    static GROUPS: OnceLock<Vec<Group>> = OnceLock::new();
    let root = Path::new("/");
    available_under(root, GROUPS.get_or_init(|| groups::of_this_process(root)))
}

/// The same by the files of a system whose root is a folder, where the process is in these control groups.
fn available_under(root: &Path, groups: &[Group]) -> Option<u64> {
    let of_machine = std::fs::read_to_string(root.join("proc/meminfo"))
        .ok()
        .and_then(|text| field(&text, "MemAvailable:")?.checked_mul(1024));
    let of_groups = groups.iter().filter_map(Group::left).min();
    [of_machine, of_groups, process::left(root)].into_iter().flatten().min()
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

    #[test]
    fn the_smallest_limit_counts() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let left = || available_under(folder.path(), &groups::of_this_process(folder.path()));
        assert_eq!(left(), None);
        put("proc/meminfo", "MemTotal: 99 kB\nMemAvailable: 50 kB\n");
        assert_eq!(left(), Some(50 << 10));
        put("proc/self/mountinfo", "9 1 0:9 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n");
        put("proc/self/cgroup", "0::/\n");
        put("sys/fs/cgroup/memory.max", "40960\n");
        assert_eq!(left(), Some(40 << 10));
        put("proc/self/limits", "Max address space         102400 unlimited bytes\n");
        put("proc/self/status", "VmSize: 70 kB\nVmData: 10 kB\n");
        assert_eq!(left(), Some(30 << 10));
    }
}
