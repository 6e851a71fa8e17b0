//! BSDF at a point: parameters of the models behind the closed enum [`Bsdf`]. Their formulas are functions
//! over lanes ([`halflight_simd::kernels::shade`]), called with f32 as a lane.
//!
//! Directions are local and point away from the surface: z is the shading normal on the side of the viewer,
//! `wo` points to the viewer and `wi` to the origin of the light. Transmission is that of radiance and
//! includes the factor (n_o/n_i)² (Veach 1997, §5.2). [`BsdfSample::eta`] removes the factor for other
//! quantities, such as the power of photons.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "!(x > 0) is meant: it catches NaN as well")]

mod albedo;
mod base;
mod class;
mod coated;
mod glossy;
mod lobe;
mod pane;
mod plastic;
mod range;
mod resolve;
mod uncoated;

pub use crate::features::{All, DiffuseOnly, DiffuseTextured, Features, Only, Opaque};
pub(crate) use albedo::COATS;
pub(crate) use base::CoatTransmittance;
pub use glossy::Glossy;
pub use halflight_simd::kernels::shade::{fresnel, ggx};
pub(crate) use lobe::MicrofacetLobe;
pub use pane::Pane;
pub use plastic::Plastic;
pub use uncoated::{Conductor, Dielectric, Diffuse, Mirror, RoughDielectric};

use crate::Rgb;
use glam::Vec3;
use halflight_simd::kernels::shade::bsdf::{
    SampleLanes, diffuse, metal, sample_diffuse, sample_metal, viewer,
};
use halflight_simd::kernels::shade::specular::sample_dielectric;

/// Material at a hit: textures looked up, indices of refraction relative to the side of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian.
    Diffuse(Diffuse),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Thin pane, where a ray does not pass it.
    Pane(Pane),
    /// Metal, smooth or rough.
    Conductor(Conductor),
    /// Coat with Schlick's reflectance over a base.
    Glossy(Glossy),
    /// Dielectric coat over a base.
    Plastic(Plastic),
    /// Smooth glass.
    Dielectric(Dielectric),
    /// Rough glass.
    RoughDielectric(RoughDielectric),
}

/// Sample of [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction, local.
    pub direction: Vec3,
    /// f |cos| / pdf, a factor of the path's throughput.
    pub weight: Rgb,
    /// Density in solid angle over all lobes; the probability of the choice if `delta`.
    pub pdf: f32,
    /// True for a delta lobe, which no other technique can find.
    pub delta: bool,
    /// True if the direction leads to the other side of the surface.
    pub transmitted: bool,
    /// Index of refraction on the side of `direction` over that of the viewer; 1 for reflection.
    pub eta: f32,
}

impl BsdfSample {
    #[inline]
    pub(crate) fn reflection(direction: Vec3, weight: Rgb, pdf: f32) -> Self {
        Self { direction, weight, pdf, delta: false, transmitted: false, eta: 1.0 }
    }

    /// Sample of a lane.
    #[inline]
    fn of(sample: SampleLanes<f32>) -> Option<Self> {
        let SampleLanes { direction, weight, pdf, eta, exists, delta } = sample;
        let transmitted = direction[2] < 0.0;
        let (direction, weight) = (direction.into(), weight.into());
        exists.then_some(Self { direction, weight, pdf, delta, transmitted, eta })
    }
}

