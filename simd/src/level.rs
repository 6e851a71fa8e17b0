//! The instruction sets a kernel can be compiled for, and which of them this processor has.
//!
//! A level is a value: detected once, capped at will, passed down. Nothing here is global.

/// A tier of SIMD instructions. Ordered: a higher tier holds all of the lower ones.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
#[non_exhaustive]
pub enum Level {
    /// What the build target guarantees: SSE2, NEON, simd128 or plain scalar code, through `wide`.
    Baseline,
    /// x86-64-v3: AVX2, FMA, F16C, BMI1/2, LZCNT, MOVBE, POPCNT.
    Avx2,
    /// x86-64-v4: AVX-512 F, VL, DQ, BW, CD.
    Avx512,
}

impl Level {
    /// The highest level of this processor. Without the feature `std`: [`Level::Baseline`].
    pub fn detect() -> Level {
        Level::Baseline
    }

    /// This level, or `cap` where that is lower.
    pub fn capped(self, cap: Level) -> Level {
        self.min(cap)
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Level::Baseline => "baseline",
            Level::Avx2 => "avx2",
            Level::Avx512 => "avx512",
        }
    }
}
