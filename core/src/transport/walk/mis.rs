//! Multiple importance sampling (Veach 1997, chapter 9): the heuristics, and the running quantities R and ρ
//! by which camera and light subpaths weigh vertex merging against path tracing (`caustics/merge.rs`).
//!
//! With étendue in place of areas (`light/emission/pdf.rs`) distances cancel. The pdf of a photon near the
//! rough vertex xⱼ over that of a camera path from xⱼ by x₍ⱼ₋₁₎ … x₁ to the light vertex x₀ is
//!
//!   R = N π r² cos θⱼ / p(xⱼ → x₍ⱼ₋₁₎) · Π ρᵢ · p(x₀) p(ω₀) / cos θ₀
//!   ρᵢ = p(x₍ᵢ₋₁₎ → xᵢ → x₍ᵢ₊₁₎) cos θ(x₍ᵢ₋₁₎) / (p(x₍ᵢ₊₁₎ → xᵢ → x₍ᵢ₋₁₎) cos θ(x₍ᵢ₊₁₎))
//!
//! of N light paths and kernels of radius r. At a mirror ρ = 1; where light is refracted, ρ is the squared
//! ratio of the indices of refraction. Both subpaths know all of it when they meet: no vertex needs to be
//! traced back.

use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::light::LightSampler;
use crate::scene::SurfacePoint;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;

/// Weight of a sample of pdf `own` beside a technique of pdf `other`: the power heuristic (Veach and Guibas
/// 1995, section 4.1). Any two numbers, not both zero.
#[inline]
pub(in crate::transport) fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// The same for light of the environment. The visible environment is known by place, not by point: its pdf is
/// less certain than it seems, and the square would trust it too much.
#[inline]
pub(in crate::transport) fn environment_heuristic(lights: &LightSampler, own: f32, other: f32) -> f32 {
    if lights.has_visibility() { 1.0 / (1.0 + other / own) } else { power_heuristic(own, other) }
}

/// The `weight` of a contribution among the techniques of path tracing, once more beside vertex merging,
/// whose pdf is `ratio` times that of path tracing.
#[inline]
pub(in crate::transport) fn weight_beside_merging(weight: f32, ratio: f32) -> f32 {
    weight / (1.0 + weight * ratio * ratio)
}

/// Weight of a photon, `ratio` being the pdf of path tracing over that of vertex merging.
#[inline]
pub(in crate::transport) fn merging_weight(ratio: f32) -> f32 {
    1.0 / (1.0 + ratio * ratio)
}

/// A vertex of a chain of specular surfaces: light comes from `far`, the side of the light, and leaves to
/// `near`, the side of the camera.
pub(in crate::transport) struct ChainLink<'p> {
    pub(in crate::transport) point: &'p SurfacePoint<'p>,
    /// As seen from one of the two sides.
    pub(in crate::transport) bsdf: &'p Bsdf,
    /// The side from which the BSDF is seen; local, as `far`.
    pub(in crate::transport) near: Vec3,
    pub(in crate::transport) far: Vec3,
    /// Whether the coat alone scatters.
    pub(in crate::transport) coat_alone: bool,
}

impl ChainLink<'_> {
    /// The pdf of scattering from `far` to `near`, times the ratio of the cosines of `far` and of `near`.
    /// Over the pdf of the other direction it is ρ.
    pub(in crate::transport) fn reverse<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        self.pdf(context) * (self.far.z / self.near.z).abs()
    }

    /// The pdf of scattering from `far` to `near`.
    pub(in crate::transport) fn pdf<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        let Self { point, bsdf, near, far, coat_alone } = *self;
        if F::GLOSSY && coat_alone {
            return bsdf.evaluate_apart::<F>(far, near)[1].1;
        }
        if far.z > 0.0 {
            return bsdf.evaluate::<F>(far, near).1;
        }
        let turned = |way: Vec3| Vec3::new(way.x, way.y, -way.z);
        let behind = Bsdf::at::<F>(context.scene, point.material, point.uv, !point.front);
        behind.evaluate::<F>(turned(far), turned(near)).1
    }
}

/// R of a camera path behind a specular vertex, which it left by `sample`: R so far times ρ.
#[inline]
pub(in crate::transport) fn ratio_behind<F: Features>(
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
