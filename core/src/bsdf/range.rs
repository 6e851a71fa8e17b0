//! Numbers brought into the range in which BSDFs are right.

use crate::Rgb;
use glam::Vec3;

/// Nothing transparent comes near; beyond, refraction from inside multiplies the rounding of a direction.
pub(super) const GREATEST_INDEX: f32 = 20.0;

/// `x` within 0 … 1; 0 where it is not a number.
#[inline]
pub(super) fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Every channel within 0 … 1.
#[inline]
pub(super) fn unit_rgb(c: Rgb) -> Rgb {
    Vec3::new(unit(c.x), unit(c.y), unit(c.z))
}
