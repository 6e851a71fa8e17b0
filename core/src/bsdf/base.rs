//! Diffuse base of a surface, and the directional dependence of its light by the transmittance of the coat.

use super::albedo::{self, SchlickAlbedo};
use super::{Bsdf, coated};
use crate::Rgb;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Coat over a diffuse base.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CoatTransmittance {
    /// Reflectance of Schlick's coat at normal incidence.
    specular: [f32; 3],
    /// GGX alpha.
    alpha: f32,
    /// Index of refraction of a dielectric coat; zero for others.
    eta: f32,
}

impl CoatTransmittance {
    /// No coat: the reflected radiance is the same in all directions.
    pub(crate) const NONE: CoatTransmittance = CoatTransmittance { specular: [0.0; 3], alpha: 0.0, eta: 0.0 };

    pub(super) fn dielectric(alpha: f32, eta: f32) -> Self {
        Self { alpha, eta, ..Self::NONE }
    }

    pub(super) fn schlick(alpha: f32, specular: Rgb) -> Self {
        Self { alpha, specular: specular.to_array(), ..Self::NONE }
    }

    /// Transmittance T at the cosine `c` for light from the base, up to a factor.
    #[inline]
    pub(crate) fn transmittance(&self, c: f32) -> Rgb {
        if self.eta > 0.0 {
            return Rgb::splat(albedo::transmittance(c, self.alpha, self.eta));
        }
        if self.specular == [0.0; 3] {
            return Rgb::ONE;
        }
        Rgb::ONE - SchlickAlbedo::directional(c, self.alpha).of(self.specular.into())
    }
}

impl Bsdf {
    /// Coat over the diffuse base; `None` without a base.
    #[inline]
    pub(crate) fn coat_transmittance(&self) -> Option<CoatTransmittance> {
        match self {
            Bsdf::Diffuse(_) => Some(CoatTransmittance::NONE),
            Bsdf::Glossy(b) => b.coat_transmittance(),
            Bsdf::Plastic(b) => b.coat_transmittance(),
            _ => None,
        }
    }

    /// Fraction of `f`, which is f(wo, wi) |cos θ_i|, that the base reflects: 0 … 1.
    #[inline]
    pub(crate) fn base_part(&self, wo: Vec3, wi: Vec3, f: Rgb) -> Rgb {
        let base = match self {
            Bsdf::Diffuse(_) => return Rgb::ONE,
            Bsdf::Glossy(b) => coated::of_base(b, wo, wi),
            Bsdf::Plastic(b) => coated::of_base(b, wo, wi),
            _ => return Rgb::ZERO,
        };
        Rgb::select(f.cmpgt(base), base / f, Rgb::ONE)
    }
}
