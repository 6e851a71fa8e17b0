//! Real spherical harmonics for radiance caching as in Křivánek et al. (2005), the rival of
//! [`super::zernike`].
//!
//! With Y_{l,±m} = √(2 - δ_{m0}) p_l^m(z) {Re, Im} (x + iy)^m, where p_l^m is the normalised associated
//! Legendre function over sin^m θ, there is neither an angle nor a division. Light below the horizon is zero:
//! λ_k = ∫ L Y_k dω over the hemisphere, and a lobe has c_k = ∫ f cos θ Y_k dω, so that Lo ≈ Σ c_k λ_k.
//! Functions are numbered by l, then by m = -l … l; negative m have the sine.

mod coefficients;
mod derivatives;
mod rotation;

pub use coefficients::{ShCoefficients, ShTables};
pub use derivatives::{ShGradients, displaced, unoccluded};
pub use rotation::ShRotation;

use core::f32::consts::{PI, SQRT_2};
use glam::{Vec2, Vec3};

/// Maximum order l.
pub const ORDER_MAX: usize = 9;

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

/// Values of all functions up to `order` in the unit direction; zeros beyond.
///
/// ```
/// use halflight_core::cache::radiance::sh;
/// let values = sh::values(1, [0.6, 0.0, 0.8]);
/// let degree_one = (3.0 / (4.0 * std::f32::consts::PI)).sqrt();
/// assert!((values[sh::index(1, 0)] - 0.8 * degree_one).abs() < 1e-6);
/// assert!((values[sh::index(1, 1)] - 0.6 * degree_one).abs() < 1e-6);
/// ```
pub fn values(order: usize, direction: [f32; 3]) -> [f32; COUNT_MAX] {
    let mut values = [0.0; COUNT_MAX];
    Recurrence::new().each(order, direction, |k, Function { part, p, .. }| values[k] = part * p);
    values
}

/// Gradients of all functions up to `order` on the sphere, ∇Y - w (w·∇Y) in three coordinates, and values, in
/// the unit direction w; zeros beyond.
pub fn gradients(order: usize, direction: [f32; 3]) -> [[f32; 4]; COUNT_MAX] {
    Recurrence::new().gradients(order, direction)
}

/// Function p_l^m(z) Re or Im (x + iy)^m.
struct Function {
    /// Re or Im (x + iy)^m, with the factor √(2 - δ_{m0}).
    part: f32,
    /// Derivatives of `part` along x and y.
    along: Vec2,
    /// p_l^m, and its derivative.
    p: f32,
    slope: f32,
}

/// Factors of the recurrence over l.
struct Recurrence {
    /// p_m^m.
    diagonal: [f32; ORDER_MAX + 1],
    /// a and b of p_l^m = a (z p_{l-1}^m - b p_{l-2}^m), by l and m.
    factors: [[[f32; 2]; ORDER_MAX + 1]; ORDER_MAX + 1],
}

impl Recurrence {
    fn new() -> Self {
        let mut diagonal = [libm::sqrtf(0.25 / PI); ORDER_MAX + 1];
        let mut factors = [[[0.0; 2]; ORDER_MAX + 1]; ORDER_MAX + 1];
        for m in 0..=ORDER_MAX {
            if m > 0 {
                diagonal[m] = diagonal[m - 1] * libm::sqrtf((2 * m + 1) as f32 / (2 * m) as f32);
            }
            for (l, factors) in factors.iter_mut().enumerate().skip(m + 1) {
                let [l, squared, k] = [l * l, m * m, (l - 1) * (l - 1)].map(|n| n as f32);
                let a = libm::sqrtf((4.0 * l - 1.0) / (l - squared));
                factors[m] = [a, libm::sqrtf((k - squared) / (4.0 * k - 1.0).max(1.0))];
            }
        }
        Self { diagonal, factors }
    }

    /// [`gradients`].
    fn gradients(&self, order: usize, direction: [f32; 3]) -> [[f32; 4]; COUNT_MAX] {
        let w = Vec3::from(direction);
        let mut found = [[0.0; 4]; COUNT_MAX];
        self.each(order, direction, |k, Function { part, along, p, slope }| {
            let gradient = (p * along).extend(part * slope);
            let tangential = gradient - w.dot(gradient) * w;
            found[k] = tangential.extend(part * p).to_array();
        });
        found
    }

    /// Calls `with` for the functions up to `order`, with their numbers.
    #[inline(always)]
    fn each(&self, order: usize, [x, y, z]: [f32; 3], mut with: impl FnMut(usize, Function)) {
        let order = order.min(ORDER_MAX);
        // (x + iy)^m, and its derivative m (x + iy)^(m-1).
        let (mut power, mut derivative) = (Vec2::X, Vec2::ZERO);
        for m in 0..=order {
            if m > 0 {
                derivative = m as f32 * power;
                power = Vec2::new(x, y).rotate(power);
            }
            let factor = if m == 0 { 1.0 } else { SQRT_2 };
            let [cos, sin] = (factor * power).to_array();
            let [re, im] = (factor * derivative).to_array();
            // p and its derivative for l - 1 and l - 2.
            let (mut before, mut last) = ([0.0; 2], [0.0; 2]);
            for l in m..=order {
                let [a, b] = self.factors[l][m];
                let [p, slope] = match l - m {
                    0 => [self.diagonal[m], 0.0],
                    _ => [a * (z * last[0] - b * before[0]), a * (last[0] + z * last[1] - b * before[1])],
                };
                (before, last) = (last, [p, slope]);
                let function = |part, along| Function { part, along, p, slope };
                with(index(l, -(m as isize)), function(sin, Vec2::new(im, re)));
                with(index(l, m as isize), function(cos, Vec2::new(re, -im)));
            }
        }
    }
}

#[cfg(test)]
mod tests;
