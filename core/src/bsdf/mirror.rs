//! Perfect mirror.

use super::BsdfSample;
use crate::Rgb;
use glam::Vec3;

/// Reflects into one direction, with the same reflectance at every angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance, 0 … 1.
    pub reflectance: Rgb,
}

impl Mirror {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        Some(BsdfSample::mirrored(wo, self.reflectance, 1.0))
    }
}
