//! SIMD levels: the instruction sets that kernels are compiled for, and their detection.
//!
//! A level is a value: detected once, capped if wanted, passed down. Nothing is global.

use crate::{Baseline, Simd};

/// Tier of SIMD instructions. A higher tier contains all lower ones.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum Tier {
    /// Single lanes, for tests.
    #[cfg(any(test, feature = "scalar"))]
    Scalar,
    /// Instructions of the build target: SSE2, NEON, simd128 or scalar code, through `wide`.
    Baseline,
    /// x86-64-v3: AVX2, FMA, F16C, BMI1/2, LZCNT, MOVBE, POPCNT.
    Avx2,
    /// x86-64-v4: AVX-512 F, VL, DQ, BW, CD.
    Avx512,
}

impl Tier {
    /// All tiers, lowest first.
    pub const ALL: [Tier; 3] = [Tier::Baseline, Tier::Avx2, Tier::Avx512];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            #[cfg(any(test, feature = "scalar"))]
            Tier::Scalar => "scalar",
            Tier::Baseline => "baseline",
            Tier::Avx2 => "avx2",
            Tier::Avx512 => "avx512",
        }
    }

    /// Tier of that name.
    pub fn named(name: &str) -> Option<Tier> {
        Tier::ALL.into_iter().find(|tier| tier.name() == name)
    }
}

/// Tier that this processor is known to have. Its only sources are [`Level::detect`], [`Level::BASELINE`],
/// and a higher level.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Level(Tier);

/// Work that is compiled once per level and run by [`Level::dispatch`].
///
/// `run` and everything that it calls in its hot part must be `#[inline(always)]`: functions that are not
/// inlined are compiled for the baseline.
pub trait Kernel {
    /// Result.
    type Out;
    /// Runs the work with lanes made by `simd`.
    fn run<S: Simd>(self, simd: S) -> Self::Out;
}

impl Level {
    /// Level that every processor of the build target has.
    pub const BASELINE: Level = Level(Tier::Baseline);

    /// Single lanes, by which tests judge the other levels.
    #[cfg(any(test, feature = "scalar"))]
    pub const SCALAR: Level = Level(Tier::Scalar);

    /// Highest level of this processor; without the feature `std` the highest that the build target
    /// guarantees.
    pub fn detect() -> Level {
        #[cfg(target_arch = "x86_64")]
        {
            if crate::x86::has_avx512() {
                return Level(Tier::Avx512);
            }
            if crate::x86::has_avx2() {
                return Level(Tier::Avx2);
            }
        }
        Level::BASELINE
    }

    /// This level, or `cap` if that is lower.
    pub fn capped(self, cap: Tier) -> Level {
        Level(self.0.min(cap))
    }

    /// Every level up to this one, lowest first.
    pub fn and_below(self) -> impl Iterator<Item = Level> {
        Tier::ALL.into_iter().filter(move |&tier| tier <= self.0).map(Level)
    }

    /// Tier.
    pub const fn tier(self) -> Tier {
        self.0
    }

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        self.0.name()
    }

    /// Runs `kernel` compiled for this level.
    #[inline]
    #[doc(hidden)]
    pub fn dispatch<K: Kernel>(self, kernel: K) -> K::Out {
        #[cfg(any(test, feature = "scalar"))]
        if self == Self::SCALAR {
            return kernel.run(crate::scalar::Scalar);
        }
        #[cfg(target_arch = "x86_64")]
        match self.0 {
            // SAFETY: a `Level` of this tier exists only where `has_avx512` was true.
            Tier::Avx512 => return unsafe { crate::x86::with_avx512(kernel) },
            // SAFETY: a `Level` of this tier exists only where `has_avx2` was true.
            Tier::Avx2 => return unsafe { crate::x86::with_avx2(kernel) },
            _ => {}
        }
        kernel.run(Baseline)
    }
}
