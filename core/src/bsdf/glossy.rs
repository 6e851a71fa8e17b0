//! Coat with Schlick's reflectance over a diffuse base, blended with metal: the meaning of MTL's Kd + Ks and
//! Pm.
//!
//! With E the directional albedo of the coat and Ē its mean, T = 1 - E and base = colour / (1 - Ē). The base
//! returns colour · (1 - E(θ_o)), so that coat and base together return at most E + (1 - E) = 1 for every
//! colour up to white (Kelemen and Szirmay-Kalos 2001, eq. 5; Kulla and Conty 2017). The blend with metal is
//! a weighted mean of two such surfaces.

use super::CoatTransmittance;
use super::albedo::{SchlickAlbedo, SchlickFit, schlick_albedo_fit};
use super::coated::Coat;
use super::{fresnel, range::unit};
use crate::Rgb;
use halflight_simd::kernels::shade::coat::CoatBlock;
use halflight_simd::kernels::shade::put;

/// Coat over a base, blended with metal. See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    /// Colour of the base over the mean transmittance of the coat, times 1 - metallic.
    base: Rgb,
    /// Reflectance of the coat at normal incidence.
    specular: Rgb,
    /// Reflectance at normal incidence of the blend of coat and metal. Schlick's formula is linear in it.
    f0: Rgb,
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
        let mean = Rgb::ONE - SchlickAlbedo::mean(alpha).of(specular);
        Self {
            base: color * (1.0 - metallic) / mean.max(Rgb::splat(LEAST_MEAN)),
            specular,
            f0: specular.lerp(color, metallic),
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

    /// Makes the surface that of vertex `i` of a block.
    #[inline]
    pub(crate) fn put(&self, block: &mut CoatBlock, i: usize) {
        put(&mut block.base, i, self.base.to_array());
        put(&mut block.tint, i, self.specular.to_array());
        put(&mut block.metal, i, self.f0.to_array());
        put(&mut block.mean, i, self.mean_transmittance().to_array());
        (block.metallic[i & 15], block.alpha[i & 15], block.eta[i & 15]) = (1.0, self.alpha, 1.5);
        block.exists |= 1 << i;
    }

    pub(super) fn is_delta(&self) -> bool {
        self.alpha == 0.0 && self.base == Rgb::ZERO
    }
}

impl Coat for Glossy {
    #[inline]
    fn alpha(&self) -> f32 {
        self.alpha
    }

    #[inline]
    fn reflectance(&self, c: f32) -> Rgb {
        fresnel::schlick(self.f0, c)
    }

    #[inline]
    fn transmittance(&self, c: f32) -> Rgb {
        Rgb::ONE - SchlickAlbedo::directional(c, self.alpha).of(self.specular)
    }

    #[inline]
    fn specular_albedo(&self, c: f32) -> Rgb {
        SchlickAlbedo::directional(c, self.alpha).of(self.f0)
    }

    #[inline]
    fn base(&self) -> Rgb {
        self.base
    }

    #[inline]
    fn mean_transmittance(&self) -> Rgb {
        Rgb::ONE - SchlickAlbedo::mean(self.alpha).of(self.specular)
    }

    #[inline]
    fn transmittance_fit(&self) -> SchlickFit<Rgb> {
        // The albedo is specular · (white - edge) + edge.
        let [white, edge] = schlick_albedo_fit(self.alpha);
        let of = |white: f32, edge: f32| self.specular * (white - edge) + Rgb::splat(edge);
        SchlickFit {
            constant: Rgb::ONE - of(white.constant, edge.constant),
            edge: -of(white.edge, edge.edge),
        }
    }
}
