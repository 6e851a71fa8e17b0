//! Counter-based random numbers: hashes without state between calls.

use super::{GOLDEN, mix, unit_float};

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
