//! Eigen decomposition of symmetric matrices of two and three rows, in batches.

use crate::memory::{array, array_mut};
use crate::status::{HalflightStatus, of};
use halflight_core::Level;
use halflight_core::parts::eigen::{Decomposed2, Decomposed3, Matrices2, Matrices3, decompose2, decompose3};

/// Matrices of a batch.
const LANES: usize = 16;

/// Decomposes `count` symmetric matrices xx, xy, yy: two `values` each, the larger first, and the unit `axes`
/// x, y of the larger. Errors are at most 5e-7 of the larger value.
///
/// # Safety
/// `matrices` has 3, `values` and `axes` have 2 numbers for each of `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_eigen2(
    matrices: *const f32,
    count: usize,
    values: *mut f32,
    axes: *mut f32,
) -> HalflightStatus {
    // SAFETY: by the caller; arrays of floats have the alignment of their elements.
    let arrays = unsafe {
        (|| {
            let matrices = array(matrices.cast::<[f32; 3]>(), count)?;
            let values = array_mut(values.cast::<[f32; 2]>(), count)?;
            Ok((matrices, values, array_mut(axes.cast::<[f32; 2]>(), count)?))
        })()
    };
    of(arrays.map(|(matrices, values, axes)| {
        let (mut lanes, mut found): (Matrices2, Decomposed2) = Default::default();
        let chunks = values.chunks_mut(LANES).zip(axes.chunks_mut(LANES));
        for (matrices, (values, axes)) in matrices.chunks(LANES).zip(chunks) {
            transpose(matrices, &mut lanes);
            decompose2(Level::detect(), &[lanes], core::slice::from_mut(&mut found));
            for (lane, (value, axis)) in values.iter_mut().zip(axes).enumerate() {
                *value = [found[0][lane], found[1][lane]];
                *axis = [found[2][lane], found[3][lane]];
            }
        }
    }))
}

/// Decomposes `count` symmetric matrices xx, xy, xz, yy, yz, zz: three `values` each, the largest first, and
/// the three unit `vectors`, in the same order. Errors are at most 5e-7 of the largest value.
///
/// # Safety
/// `matrices` has 6, `values` 3 and `vectors` 9 numbers for each of `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_eigen3(
    matrices: *const f32,
    count: usize,
    values: *mut f32,
    vectors: *mut f32,
) -> HalflightStatus {
    // SAFETY: by the caller; arrays of floats have the alignment of their elements.
    let arrays = unsafe {
        (|| {
            let matrices = array(matrices.cast::<[f32; 6]>(), count)?;
            let values = array_mut(values.cast::<[f32; 3]>(), count)?;
            Ok((matrices, values, array_mut(vectors.cast::<[f32; 9]>(), count)?))
        })()
    };
    of(arrays.map(|(matrices, values, vectors)| {
        let (mut lanes, mut found): (Matrices3, Decomposed3) = Default::default();
        let chunks = values.chunks_mut(LANES).zip(vectors.chunks_mut(LANES));
        for (matrices, (values, vectors)) in matrices.chunks(LANES).zip(chunks) {
            transpose(matrices, &mut lanes);
            decompose3(Level::detect(), &[lanes], core::slice::from_mut(&mut found));
            for (lane, (value, vector)) in values.iter_mut().zip(vectors).enumerate() {
                *value = core::array::from_fn(|i| found[i][lane]);
                *vector = core::array::from_fn(|i| found[3 + i][lane]);
            }
        }
    }))
}

/// Entries of at most sixteen matrices in lanes; the other lanes are zero.
fn transpose<const N: usize>(matrices: &[[f32; N]], lanes: &mut [[f32; LANES]; N]) {
    for (entry, lanes) in lanes.iter_mut().enumerate() {
        *lanes = core::array::from_fn(|lane| matrices.get(lane).map_or(0.0, |matrix| matrix[entry]));
    }
}
