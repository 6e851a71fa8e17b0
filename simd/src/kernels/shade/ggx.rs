//! GGX microfacets over lanes: the operations of the scalar distribution in their order (Walter et al. 2007;
//! Eto and Tokuyoshi 2023). Viewers are above the horizon.

use super::vector::{self, add, divide, scale, sub};
use super::warp::sin_cos_turns;
use crate::lanes::{Lanes, dot};
use core::f32::consts::FRAC_1_PI;

/// Distributions of microfacet normals.
#[derive(Clone, Copy)]
pub struct Ggx<L> {
    alpha2: L,
}

impl<L: Lanes> Ggx<L> {
    /// `alpha` in 1e-4 … 1.
    #[inline(always)]
    pub fn new(alpha: L) -> Self {
        Self { alpha2: alpha * alpha }
    }

    /// D(m) per solid angle at the normal along `m`, of any length.
    #[inline(always)]
    pub fn density(self, [x, y, z]: [L; 3]) -> L {
        let (xy2, z2) = (x * x + y * y, z * z);
        let q = (xy2 + z2) / (xy2 + self.alpha2 * z2);
        self.alpha2 * z.all(FRAC_1_PI) * q * q
    }

    /// sqrt(α² sin²θ + cos²θ).
    #[inline(always)]
    fn stretch(self, [x, y, z]: [L; 3]) -> L {
        (self.alpha2 * (x * x + y * y) + z * z).sqrt()
    }

    /// G / (4 cos θ_o cos θ_i) of a reflection, with independent masking and shadowing.
    #[inline(always)]
    pub fn visibility(self, wo: [L; 3], wi: [L; 3]) -> L {
        wo[2].all(1.0) / ((wo[2] + self.stretch(wo)) * (wi[2] + self.stretch(wi)))
    }

    /// Factor on the lower bound of the cap (Eto and Tokuyoshi 2023, eq. 5).
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

    /// Samples a visible normal.
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

    /// Smith's masking of a direction on either side.
    #[inline(always)]
    pub fn masking(self, v: [L; 3]) -> L {
        let c = v[2].abs();
        c.all(2.0) * c / (c + self.stretch(v))
    }

    /// Samples the reflection of `wo` at a visible normal. The direction may point below the horizon.
    #[inline(always)]
    pub fn sample_reflection(self, wo: [L; 3], u: [L; 2]) -> [L; 3] {
        let m = self.sample_cap(wo, u, self.cap_bound(wo));
        sub(scale(m, u[0].all(2.0) * dot(wo, m) / vector::square(m)), wo)
    }

    /// Density of [`Ggx::sample_reflection`] in solid angle of `wi`; `h` = wo + wi.
    #[inline(always)]
    pub fn reflection_density(self, wo: [L; 3], h: [L; 3]) -> L {
        h[0].all(0.5) * self.density(h) / (self.cap_bound(wo) * wo[2] + self.stretch(wo))
    }

    /// G |cos θ_i| D / (4 cos θ_o cos θ_i) over the density of [`Ggx::sample_reflection`].
    #[inline(always)]
    pub fn reflection_weight(self, wo: [L; 3], wi: [L; 3]) -> L {
        let stretch = self.stretch(wo);
        self.masking(wi) * (self.cap_bound(wo) * wo[2] + stretch) / (wo[2] + stretch)
    }
}
