//! Real spherical harmonics for radiance caching as in Křivánek et al. (2005), the rival of
//! [`super::zernike`].
//!
//! With Y_{l,±m} = √(2 - δ_{m0}) p_l^m(z) {Re, Im} (x + iy)^m, where p_l^m is the normalised associated
//! Legendre function over sin^m θ, there is neither an angle nor a division. Light below the horizon is zero:
//! λ_k = ∫ L Y_k dω over the hemisphere, and a lobe has c_k = ∫ f cos θ Y_k dω, so that Lo ≈ Σ c_k λ_k.
//! Functions are numbered by l, then by m = -l … l; negative m have the sine.

mod coefficients;
mod lobe;
mod rotation;

pub use coefficients::{ShCoefficients, ShTables};
pub use lobe::ShLobe;
pub use rotation::ShRotation;

use core::f32::consts::{PI, SQRT_2};

/// Maximum order l.
pub const ORDER_MAX: usize = 8;

/// Number of functions up to [`ORDER_MAX`].
pub const COUNT_MAX: usize = count(ORDER_MAX);

/// Number of functions up to `order`.
pub const fn count(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// Number of the function of order `l` and degree `m`, |m| <= l.
pub const fn index(l: usize, m: isize) -> usize {
    (l * (l + 1)).wrapping_add_signed(m)
}

/// Values of all functions up to `order` in the unit direction (x, y, z); zeros beyond.
///
/// ```
/// use halflight_core::cache::radiance::sh;
/// let values = sh::values(1, [0.6, 0.0, 0.8]);
/// let degree_one = (3.0 / (4.0 * std::f32::consts::PI)).sqrt();
/// assert!((values[sh::index(1, 0)] - 0.8 * degree_one).abs() < 1e-6);
/// assert!((values[sh::index(1, 1)] - 0.6 * degree_one).abs() < 1e-6);
/// ```
pub fn values(order: usize, [x, y, z]: [f32; 3]) -> [f32; COUNT_MAX] {
    let order = order.min(ORDER_MAX);
    let mut values = [0.0; COUNT_MAX];
    // p_m^m, and (x + iy)^m.
    let (mut diagonal, mut power) = (libm::sqrtf(0.25 / PI), [1.0, 0.0]);
    for m in 0..=order {
        if m > 0 {
            diagonal *= libm::sqrtf((2 * m + 1) as f32 / (2 * m) as f32);
            power = [power[0] * x - power[1] * y, power[0] * y + power[1] * x];
        }
        let [cos, sin] = if m == 0 { [1.0, 0.0] } else { power.map(|part| SQRT_2 * part) };
        // p_{l-1}^m and p_{l-2}^m.
        let (mut before, mut last) = (0.0, 0.0);
        for l in m..=order {
            let p = match l - m {
                0 => diagonal,
                _ => {
                    let [l, m, k] = [l * l, m * m, (l - 1) * (l - 1)].map(|n| n as f32);
                    let a = libm::sqrtf((4.0 * l - 1.0) / (l - m));
                    let b = libm::sqrtf((k - m) / (4.0 * k - 1.0).max(1.0));
                    a * (z * last - b * before)
                }
            };
            (before, last) = (last, p);
            values[index(l, -(m as isize))] = sin * p;
            values[index(l, m as isize)] = cos * p;
        }
    }
    values
}

#[cfg(test)]
mod tests;
