//! How light scatters at a point: one file per kind behind the closed enum [`Bsdf`].
//!
//! Directions are local: z is the shading normal on the side of the viewer, `wo` looks to the viewer and
//! `wi` to where the light comes from; both point away from the surface. What is transmitted is radiance,
//! so it carries the factor (n_o/n_i)² (Veach 1997, §5.2); [`BsdfSample::eta`] takes it back where
//! something else, a photon's power, is carried.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "!(x > 0) is meant: it catches NaN as well")]

mod albedo;
mod base;
mod class;
mod coated;
mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod ggx;
mod glossy;
mod mirror;
mod plastic;
mod range;
mod resolve;
mod rough_dielectric;

pub use crate::features::{All, DiffuseOnly, DiffuseTextured, Features, Only, Opaque, OpaquePlain, Plain};
pub(crate) use base::Cover;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use glossy::Glossy;
pub use mirror::Mirror;
pub use plastic::Plastic;
pub use rough_dielectric::RoughDielectric;

use crate::Rgb;
use glam::Vec3;

/// A material at a hit point: textures looked up, indices turned to the side of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambert.
    Diffuse(Diffuse),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Metal, smooth or rough.
    Conductor(Conductor),
    /// Coat over a base by Schlick's formula.
    Glossy(Glossy),
    /// Dielectric coat over a base.
    Plastic(Plastic),
    /// Smooth glass.
    Dielectric(Dielectric),
    /// Rough glass.
    RoughDielectric(RoughDielectric),
}

/// A direction that [`Bsdf::sample`] chose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction, local.
    pub direction: Vec3,
    /// f |cos| / pdf, the factor on the path's throughput.
    pub weight: Rgb,
    /// Density in solid angle, of all lobes together; the probability of the choice where `delta`.
    pub pdf: f32,
    /// The direction was the only one possible: no other technique can find it.
    pub delta: bool,
    /// The direction leads to the other side of the surface.
    pub transmitted: bool,
    /// Index of refraction on the side of `direction` over that of the viewer; 1 where reflected.
    pub eta: f32,
}

impl BsdfSample {
    #[inline]
    pub(crate) fn reflection(direction: Vec3, weight: Rgb, pdf: f32) -> Self {
        Self { direction, weight, pdf, delta: false, transmitted: false, eta: 1.0 }
    }

    #[inline]
    fn mirrored(wo: Vec3, weight: Rgb, probability: f32) -> Self {
        let direction = Vec3::new(-wo.x, -wo.y, wo.z);
        Self { direction, weight, pdf: probability, delta: true, transmitted: false, eta: 1.0 }
    }
}

/// A material as it is seen from somewhere: what is the same for all light is worked out.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'b> {
    bsdf: &'b Bsdf,
    wo: Vec3,
    /// T(θ_o) of a coat.
    transmittance: Rgb,
    /// By its base alone.
    base_alone: bool,
}

impl Seen<'_> {
    /// What [`Bsdf::evaluate`] has as f(wo, wi) |cos θ_i|, to the bit.
    #[inline]
    pub(crate) fn value<F: Features>(&self, wi: Vec3) -> Rgb {
        let Self { bsdf, wo, transmittance, base_alone } = *self;
        match bsdf {
            Bsdf::Glossy(_) | Bsdf::Plastic(_) if !(wi.z > 0.0) => Rgb::ZERO,
            Bsdf::Glossy(b) if F::GLOSSY && base_alone => coated::base_value(b, wi, transmittance),
            Bsdf::Plastic(b) if F::GLOSSY && base_alone => coated::base_value(b, wi, transmittance),
            Bsdf::Glossy(b) if F::GLOSSY => coated::value(b, wo, wi, transmittance),
            Bsdf::Plastic(b) if F::GLOSSY => coated::value(b, wo, wi, transmittance),
            _ => bsdf.evaluate::<F>(wo, wi).0,
        }
    }
}

