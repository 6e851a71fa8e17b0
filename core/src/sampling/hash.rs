//! Counter-based random numbers: hashes without state between calls.

use super::unit_float;

/// Bijective mix of 64 bits in which every input bit affects every output bit (the finaliser of SplitMix64,
/// Stafford's variant 13).
#[inline]
pub const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Independent random numbers for decisions outside the Sobol' streams. Counter `n` of a key always gives the
/// same number.
///
/// ```
/// use halflight_core::sampling::Random;
/// let random = Random::new(7, 42);
/// assert_eq!(random.single(3), Random::new(7, 42).single(3));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    key: u64,
}

impl Random {
    /// Stream number `stream` of `seed`.
    #[inline]
    pub const fn new(seed: u32, stream: u32) -> Self {
        Self { key: mix(((seed as u64) << 32 | stream as u64).wrapping_add(GOLDEN)) }
    }

    /// 32 random bits.
    #[inline]
    pub const fn bits(&self, counter: u32) -> u32 {
        (mix(self.key.wrapping_add((counter as u64).wrapping_mul(GOLDEN))) >> 32) as u32
    }

    /// Number in [0, 1).
    #[inline]
    pub const fn single(&self, counter: u32) -> f32 {
        unit_float(self.bits(counter))
    }
}

/// 2^64 over the golden ratio, odd, so that consecutive multiples are far apart.
pub(super) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
