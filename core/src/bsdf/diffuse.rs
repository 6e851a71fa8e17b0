//! Lambertian surface: f = ρ/π.

use super::BsdfSample;
use crate::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Scatters uniformly into the hemisphere of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo ρ, 0 … 1.
    pub reflectance: Rgb,
}

impl Diffuse {
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<BsdfSample> {
        let direction = cosine_hemisphere(u);
        // The density is zero at the rim of the hemisphere.
        (direction.z > 0.0)
            .then(|| BsdfSample::reflection(direction, self.reflectance, direction.z * FRAC_1_PI))
    }

    #[inline]
    pub(super) fn evaluate(&self, wi: Vec3) -> (Rgb, f32) {
        let pdf = wi.z.max(0.0) * FRAC_1_PI;
        (self.reflectance * pdf, pdf)
    }
}
