//! The instruction sets a kernel can be compiled for, and which of them this processor has.
//!
//! A level is a value: detected once, capped at will, passed down. Nothing here is global.

use crate::{Baseline, Simd};

/// A tier of SIMD instructions. Ordered: a higher tier holds all of the lower ones.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum Tier {
    /// What the build target guarantees: SSE2, NEON, simd128 or plain scalar code, through `wide`.
    Baseline,
    /// x86-64-v3: AVX2, FMA, F16C, BMI1/2, LZCNT, MOVBE, POPCNT.
    Avx2,
    /// x86-64-v4: AVX-512 F, VL, DQ, BW, CD.
    Avx512,
}

impl Tier {
    /// All tiers, lowest first.
    pub const ALL: [Tier; 3] = [Tier::Baseline, Tier::Avx2, Tier::Avx512];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Tier::Baseline => "baseline",
            Tier::Avx2 => "avx2",
            Tier::Avx512 => "avx512",
        }
    }

    /// The tier of that name.
    pub fn named(name: &str) -> Option<Tier> {
        Tier::ALL.into_iter().find(|tier| tier.name() == name)
    }
}

/// A tier that this processor is known to have. Cannot be made otherwise than by [`Level::detect`],
/// by [`Level::BASELINE`], or lower from higher.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Level(Tier);

/// Work to be compiled once per level and run by [`Level::dispatch`].
///
/// `run` must be `#[inline(always)]`, and so must all that it calls in its hot part: what is not
/// inlined is compiled for the baseline.
pub trait Kernel {
    /// What it returns.
    type Out;
    /// The work, with the lanes that `simd` makes.
    fn run<S: Simd>(self, simd: S) -> Self::Out;
}

impl Level {
    /// What every processor of the build target has.
    pub const BASELINE: Level = Level(Tier::Baseline);

    /// The highest level of this processor. Without the feature `std`: what the build target guarantees.
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

    /// This level, or `cap` where that is lower.
    pub fn capped(self, cap: Tier) -> Level {
        Level(self.0.min(cap))
    }

    /// Every level up to this one, lowest first.
    pub fn and_below(self) -> impl Iterator<Item = Level> {
        Tier::ALL.into_iter().filter(move |&tier| tier <= self.0).map(Level)
    }

    /// Its tier.
    pub const fn tier(self) -> Tier {
        self.0
    }

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        self.0.name()
    }

    /// Runs `kernel` compiled for this level.
    #[inline]
    pub fn dispatch<K: Kernel>(self, kernel: K) -> K::Out {
        #[cfg(target_arch = "x86_64")]
        match self.0 {
            // SAFETY: a `Level` of this tier exists only where `has_avx512` was true.
            Tier::Avx512 => return unsafe { crate::x86::with_avx512(kernel) },
            // SAFETY: a `Level` of this tier exists only where `has_avx2` was true.
            Tier::Avx2 => return unsafe { crate::x86::with_avx2(kernel) },
            Tier::Baseline => {}
        }
        kernel.run(Baseline)
    }
}
