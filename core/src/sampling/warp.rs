//! Warps of the unit square to the domains of light transport, with their densities. They are continuous and
//! of low distortion, so that the stratification of the square is preserved.

use super::{ONE_MINUS_EPSILON, sin_cos_turns};
use core::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::warp as lanes;

/// Uniform point of the unit disk (Shirley and Chiu 1997, concentric map). Density 1/π.
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    lanes::concentric_disk(u).into()
}

/// Inverse of [`concentric_disk`].
#[inline]
pub fn concentric_square(point: Vec2) -> [f32; 2] {
    let steep = point.y.abs() > point.x.abs();
    let (far, near) = if steep { (point.y, point.x) } else { (point.x, point.y) };
    if far == 0.0 {
        return [0.5; 2];
    }
    let radius = point.length().copysign(far);
    let other = radius * (libm::atanf(near / far) / FRAC_PI_4);
    let (x, y) = if steep { (other, radius) } else { (radius, other) };
    [x, y].map(|at| (0.5 * (at + 1.0)).clamp(0.0, ONE_MINUS_EPSILON))
}

/// Direction of the upper hemisphere with density cos θ / π. Never on the horizon, where the density is zero:
/// z² is at least the rounding of 1 - x² - y².
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    lanes::cosine_hemisphere(u).into()
}

/// cos θ / π.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Uniform direction. Density 1 / 4π.
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let radius = 2.0 * libm::sqrtf(u[0] * (1.0 - u[0]));
    let (sin, cos) = sin_cos_turns(u[1]);
    Vec3::new(radius * cos, radius * sin, z)
}

/// Inverse of [`uniform_sphere`] for a unit direction.
#[inline]
pub fn uniform_sphere_square(direction: Vec3) -> [f32; 2] {
    let turns = libm::atan2f(direction.y, direction.x) / TAU;
    [0.5 * (1.0 - direction.z), if turns < 0.0 { turns + 1.0 } else { turns }]
}

/// Density of [`uniform_sphere`].
pub use halflight_simd::kernels::shade::sky::UNIFORM_SPHERE_PDF;

/// Uniform direction of the cone around +z. `one_minus_cos` is 1 − the cosine of its half-angle, which keeps
/// its precision for narrow cones. Density [`uniform_cone_pdf`].
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos: f32) -> Vec3 {
    let h = u[0] * one_minus_cos;
    let radius = libm::sqrtf((h * (2.0 - h)).max(0.0));
    let (sin, cos) = sin_cos_turns(u[1]);
    Vec3::new(radius * cos, radius * sin, 1.0 - h)
}

/// 1 / solid angle of the cone.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights of the second and third vertex, uniform over a triangle (Heitz 2019, "A Low-Distortion
/// Map Between Triangle and Square"). Density 1 / area.
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> (f32, f32) {
    lanes::uniform_triangle(u).into()
}
