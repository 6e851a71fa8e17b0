//! Owen-scrambled Sobol' points by hashing (Burley 2020, "Practical Hash-based Owen Scrambling").
//!
//! A pair of dimensions is the (0,2)-sequence of Sobol' dimensions 0 and 1. For each pair the sample index is
//! shuffled by an Owen scramble of its own, which permutes every aligned power-of-two block within itself, so
//! that every power-of-two prefix stays a net. Both coordinates are then Owen-scrambled. Pairs are thus
//! independent of each other (padding), and their number is unlimited.
//!
//! Even and odd samples of a pixel come from two such sequences with different keys: independent replicates,
//! which the estimate of their mean's error requires (docs/decisions/error-estimate.md).
//!
//! Departures from the paper:
//! 1. The Laine-Karras hash has Vegdahl's constants (2021, "Building a Better LK Hash"), which approximate a
//!    true Owen scramble more closely.
//! 2. The hash works on reversed bits. Dimension 0 of Sobol' is the reversed index, dimension 1 the product
//!    of the Pascal matrix mod 2 with it. The hash needs both reversed, so that neither reversal is done.
//!    Five shift-xor steps compute the matrix product (Ahmed 2024, "An Implementation Algorithm of 2D Sobol
//!    Sequence").
//! 3. `quad` gives four dimensions at once: two (0,2)-sequences that are also stratified jointly. At 16, 64
//!    and 256 samples their projections are better than those of Sobol' dimensions 0 to 3 with the direction
//!    numbers of Joe and Kuo 2008, whose last two are no (0,2)-sequence.
//!
//! Everything before the last conversion is integer arithmetic: the same bits on every machine.

use super::{GOLDEN, mix, unit_float};
use halflight_simd::kernels::shade::numbers::{self, SECOND_PAIR, owen, pascal, second_key};

/// Random numbers of one sample of one pixel, by dimension. A dimension always gives the same numbers, and
/// different dimensions are independent. Up to 2^32 samples of pixels below 2^31.
///
/// ```
/// use halflight_core::sampling::Sampler;
/// let sampler = Sampler::new(1, 640 * 480 - 1, 0);
/// let [x, y] = sampler.pair(5);
/// assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    key: u64,
    reversed_index: u32,
}

impl Sampler {
    /// Sample number `sample` of `pixel` in the picture of `seed`. Even samples are the points of replicate
    /// 0, odd samples those of replicate 1.
    #[inline]
    pub const fn new(seed: u32, pixel: u32, sample: u32) -> Self {
        Self::replicate(seed, pixel, sample & 1, sample >> 1)
    }

    /// Point number `index` of replicate 0 or 1 of `pixel` in the picture of `seed`. The replicates are
    /// independent.
    #[inline]
    pub const fn replicate(seed: u32, pixel: u32, replicate: u32, index: u32) -> Self {
        let place = Self::replicate_place(seed, pixel, replicate);
        Self { key: numbers::place_key(place), reversed_index: index.reverse_bits() }
    }

    /// Number in [0, 1). Every power-of-two prefix of a replicate has one number in each of its equal
    /// intervals.
    #[inline]
    pub fn single(&self, dimension: u32) -> f32 {
        numbers::single(self.key, self.reversed_index, dimension)
    }

    /// Point of [0, 1)². Every power-of-two prefix of a replicate is a (0,2)-net.
    #[inline]
    pub fn pair(&self, dimension: u32) -> [f32; 2] {
        numbers::pair(self.key, self.reversed_index, dimension)
    }

    /// Point of [0, 1)⁴. Both halves are (0,2)-sequences over a replicate, and all four numbers together fill
    /// space more evenly than two independent pairs.
    #[inline]
    pub fn quad(&self, dimension: u32) -> [f32; 4] {
        let keys = numbers::keys(self.key, dimension);
        let index = owen(self.reversed_index, keys as u32);
        let other = second_pair(index);
        let more = mix(keys.wrapping_add(GOLDEN));
        [
            unit_float(owen(index, (keys >> 32) as u32)),
            unit_float(owen(pascal(index), second_key(keys))),
            unit_float(owen(other, more as u32)),
            unit_float(owen(pascal(other), (more >> 32) as u32)),
        ]
    }

    /// Seed and pixel of sample number `sample`, and its index, for [`numbers::SampleBlock`].
    #[inline]
    pub(crate) const fn place(seed: u32, pixel: u32, sample: u32) -> (u64, u32) {
        (Self::replicate_place(seed, pixel, sample & 1), sample >> 1)
    }

    /// Seed and pixel of the points of a replicate, for [`numbers::SampleBlock`].
    #[inline]
    pub(crate) const fn replicate_place(seed: u32, pixel: u32, replicate: u32) -> u64 {
        (seed as u64) << 32 | (pixel ^ replicate << 31) as u64
    }
}

/// Sum of the columns for each value of each nibble of an index.
static SECOND_PAIR_SUMS: [[u32; 16]; 8] = {
    let mut sums = [[0u32; 16]; 8];
    let mut i = 0;
    while i < 512 {
        let (entry, bit) = (i / 4, i % 4);
        if (entry >> bit) & 1 == 1 {
            sums[entry / 16][entry % 16] ^= SECOND_PAIR[entry / 16 * 4 + bit];
        }
        i += 1;
    }
    sums
};

/// Index of the second pair of a quad.
#[inline]
fn second_pair(index: u32) -> u32 {
    let mut sum = 0;
    for (nibble, sums) in SECOND_PAIR_SUMS.iter().enumerate() {
        sum ^= sums[(index >> (4 * nibble)) as usize & 15];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pascal_matrix_is_sobols_second_dimension() {
        // Direction numbers of degree 1: v_i = v_{i-1} ^ (v_{i-1} >> 1), m_1 = 1.
        let mut v = [1u32 << 31; 32];
        for i in 1..32 {
            v[i] = v[i - 1] ^ (v[i - 1] >> 1);
        }
        for i in 0..10_000u32 {
            let index = i.wrapping_mul(2_654_435_761);
            let sobol = (0..32).filter(|b| (index >> b) & 1 == 1).fold(0, |x, b: usize| x ^ v[b]);
            assert_eq!(pascal(index).reverse_bits(), sobol);
        }
    }

    #[test]
    fn the_matrix_of_the_second_pair_is_upper_unitriangular() {
        for (i, column) in SECOND_PAIR.iter().enumerate() {
            assert_eq!(column >> i, 1);
            assert_eq!(second_pair(1 << i), *column);
        }
        assert_eq!(second_pair(0x8421), second_pair(0x8000) ^ second_pair(0x421));
    }
}
