//! The film: size of the picture, and how radiance becomes an 8-bit image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tyndall::film::tone::ToneCurve;
use tyndall::film::{Backdrop, Image};

use super::shape::{Color, Size, Stops};

/// Size of the picture, and how radiance becomes an 8-bit image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Film {
    /// Width and height, in pixels; at most 2^28 pixels in all.
    #[schemars(with = "Size<2>")]
    pub size: [u32; 2],

    /// Brightness of 8-bit outputs, in stops: +1 doubles it; `auto` sets it from the picture.
    pub exposure: Exposure,

    /// Tone curve of 8-bit outputs.
    pub tone: Tone,

    /// What is seen behind the volume.
    pub background: Background,
}

impl Default for Film {
    fn default() -> Self {
        Self {
            size: [512; 2],
            exposure: Exposure::default(),
            tone: Tone::default(),
            background: Background::default(),
        }
    }
}

impl Film {
    /// How a picture is shown in 8 bits.
    #[must_use]
    pub fn shown(&self, picture: &Image) -> tyndall::film::Tone {
        self.shown_at(self.stops(picture))
    }

    /// How a picture is shown in 8 bits with an exposure in stops.
    #[must_use]
    pub fn shown_at(&self, stops: f32) -> tyndall::film::Tone {
        tyndall::film::Tone { curve: self.tone.curve(), stops, backdrop: self.backdrop() }
    }

    /// Its exposure, in stops, as given or else measured in the picture.
    #[must_use]
    pub fn stops(&self, picture: &Image) -> f32 {
        match self.exposure {
            Exposure::Auto => picture.exposure(self.backdrop()),
            Exposure::Stops(stops) => stops,
        }
    }

    fn backdrop(&self) -> Option<Backdrop> {
        match self.background {
            Background::Color(color) => Some(Backdrop { color: color.into(), in_radiance: true }),
            Background::Environment | Background::Transparent => None,
        }
    }
}

/// Brightness of 8-bit outputs: a number of stops, or one that suits the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Exposure {
    /// What brings the bright parts of the matter to a linear radiance of 0.6, or of 0.3 before white, see [`Image::exposure`]. Metadata state
    /// the number.
    Auto,
    /// Stops: +1 doubles the brightness.
    #[serde(untagged)]
    Stops(#[schemars(with = "Stops")] f32),
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Stops(0.0)
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
