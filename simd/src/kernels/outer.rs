//! Sums of outer products: for each row of a table, a few factors times every entry.
//!
//! `sums[k][r] = Σ_i factors[i][r] table[i][k]`. With N² strata as i and the functions of a basis as k this
//! is a projection of radiance; with the borders between strata as i it is a sum over boundaries. Lanes run
//! over k, sixteen at a time, so that each sum has the order of i on every level. The cost: tables are padded
//! to sixteen entries, and factors are read once for each sixteen.

use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Outer products of `R` factors with rows of a table.
#[derive(Debug)]
pub struct Outer<'a, const R: usize> {
    /// Factors of each row.
    pub factors: &'a [[f32; R]],
    /// Rows of as many groups of sixteen entries as there are `sums`.
    pub table: &'a [[f32; 16]],
    /// Sums to be increased: for each group of sixteen entries, one register for each factor.
    pub sums: &'a mut [[[f32; 16]; R]],
}

impl<const R: usize> Outer<'_, R> {
    /// Adds all rows that both factors and table have.
    pub fn add(self, level: Level) {
        level.dispatch(self);
    }
}

impl<const R: usize> Kernel for Outer<'_, R> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let groups = self.sums.len().max(1);
        for (group, sums) in self.sums.iter_mut().enumerate() {
            let mut lanes = [simd.splat16(0.0); R];
            for (lanes, sum) in lanes.iter_mut().zip(&*sums) {
                *lanes = simd.load16(sum);
            }
            for (factors, row) in self.factors.iter().zip(self.table.chunks_exact(groups)) {
                let Some(entries) = row.get(group) else { continue };
                let entries = simd.load16(entries);
                for (lanes, factor) in lanes.iter_mut().zip(factors) {
                    *lanes = *lanes + simd.splat16(*factor) * entries;
                }
            }
            for (lanes, sum) in lanes.iter().zip(sums) {
                *sum = lanes.to_array();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn numbers(count: usize, state: &mut u32) -> Vec<f32> {
        let mut next = || {
            *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (*state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    fn check<const R: usize>(rows: usize, groups: usize, state: &mut u32) {
        let factors: Vec<[f32; R]> = (0..rows)
            .map(|_| {
                let mut factors = [0.0; R];
                factors.copy_from_slice(&numbers(R, state));
                factors
            })
            .collect();
        let table: Vec<[f32; 16]> = numbers(16 * rows * groups, state).as_chunks().0.to_vec();
        let start = std::vec![[[0.25; 16]; R]; groups];
        let mut wanted = start.clone();
        Outer { factors: &factors, table: &table, sums: &mut wanted }.add(Level::SCALAR);
        for level in Level::detect().and_below() {
            let mut sums = start.clone();
            Outer { factors: &factors, table: &table, sums: &mut sums }.add(level);
            assert_eq!(sums, wanted, "{level:?}");
        }
        let (group, r, lane) = (groups / 2, R / 2, 7);
        let row = |i: usize| f64::from(factors[i][r]) * f64::from(table[i * groups + group][lane]);
        let exact = 0.25 + (0..rows).map(row).sum::<f64>();
        assert!((f64::from(wanted[group][r][lane]) - exact).abs() < 1e-5);
    }

    #[test]
    fn sums_are_the_same_on_every_level() {
        let mut state = 3;
        for (rows, groups) in [(0, 1), (1, 1), (5, 3), (63, 2), (1024, 4)] {
            check::<3>(rows, groups, &mut state);
            check::<8>(rows, groups, &mut state);
        }
    }

    #[test]
    fn short_tables_and_no_sums_add_nothing_beyond_them() {
        let mut sums = [[[0.0; 16]; 1]; 2];
        let table = [[1.0; 16]; 3];
        Outer { factors: &[[2.0], [5.0]], table: &table, sums: &mut sums }.add(Level::detect());
        assert_eq!(sums, [[[2.0; 16]; 1]; 2]);
        Outer::<1> { factors: &[[2.0]], table: &table, sums: &mut [] }.add(Level::detect());
    }
}
