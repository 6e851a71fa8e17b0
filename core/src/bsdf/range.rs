//! Clamps of parameters to the range in which the BSDFs are valid.

use crate::Rgb;
use glam::Vec3;

/// Largest index of refraction, above that of all transparent materials. Beyond it, refraction from inside
/// amplifies the rounding of directions.
pub(super) const MAX_INDEX: f32 = 20.0;

/// `x` clamped to 0 … 1; NaN becomes 0.
#[inline]
pub(super) fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Colour with every channel clamped to 0 … 1.
#[inline]
pub(super) fn unit_rgb(c: Rgb) -> Rgb {
    Vec3::new(unit(c.x), unit(c.y), unit(c.z))
}