impl Bsdf {
    /// Chooses where the light that leaves to `wo` (`wo.z` > 0) came from; `u` in [0, 1), `u[2]` picks the
    /// lobe. `None`: absorbed.
    #[inline]
    pub fn sample<F: Features>(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Diffuse(b) => b.sample([u[0], u[1]]),
            Bsdf::Mirror(b) if F::GLOSSY => b.sample(wo),
            Bsdf::Conductor(b) if F::GLOSSY => b.sample(wo, [u[0], u[1]]),
            Bsdf::Glossy(b) if F::GLOSSY => coated::sample(b, wo, u),
            Bsdf::Plastic(b) if F::GLOSSY => coated::sample(b, wo, u),
            Bsdf::Dielectric(b) if F::DIELECTRIC => b.sample(wo, u[2]),
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.sample(wo, u),
            _ => None,
        }
    }

    /// f(wo, wi) |cos θ_i| and the density with which [`Bsdf::sample`] chooses `wi`. Zeros for directions
    /// that only a delta lobe connects.
    #[inline]
    pub fn evaluate<F: Features>(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Diffuse(b) => b.evaluate(wi),
            Bsdf::Conductor(b) if F::GLOSSY => b.evaluate(wo, wi),
            Bsdf::Glossy(b) if F::GLOSSY => coated::evaluate(b, wo, wi),
            Bsdf::Plastic(b) if F::GLOSSY => coated::evaluate(b, wo, wi),
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.evaluate(wo, wi),
            _ => (Rgb::ZERO, 0.0),
        }
    }

    /// As it is seen from `wo`, by light from many directions.
    #[inline]
    pub(crate) fn seen<F: Features>(&self, wo: Vec3) -> Seen<'_> {
        let wo = above_horizon(wo);
        let transmittance = match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::Coat::transmittance(b, wo.z),
            Bsdf::Plastic(b) if F::GLOSSY => coated::Coat::transmittance(b, wo.z),
            _ => Rgb::ONE,
        };
        Seen { bsdf: self, wo, transmittance, base_alone: false }
    }

    /// The same without the coat, if `base_alone`.
    #[inline]
    pub(crate) fn seen_apart<F: Features>(&self, wo: Vec3, base_alone: bool) -> Seen<'_> {
        Seen { base_alone, ..self.seen::<F>(wo) }
    }

    /// As [`Bsdf::sample`] of a surface with a rough coat, by its base or its coat alone: weight and density
    /// are of that one, with the probability of its choice. Whether it was the coat.
    #[inline]
    pub(crate) fn sample_apart<F: Features>(&self, wo: Vec3, u: [f32; 3]) -> Option<(BsdfSample, bool)> {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::sample_apart(b, wo, u),
            Bsdf::Plastic(b) if F::GLOSSY => coated::sample_apart(b, wo, u),
            _ => None,
        }
    }

    /// As [`Bsdf::evaluate`] of a surface with a rough coat: of its base, and of its coat.
    #[inline]
    pub(crate) fn evaluate_apart<F: Features>(&self, wo: Vec3, wi: Vec3) -> [(Rgb, f32); 2] {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::evaluate_apart(b, wo, wi),
            Bsdf::Plastic(b) if F::GLOSSY => coated::evaluate_apart(b, wo, wi),
            _ => [(Rgb::ZERO, 0.0); 2],
        }
    }

    /// Whether it has a coat, rough or smooth, whose peak outshines a diffuse surface.
    #[inline]
    pub(crate) fn has_narrow_coat(&self) -> bool {
        match self {
            Bsdf::Glossy(b) => coated::is_narrow(b),
            Bsdf::Plastic(b) => coated::is_narrow(b),
            _ => false,
        }
    }

    /// Whether it has a coat that is not smooth.
    #[inline]
    pub(crate) fn has_rough_coat(&self) -> bool {
        match self {
            Bsdf::Glossy(b) => b.alpha() > 0.0,
            Bsdf::Plastic(b) => b.alpha() > 0.0,
            _ => false,
        }
    }

    /// Whether every lobe is a delta lobe: to connect it to a light is in vain.
    #[inline]
    pub fn is_delta(&self) -> bool {
        match self {
            Bsdf::Diffuse(_) | Bsdf::RoughDielectric(_) => false,
            Bsdf::Mirror(_) | Bsdf::Dielectric(_) => true,
            Bsdf::Conductor(b) => b.alpha == 0.0,
            Bsdf::Glossy(b) => b.is_delta(),
            Bsdf::Plastic(b) => b.is_delta(),
        }
    }

    /// The colour of what is scattered evenly; black where all is glossy.
    #[inline]
    pub(crate) fn base(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.reflectance,
            Bsdf::Glossy(b) => coated::Coat::base(b),
            Bsdf::Plastic(b) => coated::Coat::base(b),
            _ => Rgb::ZERO,
        }
    }

    /// Whether light passes to the other side.
    #[inline]
    pub fn transmits(&self) -> bool {
        matches!(self, Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_))
    }
}

// A hit carries one through the shading stages: keep it within a cache line.
const _: () = assert!(size_of::<Bsdf>() <= 64);

/// `wo` no nearer to the horizon than directions in f32 are known: the squares of half-vectors stay normal.
#[inline]
fn above_horizon(wo: Vec3) -> Vec3 {
    const RESOLUTION: f32 = 1e-7;
    Vec3::new(wo.x, wo.y, wo.z.max(RESOLUTION))
}

/// Square root, correctly rounded: one instruction where the processor has one.
#[inline]
fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use crate::sampling::warp::uniform_sphere;

    #[test]
    fn what_is_seen_is_what_is_evaluated() {
        let (colour, coat) = (Rgb::new(0.8, 0.5, 0.1), Rgb::splat(0.04));
        let random = Random::new(1, 2);
        for i in 0..4000 {
            let [a, b, c, d, alpha] = [0, 1, 2, 3, 4].map(|k| random.single(5 * i + k));
            let (wo, wi) = (uniform_sphere([a, b]), uniform_sphere([c, d]));
            let wo = wo.with_z(wo.z.abs());
            let alpha = if i % 8 == 0 { 0.0 } else { alpha };
            let kinds = [
                Bsdf::Diffuse(Diffuse { reflectance: colour }),
                Bsdf::Glossy(Glossy::new(colour, coat, alpha, a)),
                Bsdf::Plastic(Plastic::new(colour, coat, alpha, b, 1.5)),
            ];
            for bsdf in kinds {
                assert_eq!(bsdf.seen::<All>(wo).value::<All>(wi), bsdf.evaluate::<All>(wo, wi).0, "{bsdf:?}");
            }
        }
    }
}
