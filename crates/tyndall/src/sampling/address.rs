//! Addresses of a picture's random numbers: the one table of what they are for, with the key and the counter
//! \[Salmon11\] of each.
//!
//! Under one seed, five words identify a number: the pass, which goes into the key, and the four words of the counter.
//! The first of these counts the blocks of a [`Stream`], without bound; a purpose that draws once may give it another
//! meaning. The last begins with the [`Kind`] of the purpose, so that no two purposes overlap; the tests below check it.

use super::philox;
use super::stream::{Stream, key};
use std::ops::RangeInclusive;

/// Bounces that draw from the Sobol sequence; past these a better spread no longer pays.
pub(super) const SOBOL_BOUNCES: u32 = 12;

/// Points of a Sobol sequence before the next one, with its own scramble.
pub(super) const SEQUENCE: u32 = 1 << 16;

/// Samples, passes and emitters: any word is possible.
const ANY: RangeInclusive<u32> = 0..=u32::MAX;
/// Pixels, row by row; a document has no more.
pub const PIXELS: RangeInclusive<u32> = 0..=(1 << 28) - 1;
/// Paths of one emitter in one pass; a document has no more.
pub const PATHS: RangeInclusive<u32> = 0..=(1 << 28) - 1;
/// Bounces, from 0; a document has no more.
pub const BOUNCES: RangeInclusive<u32> = 0..=999_999;
/// Bounces past the Sobol sequence.
const LATE_BOUNCES: RangeInclusive<u32> = SOBOL_BOUNCES..=*BOUNCES.end();
/// Numbers of successive Sobol sequences, of a pixel's samples and of an emitter's paths.
const SEQUENCES_OF_SAMPLES: RangeInclusive<u32> = 0..=*ANY.end() / SEQUENCE;
const SEQUENCES_OF_PATHS: RangeInclusive<u32> = 0..=*PATHS.end() / SEQUENCE;

/// Above every index of a light.
const TOP_BIT: u32 = 1 << 31;

/// The purpose of numbers, in the upper four bits of the counter's last word.
#[derive(Clone, Copy, Debug)]
enum Kind {
    CameraTracking,
    CameraScramble,
    ViewRay,
    LightScramble,
    LightTracking,
    LightLateBounce,
    MatterEmission,
}

impl Kind {
    /// The counter's last word; a bounce takes its lower 28 bits.
    const fn at(self, bounce: u32) -> u32 {
        (self as u32) << 28 | bounce
    }
}

/// Each row: a variant, the values that its fields may have, and the words computed from them. Each word must increase
/// with one field.
macro_rules! table {
    ($(#[$about:meta])* $table:ident.$words:ident -> $of:ty {
        $($(#[$doc:meta])* $name:ident $({ $($field:ident in $range:expr),* })? => $word:expr;)*
    }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug)]
        pub(crate) enum $table {
            $($(#[$doc])* $name $({ $($field: u32),* })?,)*
        }

        impl $table {
            #[inline]
            pub fn $words(self) -> $of {
                match self {
                    $(Self::$name $({ $($field),* })? => {
                        $($(debug_assert!($range.contains(&$field), "{self:?}");)*)?
                        $word
                    })*
                }
            }

            /// One of each row, its fields picked from the values that they may have.
            #[cfg(test)]
            fn each(mut pick: impl FnMut(RangeInclusive<u32>) -> u32) -> Vec<Self> {
                vec![$(Self::$name $({ $($field: pick($range)),* })?),*]
            }

            #[cfg(test)]
            fn name(self) -> &'static str {
                match self {
                    $(Self::$name $({ $($field: _),* })? => stringify!($name),)*
                }
            }
        }
    };
}

table! {
    /// What random numbers are for.
    Purpose.address -> Address {
        /// Tracking of a camera path, its draws from glowing matter, and its bounces past the Sobol sequence.
        CameraTracking { pixel in PIXELS, sample in ANY } =>
            stream(0, [pixel, sample, Kind::CameraTracking.at(0)]);
        /// Scramble of the Sobol sequence of camera paths.
        CameraScramble { pixel in PIXELS, sequence in SEQUENCES_OF_SAMPLES } =>
            once(0, [pixel, sequence, 0, Kind::CameraScramble.at(0)]);
        /// A view ray of a refinement pass: its position in the pixel and on the lens, and its steps.
        ViewRay { pixel in PIXELS, sample in ANY } =>
            stream(0, [pixel, sample, Kind::ViewRay.at(0)]);
        /// Scramble of the Sobol sequence of light paths.
        LightScramble { pass in ANY, emitter in ANY, sequence in SEQUENCES_OF_PATHS } =>
            once(pass, [emitter, sequence, 0, Kind::LightScramble.at(0)]);
        /// Tracking of a flight of a light path.
        LightTracking { pass in ANY, emitter in ANY, path in PATHS, bounce in BOUNCES } =>
            stream(pass, [emitter, path, Kind::LightTracking.at(bounce)]);
        /// A scattering event of a light path past the Sobol sequence: apart from the flight's numbers, whose count is
        /// unknown.
        LightLateBounce { pass in ANY, emitter in ANY, path in PATHS, bounce in LATE_BOUNCES } =>
            stream(pass, [emitter, path, Kind::LightLateBounce.at(bounce)]);
        /// Where in a glowing cell a light path begins.
        MatterEmission { pass in ANY, path in PATHS } =>
            stream(pass, [Emitter::Matter.number(), path, Kind::MatterEmission.at(0)]);
    }
}

table! {
    /// Emitters of light paths, each with the word that separates its random numbers from those of the others.
    Emitter.number -> u32 {
        /// A light without a name of its own: by its index among the lights.
        Unnamed { index in 0..=TOP_BIT - 2 } => index;
        /// A light with a name: by a hash, so that it keeps its numbers when other lights come and go. One pair of names in
        /// 2^31 shares them.
        Named { hash in ANY } => hash | TOP_BIT;
        /// All glowing matter.
        Matter => TOP_BIT - 1;
    }
}

/// Address of random numbers under a seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Address {
    pass: u32,
    counter: [u32; 4],
    /// Whether the counter's first word counts up from there.
    is_stream: bool,
}

const fn once(pass: u32, counter: [u32; 4]) -> Address {
    Address { pass, counter, is_stream: false }
}

const fn stream(pass: u32, [a, b, c]: [u32; 3]) -> Address {
    Address { pass, counter: [0, a, b, c], is_stream: true }
}

impl Purpose {
    /// The numbers of a purpose that may draw any number of them.
    #[inline]
    pub fn stream(self, seed: u64) -> Stream {
        let Address { pass, counter, is_stream } = self.address();
        debug_assert!(is_stream, "{self:?} draws once");
        Stream::at(key(seed, pass), counter)
    }

    /// The 32 random bits of a purpose that draws once.
    #[inline]
    pub(super) fn bits(self, seed: u64) -> u32 {
        let Address { pass, counter, is_stream } = self.address();
        debug_assert!(!is_stream, "{self:?} draws more than once");
        philox(counter, key(seed, pass))[0]
    }
}

#[cfg(test)]
mod tests;
