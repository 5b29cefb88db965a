//! Control groups, by which containers and batch systems limit memory: versions 1 and 2, and both at once.
//!
//! A group's limit holds for all groups inside it, so that each on the way from the process's own group to the root counts.

use super::field;
use std::path::{Path, PathBuf};

/// A control group that may limit memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Group {
    folder: PathBuf,
    files: &'static Files,
}

/// Names of a group's files, which differ by version.
#[derive(Debug, PartialEq, Eq)]
struct Files {
    limit: &'static str,
    used: &'static str,
    /// In `memory.stat`: used, but freed when needed; of the group and all in it.
    reclaimable: &'static str,
}

static VERSION_1: Files = Files {
    limit: "memory.limit_in_bytes",
    used: "memory.usage_in_bytes",
    reclaimable: "total_inactive_file",
};

static VERSION_2: Files = Files { limit: "memory.max", used: "memory.current", reclaimable: "inactive_file" };

impl Group {
    /// Bytes that it leaves; `None` if it has no limit.
    pub fn left(&self) -> Option<u64> {
        let read = |name: &str| std::fs::read_to_string(self.folder.join(name)).ok();
        let number = |name: &str| read(name)?.trim().parse::<u64>().ok();
        // Version 2 says "max" where there is none, version 1 a number that no machine reaches.
        let limit = number(self.files.limit)?;
        let used = number(self.files.used).unwrap_or(0);
        let reclaimable =
            read("memory.stat").and_then(|text| field(&text, self.files.reclaimable)).unwrap_or(0);
        Some(limit.saturating_sub(used.saturating_sub(reclaimable)))
    }
}

/// The process's own groups and all that contain them, as far as they can be seen.
pub(super) fn of_this_process(root: &Path) -> Vec<Group> {
    let read = |name: &str| {
        let bytes = std::fs::read(root.join("proc/self").join(name)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let own = read("cgroup");
    read("mountinfo").lines().filter_map(Mount::parse).flat_map(|mount| mount.groups(root, &own)).collect()
}

/// Where a hierarchy of groups is mounted.
struct Mount {
    files: &'static Files,
    /// The group that the mount shows as its root.
    group: PathBuf,
    /// Where it is in the file system.
    place: PathBuf,
}

impl Mount {
    /// From a line of `mountinfo`, if it is a hierarchy that can limit memory:
    /// `32 31 0:29 /group /sys/fs/cgroup/memory rw,relatime - cgroup cgroup rw,memory`.
    fn parse(line: &str) -> Option<Self> {
        let (mount, file_system) = line.split_once(" - ")?;
        let mut words = mount.split(' ').skip(3);
        let (group, place) = (unescaped(words.next()?), unescaped(words.next()?));
        let mut words = file_system.split(' ');
        let files = match words.next()? {
            "cgroup2" => &VERSION_2,
            "cgroup" if words.nth(1)?.split(',').any(|option| option == "memory") => &VERSION_1,
            _ => return None,
        };
        Some(Self { files, group, place })
    }

    /// The groups on the way from the process's own to the mount's root; `own` is the text of `/proc/self/cgroup`.
    fn groups(self, root: &Path, own: &str) -> Vec<Group> {
        let Some(group) = own.lines().find_map(|line| self.membership(line)) else { return Vec::new() };
        // A process may have been moved out of what the mount shows; then only the mount's root is known to contain it.
        let inside = Path::new(group).strip_prefix(&self.group).unwrap_or(Path::new(""));
        let is_inside = inside.components().all(|part| matches!(part, std::path::Component::Normal(_)));
        let inside = if is_inside { inside } else { Path::new("") };
        let place = self.place.strip_prefix("/").unwrap_or(&self.place);
        let folder = |inside: &Path| root.join(place).join(inside);
        inside.ancestors().map(|inside| Group { folder: folder(inside), files: self.files }).collect()
    }

    /// The process's group, from a line such as `4:memory:/group`, if the line is of this hierarchy.
    fn membership<'a>(&self, line: &'a str) -> Option<&'a str> {
        let (number, rest) = line.split_once(':')?;
        let (controllers, group) = rest.split_once(':')?;
        let is_of_this = if self.files == &VERSION_2 {
            number == "0" && controllers.is_empty()
        } else {
            controllers.split(',').any(|controller| controller == "memory")
        };
        is_of_this.then_some(group)
    }
}

