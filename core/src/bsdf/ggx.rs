//! GGX microfacet distribution (Trowbridge and Reitz 1975; Walter et al. 2007): density, Smith's masking and
//! shadowing, and sampling of visible normals.
//!
//! Half-vectors are not normalised, and D is written in their squared coordinates: 1 - z² loses the tangent
//! of a lobe of alpha 1e-4, x² + y² keeps it.

use super::sqrt;
use crate::sampling::sin_cos_turns;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Distribution of microfacet normals of roughness `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha2: f32,
}

impl Ggx {
    /// `alpha` in 1e-4 … 1; smoother surfaces are perfectly smooth.
    #[inline]
    pub fn new(alpha: f32) -> Self {
        Self { alpha2: alpha * alpha }
    }

    /// D(m) per solid angle at the normal along `m`, of any length (Walter 2007, eq. 33).
    #[inline]
    pub fn density(&self, m: Vec3) -> f32 {
        let (xy2, z2) = (m.x * m.x + m.y * m.y, m.z * m.z);
        let length2 = xy2 + z2;
        let q = length2 / (xy2 + self.alpha2 * z2);
        self.alpha2 * FRAC_1_PI * q * q
    }

    /// sqrt(α² sin²θ + cos²θ): length of the stretched direction. Smith's Λ = (length / |cos θ| - 1) / 2.
    #[inline]
    fn stretch(&self, v: Vec3) -> f32 {
        sqrt(self.alpha2 * (v.x * v.x + v.y * v.y) + v.z * v.z)
    }

    /// Smith's masking G1 = 1 / (1 + Λ) of a direction on either side (Walter 2007, eq. 34).
    #[inline]
    pub fn masking(&self, v: Vec3) -> f32 {
        let c = v.z.abs();
        2.0 * c / (c + self.stretch(v))
    }

    /// G / (4 cos θ_o cos θ_i) of a reflection, with independent masking and shadowing (Walter 2007, eq. 23),
    /// as in the renderers for which published scenes were made. Height correlation (Heitz 2014, eq. 99)
    /// would return a little more at grazing angles.
    #[inline]
    pub fn visibility(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / ((wo.z + self.stretch(wo)) * (wi.z + self.stretch(wi)))
    }

    /// Samples a normal with density D(m) G1(wo) (wo·m)⁺ / cos θ_o: visible normals by spherical caps (Dupuy
    /// and Benyoub 2023, listing 3).
    #[inline]
    pub fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        self.sample_cap(wo, u, 1.0).normalize()
    }

    /// Density of [`Ggx::sample_visible`]; `m` of any length, `c` = wo·m / |m|.
    #[inline]
    pub fn visible_density(&self, wo: Vec3, m: Vec3, c: f32) -> f32 {
        2.0 * self.density(m) * c.max(0.0) / (wo.z + self.stretch(wo))
    }

    /// Samples the reflection of `wo` at a visible normal, from a cap without most normals that reflect below
    /// the horizon (Eto and Tokuyoshi 2023, listing 1). The direction may still point below.
    #[inline]
    pub fn sample_reflection(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let m = self.sample_cap(wo, u, self.cap_bound(wo));
        // Reflection at m of any length: one division in place of a root and a division.
        (2.0 * wo.dot(m) / m.length_squared()) * m - wo
    }

    /// Density of [`Ggx::sample_reflection`] in solid angle of `wi`; `h` = wo + wi (eq. 8).
    #[inline]
    pub fn reflection_density(&self, wo: Vec3, h: Vec3) -> f32 {
        0.5 * self.density(h) / (self.cap_bound(wo) * wo.z + self.stretch(wo))
    }

    /// G |cos θ_i| D / (4 cos θ_o cos θ_i) over the density of [`Ggx::sample_reflection`]. D cancels, and the
    /// result is in 0 … 1.
    #[inline]
    pub fn reflection_weight(&self, wo: Vec3, wi: Vec3) -> f32 {
        let stretch = self.stretch(wo);
        self.masking(wi) * (self.cap_bound(wo) * wo.z + stretch) / (wo.z + stretch)
    }

    /// k of Eto and Tokuyoshi (2023, eq. 5): factor on the lower bound of the cap.
    #[inline]
    fn cap_bound(&self, wo: Vec3) -> f32 {
        let s = 1.0 + sqrt(wo.x * wo.x + wo.y * wo.y);
        let s2 = s * s;
        (1.0 - self.alpha2) * s2 / (s2 + self.alpha2 * wo.z * wo.z)
    }

    /// Samples a normal, not normalised: a point of the cap z > -k z_o of the unit sphere in stretched space,
    /// plus the stretched viewer.
    #[inline]
    fn sample_cap(&self, wo: Vec3, u: [f32; 2], k: f32) -> Vec3 {
        let alpha = sqrt(self.alpha2);
        let viewer = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z) / self.stretch(wo);
        let bound = k * viewer.z;
        let z = (1.0 - u[1]) * (1.0 + bound) - bound;
        let (sin, cos) = sin_cos_turns(u[0]);
        let r = sqrt((1.0 - z * z).max(0.0));
        let h = Vec3::new(r * cos, r * sin, z) + viewer;
        Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0))
    }
}
