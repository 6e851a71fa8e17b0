//! Zernike polynomials on the disk of the hemisphere (Zernike 1934), a basis of incident radiance.
//!
//! A direction of the upper hemisphere is the point q = (x, y) of the unit disk, with cos θ dω = dx dy. The
//! polynomials Z_{d,m} are orthonormal on the disk, hence on the hemisphere with the weight cos θ:
//!
//!   Z_{d,±m} = √((2 - δ_{m0})(d + 1)/π) R_d^m(r) {cos mφ, sin mφ},   d - m even, 0 <= m <= d <= 8.
//!
//! With w = x + iy and V_d^m = R_d^m(r) e^{imφ} the recurrence of Honarvar Shakibaei and Paramesran (2013)
//! has neither angles nor divisions, and the derivatives are values of lower degrees:
//!
//!   V_d^m = w V_{d-1}^{m-1} + w̄ V_{d-1}^{m+1} - V_{d-2}^m,
//!   ∂V_d^m/∂w = ∂V_{d-2}^m/∂w + d V_{d-1}^{m-1},   ∂V_d^m/∂w̄ = ∂V_{d-2}^m/∂w̄ + d V_{d-1}^{m+1}.
//!
//! Functions are numbered by degree, then by m = -d, -d + 2, …, d; negative m have the sine.

use core::f32::consts::{FRAC_1_PI, SQRT_2};

/// Maximum degree of a representation.
pub const DEGREE_MAX: usize = 8;

/// Number of functions up to [`DEGREE_MAX`].
pub const COUNT_MAX: usize = count(DEGREE_MAX);

/// Number of functions up to one degree more, which second derivatives need.
pub(super) const COUNT_HIGHER: usize = count(DEGREE_MAX + 1);

