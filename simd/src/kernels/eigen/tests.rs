//! Eigenvalues against f64 for every class of difficult matrix, and every level against the scalar reference,
//! to the bit. For stiff matrices f64 gives the small value by the exact determinant.

use super::*;
use halflight_test_support::Random;
use std::vec::Vec;

/// Matrices per class.
const COUNT: usize = 4096;
/// Largest error of both eigenvalues, in units in the last place (2⁻²³ of the value).
const ULPS: f64 = 4.0;

/// Rotated matrix with these eigenvalues.
fn turned(random: &mut Random, [l, m]: [f64; 2]) -> [f32; 3] {
    let (sin, cos) = (core::f64::consts::TAU * random.unit()).sin_cos();
    [l * cos * cos + m * sin * sin, (l - m) * sin * cos, l * sin * sin + m * cos * cos].map(|x| x as f32)
}

type Class = (&'static str, fn(&mut Random) -> [f32; 3]);

const CLASSES: [Class; 14] = [
    ("random", |r| [r.signed() as f32, r.signed() as f32, r.signed() as f32]),
    ("1e3", |r| {
        let l = [1.0, 1e-3 * r.signed()];
        turned(r, l)
    }),
    ("1e6", |r| {
        let l = [-1.0, 1e-6 * r.signed()];
        turned(r, l)
    }),
    ("1e12", |r| {
        let l = [1.0, 1e-12 * r.signed()];
        turned(r, l)
    }),
    ("equal", |r| {
        let l = r.signed() as f32;
        [l, 0.0, l]
    }),
    ("1e-7 apart", |r| {
        let l = r.signed();
        turned(r, [l, l * (1.0 + 1e-7)])
    }),
    ("denormal", |r| [1e-42 * r.signed(), 1e-42 * r.signed(), 1e-42 * r.signed()].map(|x| x as f32)),
    ("1e-30", |r| [1e-30 * r.signed(), 1e-30 * r.signed(), 1e-30 * r.signed()].map(|x| x as f32)),
    ("1e38", |r| [1.5e38 * r.signed(), 1.5e38 * r.signed(), 1.5e38 * r.signed()].map(|x| x as f32)),
    ("zero", |_| [0.0; 3]),
    ("trace zero", |r| {
        let (a, b) = (r.signed() as f32, r.signed() as f32);
        [a, b, -a]
    }),
    ("diagonal", |r| [r.signed() as f32, 0.0, r.signed() as f32]),
    ("diagonal, far apart", |r| [(1e30 * r.signed()) as f32, 0.0, (1e-38 * r.signed()) as f32]),
    ("one entry", |r| {
        [[1e-3, 0.0, 0.0], [0.0, r.signed() as f32, 0.0], [0.0, 0.0, -2.0]][(3.0 * r.unit()) as usize]
    }),
];

/// Exact product a b as two f64. (The factors are f32 or their sums, far from the limits of f64.)
fn product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

/// Eigenvalues of the stored matrix in f64, larger magnitude first.
fn exact([a, b, c]: [f32; 3]) -> [f64; 2] {
    let [a, b, c] = [a, b, c].map(f64::from);
    let (mean, radius) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let large = if mean < 0.0 { mean - radius } else { mean + radius };
    let ((ac, ac_rest), (bb, bb_rest)) = (product(a, c), product(b, b));
    let determinant = (ac - bb) + (ac_rest - bb_rest);
    [large, if large == 0.0 { 0.0 } else { determinant / large }]
}

/// Error in units in the last place of `wanted` as f32 stores it.
fn ulps(found: f32, wanted: f64) -> f64 {
    let unit = (wanted.abs() * f64::from(f32::EPSILON)).max(f64::from(f32::from_bits(1)));
    (f64::from(found) - wanted).abs() / unit
}

#[test]
fn both_values_of_every_class_are_exact_to_four_units() {
    let mut random = Random(1);
    for (name, make) in CLASSES {
        let mut worst = [0.0f64; 3];
        for _ in 0..COUNT {
            let matrix = make(&mut random);
            let found = symmetric2(|x| x, matrix);
            for (k, (found, wanted)) in found.values.into_iter().zip(exact(matrix)).enumerate() {
                worst[k] = worst[k].max(ulps(found, wanted));
                assert!(worst[k] <= ULPS, "{name}: {matrix:?} has {wanted:e}, not {found:e}");
            }
            // A v - λ v relative to the norm of A. The rounding of v alone contributes half a unit of each
            // coordinate.
            let ([a, b, c], [x, y]) = (matrix.map(f64::from), found.axis.map(f64::from));
            let value = exact(matrix)[0];
            let residual = (a * x + b * y - value * x).hypot(b * x + c * y - value * y);
            assert!(residual <= 3e-7 * value.abs(), "{name}: {matrix:?} along {:?}", found.axis);
            assert!((x.hypot(y) - 1.0).abs() < 3e-7, "{name}: {matrix:?} along {:?}", found.axis);
            worst[2] = worst[2].max(residual / value.abs().max(1e-300));
        }
        std::println!("{name}: {:.2} and {:.2} ulp, residual {:.1e}", worst[0], worst[1], worst[2]);
    }
}

#[test]
fn known_matrices() {
    let of = |matrix| symmetric2(|x: f32| x, matrix);
    assert_eq!(of([2.0, 1.0, 2.0]).values, [3.0, 1.0]);
    let half = core::f32::consts::FRAC_1_SQRT_2;
    assert_eq!(of([2.0, 1.0, 2.0]).axis, [half, half]);
    // A saddle and its negative: the axis follows the magnitude, not the sign.
    assert_eq!(of([-3.0, 0.0, 1.0]), Eigen2 { values: [-3.0, 1.0], axis: [-1.0, 0.0] });
    assert_eq!(of([1.0, 0.0, -3.0]), Eigen2 { values: [-3.0, 1.0], axis: [-0.0, 1.0] });
    assert_eq!(of([0.0; 3]), Eigen2 { values: [0.0; 2], axis: [1.0, 0.0] });
    // With equal magnitudes, value and axis still belong together.
    assert_eq!(of([-12.0, 0.0, 12.0]), Eigen2 { values: [12.0, -12.0], axis: [0.0, 1.0] });
    assert_eq!(of([12.0, 0.0, -12.0]), Eigen2 { values: [12.0, -12.0], axis: [1.0, 0.0] });
    // Variation along one axis only.
    assert_eq!(of([1.0, 1.0, 1.0]).values, [2.0, 0.0]);
}

#[test]
fn jacobi_finds_known_values_and_orthogonal_vectors() {
    let mut random = Random(2);
    // Error relative to the largest value after four sweeps.
    const TOLERANCE: f64 = 6e-7;
    let scales = [1.0, 1e-42, 1e-30, 1e38];
    let ratios =
        [[1.0, 0.5, -0.3], [1.0, 1e-3, 1e-6], [1.0, 1.0, 1e-4], [-1.0, 1.0, 0.1], [1.0, 1e-7, -1e-7]];
    for scale in scales {
        for values in ratios {
            for _ in 0..500 {
                let basis = basis(&mut random);
                let entry = |i: usize, j: usize| -> f32 {
                    let sum: f64 = (0..3).map(|k| values[k] * basis[k][i] * basis[k][j]).sum();
                    (scale * sum) as f32
                };
                let matrix = [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
                let found = symmetric3(|x| x, matrix);
                // Rounding of the entries moves the values by half a denormal of each.
                let tolerance = TOLERANCE * scale + 3.0 * f64::from(f32::from_bits(1));
                let mut wanted = values;
                wanted.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
                for (found, wanted) in found.values.iter().zip(wanted) {
                    // Values of equal magnitude may come in either order.
                    let off = (f64::from(found.abs()) - (scale * wanted).abs()).abs();
                    assert!(off <= tolerance, "{found:e} for {:e} of {matrix:?}", scale * wanted);
                }
                let [xx, xy, xz, yy, yz, zz] = matrix.map(f64::from);
                let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
                for (k, v) in found.vectors.iter().enumerate() {
                    let v = v.map(f64::from);
                    for row in rows.iter().zip(v).map(|(row, x)| {
                        row.iter().zip(v).map(|(a, b)| a * b).sum::<f64>() - f64::from(found.values[k]) * x
                    }) {
                        assert!(row.abs() <= tolerance, "residual {row:e} of {matrix:?}");
                    }
                    for (l, w) in found.vectors.iter().enumerate() {
                        let dot: f64 = v.iter().zip(w).map(|(a, &b)| a * f64::from(b)).sum();
                        let wanted = if k == l { 1.0 } else { 0.0 };
                        assert!((dot - wanted).abs() < TOLERANCE * 2.0, "{dot} of vectors {k} and {l}");
                    }
                }
            }
        }
    }
}

/// Three orthonormal vectors, from a random unit quaternion.
fn basis(random: &mut Random) -> [[f64; 3]; 3] {
    let q = [random.signed(), random.signed(), random.signed(), random.signed()];
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [w, x, y, z] = q.map(|c| c / length);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

#[test]
fn every_level_agrees_with_the_single_lane_to_the_bit() {
    let mut random = Random(3);
    for (name, make) in CLASSES {
        let matrices: [[f32; 3]; 16] = core::array::from_fn(|_| make(&mut random));
        let batch: Matrices2 = core::array::from_fn(|k| matrices.map(|matrix| matrix[k]));
        let large: Matrices3 = core::array::from_fn(|k| matrices.map(|matrix| matrix[k % 3] + matrix[k / 3]));
        for level in Level::detect().and_below() {
            let mut found: [Decomposed2; 1] = [[[0.0; 16]; 4]];
            decompose2(level, &[batch], &mut found);
            let mut found3: Vec<Decomposed3> = std::vec![[[0.0; 16]; 12]];
            decompose3(level, &[large], &mut found3);
            for i in 0..16 {
                let Eigen2 { values, axis } = symmetric2(|x| x, matrices[i]);
                for (row, wanted) in found[0].iter().zip(values.iter().chain(&axis)) {
                    assert_eq!(row[i].to_bits(), wanted.to_bits(), "{level:?} {name} {:?}", matrices[i]);
                }
                let Eigen3 { values, vectors } = symmetric3(|x| x, large.map(|row| row[i]));
                for (row, wanted) in found3[0].iter().zip(values.iter().chain(vectors.as_flattened())) {
                    assert_eq!(row[i].to_bits(), wanted.to_bits(), "{level:?} {name} {:?}", matrices[i]);
                }
            }
        }
    }
}
