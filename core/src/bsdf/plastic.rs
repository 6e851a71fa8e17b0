//! Dielectric coat over a diffuse base: plastic, varnish, glazed tiles. Light from the base is reflected
//! inside the coat and returns to the base repeatedly; the sum of the series is
//!
//! base = colour / (1 - colour · R_i) / η²
//!
//! with R_i the mean internal reflectance: 1 - R_i = (1 - R_e) / η² by reciprocity. (The model of Mitsuba's
//! `plastic` and `roughplastic` with `nonlinear` set.) If smooth, a white base returns exactly the T(θ_o)
//! that reached it. If rough, it returns less, as in every model of one bounce between microfacets.

use super::CoatTransmittance;
use super::albedo::{self, SchlickAlbedo, SchlickFit};
use super::coated::Coat;
use super::fresnel;
use super::range::{MAX_INDEX, unit};
use crate::Rgb;
use halflight_simd::kernels::shade::coat::CoatBlock;
use halflight_simd::kernels::shade::put;

/// Dielectric coat over a diffuse base, blended with metal. See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Factor of the base; includes 1 - metallic.
    base: Rgb,
    /// Factor on the coat's Fresnel reflectance; includes 1 - metallic.
    coat: Rgb,
    /// Reflectance of the metal at normal incidence; includes metallic.
    metal: Rgb,
    metallic: f32,
    /// GGX alpha; 0 is smooth.
    alpha: f32,
    /// Index of refraction of the coat, at least 1.
    eta: f32,
    /// Reflectance of the coat at normal incidence, from `eta` alone.
    f0: f32,
}

impl Plastic {
    /// From the colour of the base, the coat's reflectance at normal incidence (that of `eta` times a tint),
    /// alpha as in [`super::Conductor`], `metallic` 0 … 1, and the index of refraction.
    #[inline]
    pub fn new(color: Rgb, specular: Rgb, alpha: f32, metallic: f32, eta: f32) -> Self {
        let metallic = unit(metallic);
        let eta = if eta.is_finite() { eta.clamp(1.0, MAX_INDEX) } else { 1.0 };
        let f0 = fresnel::normal_incidence(eta);
        let tint = if f0 > 0.0 { (specular / f0).min(Rgb::ONE) } else { Rgb::ONE };
        let internal = albedo::internal_reflectance(alpha, eta);
        Self {
            base: color * (1.0 - metallic) / ((Rgb::ONE - color * internal) * (eta * eta)),
            coat: tint * (1.0 - metallic),
            metal: color * metallic,
            metallic,
            alpha,
            eta,
            f0,
        }
    }

    /// GGX alpha of the coat; 0 is smooth.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    pub(super) fn coat_transmittance(&self) -> Option<CoatTransmittance> {
        (self.base != Rgb::ZERO).then(|| CoatTransmittance::dielectric(self.alpha, self.eta))
    }

    /// Index of refraction of the coat.
    pub(super) fn eta(&self) -> f32 {
        self.eta
    }

    /// Factor on the coat's Fresnel reflectance; `None` with metal.
    pub(super) fn coat_tint(&self) -> Option<Rgb> {
        (self.metallic == 0.0).then_some(self.coat)
    }

    /// Makes the surface that of vertex `i` of a block.
    #[inline]
    pub(crate) fn put(&self, block: &mut CoatBlock, i: usize) {
        put(&mut block.base, i, self.base.to_array());
        put(&mut block.tint, i, self.coat.to_array());
        put(&mut block.metal, i, self.metal.to_array());
        put(&mut block.mean, i, self.mean_transmittance().to_array());
        (block.metallic[i & 15], block.alpha[i & 15], block.eta[i & 15]) =
            (self.metallic, self.alpha, self.eta);
        (block.exists, block.dielectric) = (block.exists | 1 << i, block.dielectric | 1 << i);
    }

    pub(super) fn is_delta(&self) -> bool {
        self.alpha == 0.0 && self.base == Rgb::ZERO
    }

    #[inline]
    fn mix(&self, coat: f32, schlick: f32) -> Rgb {
        self.coat * coat + self.metal + (Rgb::splat(self.metallic) - self.metal) * schlick
    }
}

impl Coat for Plastic {
    #[inline]
    fn alpha(&self) -> f32 {
        self.alpha
    }

    #[inline]
    fn reflectance(&self, c: f32) -> Rgb {
        self.mix(fresnel::dielectric(c, self.eta), fresnel::schlick_weight(c))
    }

    #[inline]
    fn transmittance(&self, c: f32) -> Rgb {
        Rgb::splat(albedo::transmittance(c, self.alpha, self.eta))
    }

    #[inline]
    fn specular_albedo(&self, c: f32) -> Rgb {
        if self.alpha == 0.0 {
            return self.reflectance(c);
        }
        // The albedo tables of Schlick's coat also serve the dielectric coat.
        let of = SchlickAlbedo::directional(c, self.alpha);
        self.mix(of.edge + self.f0 * (of.white - of.edge), of.edge)
    }

    #[inline]
    fn base(&self) -> Rgb {
        self.base
    }

    #[inline]
    fn mean_transmittance(&self) -> Rgb {
        Rgb::splat(1.0 - fresnel::mean_external_reflectance(self.eta))
    }

    #[inline]
    fn transmittance_fit(&self) -> SchlickFit<Rgb> {
        let SchlickFit { constant, edge } = albedo::transmittance_fit(self.alpha, self.eta);
        SchlickFit { constant: Rgb::splat(constant), edge: Rgb::splat(edge) }
    }
}
