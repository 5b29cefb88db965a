//! Runs the built program in temporary folders.
#![allow(dead_code, reason = "each file of tests uses what it needs")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A run that takes longer hangs: all here take a fraction of a second, or a few seconds on a busy machine.
const HANGS: Duration = Duration::from_secs(60);

/// A folder with the files of a test.
pub struct Folder(TempDir);

/// How a run ended.
pub struct Ended {
    /// The exit status; `None` after a signal.
    pub status: Option<i32>,
    pub stdout: Vec<u8>,
    pub stderr: String,
    /// How long it ran.
    pub took: Duration,
    /// The largest resident memory seen, in bytes; 0 where the system does not report it.
    pub memory: u64,
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// The path of `name`, which is relative to this folder.
    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file there, and creates the folders that it needs.
    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.at(name);
        fs::create_dir_all(path.parent().expect("a place in the folder")).expect("a folder");
        fs::write(path, bytes).expect("a file");
    }

    /// The program, ready to run with the folder `out` in this one as its working directory.
    pub fn tyndall(&self, arguments: &[&str]) -> Command {
        let out = self.at("out");
        fs::create_dir_all(&out).expect("a folder");
        let mut command = Command::new(env!("CARGO_BIN_EXE_tyndall"));
        command.args(arguments).current_dir(out).stdin(Stdio::null());
        command
    }

    /// Runs the program to its end, with the folder `out` in this one as its working directory.
    pub fn run(&self, arguments: &[&str]) -> Ended {
        let [stdout, stderr] = ["stdout", "stderr"].map(|name| self.at(name));
        let mut command = self.tyndall(arguments);
        command.stdout(File::create(&stdout).expect("a file")).stderr(File::create(&stderr).expect("a file"));
        let mut child = command.spawn().expect("the program starts");
        let begun = Instant::now();
        let mut memory = 0;
        let status = loop {
            // A peak is missed only if the program ends within two milliseconds of it.
            memory = memory.max(peak_memory(child.id()));
            if let Some(status) = child.try_wait().expect("a status") {
                break status.code();
            }
            if begun.elapsed() > HANGS {
                child.kill().expect("it can be ended");
                panic!("{arguments:?} hangs");
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let took = begun.elapsed();
        let text = |path: &Path| fs::read(path).expect("a file");
        let stderr = String::from_utf8_lossy(&text(&stderr)).into_owned();
        Ended { status, stdout: text(&stdout), stderr, took, memory }
    }
}

/// The largest resident memory of a running process so far; 0 where the system does not report it.
fn peak_memory(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) << 10
}

/// A run that must succeed without a message; returns what it printed.
pub fn run(folder: &Folder, arguments: &[&str]) -> Vec<u8> {
    let Ended { status, stdout, stderr, .. } = folder.run(arguments);
    assert_eq!((status, stderr.as_str()), (Some(0), ""), "{arguments:?}");
    stdout
}

/// What was printed as JSON.
pub fn json(bytes: &[u8]) -> serde_json::Value {
    serde_json::from_slice(bytes).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(bytes)))
}

/// Width, height, bytes per pixel and pixels of a PNG.
pub fn decode(png: &[u8]) -> ([u32; 2], usize, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    ([info.width, info.height], info.color_type.samples(), pixels)
}

/// A file that the program wrote.
pub fn written(folder: &Folder, name: &str) -> Vec<u8> {
    fs::read(folder.at("out").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The names in the folder in which the program ran, sorted.
pub fn files_in_out(folder: &Folder) -> Vec<String> {
    let entries = fs::read_dir(folder.at("out")).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
