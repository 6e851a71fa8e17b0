//! Dielectric coat over a diffuse base: plastic, varnish, glazed tiles. Light from the base is reflected
//! inside the coat and returns to the base repeatedly; the sum of the series is
//!
//! base = colour / (1 - colour · R_i) / η²
//!
//! with R_i the mean internal reflectance: 1 - R_i = (1 - R_e) / η² by reciprocity. (The model of Mitsuba's
//! `plastic` and `roughplastic` with `nonlinear` set.) If smooth, a white base returns exactly the T(θ_o)
//! that reached it. If rough, it returns less, as in every model of one bounce between microfacets.

use super::CoatTransmittance;
use super::albedo::{self, SchlickFit};
use super::fresnel;
use super::range::{MAX_INDEX, unit};
use crate::Rgb;
use halflight_simd::kernels::shade::coat_lanes::CoatLanes;

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

    /// Coat and base as a lane.
    #[inline(always)]
    pub(super) fn lane(&self) -> CoatLanes<f32> {
        CoatLanes {
            base: self.base.into(),
            tint: self.coat.into(),
            metal: self.metal.into(),
            metallic: self.metallic,
            alpha: self.alpha,
            eta: self.eta,
            mean: [1.0 - fresnel::mean_external_reflectance(self.eta); 3],
            dielectric: true,
            ..CoatLanes::SMOOTH
        }
    }

    pub(super) fn base(&self) -> Rgb {
        self.base
    }

    pub(super) fn is_delta(&self) -> bool {
        self.alpha == 0.0 && self.base == Rgb::ZERO
    }

    /// Least-squares fit to the transmittance.
    #[inline]
    pub(super) fn transmittance_fit(&self) -> SchlickFit<Rgb> {
        let SchlickFit { constant, edge } = albedo::transmittance_fit(self.alpha, self.eta);
        SchlickFit { constant: Rgb::splat(constant), edge: Rgb::splat(edge) }
    }
}
