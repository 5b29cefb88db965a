//! Limits of memory: a picture that cannot be written is refused before the work.
#![cfg(target_os = "linux")]

mod support;

use std::process::{Command, Stdio};
use support::{Folder, files_in_out};

/// A run with an address space of so many MiB: its exit status, `None` after a signal, and its messages.
fn run_within(folder: &Folder, mebibytes: u32, arguments: &[&str]) -> (Option<i32>, String) {
    let out = folder.at("out");
    std::fs::create_dir_all(&out).expect("a folder");
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {}; exec \"$@\"", mebibytes << 10), "sh"]);
    command.arg(env!("CARGO_BIN_EXE_tyndall")).args(arguments).current_dir(out).stdin(Stdio::null());
    let ended = command.output().expect("the program starts");
    (ended.status.code(), String::from_utf8_lossy(&ended.stderr).into_owned())
}

/// Whatever the limit, there is a picture or a refusal that says why, and never an abort.
#[test]
fn a_picture_that_cannot_be_written_is_refused_before_the_work() {
    let folder = Folder::new();
    folder.put(
        "scene.toml",
        "volume.procedural = { kind = 'constant', size = [2, 2, 2] }\nlights = []\nrender.samples = 1\n",
    );
    for outputs in [
        &["-o", "a.png"][..],
        &["-o", "a.jpg"],
        &["-o", "a.tif"],
        &["-o", "a.exr"],
        &["-o", "a.exr", "--resumable"],
    ] {
        let (mut refused, mut written) = (0, 0);
        for limit in [250, 300, 350, 400, 500, 700, 1000, 2000, 4000] {
            let options = ["render", "../scene.toml", "--size", "1000x1000", "--threads", "1", "-q"];
            let (status, stderr) = run_within(&folder, limit, &[&options[..], outputs].concat());
            let files = files_in_out(&folder);
            match status {
                Some(0) => {
                    assert_eq!(files.len(), 1, "{outputs:?} in {limit} MiB: {stderr}");
                    std::fs::remove_file(folder.at("out").join(&files[0])).expect("the picture");
                    written += 1;
                }
                Some(1) => {
                    let helps = stderr.contains("film.size")
                        && (stderr.contains("MiB are free") || stderr.contains("more than is free"));
                    assert!(helps && files.is_empty(), "{outputs:?} in {limit} MiB: {files:?}, {stderr}");
                    refused += 1;
                }
                other => panic!("{outputs:?} in {limit} MiB: {other:?}, {stderr}"),
            }
        }
        assert!(refused > 0 && written > 0, "{outputs:?}: {refused} refused, {written} written");
    }
}

/// The number of threads is that of the processors that the process may use.
#[test]
fn threads_follow_the_affinity() {
    let folder = Folder::new();
    folder.put(
        "scene.toml",
        "volume.procedural = { kind = 'constant', size = [2, 2, 2] }\nfilm.size = [4, 4]\nrender.samples = 1\n",
    );
    std::fs::create_dir_all(folder.at("out")).expect("a folder");
    let status = std::fs::read_to_string("/proc/self/status").expect("the status of the process");
    let allowed =
        status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("processors");
    let first = allowed.trim().split([',', '-']).next().expect("a processor");
    let mut command = Command::new("taskset");
    command.args([
        "--cpu-list",
        first,
        env!("CARGO_BIN_EXE_tyndall"),
        "render",
        "../scene.toml",
        "-o",
        "a.png",
    ]);
    let Ok(ended) = command.args(["--stats", "-"]).current_dir(folder.at("out")).output() else {
        // A system without `taskset`.
        return;
    };
    assert_eq!(support::json(&ended.stdout)["threads"], 1);
}
