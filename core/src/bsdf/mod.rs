//! BSDF at a point: one file per model behind the closed enum [`Bsdf`].
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
mod conductor;
mod dielectric;
mod diffuse;
pub mod fresnel;
pub mod ggx;
mod glossy;
mod lobe;
mod mirror;
mod plastic;
mod range;
mod resolve;
mod rough_dielectric;

pub use crate::features::{All, DiffuseOnly, DiffuseTextured, Features, Only, Opaque};
pub(crate) use albedo::COATS;
pub(crate) use base::CoatTransmittance;
use coated::CoatView;
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use glossy::Glossy;
pub(crate) use lobe::MicrofacetLobe;
pub use mirror::Mirror;
pub use plastic::Plastic;
pub use rough_dielectric::RoughDielectric;

use crate::Rgb;
use glam::Vec3;

/// Material at a hit: textures looked up, indices of refraction relative to the side of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian.
    Diffuse(Diffuse),
    /// Perfect mirror.
    Mirror(Mirror),
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

    #[inline]
    fn mirrored(wo: Vec3, weight: Rgb, probability: f32) -> Self {
        let direction = Vec3::new(-wo.x, -wo.y, wo.z);
        Self { direction, weight, pdf: probability, delta: true, transmitted: false, eta: 1.0 }
    }
}

/// BSDF for a fixed viewer, with everything precomputed that does not depend on the light.
#[derive(Clone, Copy)]
pub(crate) struct BsdfView<'b> {
    bsdf: &'b Bsdf,
    wo: Vec3,
    /// T(θ_o) of a coat.
    transmittance: Rgb,
    /// True to leave out the coat.
    base_alone: bool,
}

