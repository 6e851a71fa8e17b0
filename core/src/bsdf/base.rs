//! The diffuse part of a surface, and how the light that it sends back depends on where it goes: by the share
//! that passes the coat, which is known for any direction.

use super::albedo::{self, SchlickAlbedo};
use super::{Bsdf, coated};
use crate::Rgb;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// What is on top of a diffuse surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Cover {
    /// Of Schlick's coat, reflectance at normal incidence.
    specular: [f32; 3],
    /// GGX alpha.
    alpha: f32,
    /// Of a dielectric coat, the index of refraction; zero elsewhere.
    eta: f32,
}

impl Cover {
    /// Nothing on top: what leaves is alike in all directions.
    pub(crate) const NONE: Cover = Cover { specular: [0.0; 3], alpha: 0.0, eta: 0.0 };

    pub(super) fn dielectric(alpha: f32, eta: f32) -> Self {
        Self { alpha, eta, ..Self::NONE }
    }

    pub(super) fn schlick(alpha: f32, specular: Rgb) -> Self {
        Self { alpha, specular: specular.to_array(), ..Self::NONE }
    }

    /// T: the share of the light from the base that leaves at the cosine `c`, up to a factor.
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
    /// What covers the diffuse part; `None` where there is no such part.
    #[inline]
    pub(crate) fn cover(&self) -> Option<Cover> {
        match self {
            Bsdf::Diffuse(_) => Some(Cover::NONE),
            Bsdf::Glossy(b) => b.cover(),
            Bsdf::Plastic(b) => b.cover(),
            _ => None,
        }
    }

    /// The part of `f`, which is f(wo, wi) |cos θ_i|, that the diffuse part reflects: 0 … 1.
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
