//! Derivatives of coefficients from the borders between strata.
//!
//! As in [`crate::cache::irradiance::CellFlux`], a border between strata of radiance L₁ and L₂ belongs to the
//! nearer surface and moves with its inverse distance u. By Reynolds' transport theorem, with Z_k a
//! polynomial in q = (x, y) and ν the normal of the border,
//!
//!   ∇λ_k = ∮ (L₁ - L₂) u Z_k (z ν ds),
//!   Hess λ_k = ∮ (L₁ - L₂) u² Sym((z ν ds) ⊗ B_k),   B_k = 4 Z_k q - ∇Z_k + q (q·∇Z_k).
//!
//! Each sum over borders is an outer product of z ν ds with the means of Z_k along the border. B_k is a
//! combination of the two neighbouring degrees: with V_d^m of [`super::super::zernike`], and x ± iy of the
//! vector B for V_d^m,
//!
//!   B_x ± i B_y = ((d + 4)(d ± m + 2) V_{d+1}^{m±1} - (d - 2)(d ∓ m) V_{d-1}^{m±1})/2(d + 1),
//!
//! so that the moments A_k = ∮ (L₁ - L₂) u² Z_k (z ν ds) up to one degree more give every Hessian. For d = 0
//! this is the irradiance's 4 Sym(ν ⊗ w) cos.

use super::super::strata::{StrataTables, groups};
use super::super::zernike::{COUNT_HIGHER, COUNT_MAX, Complex, count, index, norm};
use super::CoefficientDerivatives;
use crate::Level;
use crate::cache::hemisphere::{Hemisphere, SIDE_MAX};
use crate::cache::hessian::Hessian;
use halflight_simd::kernels::cells::between;
use halflight_simd::kernels::jumps::LUMINANCE;
use halflight_simd::kernels::outer::Outer;

/// Registers of sixteen for all functions of the moments.
const GROUPS_HIGHER: usize = COUNT_HIGHER.div_ceil(16);

/// Factors of a border: jump of each channel times u along x and y, and jump of the luminance times u².
const FACTORS: usize = 8;

/// First and second derivatives of all coefficients. `None` if the hemisphere has another number of strata
/// than the tables.
pub fn border_flux(
    level: Level,
    tables: &StrataTables,
    hemisphere: &Hemisphere,
) -> Option<CoefficientDerivatives> {
    let (n, degree) = (tables.n(), tables.degree());
    if hemisphere.n() != n {
        return None;
    }
    let mut sums = [[[0.0; 16]; FACTORS]; GROUPS_HIGHER];
    let sums = sums.get_mut(..groups(degree + 1))?;
    let mut factors = [[0.0; FACTORS]; 2 * SIDE_MAX];
    for i in 0..n {
        let (means, normals) = tables.borders_of_row(i);
        for (at, (factors, normal)) in factors.iter_mut().zip(normals).enumerate() {
            let (here, next) = if at < n - 1 { (i * n + at, 1) } else { (i * n + at + 1 - n, n) };
            *factors = factors_of(hemisphere, [here, here + next], *normal);
        }
        let factors = factors.get(..normals.len()).unwrap_or_default();
        Outer { factors, table: means, sums: &mut *sums }.add(level);
    }
    let mut found = CoefficientDerivatives {
        degree,
        gradients: [[[0.0; 2]; COUNT_MAX]; 3],
        hessians: [Hessian::default(); COUNT_MAX],
    };
    for (channel, gradients) in found.gradients.iter_mut().enumerate() {
        for (k, gradient) in gradients.iter_mut().enumerate().take(count(degree)) {
            *gradient = [0, 1].map(|axis| sums[k / 16][2 * channel + axis][k % 16]);
        }
    }
    let moment = |k: usize| [6, 7].map(|axis: usize| sums[k / 16][axis][k % 16]);
    hessians(degree, moment, &mut found.hessians);
    Some(found)
}

/// Factors of the border between two strata with the integral `normal`.
fn factors_of(hemisphere: &Hemisphere, strata: [usize; 2], normal: [f32; 2]) -> [f32; FACTORS] {
    let [here, there] = strata.map(|at| hemisphere.radiance().get(at).copied().unwrap_or_default());
    let [u, v] = strata.map(|at| hemisphere.inverse_distance().get(at).copied().unwrap_or_default());
    let u = between(|x| x, u, v);
    let jump = [here[0] - there[0], here[1] - there[1], here[2] - there[2]];
    let luminance = LUMINANCE[0] * jump[0] + LUMINANCE[1] * jump[1] + LUMINANCE[2] * jump[2];
    let [x, y] = normal.map(|normal| u * normal);
    let [r, g, b] = jump;
    [r * x, r * y, g * x, g * y, b * x, b * y, luminance * u * x, luminance * u * y]
}

/// Hessians of all coefficients up to `degree` from the moments A_k, x and y, up to one degree more.
pub(super) fn hessians(degree: usize, moment: impl Fn(usize) -> [f32; 2], out: &mut [Hessian; COUNT_MAX]) {
    // Moments of V_d^m, x and y; conjugate for negative m, zero beyond the degree.
    let complex = |d: usize, m: isize| -> [Complex; 2] {
        let order = m.unsigned_abs();
        if order > d {
            return [[0.0; 2]; 2];
        }
        let norm = norm(d, order);
        let (cos, sin) = (moment(index(d, order as isize)), moment(index(d, -(order as isize))));
        let sign = if m < 0 { -1.0 } else { 1.0 };
        [0, 1].map(|axis| [cos[axis] / norm, if m == 0 { 0.0 } else { sign * sin[axis] / norm }])
    };
    for d in 0..=degree {
        for m in (d % 2..=d).step_by(2) {
            let (degree, order) = (d as f32, m as f32);
            let half = 0.5 / (degree + 1.0);
            // Moments of B_x ± i B_y.
            let [plus, minus] = [1isize, -1].map(|side| {
                let along = side as f32 * order;
                let raised = half * (degree + 4.0) * (degree + along + 2.0);
                let lowered = -half * (degree - 2.0) * (degree - along);
                let above = complex(d + 1, m as isize + side);
                let below = if d > 0 { complex(d - 1, m as isize + side) } else { [[0.0; 2]; 2] };
                [0, 1].map(|axis: usize| {
                    [0, 1].map(|part: usize| raised * above[axis][part] + lowered * below[axis][part])
                })
            });
            // (plus + minus)/2 and (plus - minus)/2i.
            let along_x = |axis: usize| [0, 1].map(|part| 0.5 * (plus[axis][part] + minus[axis][part]));
            let along_y = |axis: usize| {
                [0.5 * (plus[axis][1] - minus[axis][1]), -0.5 * (plus[axis][0] - minus[axis][0])]
            };
            let (xx, xy, yx, yy) = (along_x(0), along_y(0), along_x(1), along_y(1));
            let norm = norm(d, m);
            for (part, k) in [(1, index(d, -(m as isize))), (0, index(d, m as isize))] {
                out[k] = Hessian {
                    xx: norm * xx[part],
                    xy: 0.5 * norm * (xy[part] + yx[part]),
                    yy: norm * yy[part],
                };
            }
        }
    }
}
