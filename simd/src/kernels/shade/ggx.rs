//! GGX microfacet distribution over lanes (Trowbridge and Reitz 1975; Walter et al. 2007): density, Smith's
//! masking and shadowing, and sampling of visible normals. Viewers are above the horizon.
//!
//! Half-vectors are not normalised, and D is written in their squared coordinates: 1 - z² loses the tangent
//! of a lobe of alpha 1e-4, x² + y² keeps it.

use super::vector::{self, add, divide, scale, sub};
use super::warp::sin_cos_turns;
use crate::lanes::{Lanes, dot};
use core::f32::consts::FRAC_1_PI;

/// Distribution of microfacet normals of roughness `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<L> {
    alpha2: L,
}

impl<L: Lanes> Ggx<L> {
    /// `alpha` in 1e-4 … 1; smoother surfaces are perfectly smooth.
    #[inline(always)]
    pub fn new(alpha: L) -> Self {
        Self { alpha2: alpha * alpha }
    }

    /// D(m) per solid angle at the normal along `m`, of any length (Walter 2007, eq. 33).
    #[inline(always)]
    pub fn density(self, [x, y, z]: [L; 3]) -> L {
        let (xy2, z2) = (x * x + y * y, z * z);
        let q = (xy2 + z2) / (xy2 + self.alpha2 * z2);
        self.alpha2 * z.all(FRAC_1_PI) * q * q
    }

    /// sqrt(α² sin²θ + cos²θ): length of the stretched direction. Smith's Λ = (length / |cos θ| - 1) / 2.
    #[inline(always)]
    fn stretch(self, [x, y, z]: [L; 3]) -> L {
        (self.alpha2 * (x * x + y * y) + z * z).sqrt()
    }

    /// G / (4 cos θ_o cos θ_i) of a reflection, with independent masking and shadowing (Walter 2007, eq. 23),
    /// as in the renderers for which published scenes were made. Height correlation (Heitz 2014, eq. 99)
    /// would return a little more at grazing angles.
    #[inline(always)]
    pub fn visibility(self, wo: [L; 3], wi: [L; 3]) -> L {
        wo[2].all(1.0) / ((wo[2] + self.stretch(wo)) * (wi[2] + self.stretch(wi)))
    }

    /// k of Eto and Tokuyoshi (2023, eq. 5): factor on the lower bound of the cap.
    #[inline(always)]
    fn cap_bound(self, [x, y, z]: [L; 3]) -> L {
        let one = z.all(1.0);
        let s = one + (x * x + y * y).sqrt();
        let s2 = s * s;
        (one - self.alpha2) * s2 / (s2 + self.alpha2 * z * z)
    }

    /// Samples a normal, not normalised: a point of the cap z > -k z_o of the unit sphere in stretched space,
    /// plus the stretched viewer.
    #[inline(always)]
    fn sample_cap(self, wo: [L; 3], u: [L; 2], k: L) -> [L; 3] {
        let (zero, one) = (u[0].all(0.0), u[0].all(1.0));
        let alpha = self.alpha2.sqrt();
        let viewer = divide([alpha * wo[0], alpha * wo[1], wo[2]], self.stretch(wo));
        let bound = k * viewer[2];
        let z = (one - u[1]) * (one + bound) - bound;
        let (sin, cos) = sin_cos_turns(u[0]);
        let r = (one - z * z).max(zero).sqrt();
        let h = add([r * cos, r * sin, z], viewer);
        [alpha * h[0], alpha * h[1], h[2].max(zero)]
    }

    /// Samples a normal with density D(m) G1(wo) (wo·m)⁺ / cos θ_o: visible normals by spherical caps (Dupuy
    /// and Benyoub 2023, listing 3).
    #[inline(always)]
    pub fn sample_visible(self, wo: [L; 3], u: [L; 2]) -> [L; 3] {
        let m = self.sample_cap(wo, u, wo[2].all(1.0));
        scale(m, wo[2].all(1.0) / vector::length(m))
    }

    /// Density of [`Ggx::sample_visible`]; `m` of any length, `c` = wo·m / |m|.
    #[inline(always)]
    pub fn visible_density(self, wo: [L; 3], m: [L; 3], c: L) -> L {
        c.all(2.0) * self.density(m) * c.max(c.all(0.0)) / (wo[2] + self.stretch(wo))
    }

    /// Smith's masking G1 = 1 / (1 + Λ) of a direction on either side (Walter 2007, eq. 34).
    #[inline(always)]
    pub fn masking(self, v: [L; 3]) -> L {
        let c = v[2].abs();
        c.all(2.0) * c / (c + self.stretch(v))
    }

    /// Samples the reflection of `wo` at a visible normal, from a cap without most normals that reflect below
    /// the horizon (Eto and Tokuyoshi 2023, listing 1). The direction may still point below.
    #[inline(always)]
    pub fn sample_reflection(self, wo: [L; 3], u: [L; 2]) -> [L; 3] {
        let m = self.sample_cap(wo, u, self.cap_bound(wo));
        // Reflection at m of any length: one division in place of a root and a division.
        sub(scale(m, u[0].all(2.0) * dot(wo, m) / vector::square(m)), wo)
    }

    /// Density of [`Ggx::sample_reflection`] in solid angle of `wi`; `h` = wo + wi (eq. 8).
    #[inline(always)]
    pub fn reflection_density(self, wo: [L; 3], h: [L; 3]) -> L {
        h[0].all(0.5) * self.density(h) / (self.cap_bound(wo) * wo[2] + self.stretch(wo))
    }

    /// G |cos θ_i| D / (4 cos θ_o cos θ_i) over the density of [`Ggx::sample_reflection`]. D cancels, and the
    /// result is in 0 … 1.
    #[inline(always)]
    pub fn reflection_weight(self, wo: [L; 3], wi: [L; 3]) -> L {
        let stretch = self.stretch(wo);
        self.masking(wi) * (self.cap_bound(wo) * wo[2] + stretch) / (wo[2] + stretch)
    }
}
