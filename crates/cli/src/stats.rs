//! The statistics of a run, as JSON.

use serde_json::{Map, Value, json};
use std::time::Instant;

/// Named stages and their seconds, in the order in which they happened.
#[derive(Debug)]
pub struct Stages {
    stages: Vec<(&'static str, f64)>,
    since: Instant,
}

impl Stages {
    /// The first stage begins at `start`.
    pub fn new(start: Instant) -> Self {
        Self { stages: Vec::new(), since: start }
    }

    /// Ends the stage that began when the previous one ended; returns its seconds.
    pub fn end(&mut self, name: &'static str) -> f64 {
        let seconds = self.since.elapsed().as_secs_f64();
        self.since = Instant::now();
        self.stages.push((name, seconds));
        seconds
    }

    /// Name to seconds.
    pub fn to_value(&self) -> Value {
        Value::Object(self.stages.iter().map(|&(name, s)| (name.into(), json!(s))).collect::<Map<_, _>>())
    }
}

/// The largest resident memory of this process so far; `None` where the system does not report it.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}
