//! The film: size of the picture, and how radiance becomes an 8-bit image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tyndall::film::Backdrop;
use tyndall::film::tone::ToneCurve;

use super::shape::{Color, Exposure, Size};

/// Size of the picture, and how radiance becomes an 8-bit image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Film {
    /// Width and height, in pixels; at most 2^28 pixels in all.
    #[schemars(with = "Size<2>")]
    pub size: [u32; 2],

    /// Brightness of 8-bit outputs, in stops: +1 doubles it.
    #[schemars(with = "Exposure")]
    pub exposure: f32,

    /// Tone curve of 8-bit outputs.
    pub tone: Tone,

    /// What is seen behind the volume.
    pub background: Background,
}

impl Default for Film {
    fn default() -> Self {
        Self { size: [512; 2], exposure: 0.0, tone: Tone::default(), background: Background::default() }
    }
}

impl Film {
    /// How it is shown in 8 bits.
    #[must_use]
    pub fn shown(&self) -> tyndall::film::Tone {
        let backdrop = match self.background {
            Background::Color(color) => Some(Backdrop { color: color.into(), in_radiance: true }),
            Background::Environment | Background::Transparent => None,
        };
        tyndall::film::Tone { curve: self.tone.curve(), stops: self.exposure, backdrop }
    }
}

/// Tone curve: from radiance to the 8 bits of a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// AgX: a filmic curve that keeps hues where bright colours would clip.
    #[default]
    Agx,
    /// No curve: clipped at 1.
    Linear,
    /// Reinhard's curve, applied to luminance.
    Reinhard,
    /// A fit of the ACES film curve.
    Aces,
}

impl Tone {
    /// The curve that it names.
    #[must_use]
    pub fn curve(self) -> ToneCurve {
        match self {
            Self::Agx => ToneCurve::Agx,
            Self::Linear => ToneCurve::Linear,
            Self::Reinhard => ToneCurve::Reinhard,
            Self::Aces => ToneCurve::Aces,
        }
    }
}

/// What is seen behind the volume: the environment, nothing, or a colour that lights nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// The environment light if it is visible, otherwise black.
    #[default]
    Environment,
    /// Nothing: the picture has transparent pixels.
    Transparent,
    /// One radiance, which is seen but lights nothing.
    #[serde(untagged)]
    Color(#[schemars(with = "Color")] [f32; 3]),
}
