//! Coat with Schlick's reflectance over a diffuse base, blended with metal: the meaning of MTL's Kd + Ks and
//! Pm.
//!
//! With E the directional albedo of the coat and Ē its mean, T = 1 - E and base = colour / (1 - Ē). The base
//! returns colour · (1 - E(θ_o)), so that coat and base together return at most E + (1 - E) = 1 for every
//! colour up to white (Kelemen and Szirmay-Kalos 2001, eq. 5; Kulla and Conty 2017). The blend with metal is
//! a weighted mean of two such surfaces.

use super::CoatTransmittance;
use super::albedo::{self, SchlickFit, schlick_albedo_fit};
use super::range::unit;
use crate::Rgb;
use halflight_simd::kernels::shade::coat_lanes::CoatLanes;

/// Coat over a base, blended with metal. See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    /// Colour of the base over the mean transmittance of the coat, times 1 - metallic.
    base: Rgb,
    /// Reflectance of the coat at normal incidence.
    specular: Rgb,
    /// Reflectance at normal incidence of the blend of coat and metal. Schlick's formula is linear in it.
    f0: Rgb,
    /// Mean transmittance for uniform light from the base.
    mean: Rgb,
    /// GGX alpha; 0 is smooth.
    alpha: f32,
}

/// Least mean transmittance. A smaller one passes the coat at grazing angles only, where the base would add
/// noise; that energy is lost.
const LEAST_MEAN: f32 = 0.02;

impl Glossy {
    /// From colours in 0 … 1, alpha as in [`super::Conductor`], `metallic` 0 … 1.
    #[inline]
    pub fn new(color: Rgb, specular: Rgb, alpha: f32, metallic: f32) -> Self {
        let metallic = unit(metallic);
        let [white, edge] = albedo::schlick_mean(alpha);
        let mean = Rgb::ONE - (specular * (white - edge) + Rgb::splat(edge));
        Self {
            base: color * (1.0 - metallic) / mean.max(Rgb::splat(LEAST_MEAN)),
            specular,
            f0: specular.lerp(color, metallic),
            mean,
            alpha,
        }
    }

    /// GGX alpha of the coat; 0 is smooth.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    pub(super) fn specular(&self) -> Rgb {
        self.specular
    }

    pub(super) fn coat_transmittance(&self) -> Option<CoatTransmittance> {
        (self.base != Rgb::ZERO).then(|| CoatTransmittance::schlick(self.alpha, self.specular))
    }

    /// Coat and base as a lane.
    #[inline(always)]
    pub(super) fn lane(&self) -> CoatLanes<f32> {
        CoatLanes {
            base: self.base.into(),
            tint: self.specular.into(),
            metal: self.f0.into(),
            metallic: 1.0,
            alpha: self.alpha,
            mean: self.mean.into(),
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
        // The albedo is specular · (white - edge) + edge.
        let [white, edge] = schlick_albedo_fit(self.alpha);
        let of = |white: f32, edge: f32| self.specular * (white - edge) + Rgb::splat(edge);
        SchlickFit {
            constant: Rgb::ONE - of(white.constant, edge.constant),
            edge: -of(white.edge, edge.edge),
        }
    }
}