impl BsdfView<'_> {
    /// f(wo, wi) |cos θ_i|, equal to [`Bsdf::evaluate`] to the bit.
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
    /// Samples the direction from which light that leaves towards `wo` (`wo.z` > 0) came; `u` in [0, 1),
    /// `u[2]` chooses the lobe. `None`: absorbed.
    #[inline]
    pub fn sample<F: Features>(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.sample_seen::<F>(self.coat_view::<F>(wo), wo, u)
    }

    /// [`Bsdf::sample`] with a known [`Bsdf::coat_view`].
    #[inline]
    fn sample_seen<F: Features>(&self, view: CoatView, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Diffuse(b) => b.sample([u[0], u[1]]),
            Bsdf::Mirror(b) if F::GLOSSY => b.sample(wo),
            Bsdf::Conductor(b) if F::GLOSSY => b.sample(wo, [u[0], u[1]]),
            Bsdf::Glossy(b) if F::GLOSSY => coated::sample(b, view, wo, u),
            Bsdf::Plastic(b) if F::GLOSSY => coated::sample(b, view, wo, u),
            Bsdf::Dielectric(b) if F::DIELECTRIC => b.sample(wo, u[2]),
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.sample(wo, u),
            _ => None,
        }
    }

    /// f(wo, wi) |cos θ_i|, and the density of [`Bsdf::sample`] at `wi`. Zeros for delta lobes.
    #[inline]
    pub fn evaluate<F: Features>(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if let Bsdf::Glossy(_) | Bsdf::Plastic(_) = self
            && !(wi.z > 0.0)
        {
            return (Rgb::ZERO, 0.0);
        }
        self.evaluate_seen::<F>(self.coat_view::<F>(wo), wo, wi)
    }

    /// [`Bsdf::evaluate`] with a known [`Bsdf::coat_view`].
    #[inline]
    fn evaluate_seen<F: Features>(&self, view: CoatView, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Diffuse(b) => b.evaluate(wi),
            Bsdf::Conductor(b) if F::GLOSSY => b.evaluate(wo, wi),
            Bsdf::Glossy(b) if F::GLOSSY => coated::evaluate(b, view, wo, wi),
            Bsdf::Plastic(b) if F::GLOSSY => coated::evaluate(b, view, wo, wi),
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => b.evaluate(wo, wi),
            _ => (Rgb::ZERO, 0.0),
        }
    }

    /// Part of a coat that depends on the viewer alone.
    #[inline]
    fn coat_view<F: Features>(&self, wo: Vec3) -> CoatView {
        let c = above_horizon(wo).z;
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => CoatView::of(b, c),
            Bsdf::Plastic(b) if F::GLOSSY => CoatView::of(b, c),
            _ => CoatView::default(),
        }
    }

    /// BSDF for the viewer at `wo`, for light from many directions.
    #[inline]
    pub(crate) fn view<F: Features>(&self, wo: Vec3) -> BsdfView<'_> {
        let wo = above_horizon(wo);
        let transmittance = match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::Coat::transmittance(b, wo.z),
            Bsdf::Plastic(b) if F::GLOSSY => coated::Coat::transmittance(b, wo.z),
            _ => Rgb::ONE,
        };
        BsdfView { bsdf: self, wo, transmittance, base_alone: false }
    }

    /// [`Bsdf::view`] without the coat if `base_alone`.
    #[inline]
    pub(crate) fn view_apart<F: Features>(&self, wo: Vec3, base_alone: bool) -> BsdfView<'_> {
        BsdfView { base_alone, ..self.view::<F>(wo) }
    }

    /// [`Bsdf::sample`] of the base or the coat alone. Weight and density are those of the chosen lobe,
    /// including the probability of the choice; the base has the weight `base_weight` in the choice, 1 in
    /// [`Bsdf::sample`], 0 to sample the coat always. The flag is true for the coat.
    #[inline]
    pub(crate) fn sample_apart<F: Features>(
        &self,
        wo: Vec3,
        u: [f32; 3],
        base_weight: f32,
    ) -> Option<(BsdfSample, bool)> {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::sample_apart(b, wo, u, base_weight),
            Bsdf::Plastic(b) if F::GLOSSY => coated::sample_apart(b, wo, u, base_weight),
            _ => None,
        }
    }

    /// [`Bsdf::evaluate`] of the base and of the coat, each alone, with the densities of
    /// [`Bsdf::sample_apart`].
    #[inline]
    pub(crate) fn evaluate_apart<F: Features>(
        &self,
        wo: Vec3,
        wi: Vec3,
        base_weight: f32,
    ) -> [(Rgb, f32); 2] {
        let wo = above_horizon(wo);
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => coated::evaluate_apart(b, wo, wi, base_weight),
            Bsdf::Plastic(b) if F::GLOSSY => coated::evaluate_apart(b, wo, wi, base_weight),
            _ => [(Rgb::ZERO, 0.0); 2],
        }
    }

    /// True for a coat, rough or smooth, whose peak is brighter than a quarter of a white diffuse surface.
    #[inline]
    pub(crate) fn has_narrow_coat(&self) -> bool {
        match self {
            Bsdf::Glossy(b) => coated::is_narrow(b),
            Bsdf::Plastic(b) => coated::is_narrow(b),
            _ => false,
        }
    }

    /// True for a coat that is not smooth.
    #[inline]
    pub(crate) fn has_rough_coat(&self) -> bool {
        match self {
            Bsdf::Glossy(b) => b.alpha() > 0.0,
            Bsdf::Plastic(b) => b.alpha() > 0.0,
            _ => false,
        }
    }

    /// True if every lobe is a delta lobe: light samples contribute nothing.
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

    /// Albedo of the diffuse component; black without one.
    #[inline]
    pub(crate) fn base(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.reflectance,
            Bsdf::Glossy(b) => coated::Coat::base(b),
            Bsdf::Plastic(b) => coated::Coat::base(b),
            _ => Rgb::ZERO,
        }
    }

    /// Directional albedo at normal incidence, an estimate; that of the transmitted light for a dielectric.
    pub(crate) fn normal_albedo(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.reflectance,
            Bsdf::Mirror(b) => b.reflectance,
            Bsdf::Conductor(b) => b.f0,
            Bsdf::Glossy(b) => coated::Coat::normal_albedo(b),
            Bsdf::Plastic(b) => coated::Coat::normal_albedo(b),
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

/// `wo` raised above the horizon by the resolution of f32 directions, so that squares of half-vectors are
/// normal floats.
#[inline]
fn above_horizon(wo: Vec3) -> Vec3 {
    const RESOLUTION: f32 = 1e-7;
    Vec3::new(wo.x, wo.y, wo.z.max(RESOLUTION))
}

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
