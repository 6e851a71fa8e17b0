//! Rough dielectric boundary: GGX microfacets, each a smooth dielectric (Walter et al. 2007).

use super::dielectric::{reflection_probability, refract};
use super::ggx::Ggx;
use super::{BsdfSample, fresnel};
use crate::Rgb;
use glam::Vec3;

/// Rough glass, seen from one side. Masking and shadowing are independent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// Index of refraction on the far side over that on the viewer's side; not 1.
    pub eta: f32,
    /// GGX alpha.
    pub alpha: f32,
    /// Factor on the transmitted light, 0 … 1.
    pub tint: Rgb,
}

/// Bound of the rounding error in a sum of two unit vectors.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

impl RoughDielectric {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let ggx = Ggx::new(self.alpha);
        let m = ggx.sample_visible(wo, [u[0], u[1]]);
        let c = wo.dot(m);
        if !(c > 0.0) {
            return None;
        }
        let reflectance = fresnel::dielectric(c, self.eta);
        let p = reflection_probability(reflectance, self.tint);
        let normals = ggx.visible_density(wo, m, c);
        if u[2] < p {
            let wi = 2.0 * c * m - wo;
            if !(wi.z > 0.0) {
                return None;
            }
            let weight = Rgb::splat(reflectance / p * ggx.masking(wi));
            return Some(BsdfSample::reflection(wi, weight, p * normals / (4.0 * c)));
        }
        let wi = refract(wo, m, c, self.eta);
        let c_i = -wi.dot(m);
        if !(wi.z < 0.0 && c_i > 0.0 && p < 1.0) {
            return None;
        }
        let scale = (1.0 - reflectance) / ((1.0 - p) * self.eta * self.eta);
        Some(BsdfSample {
            direction: wi,
            weight: self.tint * (scale * ggx.masking(wi)),
            pdf: (1.0 - p) * normals * self.refraction_jacobian(c, c_i),
            delta: false,
            transmitted: true,
            eta: self.eta,
        })
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let ggx = Ggx::new(self.alpha);
        if wi.z > 0.0 {
            let h = wo + wi;
            let length = h.length();
            let c = wo.dot(h) / length;
            let reflectance = fresnel::dielectric(c, self.eta);
            let p = reflection_probability(reflectance, self.tint);
            let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi.z;
            return (Rgb::splat(reflectance * lobe), p * ggx.visible_density(wo, h, c) / (4.0 * c));
        }
        // The normal that refracts wo to wi (Walter 2007, eq. 16) points to the side of the lower index; here
        // it is turned to the viewer. By rounding, a normal in the surface may seem to be below it.
        let h = (wo + self.eta * wi) * 1f32.copysign(1.0 - self.eta);
        if h.z < -ROUNDING {
            return (Rgb::ZERO, 0.0);
        }
        let h = h.with_z(h.z.max(0.0));
        let length = h.length();
        let (c, c_i) = (wo.dot(h) / length, -wi.dot(h) / length);
        if !(wi.z < 0.0 && c > 0.0 && c_i > 0.0) {
            return (Rgb::ZERO, 0.0);
        }
        let reflectance = fresnel::between(c, self.eta * c_i, self.eta);
        let p = reflection_probability(reflectance, self.tint);
        let density = ggx.visible_density(wo, h, c) * self.refraction_jacobian(c, c_i);
        // Walter 2007, eq. 21, over eta² for radiance.
        let transmitted = (1.0 - reflectance) * ggx.masking(wi) * density / (self.eta * self.eta);
        (self.tint * transmitted, (1.0 - p) * density)
    }

    /// Solid angle of normals per solid angle of refracted directions (Walter 2007, eq. 17).
    #[inline]
    fn refraction_jacobian(&self, c: f32, c_i: f32) -> f32 {
        // η c_i - c without cancellation for η near 1: (η c_i)² - c² = η² - 1.
        let sum = (self.eta - 1.0) * (self.eta + 1.0) / (self.eta * c_i + c);
        self.eta * self.eta * c_i / (sum * sum)
    }
}