/// Number of functions up to `degree`.
pub const fn count(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Number of the function of `degree` and `order` m, |m| <= degree, degree - m even.
pub const fn index(degree: usize, order: isize) -> usize {
    (degree * (degree + 2)).wrapping_add_signed(order) / 2
}

/// Complex number.
pub(super) type Complex = [f32; 2];

pub(super) fn product([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// Factor √((2 - δ_{m0})(d + 1)/π) of a function.
pub(super) fn norm(degree: usize, order: usize) -> f32 {
    let norm = libm::sqrtf((degree + 1) as f32 * FRAC_1_PI);
    if order == 0 { norm } else { SQRT_2 * norm }
}

/// V_d^m of all degrees and orders 0 <= m <= d; zero for odd d - m.
type Polynomials = [[Complex; DEGREE_MAX + 2]; DEGREE_MAX + 2];

/// V_d^m up to `degree`, at most [`DEGREE_MAX`] + 1.
fn polynomials(degree: usize, [x, y]: [f32; 2]) -> Polynomials {
    let mut v: Polynomials = [[[0.0; 2]; DEGREE_MAX + 2]; DEGREE_MAX + 2];
    v[0][0] = [1.0, 0.0];
    for d in 1..=degree.min(DEGREE_MAX + 1) {
        for m in (d % 2..=d).step_by(2) {
            let [lower, higher] = neighbours(&v, d, m);
            let (a, b) = (product([x, y], lower), product([x, -y], higher));
            let before = if d >= 2 { v[d - 2][m] } else { [0.0; 2] };
            v[d][m] = [a[0] + b[0] - before[0], a[1] + b[1] - before[1]];
        }
    }
    v
}

/// V_{d-1}^{m-1} and V_{d-1}^{m+1}; zero beyond the degree.
fn neighbours(v: &Polynomials, d: usize, m: usize) -> [Complex; 2] {
    let lower = match m {
        0 => [v[d - 1][1][0], -v[d - 1][1][1]],
        _ => v[d - 1][m - 1],
    };
    [lower, if m < d { v[d - 1][m + 1] } else { [0.0; 2] }]
}

/// Values of all functions up to `degree` at a point of the disk, for `degree` up to one above
/// [`DEGREE_MAX`]; zeros beyond.
pub(super) fn values_higher(degree: usize, q: [f32; 2]) -> [f32; COUNT_HIGHER] {
    let degree = degree.min(DEGREE_MAX + 1);
    let v = polynomials(degree, q);
    let mut values = [0.0; COUNT_HIGHER];
    for d in 0..=degree {
        for m in (d % 2..=d).step_by(2) {
            let norm = norm(d, m);
            values[index(d, -(m as isize))] = norm * v[d][m][1];
            values[index(d, m as isize)] = norm * v[d][m][0];
        }
    }
    values
}

/// Values of all functions up to `degree` at a point of the disk; zeros beyond `degree` and [`DEGREE_MAX`].
///
/// ```
/// use halflight_core::cache::radiance::zernike;
/// let values = zernike::values(2, [0.6, 0.0]);
/// assert!((values[0] - 1.0 / std::f32::consts::PI.sqrt()).abs() < 1e-6);
/// assert_eq!(zernike::index(2, 0), 4);
/// assert!((values[4] - (3.0 / std::f32::consts::PI).sqrt() * (2.0 * 0.36 - 1.0)).abs() < 1e-6);
/// ```
pub fn values(degree: usize, q: [f32; 2]) -> [f32; COUNT_MAX] {
    let higher = values_higher(degree.min(DEGREE_MAX), q);
    let mut values = [0.0; COUNT_MAX];
    values.copy_from_slice(&higher[..COUNT_MAX]);
    values
}

/// Gradients (∂/∂x, ∂/∂y) of all functions up to `degree` at a point of the disk; zeros beyond.
pub fn gradients(degree: usize, q: [f32; 2]) -> [[f32; 2]; COUNT_MAX] {
    let degree = degree.min(DEGREE_MAX);
    let v = polynomials(degree, q);
    // ∂/∂x = ∂/∂w + ∂/∂w̄ and ∂/∂y = i (∂/∂w - ∂/∂w̄) of V_d^m.
    let mut slopes = [[[[0.0f32; 2]; 2]; DEGREE_MAX + 1]; DEGREE_MAX + 1];
    let mut gradients = [[0.0; 2]; COUNT_MAX];
    for d in 1..=degree {
        for m in (d % 2..=d).step_by(2) {
            let [[a, b], [c, e]] = neighbours(&v, d, m);
            let before = if d >= 2 { slopes[d - 2][m] } else { [[0.0; 2]; 2] };
            let factor = d as f32;
            let x = [before[0][0] + factor * (a + c), before[0][1] + factor * (b + e)];
            let y = [before[1][0] - factor * (b - e), before[1][1] + factor * (a - c)];
            slopes[d][m] = [x, y];
            let norm = norm(d, m);
            gradients[index(d, -(m as isize))] = [norm * x[1], norm * y[1]];
            gradients[index(d, m as isize)] = [norm * x[0], norm * y[0]];
        }
    }
    gradients
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points and weights of a product rule that integrates polynomials of degree 16 over the disk: Gauss and
    /// Legendre's nine points in r², 24 angles.
    fn rule() -> impl Iterator<Item = ([f64; 2], f64)> {
        const NODES: [[f64; 2]; 5] = [
            [0.0, 0.330_239_355_001_259_8],
            [0.324_253_423_403_808_9, 0.312_347_077_040_002_84],
            [0.613_371_432_700_590_4, 0.260_610_696_402_935_46],
            [0.836_031_107_326_635_8, 0.180_648_160_694_857_4],
            [0.968_160_239_507_626_1, 0.081_274_388_361_574_41],
        ];
        let signed = NODES.into_iter().enumerate().flat_map(|(i, [at, weight])| {
            [1.0, -1.0].into_iter().take(if i == 0 { 1 } else { 2 }).map(move |sign| (sign * at, weight))
        });
        signed.flat_map(|(at, weight)| {
            (0..24).map(move |k| {
                let (radius, angle) =
                    ((0.5 * (at + 1.0)).sqrt(), core::f64::consts::TAU * f64::from(k) / 24.0);
                // dx dy = d(r²)/2 dφ.
                let weight = 0.25 * weight * core::f64::consts::TAU / 24.0;
                ([radius * angle.cos(), radius * angle.sin()], weight)
            })
        })
    }

    #[test]
    fn functions_are_orthonormal_on_the_disk() {
        let mut products = std::vec![[0.0f64; COUNT_MAX]; COUNT_MAX];
        for (q, weight) in rule() {
            let values = values(DEGREE_MAX, q.map(|x| x as f32));
            for (products, a) in products.iter_mut().zip(values) {
                for (product, b) in products.iter_mut().zip(values) {
                    *product += weight * f64::from(a) * f64::from(b);
                }
            }
        }
        for (i, products) in products.iter().enumerate() {
            for (j, product) in products.iter().enumerate() {
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((product - wanted).abs() < 3e-6, "{i} {j}: {product}");
            }
        }
    }

    /// R_8^4 = 28 r⁸ - 42 r⁶ + 15 r⁴; R_6^0 = 20 r⁶ - 30 r⁴ + 12 r² - 1.
    #[test]
    fn functions_have_the_printed_polynomials() {
        let (radius, angle) = (0.7f64, 0.4f64);
        let q = [radius * angle.cos(), radius * angle.sin()].map(|x| x as f32);
        let values = values(8, q);
        let r2 = radius * radius;
        let of_8_4 = r2 * r2 * (28.0 * r2 * r2 - 42.0 * r2 + 15.0) * (18.0 / core::f64::consts::PI).sqrt();
        let of_6_0 = (((20.0 * r2 - 30.0) * r2 + 12.0) * r2 - 1.0) * (7.0 / core::f64::consts::PI).sqrt();
        assert!((f64::from(values[index(8, 4)]) - of_8_4 * (4.0 * angle).cos()).abs() < 1e-6);
        assert!((f64::from(values[index(8, -4)]) - of_8_4 * (4.0 * angle).sin()).abs() < 1e-6);
        assert!((f64::from(values[index(6, 0)]) - of_6_0).abs() < 1e-6);
        // R_d^m(1) = 1.
        let edge = super::values(8, [1.0, 0.0]);
        for d in 0..=8 {
            for m in (d % 2..=d).step_by(2) {
                assert!((edge[index(d, m as isize)] - norm(d, m)).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn gradients_are_differences_of_values() {
        const STEP: f32 = 1.0 / 256.0;
        for q in [[0.0, 0.0], [0.3, -0.2], [-0.6, 0.7], [0.99, 0.05]] {
            let gradients = gradients(DEGREE_MAX, q);
            for axis in 0..2 {
                let moved = |by: f32| {
                    let mut q = q;
                    q[axis] += by;
                    values(DEGREE_MAX, q)
                };
                // Fourth-order differences.
                let at = [moved(STEP), moved(-STEP), moved(2.0 * STEP), moved(-2.0 * STEP)];
                for (k, gradient) in gradients.iter().enumerate() {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|i| f64::from(at[i][k]));
                    let wanted = (8.0 * (a - b) - (c - d)) / (12.0 * f64::from(STEP));
                    let off = (f64::from(gradient[axis]) - wanted).abs();
                    assert!(off < 2e-3 * (1.0 + wanted.abs()), "{k} at {q:?}: {} {wanted}", gradient[axis]);
                }
            }
        }
    }

    #[test]
    fn degrees_beyond_the_maximum_and_points_outside_are_no_panic() {
        assert_eq!(values(99, [0.1, 0.2]), values(DEGREE_MAX, [0.1, 0.2]));
        assert_eq!(gradients(99, [0.1, 0.2]), gradients(DEGREE_MAX, [0.1, 0.2]));
        assert!(values(8, [f32::NAN, 1e30])[44].is_nan());
        assert_eq!(count(6), 28);
    }
}
