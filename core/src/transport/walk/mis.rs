//! Multiple importance sampling (Veach 1997, chapter 9): heuristics, and the running quantities R and ρ by
//! which camera and light subpaths weight vertex merging against path tracing (`caustics/merge.rs`).
//!
//! Étendue in place of area (`light/emission/pdf.rs`) cancels the distances. R is the pdf of a photon near
//! the rough vertex xⱼ over the pdf of a camera path from xⱼ by x₍ⱼ₋₁₎ … x₁ to the light vertex x₀:
//!
//!   R = N π r² cos θⱼ / p(xⱼ → x₍ⱼ₋₁₎) · Π ρᵢ · p(x₀) p(ω₀) / cos θ₀
//!   ρᵢ = p(x₍ᵢ₋₁₎ → xᵢ → x₍ᵢ₊₁₎) cos θ(x₍ᵢ₋₁₎) / (p(x₍ᵢ₊₁₎ → xᵢ → x₍ᵢ₋₁₎) cos θ(x₍ᵢ₊₁₎))
//!
//! Here N is the number of light paths and r the kernel radius. ρ = 1 at a mirror; at a refraction ρ is the
//! squared ratio of the indices of refraction. Both subpaths know all factors when they meet, so that no
//! vertex is traced back.

use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::light::LightSampler;
use crate::scene::SurfacePoint;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::vertex::Scatterer;
use glam::Vec3;

/// Power heuristic (Veach and Guibas 1995, section 4.1): weight of a sample of pdf `own` beside a technique
/// of pdf `other`. One of the two may be zero.
#[inline]
pub(crate) fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// Weight of a sample of the environment. With environment visibility the balance heuristic: visibility is
/// learned per place, not per point, so the pdf is uncertain and its square would trust it too much.
#[inline]
pub(crate) fn environment_heuristic(lights: &LightSampler, own: f32, other: f32) -> f32 {
    if lights.has_visibility() { 1.0 / (1.0 + other / own) } else { power_heuristic(own, other) }
}

/// Weight of a contribution of path tracing that vertex merging can sample as well: `weight` is its weight
/// among the techniques of path tracing, `ratio` the pdf of merging over the pdf of path tracing.
#[inline]
pub(crate) fn weight_beside_merging(weight: f32, ratio: f32) -> f32 {
    weight / (1.0 + weight * ratio * ratio)
}

/// Weight of a photon; `ratio` is the pdf of path tracing over the pdf of vertex merging.
#[inline]
pub(crate) fn merging_weight(ratio: f32) -> f32 {
    1.0 / (1.0 + ratio * ratio)
}

/// Vertex of a specular chain: light arrives from `far`, towards the light, and leaves to `near`, towards the
/// camera.
pub(crate) struct ChainLink<'p> {
    pub(crate) point: &'p SurfacePoint<'p>,
    /// BSDF seen from the side of `near`.
    pub(crate) bsdf: &'p Bsdf,
    /// Local direction on the side of the BSDF.
    pub(crate) near: Vec3,
    pub(crate) far: Vec3,
    /// True if only the coat scatters.
    pub(crate) coat_alone: bool,
}

impl ChainLink<'_> {
    /// Pdf of scattering from `far` to `near`, times cos(far) / cos(near). Divided by the pdf of the other
    /// direction it is ρ.
    pub(crate) fn reverse<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        self.pdf(context) * (self.far.z / self.near.z).abs()
    }

    /// Pdf of scattering from `far` to `near`.
    pub(crate) fn pdf<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        let Self { point, bsdf, near, far, coat_alone } = *self;
        if F::GLOSSY && coat_alone {
            return bsdf.evaluate_apart::<F>(far, near, 1.0)[1].1;
        }
        Scatterer { point, bsdf }.reverse_pdf(context, near, far)
    }
}

/// R of a camera path behind a specular vertex that it left by `sample`: R so far times ρ.
#[inline]
pub(crate) fn ratio_behind<F: Features>(
    ratio: f32,
    link: &ChainLink,
    sample: &BsdfSample,
    context: &SceneContext<F>,
) -> f32 {
    if sample.delta {
        return ratio / (sample.eta * sample.eta);
    }
    ratio * link.reverse(context) / sample.pdf
}
