//! Settings of `render.photon`; lengths in voxels.

use crate::transfer::Grouping;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the integrator `photon`; lengths in voxels (cube root of the voxel volume).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "PhotonSettings")]
pub struct Settings {
    /// Number of light paths started, over all lights.
    #[schemars(range(min = 1, max = 268_435_456))]
    pub photons: u32,

    /// Radius within which photons are gathered: a larger one smooths but blurs. A sphere in world space, whatever the
    /// spacing.
    #[schemars(range(min = 0.01, max = 1000))]
    pub radius: f32,

    /// Number of parts into which each view ray is divided; an edit keeps or recomputes each part independently.
    #[schemars(range(min = 1, max = 256))]
    pub segments: u32,

    /// Steps of a view ray per voxel.
    #[schemars(range(min = 0.1, max = 100))]
    pub steps_per_voxel: f32,

    /// Maximum distance between gathers along a view ray, in radii; 0 gathers at every step.
    #[schemars(range(min = 0, max = 4))]
    pub gather_spacing: f32,

    /// How light is estimated from photons.
    pub estimate: Estimate,

    /// Number of photons that the estimate `nearest` uses, if that many are within the radius.
    #[schemars(range(min = 2, max = 65_536))]
    pub nearest: u32,

    /// Which part of a light path has a history of its own.
    pub histories: Histories,

    /// Bits of a Historygram: 32, 64 or 128 groups of data values by which edits are distinguished.
    #[schemars(range(min = 32, max = 128))]
    pub history_bits: u32,

    /// How data values are divided into these groups.
    pub bins: HistoryBins,

    /// How a part of a view ray finds out that photons near it changed.
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
    /// Number of groups of values in a Historygram.
    pub(super) fn groups(&self) -> u8 {
        u8::try_from(self.history_bits).unwrap_or(128)
    }

    /// How values are divided into groups.
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
    /// By the `nearest` nearest photons; blurs less where there are many.
    Nearest,
    /// By all photons within the radius of the view ray: no blur along the ray.
    Beam,
}

/// Which part of a light path has a history of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Histories {
    /// Each interaction: an edit retraces a path from the first interaction that it touched.
    #[default]
    Interactions,
    /// The path as a whole: less memory, but a touched path is retraced from the beginning.
    Paths,
}

/// How data values are divided into groups by which edits are distinguished.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HistoryBins {
    /// Groups with as nearly equal numbers of voxels as possible.
    #[default]
    Quantile,
    /// Groups of equal width.
    Uniform,
}

/// How a part of a view ray finds out that photons near it changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpatialHistory {
    /// A bit for each cell of the photon map: exact.
    #[default]
    Cells,
    /// 64 bits per axis: also exact, but soon everything counts as changed.
    Axes,
    /// Not at all: parts that an edit does not touch keep their old light, which is wrong.
    Off,
}

/// [`Estimate`] with its parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Estimator {
    /// By all photons within the radius.
    Point,
    /// By this many nearest photons, at most those within the radius.
    Nearest(u32),
    /// By all photons within the radius of the ray \[Jarosz08\].
    Beam,
}
