//! A volume: samples on a grid, and the continuous field between them.
//!
//! Values are *data values*: the file's values after slope and intercept. The field is trilinear
//! between voxel centres (or nearest), and clamped to the edge value in the half voxel around them.

mod block;
mod bricks;
mod cells;
mod gradient;
mod grid;
mod hounsfield;
mod kind;
mod labels;
mod lanes;
mod statistics;
mod value_bins;
mod voxels;

pub mod procedural;

pub use bricks::Bricks;
pub use cells::Cells;
pub use grid::{Grid, GridError, Space};
pub use statistics::Histogram;
pub use value_bins::ValueBins;
pub use voxels::{Voxel, Voxels};

use crate::math::{Vec3, cast};
use bricks::Lattice;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use voxels::{Mended, with_voxels};

/// How the field is read between voxel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Trilinear.
    #[default]
    Linear,
    /// The value of the nearest centre.
    Nearest,
}

/// `value = slope * stored + intercept`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueMap {
    /// Data units per stored unit; not zero.
    pub slope: f64,
    /// Data value of a stored zero.
    pub intercept: f64,
}

impl ValueMap {
    /// Stored samples are the data values.
    pub const IDENTITY: Self = Self { slope: 1.0, intercept: 0.0 };

    /// The data value of a stored sample.
    #[must_use]
    pub fn apply(self, stored: f64) -> f64 {
        self.slope * stored + self.intercept
    }

    /// The stored sample of a data value, up to rounding.
    fn stored(self, value: f64) -> f64 {
        (value - self.intercept) / self.slope
    }
}

/// Why samples and grid do not form a volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// The number of samples does not fit the dimensions.
    #[error("{found} samples, but dimensions {dims:?} ask for {expected}")]
    Samples {
        /// Samples given.
        found: usize,
        /// Product of the dimensions.
        expected: usize,
        /// The dimensions.
        dims: [usize; 3],
    },
    /// Slope or intercept cannot be used.
    #[error("slope {slope} and intercept {intercept}: expected finite numbers, the slope not zero")]
    ValueMap {
        /// The slope found.
        slope: f64,
        /// The intercept found.
        intercept: f64,
    },
}

/// Samples on a grid with what is derived from them. Cheap to clone: the samples are shared.
#[derive(Clone, Debug)]
pub struct Volume {
    grid: Grid,
    bricks: Arc<Bricks>,
    values: ValueMap,
    interpolation: Interpolation,
    value_range: [f64; 2],
    robust_range: [f64; 2],
    mended: Mended,
    cells: Arc<Cells>,
    statistics: Arc<Statistics>,
    lattice: Lattice,
    slope: f32,
    intercept: f32,
}

/// Statistics that are computed once, when first needed, and then kept with the samples.
#[derive(Debug, Default)]
struct Statistics {
    robust: OnceLock<Histogram>,
    value_bins: OnceLock<Histogram>,
    is_ct: OnceLock<bool>,
    whole_values: OnceLock<Option<Vec<f64>>>,
    are_labels: OnceLock<bool>,
    /// Cells, keyed by their edge.
    cells: Mutex<BTreeMap<usize, Arc<Cells>>>,
}

/// What a cell holds, computed first if it is empty. Not by `get_or_init`, which would wait for itself: a thread of a pool that
/// computes in parallel may take up other work of the pool meanwhile, which may need the same.
fn computed_once<T>(cell: &OnceLock<T>, compute: impl FnOnce() -> T) -> &T {
    match cell.get() {
        Some(kept) => kept,
        None => {
            let computed = compute();
            cell.get_or_init(|| computed)
        }
    }
}

