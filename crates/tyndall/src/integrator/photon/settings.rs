//! Settings of `render.photon`; lengths in voxels.

use crate::transfer::Grouping;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the integrator `photon`; lengths in voxels (cube root of the voxel volume).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "PhotonSettings")]
pub struct Settings {
    /// Light paths that start, of all lights together.
    #[schemars(range(min = 1, max = 268_435_456))]
    pub photons: u32,

    /// Radius within which light is gathered: larger is smoother, and blurs. A sphere in world space, whatever the
    /// spacing.
    #[schemars(range(min = 0.01, max = 1000))]
    pub radius: f32,

    /// Parts of each view ray that an edit leaves or redoes by themselves.
    #[schemars(range(min = 1, max = 256))]
    pub segments: u32,

    /// Steps of a view ray per voxel.
    #[schemars(range(min = 0.1, max = 100))]
    pub steps_per_voxel: f32,

    /// Radii between gathers along a view ray at most; 0 gathers at every step.
    #[schemars(range(min = 0, max = 4))]
    pub gather_spacing: f32,

    /// How light is estimated from photons.
    pub estimate: Estimate,

    /// Photons that the estimate `nearest` takes, as far as so many lie within the radius.
    #[schemars(range(min = 2, max = 65_536))]
    pub nearest: u32,

    /// Which part of a light path has a history of its own.
    pub histories: Histories,

    /// Bits of a Historygram: 32, 64 or 128 groups of data values that an edit is told apart by.
    #[schemars(range(min = 32, max = 128))]
    pub history_bits: u32,

    /// How data values are put into these groups.
    pub bins: HistoryBins,

    /// How a part of a view ray learns that photons near it changed.
    pub spatial: SpatialHistory,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            photons: 1 << 20,
            radius: 1.5,
            segments: 7,
            steps_per_voxel: 2.0,
            gather_spacing: 1.5,
            estimate: Estimate::default(),
            nearest: 32,
            histories: Histories::default(),
            history_bits: 64,
            bins: HistoryBins::default(),
            spatial: SpatialHistory::default(),
        }
    }
}

impl Settings {
    /// Groups of values in a Historygram.
    pub(super) fn groups(&self) -> u8 {
        u8::try_from(self.history_bits).unwrap_or(128)
    }

    /// How values are put into them.
    pub(super) fn grouping(&self) -> Grouping {
        match self.bins {
            HistoryBins::Quantile => Grouping::Quantile,
            HistoryBins::Uniform => Grouping::Uniform,
        }
    }

    /// How light is estimated.
    pub(super) fn estimator(&self) -> Estimator {
        match self.estimate {
            Estimate::Point => Estimator::Point,
            Estimate::Nearest => Estimator::Nearest(self.nearest),
            Estimate::Beam => Estimator::Beam,
        }
    }
}

/// How light is estimated from photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Estimate {
    /// By all photons within the radius of a point.
    #[default]
    Point,
    /// By the nearest photons, `nearest` of them; blurs less where there are many.
    Nearest,
    /// By all photons within the radius of the view ray: blurs nothing along it.
    Beam,
}

/// Which part of a light path has a history of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Histories {
    /// Each interaction: an edit retraces a path from where it touched it.
    #[default]
    Interactions,
    /// The path as a whole: less memory, but a touched path is retraced from its beginning.
    Paths,
}

/// How data values are put into groups that an edit is told apart by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HistoryBins {
    /// Groups that hold equally many voxels, as far as that goes.
    #[default]
    Quantile,
    /// Groups equally wide.
    Uniform,
}

/// How a part of a view ray learns that photons near it changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpatialHistory {
    /// A bit for each cell of the photon map: exact.
    #[default]
    Cells,
    /// 64 bits along each axis: exact, but soon everything counts as changed.
    Axes,
    /// Not at all: parts that an edit does not touch keep the light that they had, which is wrong.
    Off,
}

/// [`Estimate`] with what it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Estimator {
    /// By all photons within the radius.
    Point,
    /// By so many nearest ones, within the radius at most.
    Nearest(u32),
    /// By all photons within the radius of the ray \[Jarosz08\].
    Beam,
}
