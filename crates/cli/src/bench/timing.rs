//! Clocks: medians of several runs; rivals run by turns, since the speed of a shared machine changes from minute to minute.

use super::Table;
use crate::progress::Display;
use std::cell::RefCell;
use std::time::{Duration, Instant};

/// How much is measured, and how far it is.
pub struct Effort {
    /// Runs, of which the median is reported.
    pub rounds: usize,
    /// Whether sizes are reduced.
    pub quick: bool,
    progress: RefCell<Progress>,
}

/// How far the tables are.
struct Progress {
    display: Display,
    begun: Instant,
    /// The table that is measured, the seconds allotted to the tables before it, to those up to it and to all.
    table: &'static str,
    before: f64,
    up_to: f64,
    all: f64,
    /// When the seconds allotted to the table are over.
    until: Instant,
}

impl Effort {
    /// All rounds at full size, or one round at reduced size to show that it works.
    pub fn new(quick: bool, tables: &[&Table], display: Display) -> Self {
        let begun = Instant::now();
        let all = tables.iter().map(|table| table.seconds).sum();
        let progress = Progress { display, begun, table: "", before: 0.0, up_to: 0.0, all, until: begun };
        Self { rounds: if quick { 1 } else { 5 }, quick, progress: RefCell::new(progress) }
    }

    /// The first for a whole run, the second for a quick one.
    pub fn pick<T>(&self, whole: T, quick: T) -> T {
        if self.quick { quick } else { whole }
    }

    /// Begins a table.
    pub fn begin(&self, table: &Table) {
        {
            let progress = &mut *self.progress.borrow_mut();
            progress.table = table.name;
            progress.before = progress.up_to;
            progress.up_to += table.seconds;
            progress.until = Instant::now() + Duration::from_secs_f64(table.seconds);
        }
        self.show("");
    }

    /// Shows which case of the table is measured.
    pub fn show(&self, case: &str) {
        let progress = &mut *self.progress.borrow_mut();
        let left = progress.until.saturating_duration_since(Instant::now()).as_secs_f64();
        // A table that takes longer than its seconds stands still at its end.
        let done = progress.before.max(progress.up_to - left) / progress.all;
        let separator = if case.is_empty() { "" } else { ": " };
        let seconds = progress.begun.elapsed().as_secs_f64();
        let text = format!("{seconds:.0} s, {}{separator}{case}", progress.table);
        progress.display.say(done, text);
    }

    /// Prints with the progress out of the way.
    pub fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.progress.borrow().display.aside(print)
    }

    /// Removes the progress.
    pub fn finish(&self) {
        self.progress.borrow().display.finish();
    }

    /// Whether the seconds allotted to the table are not over yet, so that another round fits.
    pub fn has_time(&self) -> bool {
        Instant::now() < self.progress.borrow().until
    }

    /// Median seconds of each of several ways, which take turns after a round that warms up.
    pub fn by_turns(&self, ways: &mut [&mut dyn FnMut()]) -> Vec<f64> {
        let mut times = vec![Vec::new(); ways.len()];
        for round in 0..=self.rounds {
            for (way, times) in ways.iter_mut().zip(&mut times) {
                self.show("");
                let start = Instant::now();
                way();
                if round > 0 {
                    times.push(start.elapsed().as_secs_f64());
                }
            }
        }
        times.into_iter().map(median).collect()
    }

    /// Median seconds of one way.
    pub fn seconds(&self, way: &mut dyn FnMut()) -> f64 {
        self.by_turns(&mut [way])[0]
    }
}

/// The middle one of several.
pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
