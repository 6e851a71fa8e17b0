//! Smooth dielectric boundary: Fresnel reflection, and refraction by Snell's law.

use super::{BsdfSample, fresnel, sqrt};
use crate::Rgb;
use glam::Vec3;

/// Smooth glass or water, seen from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction on the far side over that on the viewer's side.
    pub eta: f32,
    /// Factor on the transmitted light, 0 … 1.
    pub tint: Rgb,
}

impl Dielectric {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: f32) -> Option<BsdfSample> {
        let reflectance = fresnel::dielectric(wo.z, self.eta);
        let p = reflection_probability(reflectance, self.tint);
        if u < p {
            return Some(BsdfSample::mirrored(wo, Rgb::splat(reflectance / p), p));
        }
        if !(p < 1.0) {
            return None;
        }
        let scale = (1.0 - reflectance) / ((1.0 - p) * self.eta * self.eta);
        Some(BsdfSample {
            direction: refract(wo, Vec3::Z, wo.z, self.eta),
            weight: self.tint * scale,
            pdf: 1.0 - p,
            delta: true,
            transmitted: true,
            eta: self.eta,
        })
    }
}

/// Probability of reflection, in proportion to the energy of each side.
#[inline]
pub(super) fn reflection_probability(reflectance: f32, tint: Rgb) -> f32 {
    let transmitted = (1.0 - reflectance) * tint.element_sum() * (1.0 / 3.0);
    let sum = reflectance + transmitted;
    if sum > 0.0 { reflectance / sum } else { 1.0 }
}

/// Refraction of `wo` at a microfacet of normal `m`, c = wo·m > 0, into the medium of relative index `eta`
/// (Walter et al. 2007, eq. 40). The caller excludes total reflection.
#[inline]
pub(super) fn refract(wo: Vec3, m: Vec3, c: f32, eta: f32) -> Vec3 {
    if eta == 1.0 {
        return -wo;
    }
    // g = eta cos θ_t, as in `fresnel::dielectric`, so that both agree on the onset of total reflection.
    let g = sqrt(((eta - 1.0) * (eta + 1.0) + c * c).max(0.0));
    ((c - g) * m - wo) / eta
}
