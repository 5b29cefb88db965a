//! Clocks: medians of several runs; rivals run by turns, since the speed of a shared machine changes from minute to minute.

use std::time::Instant;

/// How much is measured.
pub struct Effort {
    /// Runs, of which the median is reported.
    pub rounds: usize,
    /// Whether sizes are reduced.
    pub quick: bool,
}

impl Effort {
    /// All rounds at full size, or one round at reduced size to show that it works.
    pub fn new(quick: bool) -> Self {
        Self { rounds: if quick { 1 } else { 5 }, quick }
    }

    /// The first for a whole run, the second for a quick one.
    pub fn pick<T>(&self, whole: T, quick: T) -> T {
        if self.quick { quick } else { whole }
    }

    /// Median seconds of each of several ways, which take turns after a round that warms up.
    pub fn by_turns(&self, ways: &mut [&mut dyn FnMut()]) -> Vec<f64> {
        let mut times = vec![Vec::new(); ways.len()];
        for round in 0..=self.rounds {
            for (way, times) in ways.iter_mut().zip(&mut times) {
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
