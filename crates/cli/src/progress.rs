//! Progress on standard error: a bar on a terminal, lines elsewhere when asked for.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};
use tyndall::math::cast::{index, single};

/// How progress shows.
pub enum Display {
    /// Not at all.
    None,
    /// A bar with the remaining time and the current error.
    Bar(ProgressBar),
    /// A line every few seconds.
    Lines {
        /// When the last one was printed; the first is printed at once.
        last: Option<Instant>,
    },
}

const LINES_EVERY: Duration = Duration::from_secs(2);

impl Display {
    /// A bar on a terminal; lines if `forced` elsewhere; nothing if `quiet`.
    pub fn new(forced: bool, quiet: bool) -> Self {
        if quiet {
            return Self::None;
        }
        if std::io::stderr().is_terminal() {
            let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}");
            let bar = ProgressBar::new(1000);
            // The template is fixed; if it were ever refused, the default style would do.
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            return Self::Bar(bar);
        }
        if forced { Self::Lines { last: None } } else { Self::None }
    }

    /// Shows the share done (0 to 1), the seconds left and the error so far, after what else there is to say.
    pub fn show(
        &mut self,
        share: f64,
        samples: f64,
        left: Option<f64>,
        error: Option<f64>,
        about: Option<&str>,
    ) {
        let left = left.map_or_else(String::new, |s| format!(", {s:.0} s left"));
        let about = about.map_or_else(String::new, |about| format!("{about}: "));
        let error = error.map_or_else(String::new, |e| format!(", error {e:.4}"));
        self.say(share, format!("{about}{samples:.1} samples{left}{error}"));
    }

    /// Shows the share done (0 to 1), and what is said of it.
    pub fn say(&mut self, share: f64, text: String) {
        match self {
            Self::None => {}
            Self::Bar(bar) => {
                bar.set_position(index(single(1000.0 * share)) as u64);
                bar.set_message(text);
            }
            Self::Lines { last } => {
                if last.is_none_or(|last| last.elapsed() >= LINES_EVERY) {
                    *last = Some(Instant::now());
                    // Progress is optional: if stderr is closed it is dropped.
                    drop(writeln!(std::io::stderr(), "{:3.0} %  {text}", 100.0 * share));
                }
            }
        }
    }

    /// Prints with the bar out of the way.
    pub fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        match self {
            Self::Bar(bar) => bar.suspend(print),
            Self::None | Self::Lines { .. } => print(),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
