//! Owen-scrambled Sobol' points by hashing (Burley 2020), for sixteen samples at once.
//!
//! The operations are those of integers, in loops over sixteen words that the compiler turns into vectors at
//! every level (`sequences.rs`): the same bits by construction.

use super::sequences::Sequences;
use super::{BLOCK, Row};
use crate::lanes::Simd;
use crate::level::{Kernel, Level};

/// 2^64 over the golden ratio, odd, so that consecutive multiples are far apart.
pub const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Bijective mix of 64 bits in which every input bit affects every output bit (the finaliser of SplitMix64,
/// Stafford's variant 13).
#[inline(always)]
pub const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Owen-scrambles a number given with its bits reversed, and reverses them.
#[inline(always)]
pub const fn owen(reversed: u32, key: u32) -> u32 {
    laine_karras(reversed, key).reverse_bits()
}

/// Hash in which a bit depends on itself and lower bits only: on reversed bits, an Owen scramble (constants
/// of Vegdahl 2021).
#[inline(always)]
const fn laine_karras(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Key of the second coordinate, from bits of both halves.
#[inline(always)]
pub const fn second_key(keys: u64) -> u32 {
    (keys.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as u32
}

/// Product of the Pascal matrix mod 2 with `index`: Sobol' dimension 1 with its bits reversed.
#[inline(always)]
pub const fn pascal(mut index: u32) -> u32 {
    index ^= index >> 16;
    index ^= (index >> 8) & 0x00ff_00ff;
    index ^= (index >> 4) & 0x0f0f_0f0f;
    index ^= (index >> 2) & 0x3333_3333;
    index ^ ((index >> 1) & 0x5555_5555)
}

/// Float in [0, 1) from a 32-bit fraction: the upper 24 bits, so that 1 is never reached.
#[inline(always)]
pub const fn unit_float(bits: u32) -> f32 {
    // Signed, because vectors without AVX-512 convert signed integers only.
    (bits >> 8) as i32 as f32 * (1.0 / (1u32 << 24) as f32)
}

/// 64 hashed bits of the sample of `key` for a dimension: the lower half shuffles, the upper half scrambles.
#[inline(always)]
pub const fn keys(key: u64, dimension: u32) -> u64 {
    mix(key.wrapping_add((dimension as u64).wrapping_mul(GOLDEN)))
}

/// Point of [0, 1)² of the sample of `key` with the bits of its index reversed.
#[inline(always)]
pub const fn pair(key: u64, reversed_index: u32, dimension: u32) -> [f32; 2] {
    let keys = keys(key, dimension);
    let index = owen(reversed_index, keys as u32);
    [unit_float(owen(index, (keys >> 32) as u32)), unit_float(owen(pascal(index), second_key(keys)))]
}

/// First number of [`pair`].
#[inline(always)]
pub const fn single(key: u64, reversed_index: u32, dimension: u32) -> f32 {
    let keys = keys(key, dimension);
    unit_float(owen(owen(reversed_index, keys as u32), (keys >> 32) as u32))
}

/// Columns of the upper unitriangular matrix that maps the index of the first pair of a quad to that of the
/// second. The map permutes every aligned power-of-two block within itself, so that the second pair is a
/// (0,2)-sequence like the first. The columns were found by a beam search, block size by block size, for
/// small t of all projections that mix both pairs. Those after the fifteenth are random.
pub const SECOND_PAIR: [u32; 32] = [
    0x0000_0001,
    0x0000_0002,
    0x0000_0005,
    0x0000_000b,
    0x0000_0010,
    0x0000_0021,
    0x0000_0043,
    0x0000_00ec,
    0x0000_017c,
    0x0000_0259,
    0x0000_047e,
    0x0000_0ef7,
    0x0000_159f,
    0x0000_2f63,
    0x0000_7721,
    0x0000_a7db,
    0x0001_37a0,
    0x0003_2544,
    0x0006_63d9,
    0x000b_bcb2,
    0x0019_7b6d,
    0x003b_15a7,
    0x0047_28d9,
    0x00a5_cba9,
    0x010e_ddd7,
    0x0385_fea5,
    0x046b_5de9,
    0x0a04_e12a,
    0x11d2_c113,
    0x20f2_90ec,
    0x5bd2_c7de,
    0xa82b_3d3a,
];

/// Index of the second pair of a quad: the sum of the columns of the bits of `index`.
#[inline(always)]
pub fn second_index(index: u32) -> u32 {
    let mut sum = 0;
    for (bit, column) in SECOND_PAIR.iter().enumerate() {
        sum ^= column & 0u32.wrapping_sub(index >> bit & 1);
    }
    sum
}

/// Second pair of the point of [0, 1)⁴ of the sample of `key`.
#[inline(always)]
pub fn second_pair(key: u64, reversed_index: u32, dimension: u32) -> [f32; 2] {
    let keys = keys(key, dimension);
    let other = second_index(owen(reversed_index, keys as u32));
    let more = mix(keys.wrapping_add(GOLDEN));
    [unit_float(owen(other, more as u32)), unit_float(owen(pascal(other), (more >> 32) as u32))]
}

/// Samples of a block.
#[derive(Clone, Debug)]
pub struct SampleBlock {
    /// Seed in the upper half; pixel, with its highest bit flipped in replicate 1, in the lower half.
    pub place: [u64; BLOCK],
    /// Indices of the samples in their replicates.
    pub index: [u32; BLOCK],
    /// First dimensions of the vertices, below 2^31.
    pub dimension: [u32; BLOCK],
}

/// Offsets of the dimensions of a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Offsets {
    /// Pair of the light sample.
    pub light: u32,
    /// Choice of the light.
    pub choice: u32,
    /// Pair of the scattered direction.
    pub scatter: u32,
    /// Russian roulette.
    pub roulette: u32,
}

/// Random numbers of the vertices of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexNumbers {
    /// Position on the light.
    pub light: [Row; 2],
    /// Choice of the light; zero if nothing is to be chosen.
    pub choice: Row,
    /// Scattered direction.
    pub scatter: [Row; 2],
    /// Russian roulette.
    pub roulette: Row,
}

impl VertexNumbers {
    /// Zeros.
    pub const EMPTY: Self = Self {
        light: [[0.0; BLOCK]; 2],
        choice: [0.0; BLOCK],
        scatter: [[0.0; BLOCK]; 2],
        roulette: [0.0; BLOCK],
    };
}

/// Key of the sampler of a `place`.
#[inline(always)]
pub const fn place_key(place: u64) -> u64 {
    mix(place.wrapping_add(GOLDEN))
}

impl SampleBlock {
    /// Zeros.
    pub const EMPTY: Self = Self { place: [0; BLOCK], index: [0; BLOCK], dimension: [0; BLOCK] };

    /// Numbers of the vertices into `out`; those of the choice only if `chooses`.
    pub fn vertices(&self, level: Level, offsets: Offsets, chooses: bool, out: &mut VertexNumbers) {
        match chooses {
            true => level.dispatch(Vertices::<true>(self, offsets, out)),
            false => level.dispatch(Vertices::<false>(self, offsets, out)),
        }
    }

    /// The numbers of the vertices for light samples alone, into `out`.
    pub fn lights(&self, level: Level, offsets: Offsets, out: &mut VertexNumbers) {
        level.dispatch(Lights(self, offsets, out));
    }

    /// The numbers of the vertices for scattering alone, into `out`.
    pub fn scattering(&self, level: Level, offsets: Offsets, out: &mut VertexNumbers) {
        level.dispatch(Scattering(self, offsets, out));
    }

    /// Pairs of numbers at one dimension.
    pub fn pairs(&self, level: Level, dimension: u32) -> [Row; 2] {
        level.dispatch(Pairs::<false>(self, dimension))
    }

    /// Numbers of the vertices at `offset` from their first dimensions.
    pub fn singles(&self, level: Level, offset: u32) -> Row {
        level.dispatch(Singles(self, offset))
    }

    /// Second pairs of quads of numbers at one dimension.
    pub fn second_pairs(&self, level: Level, dimension: u32) -> [Row; 2] {
        level.dispatch(Pairs::<true>(self, dimension))
    }
}

struct Vertices<'k, const CHOOSES: bool>(&'k SampleBlock, Offsets, &'k mut VertexNumbers);

impl<const CHOOSES: bool> Kernel for Vertices<'_, CHOOSES> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self(samples, Offsets { light, choice, scatter, roulette }, out) = self;
        let sequences = Sequences::new(samples, &samples.dimension);
        sequences.pairs(light, &mut out.light);
        sequences.pairs(scatter, &mut out.scatter);
        sequences.singles(roulette, &mut out.roulette);
        if CHOOSES {
            sequences.singles(choice, &mut out.choice);
        }
    }
}

