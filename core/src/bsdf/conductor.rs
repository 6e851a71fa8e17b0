//! Metal: GGX microfacets with Schlick's Fresnel term; a coloured mirror if smooth.

use super::ggx::Ggx;
use super::{BsdfSample, fresnel};
use crate::Rgb;
use glam::Vec3;

/// Metal, smooth or rough. Light that bounces between microfacets is lost, as usual in single-scattering
/// models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Reflectance at normal incidence, 0 … 1.
    pub f0: Rgb,
    /// GGX alpha; 0 is smooth.
    pub alpha: f32,
}

impl Conductor {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        if self.alpha == 0.0 {
            return Some(BsdfSample::mirrored(wo, fresnel::schlick(self.f0, wo.z), 1.0));
        }
        let ggx = Ggx::new(self.alpha);
        let wi = ggx.sample_reflection(wo, u);
        if !(wi.z > 0.0) {
            return None;
        }
        let h = wo + wi;
        let reflectance = fresnel::schlick(self.f0, half_cosine(wo, h));
        Some(BsdfSample::reflection(
            wi,
            reflectance * ggx.reflection_weight(wo, wi),
            ggx.reflection_density(wo, h),
        ))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if self.alpha == 0.0 || !(wi.z > 0.0) {
            return (Rgb::ZERO, 0.0);
        }
        let ggx = Ggx::new(self.alpha);
        let h = wo + wi;
        let reflectance = fresnel::schlick(self.f0, half_cosine(wo, h));
        let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi.z;
        (reflectance * lobe, ggx.reflection_density(wo, h))
    }
}

/// wo·h of the normalised half-vector along `h` = wo + wi.
#[inline]
pub(super) fn half_cosine(wo: Vec3, h: Vec3) -> f32 {
    wo.dot(h) / h.length()
}
