//! Dot products of rows of half floats with weights in f32.
//!
//! Coefficients of incident light are stored as half floats and are read once for each lookup; the weights
//! are those of a lobe. Every level keeps sixteen sums and reduces them in one order. The cost: rows are
//! padded to sixteen, and a row of few entries spends half of its time on the reduction.

use super::jumps::total;
use crate::lanes::Simd;
use crate::level::{Kernel, Level};

/// Dot products of rows with the same weights.
#[derive(Debug)]
pub struct Dots<'a> {
    /// Rows of as many groups of sixteen half floats as there are `weights`.
    pub rows: &'a [[u16; 16]],
    /// Weights of the entries.
    pub weights: &'a [[f32; 16]],
    /// Result for each row.
    pub out: &'a mut [f32],
}

impl Dots<'_> {
    /// Computes all rows that both `rows` and `out` have.
    pub fn compute(self, level: Level) {
        level.dispatch(self);
    }
}

impl Kernel for Dots<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let groups = self.weights.len().max(1);
        for (row, out) in self.rows.chunks_exact(groups).zip(self.out) {
            *out = dot(simd, row, self.weights);
        }
    }
}

/// Dot product of one row, as in [`Dots`].
#[inline(always)]
pub fn dot<S: Simd>(simd: S, row: &[[u16; 16]], weights: &[[f32; 16]]) -> f32 {
    let mut sums = simd.splat16(0.0);
    for (entries, weights) in row.iter().zip(weights) {
        sums = sums + simd.load16_half(entries) * simd.load16(weights);
    }
    total(sums)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::half::{from_f32, to_f32};
    use std::vec::Vec;

    #[test]
    fn products_are_the_same_on_every_level() {
        let mut state = 5u32;
        let mut number = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for (rows, groups) in [(0, 1), (3, 1), (9, 2), (9, 3)] {
            let halves: Vec<[u16; 16]> =
                (0..rows * groups).map(|_| core::array::from_fn(|_| from_f32(number()))).collect();
            let weights: Vec<[f32; 16]> = (0..groups).map(|_| core::array::from_fn(|_| number())).collect();
            let mut wanted = std::vec![0.0; rows];
            Dots { rows: &halves, weights: &weights, out: &mut wanted }.compute(Level::SCALAR);
            for level in Level::detect().and_below() {
                let mut found = std::vec![7.0; rows];
                Dots { rows: &halves, weights: &weights, out: &mut found }.compute(level);
                assert_eq!(found, wanted, "{level:?}");
            }
            for (row, found) in halves.chunks_exact(groups).zip(wanted) {
                let pairs = row.as_flattened().iter().zip(weights.as_flattened());
                let exact: f64 = pairs.map(|(&a, &b)| f64::from(to_f32(a)) * f64::from(b)).sum();
                assert!((f64::from(found) - exact).abs() < 1e-5);
            }
        }
    }

    /// All half floats, which the levels convert by different instructions.
    #[test]
    fn every_half_float_converts_alike_on_every_level() {
        let halves: Vec<[u16; 16]> =
            (0..4096).map(|row: u16| core::array::from_fn(|lane| 16 * row + lane as u16)).collect();
        let mut weights = [[0.0; 16]; 1];
        for lane in 0..16 {
            weights[0] = [0.0; 16];
            weights[0][lane] = 1.0;
            // Infinite entries times zero are NaN, as in single lanes.
            let mut wanted = std::vec![0.0; 4096];
            Dots { rows: &halves, weights: &weights, out: &mut wanted }.compute(Level::SCALAR);
            for level in Level::detect().and_below() {
                let mut found = std::vec![0.0; 4096];
                Dots { rows: &halves, weights: &weights, out: &mut found }.compute(level);
                let same = |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
                assert!(found.iter().zip(&wanted).all(same), "{level:?}");
            }
        }
    }
}