struct Lights<'k>(&'k SampleBlock, Offsets, &'k mut VertexNumbers);

impl Kernel for Lights<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self(samples, Offsets { light, choice, .. }, out) = self;
        let sequences = Sequences::new(samples, &samples.dimension);
        sequences.pairs(light, &mut out.light);
        sequences.singles(choice, &mut out.choice);
    }
}

struct Scattering<'k>(&'k SampleBlock, Offsets, &'k mut VertexNumbers);

impl Kernel for Scattering<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self(samples, Offsets { scatter, roulette, .. }, out) = self;
        let sequences = Sequences::new(samples, &samples.dimension);
        sequences.pairs(scatter, &mut out.scatter);
        sequences.singles(roulette, &mut out.roulette);
    }
}

struct Singles<'k>(&'k SampleBlock, u32);

impl Kernel for Singles<'_> {
    type Out = Row;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Row {
        let mut out = [0.0; BLOCK];
        Sequences::new(self.0, &self.0.dimension).singles(self.1, &mut out);
        out
    }
}

struct Pairs<'k, const SECOND: bool>(&'k SampleBlock, u32);

impl<const SECOND: bool> Kernel for Pairs<'_, SECOND> {
    type Out = [Row; 2];

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> [Row; 2] {
        let Self(samples, dimension) = self;
        let mut out = [[0.0; BLOCK]; 2];
        let sequences = Sequences::new(samples, &[dimension; BLOCK]);
        match SECOND {
            true => sequences.second_pairs(&mut out),
            false => sequences.pairs(0, &mut out),
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of the vertices one by one.
    fn one_by_one(samples: &SampleBlock, offsets: Offsets) -> VertexNumbers {
        let mut out = VertexNumbers::EMPTY;
        for i in 0..BLOCK {
            let (key, first) = (place_key(samples.place[i]), samples.dimension[i]);
            let index = samples.index[i].reverse_bits();
            [out.light[0][i], out.light[1][i]] = pair(key, index, first + offsets.light);
            [out.scatter[0][i], out.scatter[1][i]] = pair(key, index, first + offsets.scatter);
            out.roulette[i] = single(key, index, first + offsets.roulette);
            out.choice[i] = single(key, index, first + offsets.choice);
        }
        out
    }

    #[test]
    fn numbers_have_the_bits_of_single_samples_on_every_level() {
        let mut samples = SampleBlock::EMPTY;
        let offsets = Offsets { light: 0, choice: 1, scatter: 2, roulette: 4 };
        for round in 0..200u64 {
            for i in 0..BLOCK {
                samples.place[i] = mix(round << 8 | i as u64);
                samples.index[i] = mix(round << 16 | i as u64) as u32 >> (round % 32);
                samples.dimension[i] = 2 + 5 * (round as u32 % 7 + i as u32);
            }
            let wanted = one_by_one(&samples, offsets);
            for level in Level::detect().and_below() {
                let (mut found, mut plain) = (VertexNumbers::EMPTY, VertexNumbers::EMPTY);
                let mut lights = VertexNumbers::EMPTY;
                samples.lights(level, offsets, &mut lights);
                assert_eq!((lights.light, lights.choice), (wanted.light, wanted.choice), "{level:?}");
                let mut scattering = VertexNumbers::EMPTY;
                samples.scattering(level, offsets, &mut scattering);
                let found_scattering = (scattering.scatter, scattering.roulette);
                assert_eq!(found_scattering, (wanted.scatter, wanted.roulette), "{level:?}");
                samples.vertices(level, offsets, true, &mut found);
                samples.vertices(level, offsets, false, &mut plain);
                assert_eq!(found, wanted, "{level:?}");
                assert_eq!((plain.light, plain.choice), (wanted.light, [0.0; BLOCK]), "{level:?}");
                assert_eq!(samples.singles(level, offsets.roulette), wanted.roulette, "{level:?}");
                let (first, second) = (samples.pairs(level, 3), samples.second_pairs(level, 3));
                for i in 0..BLOCK {
                    let (key, index) = (place_key(samples.place[i]), samples.index[i].reverse_bits());
                    assert_eq!([first[0][i], first[1][i]], pair(key, index, 3));
                    assert_eq!([second[0][i], second[1][i]], second_pair(key, index, 3));
                    assert_eq!(first[0][i], single(key, index, 3));
                }
            }
        }
    }
}
