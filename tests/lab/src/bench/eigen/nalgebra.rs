//! nalgebra's `symmetric_eigen` of static matrices, one after the other.

use super::Decomposer;
use core::hint::black_box;
use halflight_simd::kernels::eigen::{Matrices2, Matrices3};
use nalgebra::{Matrix2, Matrix3, SymmetricEigen, U2, U3};

/// Decompositions of both sizes.
#[derive(Default)]
pub(super) struct Nalgebra {
    small: Vec<SymmetricEigen<f32, U2>>,
    large: Vec<SymmetricEigen<f32, U3>>,
}

impl Decomposer for Nalgebra {
    fn name(&self) -> &'static str {
        "nalgebra"
    }

    fn sym2(&mut self, matrices: &[Matrices2]) {
        self.small.clear();
        for [xx, xy, yy] in matrices {
            self.small.extend((0..16).map(|i| Matrix2::new(xx[i], xy[i], xy[i], yy[i]).symmetric_eigen()));
        }
        black_box(&self.small);
    }

    fn sym3(&mut self, matrices: &[Matrices3]) {
        self.large.clear();
        for [xx, xy, xz, yy, yz, zz] in matrices {
            self.large.extend((0..16).map(|i| {
                let rows = [xx[i], xy[i], xz[i], xy[i], yy[i], yz[i], xz[i], yz[i], zz[i]];
                Matrix3::from_row_slice(&rows).symmetric_eigen()
            }));
        }
        black_box(&self.large);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::sampling::{mix, unit_float};
    use halflight_simd::kernels::eigen::{symmetric2, symmetric3};

    /// Relative to the largest eigenvalue.
    const TOLERANCE: f32 = 2e-6;

    #[test]
    fn both_find_the_same_values() {
        let number = |i| 2.0 * unit_float((mix(i) >> 32) as u32) - 1.0;
        let numbers: Vec<f32> = (0..6 * 200).map(number).collect();
        for m in numbers.as_chunks::<6>().0 {
            let [xx, xy, yy, xz, yz, zz] = *m;
            let mut theirs: Vec<f32> =
                Matrix2::new(xx, xy, xy, yy).symmetric_eigen().eigenvalues.iter().copied().collect();
            theirs.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
            for (ours, theirs) in symmetric2(|x| x, [xx, xy, yy]).values.into_iter().zip(theirs) {
                assert!((ours.abs() - theirs.abs()).abs() < TOLERANCE, "{m:?}: {ours} {theirs}");
            }
            let matrix = Matrix3::from_row_slice(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
            let mut theirs: Vec<f32> = matrix.symmetric_eigen().eigenvalues.iter().copied().collect();
            theirs.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
            for (ours, theirs) in symmetric3(|x| x, [xx, xy, xz, yy, yz, zz]).values.into_iter().zip(theirs) {
                assert!((ours.abs() - theirs.abs()).abs() < TOLERANCE, "{m:?}: {ours} {theirs}");
            }
        }
    }
}
