//! How the picture is computed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shape::{
    GatherSpacing, HistoryBits, HistoryMemory, LightSamples, MajorantCell, Nearest, Photons, Radius, Samples,
    ScatteringOrder, Segments, StepLength, StepsPerVoxel,
};

/// How the picture is computed: the method, its effort, and its own settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// The method.
    pub integrator: Integrator,

    /// Keeps light that scattered at most this many times; 1 is single scattering, 0 leaves emission, background and
    /// visible surfaces.
    #[schemars(with = "ScatteringOrder")]
    pub max_scatter: u32,

    /// Samples per pixel at which rendering stops.
    #[schemars(with = "Samples")]
    pub samples: u32,

    /// Seed of the random numbers: the same seed gives the same picture, bit for bit.
    pub seed: u64,

    /// Settings of the integrator `raymarch`.
    pub raymarch: RaymarchSettings,

    /// Settings of the integrator `path`.
    pub path: PathSettings,

    /// Settings of the integrator `photon`.
    pub photon: PhotonSettings,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            integrator: Integrator::default(),
            max_scatter: 64,
            samples: 64,
            seed: 0,
            raymarch: RaymarchSettings::default(),
            path: PathSettings::default(),
            photon: PhotonSettings::default(),
        }
    }
}

/// The method by which light is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Ray marching with shadow rays: emission, absorption and single scattering; deterministic, fast and flat.
    Raymarch,
    /// Unbiased, progressive path tracing through all orders of scattering: the ground truth.
    #[default]
    Path,
    /// Photon mapping whose photons and view rays survive edits that do not touch them.
    Photon,
}

/// Settings of the integrator `raymarch`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RaymarchSettings {
    /// Step along the ray, in voxels (cube root of the voxel volume).
    #[schemars(with = "StepLength")]
    pub step: f32,

    /// Fixed, stratified points on each area or environment light.
    #[schemars(with = "LightSamples")]
    pub light_samples: u32,
}

impl Default for RaymarchSettings {
    fn default() -> Self {
        Self { step: 0.5, light_samples: 16 }
    }
}

/// Settings of the integrator `path`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PathSettings {
    /// Edge, in voxels, of the cells that each keep their own majorant of the extinction; 0 is one majorant for the whole
    /// volume. It changes the speed, never the expected picture.
    #[schemars(with = "MajorantCell")]
    pub majorant_cell: u32,

    /// MiB in which a session that edits the scene keeps the first samples of each pixel, 32 bytes for each, so that an edit
    /// takes again those alone that it touched; 0 keeps none. It changes the speed, never the picture.
    #[schemars(with = "HistoryMemory")]
    pub history_memory: u32,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self { majorant_cell: 8, history_memory: 512 }
    }
}

/// Settings of the integrator `photon`; lengths in voxels (cube root of the voxel volume).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PhotonSettings {
    /// Light paths that start, of all lights together.
    #[schemars(with = "Photons")]
    pub photons: u32,

    /// Radius within which light is gathered: larger is smoother, and blurs. A sphere in world space, whatever the spacing.
    #[schemars(with = "Radius")]
    pub radius: f32,

    /// Parts of each view ray that an edit leaves or redoes by themselves.
    #[schemars(with = "Segments")]
    pub segments: u32,

    /// Steps of a view ray per voxel.
    #[schemars(with = "StepsPerVoxel")]
    pub steps_per_voxel: f32,

    /// Radii between gathers along a view ray at most; 0 gathers at every step.
    #[schemars(with = "GatherSpacing")]
    pub gather_spacing: f32,

    /// How light is estimated from photons.
    pub estimate: Estimate,

    /// Photons that the estimate `nearest` takes, as far as so many lie within the radius.
    #[schemars(with = "Nearest")]
    pub nearest: u32,

    /// Which part of a light path has a history of its own.
    pub histories: Histories,

    /// Bits of a Historygram: 32, 64 or 128 groups of data values that an edit is told apart by.
    #[schemars(with = "HistoryBits")]
    pub history_bits: u32,

    /// How data values are put into these groups.
    pub bins: HistoryBins,

    /// How a part of a view ray learns that photons near it changed.
    pub spatial: SpatialHistory,
}

impl Default for PhotonSettings {
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