/// A path in which the kernel wrote blanks and backslashes as `\040` and the like.
fn unescaped(word: &str) -> PathBuf {
    let mut text = String::new();
    let mut rest = word;
    while let Some((before, after)) = rest.split_once('\\') {
        text.push_str(before);
        let code = after.get(..3).and_then(|digits| u8::from_str_radix(digits, 8).ok());
        match code {
            Some(code) if code.is_ascii() => {
                text.push(char::from(code));
                rest = &after[3..];
            }
            _ => {
                text.push('\\');
                rest = after;
            }
        }
    }
    text.push_str(rest);
    PathBuf::from(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the groups leave, on a system with these files.
    fn left(files: &[(&str, &str)]) -> Option<u64> {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        of_this_process(folder.path()).iter().filter_map(Group::left).min()
    }

    const MOUNT_2: (&str, &str) =
        ("proc/self/mountinfo", "41 31 0:38 / /sys/fs/cgroup rw,relatime shared:9 - cgroup2 cgroup2 rw\n");

    #[test]
    fn in_version_2_each_group_up_to_the_root_counts() {
        let own = ("proc/self/cgroup", "0::/slurm/job_7/step_0\n");
        let of = |step: &'static str, job: &'static str, slurm: &'static str| {
            left(&[
                MOUNT_2,
                own,
                ("sys/fs/cgroup/slurm/job_7/step_0/memory.max", step),
                ("sys/fs/cgroup/slurm/job_7/step_0/memory.current", "100\n"),
                ("sys/fs/cgroup/slurm/job_7/step_0/memory.stat", "anon 70\ninactive_file 30\n"),
                ("sys/fs/cgroup/slurm/job_7/memory.max", job),
                ("sys/fs/cgroup/slurm/job_7/memory.current", "200\n"),
                ("sys/fs/cgroup/slurm/memory.max", slurm),
                ("sys/fs/cgroup/slurm/memory.current", "1000\n"),
            ])
        };
        assert_eq!(of("max\n", "max\n", "max\n"), None);
        assert_eq!(of("500\n", "max\n", "max\n"), Some(430));
        assert_eq!(of("max\n", "500\n", "max\n"), Some(300));
        assert_eq!(of("500\n", "500\n", "1200\n"), Some(200));
        assert_eq!(of("max\n", "max\n", "900\n"), Some(0));
    }

    #[test]
    fn version_1_is_found_by_its_controller_beside_version_2() {
        let mounts = "31 23 0:28 / /sys/fs/cgroup rw - tmpfs tmpfs rw\n\
                      32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n\
                      35 31 0:32 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n\
                      41 31 0:38 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n";
        let files = |own: &'static str| {
            left(&[
                ("proc/self/mountinfo", mounts),
                ("proc/self/cgroup", own),
                ("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"),
                ("sys/fs/cgroup/memory/memory.usage_in_bytes", "0\n"),
                ("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "1000\n"),
                ("sys/fs/cgroup/memory/job/memory.usage_in_bytes", "400\n"),
                ("sys/fs/cgroup/memory/job/memory.stat", "inactive_file 1\ntotal_inactive_file 150\n"),
                ("sys/fs/cgroup/memory/job/step/memory.limit_in_bytes", "9223372036854771712\n"),
                ("sys/fs/cgroup/cpu,cpuacct/job/memory.limit_in_bytes", "1\n"),
            ])
        };
        assert_eq!(files("5:cpu,cpuacct:/job\n4:memory:/job/step\n0::/\n"), Some(750));
        assert_eq!(files("5:cpu,cpuacct:/job\n4:memory:/\n0::/\n"), Some(9_223_372_036_854_771_712));
    }

    #[test]
    fn a_container_sees_its_own_group_as_the_root() {
        let mounts = "35 31 0:32 /docker/af\\04013 /mnt/groups\\040here rw - cgroup cgroup rw,memory\n";
        for own in ["4:memory:/docker/af 13\n", "4:memory:/\n", "4:memory:/../other\n"] {
            let found = left(&[
                ("proc/self/mountinfo", mounts),
                ("proc/self/cgroup", own),
                ("mnt/groups here/memory.limit_in_bytes", "77\n"),
            ]);
            assert_eq!(found, Some(77), "{own}");
        }
        let inner = left(&[
            ("proc/self/mountinfo", mounts),
            ("proc/self/cgroup", "4:memory:/docker/af 13/inner\n"),
            ("mnt/groups here/memory.limit_in_bytes", "77\n"),
            ("mnt/groups here/inner/memory.limit_in_bytes", "55\n"),
        ]);
        assert_eq!(inner, Some(55));
    }

    #[test]
    fn odd_files_limit_nothing() {
        assert_eq!(left(&[]), None);
        assert_eq!(left(&[MOUNT_2]), None);
        assert_eq!(
            left(&[("proc/self/mountinfo", "a b c - cgroup2\n - \n"), ("proc/self/cgroup", ":\n0::\n")]),
            None
        );
        assert_eq!(unescaped("a\\"), Path::new("a\\"));
        assert_eq!(unescaped("\\134\\777\u{e9}\\05"), Path::new("\\\\777\u{e9}\\05"));
    }
}