impl Volume {
    /// Cuts the samples into bricks, replaces what is not finite (see [`Self::non_finite`]), and derives
    /// the ranges, in parallel on the current thread pool.
    ///
    /// # Errors
    /// [`VolumeError`] if the number of samples, the slope or the intercept is invalid.
    pub fn new(grid: Grid, mut voxels: Voxels, values: ValueMap) -> Result<Self, VolumeError> {
        if voxels.len() != grid.len() {
            return Err(VolumeError::Samples {
                found: voxels.len(),
                expected: grid.len(),
                dims: grid.dims(),
            });
        }
        let ValueMap { slope, intercept } = values;
        if !slope.is_finite() || slope == 0.0 || !intercept.is_finite() {
            return Err(VolumeError::ValueMap { slope, intercept });
        }
        let mended = voxels.mend_non_finite(values);
        let filler = mended.gap.map(|gap| gap.filler);
        let value_range = statistics::value_range(&voxels, values, filler);
        let robust_range = statistics::robust_range(&voxels, values, filler, value_range);
        let (bricks, ranges) = Bricks::new(grid.dims(), &voxels);
        Ok(Self {
            lattice: bricks.lattice(),
            cells: Arc::new(Cells::of_bricks(&bricks, &ranges, values)),
            bricks: Arc::new(bricks),
            grid,
            values,
            interpolation: Interpolation::Linear,
            value_range,
            robust_range,
            mended,
            statistics: Arc::default(),
            slope: cast::single(slope),
            intercept: cast::single(intercept),
        })
    }

