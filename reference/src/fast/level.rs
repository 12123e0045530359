//! Which vector instructions the fast renderer uses. The instructions come through `fearless_simd`, so
//! none of this crate's code is unsafe. The level never changes a bit of an image: every operation is
//! one IEEE operation a lane, unfused, in the order written.

use std::fmt;
use std::str::FromStr;

use fearless_simd::Level;

/// Lanes of the widest vectors of 32-bit numbers; what is processed many at a time is padded to it.
pub(crate) const LANES: usize = 16;

/// A set of vector instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// One sample after the other. Every triangle is set up one by one, none is left out as hidden.
    Scalar,
    /// x86: 128 bits.
    Sse2,
    /// x86-64-v2: 128 bits.
    Sse4_2,
    /// 64-bit ARM: 128 bits.
    Neon,
    /// x86-64-v3: 256 bits.
    Avx2,
    /// x86 from Ice Lake and Zen 4 on: 512 bits.
    Avx512,
}

impl SimdLevel {
    /// Every level, the widest last.
    pub const ALL: [Self; 6] =
        [Self::Scalar, Self::Sse2, Self::Sse4_2, Self::Neon, Self::Avx2, Self::Avx512];

    /// The levels that this machine has, the widest last.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let here = |level: &Self| *level == Self::Scalar || level.token().is_some();
        Self::ALL.into_iter().filter(here).collect()
    }

    /// The widest level that this machine has.
    #[must_use]
    pub fn best() -> Self {
        Self::available().into_iter().next_back().unwrap_or(Self::Scalar)
    }

    /// Its instructions, or those of the best level below it that the machine has; `None` for none.
    pub(crate) fn or_below(self) -> Option<Level> {
        let below = Self::ALL.into_iter().rev().filter(|&level| level <= self);
        below.filter_map(Self::token).next()
    }

    /// `None` where the machine does not have it.
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn token(self) -> Option<Level> {
        let best = Level::new();
        match self {
            Self::Scalar | Self::Neon => None,
            Self::Sse2 => best.as_sse2().map(Level::Sse2),
            Self::Sse4_2 => best.as_sse4_2().map(Level::Sse4_2),
            Self::Avx2 => best.as_avx2().map(Level::Avx2),
            Self::Avx512 => best.as_avx512().map(Level::Avx512),
        }
    }

    /// `None` where the machine does not have it.
    #[cfg(target_arch = "aarch64")]
    pub(crate) fn token(self) -> Option<Level> {
        (self == Self::Neon).then(|| Level::new().as_neon().map(Level::Neon)).flatten()
    }

    /// `None` where the machine does not have it.
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    pub(crate) fn token(self) -> Option<Level> {
        let _ = self;
        None
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Sse4_2 => "sse4.2",
            Self::Neon => "neon",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        })
    }
}

impl FromStr for SimdLevel {
    type Err = String;

    /// The name as [`fmt::Display`] writes it; the error lists the names.
    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|level| level.to_string() == name).ok_or_else(|| {
            let names = Self::ALL.map(|level| level.to_string()).join(", ");
            format!("no SIMD level {name:?}; the levels are {names}")
        })
    }
}
