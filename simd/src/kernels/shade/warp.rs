//! Warps of the unit square, and the trigonometry that they need, over lanes: polynomials with the same bits
//! on every target, several times faster than general routines.

use super::vector;
use crate::lanes::Lanes;
use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// (sin x, cos x) for |x| <= π/4, within 1 unit in the last place (minimax polynomials of Cephes).
#[inline(always)]
pub fn sin_cos_octant<L: Lanes>(x: L) -> (L, L) {
    let z = x * x;
    let sin = ((x.all(-1.951_529_6e-4) * z + x.all(8.332_161e-3)) * z - x.all(1.666_665_5e-1)) * z * x + x;
    let cos = ((x.all(2.443_315_7e-5) * z - x.all(1.388_731_6e-3)) * z + x.all(4.166_664_6e-2)) * z * z;
    (sin, cos - x.all(0.5) * z + x.all(1.0))
}

/// (sin 2πu, cos 2πu) for u in [0, 1].
#[inline(always)]
pub fn sin_cos_turns<L: Lanes>(u: L) -> (L, L) {
    let (zero, one) = (u.all(0.0), u.all(1.0));
    let quarters = u.all(4.0) * u;
    let rounded = quarters + u.all(0.5);
    // The integer part of `rounded`, 0 to 4, as a count of the steps below it.
    let at_least = |step: f32| u.all(step).le(rounded);
    let (first, second, third, fourth) = (at_least(1.0), at_least(2.0), at_least(3.0), at_least(4.0));
    let step = |mask| one.select(mask, zero);
    let quadrant = (step(first) + step(second)) + (step(third) + step(fourth));
    let (sin, cos) = sin_cos_octant((quarters - quadrant) * u.all(FRAC_PI_2));
    let is_odd = first & !second | third & !fourth;
    let (near, far) = (cos.select(is_odd, sin), sin.select(is_odd, cos));
    let sin = (-near).select(second & !fourth, near);
    let cos = (-far).select(first & !third, far);
    (sin, cos)
}

/// Tangent of π/8.
const TAN_EIGHTH: f32 = 0.414_213_57;

/// Angle of (x, y) in -π … π, within 3 units in the last place (minimax polynomial of Cephes); zero at the
/// origin.
#[inline(always)]
pub fn atan2<L: Lanes>(y: L, x: L) -> L {
    let zero = x.all(0.0);
    let (far, near) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    // atan(n/f) = π/4 + atan((n - f) / (n + f)).
    let is_steep = (x.all(TAN_EIGHTH) * far).lt(near);
    let (above, below) = ((near - far).select(is_steep, near), (near + far).select(is_steep, far));
    let t = above / below;
    let z = t * t;
    let polynomial = ((x.all(8.053_744_5e-2) * z - x.all(1.387_768_6e-1)) * z + x.all(1.997_771e-1)) * z
        - x.all(3.333_295e-1);
    let angle = polynomial * z * t + t;
    let angle = (angle + x.all(FRAC_PI_4)).select(is_steep, angle);
    let angle = (x.all(FRAC_PI_2) - angle).select(x.abs().lt(y.abs()), angle);
    let angle = (x.all(PI) - angle).select(x.lt(zero), angle);
    angle.select(zero.lt(far), zero).copysign(y)
}

/// Uniform point of the unit disk (Shirley and Chiu 1997, concentric map). Density 1/π.
#[inline(always)]
pub fn concentric_disk<L: Lanes>(u: [L; 2]) -> [L; 2] {
    let (zero, one, two) = (u[0].all(0.0), u[0].all(1.0), u[0].all(2.0));
    let (x, y) = (two * u[0] - one, two * u[1] - one);
    let steep = x.abs().lt(y.abs());
    let (radius, other) = (y.select(steep, x), x.select(steep, y));
    let (sin, cos) = sin_cos_octant(u[0].all(FRAC_PI_4) * (other / radius));
    let (sin, cos) = (radius * sin, radius * cos);
    let is_center = radius.eq(zero);
    [zero.select(is_center, sin.select(steep, cos)), zero.select(is_center, cos.select(steep, sin))]
}

/// Direction of the upper hemisphere with density cos θ / π. Never on the horizon, where the density is zero:
/// z² is at least the rounding of 1 - x² - y².
#[inline(always)]
pub fn cosine_hemisphere<L: Lanes>(u: [L; 2]) -> [L; 3] {
    let [x, y] = concentric_disk(u);
    let least = u[0].all(f32::EPSILON / 2.0);
    [x, y, (u[0].all(1.0) - (x * x + y * y)).max(least).sqrt()]
}

/// Barycentric weights of the second and third vertex, uniform over a triangle (Heitz 2019, "A Low-Distortion
/// Map Between Triangle and Square"). Density 1 / area.
#[inline(always)]
pub fn uniform_triangle<L: Lanes>([u, v]: [L; 2]) -> [L; 2] {
    let half = u.all(0.5);
    let is_upper = u.lt(v);
    let (low, high) = (half * u, half * v);
    [low.select(is_upper, u - high), (v - low).select(is_upper, high)]
}

/// Tangent and bitangent around a unit `normal` (Duff et al. 2017).
#[inline(always)]
pub fn frame<L: Lanes>([x, y, z]: [L; 3]) -> [[L; 3]; 2] {
    let one = x.all(1.0);
    let sign = one.copysign(z);
    let a = x.all(-1.0) / (sign + z);
    let b = x * y * a;
    [[one + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// World direction of local `v`, with the axes of a frame.
#[inline(always)]
pub fn to_world<L: Lanes>([tangent, bitangent, normal]: [[L; 3]; 3], v: [L; 3]) -> [L; 3] {
    let flat = vector::add(vector::scale(tangent, v[0]), vector::scale(bitangent, v[1]));
    vector::add(flat, vector::scale(normal, v[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_agree_with_the_standard_library() {
        for i in 0..200_000u32 {
            let hash = i.wrapping_mul(2_654_435_761);
            let (a, b) = ((hash >> 16) as f32 / 32768.0 - 1.0, (hash & 0xffff) as f32 / 32768.0 - 1.0);
            let scale = [1.0, 1e-6, 1e-20, 1e6][i as usize % 4];
            let (y, x) = (a * scale, b);
            let (found, exact) = (atan2(y, x), f64::from(y).atan2(f64::from(x)));
            assert!((f64::from(found) - exact).abs() <= 4e-7 * exact.abs(), "{y} {x}: {found} {exact}");
        }
        assert_eq!([atan2(0.0, 0.0), atan2(0.0, 1.0), atan2(1.0, 0.0)], [0.0, 0.0, FRAC_PI_2]);
        assert_eq!([atan2(0.0, -1.0), atan2(-1.0, 0.0)], [PI, -FRAC_PI_2]);
    }

    #[test]
    fn sines_agree_with_the_standard_library() {
        for i in 0..=100_000 {
            let u = i as f32 / 100_000.0;
            let (sin, cos) = sin_cos_turns(u);
            let angle = f64::from(u) * core::f64::consts::TAU;
            assert!((f64::from(sin) - angle.sin()).abs() < 2e-7, "{u}");
            assert!((f64::from(cos) - angle.cos()).abs() < 2e-7, "{u}");
        }
    }
}
