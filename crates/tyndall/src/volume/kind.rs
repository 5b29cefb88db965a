//! What kind of data a volume holds, told from its values.

use super::{Volume, Voxels, computed_once, hounsfield, labels};

impl Volume {
    /// Whether the data are computed tomography in Hounsfield units: they lie in anatomical space and have a peak of air at
    /// -1000.
    #[must_use]
    pub fn is_ct(&self) -> bool {
        *computed_once(&self.statistics.is_ct, || hounsfield::is_ct(self))
    }

    /// The values other than 0, ascending, of data of whole numbers from 0; `None` if there are other numbers, or more than 200 of these.
    #[must_use]
    pub fn whole_values(&self) -> Option<&[f64]> {
        computed_once(&self.statistics.whole_values, || labels::whole_values(self)).as_deref()
    }

    /// The labels, ascending, of a segmentation: [`Self::whole_values`], at least two, of parts that most voxels lie inside of.
    #[must_use]
    pub fn labels(&self) -> Option<&[f64]> {
        let values = self.whole_values()?;
        let are_labels = *computed_once(&self.statistics.are_labels, || labels::are_labels(self, values));
        are_labels.then_some(values)
    }

    /// The value of all samples with data, if it is the same; `None` without data.
    #[must_use]
    pub fn only_value(&self) -> Option<f64> {
        let [least, most] = self.value_range;
        (least == most && !self.is_empty()).then_some(least)
    }

    /// Whether data of this value alone are background: 0, or the air of CT and what pads it.
    #[must_use]
    pub fn is_background(value: f64) -> bool {
        const AIR: f64 = -1000.0;
        value == 0.0 || value <= AIR
    }

    /// Whether data may have values that single precision, in which they are read, does not tell apart: whole numbers beyond 2^24, or
    /// numbers in double precision that are close together for their size.
    #[must_use]
    pub fn exceeds_single(&self) -> bool {
        /// The largest whole number up to which single precision holds all.
        const WHOLE: f64 = 16_777_216.0;
        /// Steps of single precision across the range, at least, so that data are seen as they are.
        const STEPS: f64 = 4096.0;

        let [lo, hi] = self.value_range;
        let most = lo.abs().max(hi.abs());
        let are_whole = lo.fract() == 0.0 && hi.fract() == 0.0 && self.whole_values().is_some();
        match self.bricks.samples() {
            Voxels::U32(_) | Voxels::I32(_) => most > WHOLE,
            Voxels::F64(_) => {
                if are_whole {
                    most > WHOLE
                } else {
                    hi > lo && most > (hi - lo) * (WHOLE / STEPS)
                }
            }
            _ => false,
        }
    }

    /// Folds over all data values, each once, in parallel on the current pool.
    pub(super) fn fold_data<A: Send>(
        &self,
        start: impl Fn() -> A + Sync + Send,
        take: impl Fn(&mut A, f64) + Sync + Send,
        merge: impl Fn(A, A) -> A + Sync + Send,
    ) -> A {
        let filler = self.filler();
        let take = |sum: &mut A, stored: f64| {
            if filler != Some(stored) {
                take(sum, self.values.apply(stored));
            }
        };
        self.bricks.fold(start, take, merge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{OnceLock, mpsc};
    use std::time::Duration;

    /// As a thread of a pool does that takes up other work while it waits for a part of its own.
    #[test]
    fn what_is_computed_once_may_be_asked_for_meanwhile() {
        let (done, wait) = mpsc::channel();
        std::thread::spawn(move || {
            let cell = OnceLock::new();
            let found = *computed_once(&cell, || *computed_once(&cell, || 1));
            done.send(found).expect("a listener");
        });
        assert_eq!(wait.recv_timeout(Duration::from_secs(20)), Ok(1), "it waits for itself");
    }
}
