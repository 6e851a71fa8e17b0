//! Owen-scrambled Sobol' points by hashing (Burley 2020, "Practical Hash-based Owen Scrambling").
//!
//! A pair of dimensions is the (0,2)-sequence of Sobol' dimensions 0 and 1. For each pair the sample index
//! is shuffled by an Owen scramble of its own (which keeps every aligned power-of-two block together, so
//! every power-of-two prefix stays a net), then both coordinates are Owen-scrambled. Pairs are thereby
//! independent of each other (padding), and there are as many as anybody asks for.
//!
//! Departures from the paper:
//! 1. The Laine-Karras hash has Vegdahl's constants (2021, "Building a Better LK Hash"), which come closer
//!    to a true Owen scramble.
//! 2. The hash works on reversed bits. Dimension 0 of Sobol' is the reversed index, dimension 1 the Pascal
//!    matrix mod 2 times it; both are wanted reversed, so neither reversal is done (five shift-xor steps
//!    make the matrix product, Ahmed 2024, "An Implementation Algorithm of 2D Sobol Sequence").
//! 3. Four dimensions can be asked for at once (`quad`), stratified jointly; the direction numbers are
//!    those of Joe and Kuo 2008.
//!
//! Integers only, up to the last conversion: the same bits on every machine.

use super::hash::{GOLDEN, mix};
use super::unit_float;

/// The streams of one sample of one pixel. Dimensions are names: the same one always gives the same
/// numbers, and any two are independent. 2^32 samples.
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
    /// Sample number `sample` of `pixel` in the picture of `seed`.
    #[inline]
    pub const fn new(seed: u32, pixel: u32, sample: u32) -> Self {
        let key = mix(((seed as u64) << 32 | pixel as u64).wrapping_add(GOLDEN));
        Self { key, reversed_index: sample.reverse_bits() }
    }

    /// One number in [0, 1): every power-of-two prefix of the samples has one in each of its equal parts.
    #[inline]
    pub fn single(&self, dimension: u32) -> f32 {
        let keys = self.keys(dimension);
        unit_float(owen(self.shuffled_index(keys), (keys >> 32) as u32))
    }

    /// A point of [0, 1)²: every power-of-two prefix of the samples is a (0,2)-net.
    #[inline]
    pub fn pair(&self, dimension: u32) -> [f32; 2] {
        let keys = self.keys(dimension);
        let index = self.shuffled_index(keys);
        let x = owen(index, (keys >> 32) as u32);
        let y = owen(pascal(index), second_key(keys));
        [unit_float(x), unit_float(y)]
    }

    /// A point of [0, 1)⁴ from the first four dimensions of Sobol': both halves are (0,2)-sequences, or
    /// nearly so, and all four numbers together fill space more evenly than two independent pairs.
    #[inline]
    pub fn quad(&self, dimension: u32) -> [f32; 4] {
        let keys = self.keys(dimension);
        let index = self.shuffled_index(keys);
        let more = mix(keys.wrapping_add(GOLDEN));
        [
            unit_float(owen(index, (keys >> 32) as u32)),
            unit_float(owen(pascal(index), second_key(keys))),
            unit_float(owen(product(&DIMENSION_2, index), more as u32)),
            unit_float(owen(product(&DIMENSION_3, index), (more >> 32) as u32)),
        ]
    }

    /// 64 hashed bits for a dimension: the lower half shuffles, the upper half scrambles.
    #[inline]
    const fn keys(&self, dimension: u32) -> u64 {
        mix(self.key.wrapping_add((dimension as u64).wrapping_mul(GOLDEN)))
    }

    #[inline]
    const fn shuffled_index(&self, keys: u64) -> u32 {
        owen(self.reversed_index, keys as u32)
    }
}

/// Owen-scrambles a number that is given with its bits reversed, and turns it around.
#[inline]
const fn owen(reversed: u32, key: u32) -> u32 {
    laine_karras(reversed, key).reverse_bits()
}

/// A hash in which a bit depends on itself and lower bits only: on reversed bits, an Owen scramble.
#[inline]
const fn laine_karras(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The key of the second coordinate, out of bits of both halves.
#[inline]
const fn second_key(keys: u64) -> u32 {
    (keys.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as u32
}

/// The Pascal matrix mod 2 times `index`: Sobol' dimension 1 with its bits reversed.
#[inline]
const fn pascal(mut index: u32) -> u32 {
    index ^= index >> 16;
    index ^= (index >> 8) & 0x00ff_00ff;
    index ^= (index >> 4) & 0x0f0f_0f0f;
    index ^= (index >> 2) & 0x3333_3333;
    index ^ ((index >> 1) & 0x5555_5555)
}

/// For each nibble of an index, what it adds to a Sobol' number with reversed bits.
type Matrix = [[u32; 16]; 8];

static DIMENSION_2: Matrix = matrix(2, 1, [1, 3, 0]);
static DIMENSION_3: Matrix = matrix(3, 1, [1, 3, 1]);

#[inline]
fn product(matrix: &Matrix, index: u32) -> u32 {
    let mut result = 0;
    for (nibble, row) in matrix.iter().enumerate() {
        result ^= row[(index >> (4 * nibble)) as usize & 15];
    }
    result
}

/// Direction numbers from a primitive polynomial of `degree` with inner coefficients `a` and the initial
/// values `m` (Joe and Kuo 2008, eq. 2), as sums for every nibble.
const fn matrix(degree: usize, a: u32, m: [u32; 3]) -> Matrix {
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        if i < degree {
            v[i] = m[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                v[i] ^= ((a >> (degree - 1 - k)) & 1) * v[i - k];
                k += 1;
            }
        }
        i += 1;
    }
    let mut sums = [[0u32; 16]; 8];
    let mut entry = 0;
    while entry < 128 {
        let mut bit = 0;
        while bit < 4 {
            if (entry >> bit) & 1 == 1 {
                sums[entry / 16][entry % 16] ^= v[entry / 16 * 4 + bit].reverse_bits();
            }
            bit += 1;
        }
        entry += 1;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pascal_matrix_is_sobols_second_dimension() {
        // Degree 1: v_i = v_{i-1} ^ (v_{i-1} >> 1).
        let second = matrix(1, 0, [1, 0, 0]);
        for i in 0..10_000u32 {
            let index = i.wrapping_mul(2_654_435_761);
            assert_eq!(product(&second, index), pascal(index));
        }
    }

    #[test]
    fn first_points_of_dimensions_2_and_3_are_the_published_ones() {
        // Joe and Kuo, new-joe-kuo-6, in the order without Gray code.
        let points = |m: &Matrix| [1, 2, 3, 4].map(|i| product(m, i).reverse_bits() >> 28);
        assert_eq!(points(&DIMENSION_2), [8, 12, 4, 6]);
        assert_eq!(points(&DIMENSION_3), [8, 12, 4, 2]);
    }
}
