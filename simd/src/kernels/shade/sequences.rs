//! Owen-scrambled Sobol' points of sixteen samples (Burley 2020), with the bits of `numbers.rs`. Loops over
//! 64-bit keys and over 32-bit numbers are separate, because the width of a vector is that of the widest word
//! in its loop.

use super::numbers::{
    GOLDEN, SampleBlock, mix, owen, pascal, place_key, second_index, second_key, unit_float,
};
use super::{BLOCK, Row};

/// One word of each sample.
pub(super) type Words = [u32; BLOCK];

/// Samples of a block, before the choice of a dimension.
pub(super) struct Sequences {
    /// Keys at the first dimensions, before the mix.
    key: [u64; BLOCK],
    /// Indices with their bits reversed.
    index: Words,
}

/// Keys of the samples at one dimension: for the index, and for both coordinates of a pair.
struct Keys {
    index: Words,
    first: Words,
    second: Words,
}

impl Sequences {
    #[inline(always)]
    pub(super) fn new(samples: &SampleBlock, dimension: &Words) -> Self {
        let mut sequences = Self { key: [0; BLOCK], index: [0; BLOCK] };
        for (i, dimension) in dimension.iter().enumerate() {
            let first = u64::from(*dimension).wrapping_mul(GOLDEN);
            sequences.key[i] = place_key(samples.place[i]).wrapping_add(first);
        }
        for i in 0..BLOCK {
            sequences.index[i] = samples.index[i].reverse_bits();
        }
        sequences
    }

    /// [`super::numbers::keys`] at `offset` from the first dimensions.
    #[inline(always)]
    fn keys(&self, offset: u32) -> Keys {
        let step = u64::from(offset).wrapping_mul(GOLDEN);
        let mut keys = Keys { index: [0; BLOCK], first: [0; BLOCK], second: [0; BLOCK] };
        for i in 0..BLOCK {
            let key = mix(self.key[i].wrapping_add(step));
            (keys.index[i], keys.first[i], keys.second[i]) =
                (key as u32, (key >> 32) as u32, second_key(key));
        }
        keys
    }

    /// [`super::numbers::pair`] of each sample.
    #[inline(always)]
    pub(super) fn pairs(&self, offset: u32, [x, y]: &mut [Row; 2]) {
        let keys = self.keys(offset);
        for i in 0..BLOCK {
            let index = owen(self.index[i], keys.index[i]);
            x[i] = unit_float(owen(index, keys.first[i]));
            y[i] = unit_float(owen(pascal(index), keys.second[i]));
        }
    }

    /// [`super::numbers::single`] of each sample.
    #[inline(always)]
    pub(super) fn singles(&self, offset: u32, out: &mut Row) {
        let keys = self.keys(offset);
        for (i, out) in out.iter_mut().enumerate() {
            *out = unit_float(owen(owen(self.index[i], keys.index[i]), keys.first[i]));
        }
    }

    /// [`super::numbers::second_pair`] of each sample at its first dimension.
    #[inline(always)]
    pub(super) fn second_pairs(&self, [x, y]: &mut [Row; 2]) {
        let mut keys = Keys { index: [0; BLOCK], first: [0; BLOCK], second: [0; BLOCK] };
        for i in 0..BLOCK {
            let key = mix(self.key[i]);
            let more = mix(key.wrapping_add(GOLDEN));
            (keys.index[i], keys.first[i], keys.second[i]) = (key as u32, more as u32, (more >> 32) as u32);
        }
        for i in 0..BLOCK {
            let index = second_index(owen(self.index[i], keys.index[i]));
            x[i] = unit_float(owen(index, keys.first[i]));
            y[i] = unit_float(owen(pascal(index), keys.second[i]));
        }
    }
}
