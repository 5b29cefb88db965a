//! Vector instructions, selected at run time.
//!
//! A kernel is written once, over the lanes of `fearless_simd`, and compiled for every [`Level`]; gather loads, which
//! that library lacks, are in `gather`. Fused multiply-add rounds once where the scalar level rounds twice, so pictures
//! of two levels may differ in their last bits; those of one level never do.

#[expect(unsafe_code, reason = "gathers read through pointers; a comment at each explains why it is sound")]
mod gather;
mod math;

pub(crate) use gather::Lanes;
pub(crate) use math::{exp2_unfused, log2_unfused, one_minus_exp, unpack_directions};

use fearless_simd as simd;
use std::fmt;
use std::str::FromStr;

/// Maximum number of lanes of any level.
pub(crate) const MOST_LANES: usize = 16;

/// A set of vector instructions that this processor has.
#[derive(Clone, Copy)]
pub struct Level(Token);

/// Proof that the processor has the instructions.
#[derive(Clone, Copy)]
enum Token {
    Scalar(simd::Fallback),
    #[cfg(target_arch = "aarch64")]
    Neon(simd::Neon),
    #[cfg(target_arch = "x86_64")]
    Avx2(simd::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(simd::Avx512),
}

/// There is no level of that name, or this processor lacks it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no vector instructions `{found}` on this processor; it has {available}")]
pub struct UnknownLevel {
    found: String,
    available: String,
}

/// A computation that is compiled for every level.
pub(crate) trait Kernel {
    /// Its result.
    type Output;

    /// Must be `#[inline(always)]`, like everything it calls that works on lanes; otherwise the level's instructions
    /// are not used.
    fn run<S: Lanes>(self, simd: S) -> Self::Output;
}

impl Level {
    /// The widest level that this processor has.
    #[must_use]
    pub fn best() -> Self {
        *Self::available().last().expect("the scalar level is always available")
    }

    /// All levels that this processor has, narrowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let mut levels: Vec<Self> = match simd::Level::fallback() {
            simd::Level::Fallback(token) => vec![Self(Token::Scalar(token))],
            _ => Vec::new(),
        };
        let found = simd::Level::new();
        #[cfg(target_arch = "aarch64")]
        levels.extend(found.as_neon().map(|token| Self(Token::Neon(token))));
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(found.as_avx2().map(|token| Self(Token::Avx2(token))));
            levels.extend(found.as_avx512().map(|token| Self(Token::Avx512(token))));
        }
        levels
    }

    /// `scalar`, `neon`, `avx2` or `avx512`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0 {
            Token::Scalar(_) => "scalar",
            #[cfg(target_arch = "aarch64")]
            Token::Neon(_) => "neon",
            #[cfg(target_arch = "x86_64")]
            Token::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Token::Avx512(_) => "avx512",
        }
    }

    /// Runs a kernel with these instructions.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[inline(always)]
        fn on<S: Lanes, K: Kernel>(simd: S, kernel: K) -> K::Output {
            simd.vectorize(
                #[inline(always)]
                || kernel.run(simd),
            )
        }
        match self.0 {
            Token::Scalar(token) => on(token, kernel),
            #[cfg(target_arch = "aarch64")]
            Token::Neon(token) => on(token, kernel),
            #[cfg(target_arch = "x86_64")]
            Token::Avx2(token) => on(token, kernel),
            #[cfg(target_arch = "x86_64")]
            Token::Avx512(token) => on(token, kernel),
        }
    }
}

impl FromStr for Level {
    type Err = UnknownLevel;

    fn from_str(name: &str) -> Result<Self, UnknownLevel> {
        let levels = Self::available();
        levels.iter().copied().find(|level| level.name() == name).ok_or_else(|| UnknownLevel {
            found: name.into(),
            available: levels.iter().map(|level| level.name()).collect::<Vec<_>>().join(", "),
        })
    }
}

impl fmt::Debug for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Level({})", self.name())
    }
}

impl PartialEq for Level {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_found_by_name() {
        for level in Level::available() {
            assert_eq!(level.name().parse(), Ok(level));
        }
        let error = "avx9".parse::<Level>().unwrap_err().to_string();
        assert!(error.contains("avx9") && error.contains("scalar"), "{error}");
    }
}