    /// The same volume with another interpolation between voxel centres.
    #[must_use]
    pub fn with_interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// Whether two volumes share their samples and read them alike.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bricks, &other.bricks)
            && self.grid == other.grid
            && self.values == other.values
            && self.interpolation == other.interpolation
    }

    /// How the field is read between voxel centres.
    #[must_use]
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Where the voxels are.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The stored samples as the renderer reads them.
    #[must_use]
    pub fn bricks(&self) -> &Bricks {
        &self.bricks
    }

    /// A copy of the stored samples in the file's order, x fastest; infinities are the ends of the range.
    #[must_use]
    pub fn voxels(&self) -> Voxels {
        let mut voxels = self.bricks.to_linear();
        if let Some(filler) = self.filler() {
            voxels.unmend(filler);
        }
        voxels
    }

    /// The sample type's short name, see [`Voxels::type_name`].
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        self.bricks.samples().type_name()
    }

    /// Slope and intercept.
    #[must_use]
    pub fn value_map(&self) -> ValueMap {
        self.values
    }

    /// Exact smallest and largest data value; zeros if there is no data ([`Self::is_empty`]).
    #[must_use]
    pub fn value_range(&self) -> [f64; 2] {
        self.value_range
    }

    /// The range without the outermost 0.1 % of the samples on each side, so that a few outliers
    /// do not distort it; the exact range where that would leave a single value.
    #[must_use]
    pub fn robust_range(&self) -> [f64; 2] {
        self.robust_range
    }

    /// The width of [`Self::robust_range`], at most the largest number of single precision.
    #[must_use]
    pub fn robust_width(&self) -> f32 {
        let [lo, hi] = self.robust_range;
        cast::single(hi - lo).min(f32::MAX)
    }

    /// Bins over all values that can be read here; over those of the robust range where outliers would leave it too few
    /// bins.
    #[must_use]
    pub fn value_bins(&self) -> ValueBins {
        /// If the value range is more than this many times the robust range, outliers go to the outer bins.
        const FAR_OUT: f64 = 16.0;

        let width = |[lo, hi]: [f64; 2]| hi - lo;
        let few = width(self.value_range) > FAR_OUT * width(self.robust_range);
        let [lo, hi] = (if few { self.robust_range } else { self.value_range }).map(cast::single);
        // One more bin at either end holds what interpolation rounds up or down.
        let bin = (0.5 * hi - 0.5 * lo) / (ValueBins::INSIDE as f32 / 2.0);
        ValueBins::new([(lo - bin).max(f32::MIN), (hi + bin).min(f32::MAX)])
    }

    /// How many samples were NaN or infinite in the file.
    #[must_use]
    pub fn non_finite(&self) -> u64 {
        self.mended.non_finite
    }

    /// How many samples were NaN in the file: they are no data, and neither they nor what lies between them and their neighbours is
    /// visible.
    #[must_use]
    pub fn no_data(&self) -> u64 {
        self.mended.nan
    }

    /// Whether there is no data at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.mended.nan == self.grid.len() as u64
    }

    /// The data value below which nothing that is read is data, if there are samples without data: their opacity is 0.
    #[must_use]
    pub fn no_data_below(&self) -> Option<f64> {
        self.mended.gap.map(|gap| gap.border)
    }

    /// Smallest and largest value per cell of [`Cells::EDGE`] voxels.
    #[must_use]
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Cells of another size; `0` is one cell around everything.
    #[must_use]
    pub fn cells_of(&self, edge: usize) -> Arc<Cells> {
        if edge == Cells::EDGE {
            return self.cells.clone();
        }
        /// Smaller cells take as much memory as the samples, and are not kept.
        const LEAST_KEPT: usize = 4;
        let new = || Arc::new(Cells::new(&self.grid, &self.bricks, self.values, edge));
        if (1..LEAST_KEPT).contains(&edge) {
            return new();
        }
        // The lock is not held while cells are built in parallel, or a worker that waits for it could block the others.
        let kept = || self.statistics.cells.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept().get(&edge).cloned();
        found.unwrap_or_else(|| {
            let cells = new();
            kept().entry(edge).or_insert(cells).clone()
        })
    }

    /// Counts of the data values in equal bins over `range`; values outside count in the end bins, no data in none.
    #[must_use]
    pub fn histogram(&self, range: [f64; 2], bins: usize) -> Histogram {
        Histogram::new(&self.bricks, self.values, self.filler(), range, bins)
    }

    /// The stored sample that stands for no data.
    fn filler(&self) -> Option<f64> {
        self.mended.gap.map(|gap| gap.filler)
    }

    /// The histogram of the robust range in 256 bins, by which transfer functions find their thresholds.
    #[must_use]
    pub fn robust_histogram(&self) -> &Histogram {
        /// Fine enough to set a threshold, coarse enough for every bin to mean something.
        const BINS: usize = 256;
        computed_once(&self.statistics.robust, || self.histogram(self.robust_range, BINS))
    }

    /// The histogram over the inner [`ValueBins`], all but the outermost two.
    #[must_use]
    pub fn value_bin_histogram(&self) -> &Histogram {
        computed_once(&self.statistics.value_bins, || {
            let bins = self.value_bins();
            let ends = [1.0, (ValueBins::COUNT - 1) as f32].map(|border| f64::from(bins.value(border)));
            self.histogram(ends, ValueBins::INSIDE)
        })
    }

    /// The data value at a voxel; NaN where there is no data.
    ///
    /// # Panics
    /// If the voxel is outside the grid.
    #[must_use]
    pub fn voxel(&self, position: [usize; 3]) -> f64 {
        let stored = self.bricks.get(position);
        if self.filler() == Some(stored) { f64::NAN } else { self.values.apply(stored) }
    }

    /// The data value at a point of index space, clamped to the edge outside; a number below [`Self::no_data_below`] where there is no
    /// data.
    #[inline]
    #[must_use]
    pub fn value(&self, p: Vec3) -> f32 {
        let stored = with_voxels!(self.bricks.samples(), samples => {
            self.lattice.read(samples, p, self.interpolation)
        });
        self.slope * stored + self.intercept
    }

    /// [`Self::value`], to the last bit, at all combinations of up to four ascending coordinates per axis, at most 1
    /// apart; x fastest.
    pub(crate) fn value_block(&self, axes: [&[f32]; 3], out: &mut [f32]) {
        match self.interpolation {
            Interpolation::Linear => with_voxels!(self.bricks.samples(), samples => {
                self.lattice.linear_block(samples, axes, out);
            }),
            Interpolation::Nearest => {
                let [xs, ys, zs] = axes;
                let positions = zs
                    .iter()
                    .flat_map(|&z| ys.iter().flat_map(move |&y| xs.iter().map(move |&x| Vec3::new(x, y, z))));
                for (out, p) in out.iter_mut().zip(positions) {
                    *out = with_voxels!(self.bricks.samples(), samples => {
                        self.lattice.read(samples, p, Interpolation::Nearest)
                    });
                }
            }
        }
        out.iter_mut().for_each(|stored| *stored = self.slope * *stored + self.intercept);
    }
}