impl Bsdf {
    /// Samples the direction from which light that leaves towards `wo` (`wo.z` > 0) came; `u` in [0, 1),
    /// `u[2]` chooses the lobe. `None`: absorbed.
    #[inline]
    pub fn sample<F: Features>(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let (wo, at) = (viewer(wo.into()), [u[0], u[1]]);
        BsdfSample::of(match self {
            Bsdf::Diffuse(b) => sample_diffuse(b.reflectance.into(), at),
            Bsdf::Mirror(b) if F::GLOSSY => SampleLanes::mirrored(wo, b.reflectance.into(), 1.0),
            Bsdf::Pane(b) if F::GLOSSY => SampleLanes::mirrored(wo, b.mirrored(wo[2]).into(), 1.0),
            Bsdf::Conductor(b) if F::GLOSSY && b.alpha == 0.0 => {
                SampleLanes::mirrored(wo, fresnel::schlick(b.f0.into(), wo[2]), 1.0)
            }
            Bsdf::Conductor(b) if F::GLOSSY => sample_metal(b.f0.into(), b.alpha, wo, at),
            Bsdf::Glossy(b) if F::GLOSSY => b.lane().see(&COATS, wo[2]).sample(&COATS, wo, u),
            Bsdf::Plastic(b) if F::GLOSSY => b.lane().see(&COATS, wo[2]).sample(&COATS, wo, u),
            Bsdf::Dielectric(b) if F::DIELECTRIC => sample_dielectric(b.tint.into(), b.eta, wo, u[2]),
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.lane().sample(wo, u),
            _ => return None,
        })
    }

    /// f(wo, wi) |cos θ_i|, and the density of [`Bsdf::sample`] at `wi`. Zeros for delta lobes.
    #[inline]
    pub fn evaluate<F: Features>(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let (wo, wi): (_, [f32; 3]) = (viewer(wo.into()), wi.into());
        let (f, pdf) = match self {
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.lane().evaluate(wo, wi),
            _ if !(wi[2] > 0.0) => return (Rgb::ZERO, 0.0),
            Bsdf::Diffuse(b) => diffuse(b.reflectance.into(), wi),
            Bsdf::Conductor(b) if F::GLOSSY && b.alpha > 0.0 => metal(b.f0.into(), b.alpha, wo, wi),
            Bsdf::Glossy(b) if F::GLOSSY => b.lane().see(&COATS, wo[2]).evaluate(&COATS, wo, wi),
            Bsdf::Plastic(b) if F::GLOSSY => b.lane().see(&COATS, wo[2]).evaluate(&COATS, wo, wi),
            _ => return (Rgb::ZERO, 0.0),
        };
        (f.into(), pdf)
    }

    /// True if every lobe is a delta lobe: light samples contribute nothing.
    #[inline]
    pub fn is_delta(&self) -> bool {
        match self {
            Bsdf::Diffuse(_) | Bsdf::RoughDielectric(_) => false,
            Bsdf::Mirror(_) | Bsdf::Pane(_) | Bsdf::Dielectric(_) => true,
            Bsdf::Conductor(b) => b.alpha == 0.0,
            Bsdf::Glossy(b) => b.is_delta(),
            Bsdf::Plastic(b) => b.is_delta(),
        }
    }

    /// Albedo of the diffuse component; black without one.
    #[inline]
    pub(crate) fn base(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.reflectance,
            Bsdf::Glossy(b) => b.base(),
            Bsdf::Plastic(b) => b.base(),
            _ => Rgb::ZERO,
        }
    }

    /// Directional albedo at normal incidence, an estimate; that of the transmitted light for a dielectric.
    pub(crate) fn normal_albedo(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.reflectance,
            Bsdf::Mirror(b) => b.reflectance,
            Bsdf::Pane(b) => b.tint(),
            Bsdf::Conductor(b) => b.f0,
            Bsdf::Glossy(_) | Bsdf::Plastic(_) => self.coated_albedo().unwrap_or_default(),
            Bsdf::Dielectric(b) => b.tint,
            Bsdf::RoughDielectric(b) => b.tint,
        }
    }

    /// True if light passes to the other side.
    #[inline]
    pub fn transmits(&self) -> bool {
        matches!(self, Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_))
    }
}

// Every hit carries a BSDF through the shading stages: it must fit into a cache line.
const _: () = assert!(size_of::<Bsdf>() <= 64);

/// Correctly rounded square root: one instruction if the processor has it.
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
                assert_eq!(bsdf.view::<All>(wo).value::<All>(wi), bsdf.evaluate::<All>(wo, wi).0, "{bsdf:?}");
            }
        }
    }
}
