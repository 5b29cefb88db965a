//! Runs that must fail: what the program must say and do, and what it must not.

use crate::support::{Ended, Folder};
use std::time::Duration;

/// A refusal takes a few hundredths of a second, and must take less than one; the limit leaves room for busy machines.
pub const LONGEST: Duration = Duration::from_secs(5);

/// Memory limit for a refusal, in bytes.
pub const MOST_MEMORY: u64 = 1 << 30;

/// Keys of a valid scene; tests append what is wrong.
pub const SCENE: &str = "volume.procedural = { kind = 'sphere', size = [4, 4, 4] }\nrender.samples = 1\n";

/// A run that must fail.
pub struct Fault {
    pub files: Vec<(&'static str, Vec<u8>)>,
    pub arguments: Vec<&'static str>,
    pub status: i32,
    /// Text that the message must contain.
    pub says: Vec<&'static str>,
}

impl Fault {
    /// Runs and checks it; the folder `out`, in which the program runs, must stay empty.
    pub fn check(&self) {
        let folder = Folder::new();
        for (name, bytes) in &self.files {
            folder.put(name, bytes);
        }
        let Ended { status, stdout, stderr, took, memory } = folder.run(&self.arguments);
        let arguments = self.arguments.iter().map(|a| a.chars().take(200).collect::<String>());
        let report = format!(
            "{:?}, expected {:?}: status {status:?}\n{stderr}",
            arguments.collect::<Vec<_>>(),
            self.says
        );
        assert_eq!(status, Some(self.status), "{report}");
        assert!(!stderr.contains("panicked"), "{report}");
        for word in &self.says {
            assert!(stderr.contains(word), "`{word}` is not in {report}");
        }
        let messages = stderr.lines().filter(|l| l.starts_with("tyndall: ") || l.starts_with("error: "));
        assert_eq!(messages.count(), 1, "{report}");
        assert!(stderr.len() < 1000, "{report}");
        assert!(!stderr.contains(|c: char| c.is_control() && c != '\n'), "{report:?}");
        assert!(took < LONGEST, "{took:?} for {report}");
        assert!(memory < MOST_MEMORY, "{} MiB for {report}", memory >> 20);
        assert!(stdout.is_empty(), "{report}");
        let left: Vec<_> = std::fs::read_dir(folder.at("out")).expect("a folder").collect();
        assert!(left.is_empty(), "{left:?} left by {report}");
    }
}

/// A faulty file: exit status 1.
pub fn file(name: &'static str, bytes: impl Into<Vec<u8>>, says: &[&'static str]) {
    let arguments = vec!["render", name];
    Fault { files: vec![(&name["../".len()..], bytes.into())], arguments, status: 1, says: says.to_vec() }
        .check();
}

/// A faulty scene in TOML, with a file of eight bytes beside it.
pub fn toml(text: String, says: &[&'static str]) {
    let files = vec![("scene.toml", text.into_bytes()), ("eight.raw", vec![0; 8])];
    Fault { files, arguments: vec!["render", "../scene.toml"], status: 1, says: says.to_vec() }.check();
}

/// Faulty options with a valid scene.
pub fn options(options: &[&'static str], status: i32, says: &[&'static str]) {
    let files = vec![("scene.toml", SCENE.into())];
    let arguments = [&["render", "../scene.toml"], options].concat();
    Fault { files, arguments, status, says: says.to_vec() }.check();
}
