//! Rendering a picture until it is finished.

use crate::progress::Display;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tyndall_live::{Budget, LiveSession};

/// How often progress is checked.
const SLICE: Duration = Duration::from_millis(100);

/// How often the picture's error is computed, which takes a pass over all pixels.
const ERROR_EVERY: Duration = Duration::from_millis(500);

/// When a picture is finished: whichever comes first.
#[derive(Clone, Copy, Debug)]
pub struct StopConditions {
    /// Samples per pixel.
    pub samples: u32,
    /// Time for one picture.
    pub time: Option<Duration>,
    /// Relative error that is good enough.
    pub error: Option<f64>,
    /// Samples at which to stop if the picture has no error estimate: the method has no noise, or all is black.
    pub usual_samples: u32,
}

/// Refines in slices of time until a stop condition is met, showing progress, of which `about` says more.
pub fn refine(
    live: &mut LiveSession,
    stop: &StopConditions,
    cancel: &Arc<AtomicBool>,
    mut display: Display,
    about: Option<&str>,
) {
    let begun = Instant::now();
    let (first, at_first) = (live.film().first(), live.film().mean_samples());
    // A deadline that the clock cannot represent is no limit.
    let end = stop.time.and_then(|time| begun.checked_add(time));
    let mut last_estimate = begun;
    let mut error = None;
    loop {
        let slice = Instant::now() + SLICE;
        // The first sample of every pixel is always taken: no picture has holes.
        let complete = live.film().samples() > first;
        let deadline = if complete { end.map_or(slice, |end| end.min(slice)) } else { slice };
        // By the usual samples it is known whether the picture has an error estimate at all.
        let untold = stop.error.is_some() && error.is_none();
        let samples = if untold { stop.samples.min(stop.usual_samples) } else { stop.samples };
        let budget = Budget { deadline: Some(deadline), cancel: cancel.clone(), ..Budget::samples(samples) };
        live.refine(&budget);

        let film = live.film();
        let seconds = begun.elapsed().as_secs_f64();
        let samples_done = film.samples() >= stop.samples;
        let all_taken = film.samples() >= samples;
        if last_estimate.elapsed() >= ERROR_EVERY || all_taken || begun.elapsed() < ERROR_EVERY {
            last_estimate = Instant::now();
            error = live.session().relative_error();
        }
        let time_is_up = film.samples() > first && end.is_some_and(|end| Instant::now() >= end);
        let good_enough = stop.error.is_some_and(|target| match error {
            Some(error) => error <= target,
            None => film.samples() >= stop.usual_samples,
        });
        if samples_done || time_is_up || good_enough || cancel.load(Ordering::Relaxed) {
            break;
        }
        let shares = [
            Some((film.mean_samples() - at_first) / (f64::from(stop.samples - first) - at_first)),
            stop.time.map(|time| seconds / time.as_secs_f64()),
            // Noise falls with the square root of the work.
            stop.error.zip(error).map(|(target, error)| (target / error).powi(2)),
        ];
        let share = shares.into_iter().flatten().fold(0.0, f64::max).min(1.0);
        let left = (share > 0.0).then(|| seconds * (1.0 - share) / share);
        display.show(share, film.mean_samples(), left, error, about);
    }
    display.finish();
}
