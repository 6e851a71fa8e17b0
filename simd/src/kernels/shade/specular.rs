//! Sampling of smooth surfaces at the vertices of a block, over lanes: mirrors, smooth metals, and smooth
//! dielectrics with Fresnel reflection and refraction by Snell's law.

use super::bsdf::{SampleLanes, viewer};
use super::fresnel::{dielectric, reflection_probability, refract, schlick};
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, negate, scale};
use super::{Row, Row3, load3};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Smooth surfaces of a block.
#[derive(Clone, Debug)]
pub struct SpecularBlock {
    /// Reflectances of mirrors, of metals at normal incidence; tints of dielectrics.
    pub color: Row3,
    /// Indices of refraction of dielectrics on the far side over that of the viewer's side.
    pub eta: Row,
    /// Bit `i`: surface `i` is smooth.
    pub exists: u32,
    /// Bit `i`: it is a metal.
    pub metal: u32,
    /// Bit `i`: it is a dielectric. Others are mirrors.
    pub dielectric: u32,
}

impl SpecularBlock {
    /// No surfaces.
    pub const EMPTY: Self =
        Self { color: [[0.0; 16]; 3], eta: [1.0; 16], exists: 0, metal: 0, dielectric: 0 };
}

/// Sampling of the smooth surfaces of a block.
#[derive(Debug)]
pub struct SpecularSamples<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their surfaces.
    pub specular: &'b SpecularBlock,
    /// Numbers that choose between reflection and refraction.
    pub lobe: &'b Row,
}

/// Samples reflection or refraction of a smooth dielectric.
#[inline(always)]
pub fn sample_dielectric<L: Lanes>(tint: [L; 3], eta: L, wo: [L; 3], lobe: L) -> SampleLanes<L> {
    let (zero, one, c) = (lobe.all(0.0), lobe.all(1.0), wo[2]);
    let reflectance = dielectric(c, eta);
    let p = reflection_probability(reflectance, tint);
    let reflects = lobe.lt(p);
    let mut sample = SampleLanes::mirrored(wo, [reflectance / p; 3], p);
    if (!reflects).any() {
        let weight = scale(tint, (one - reflectance) / ((one - p) * eta * eta));
        let bent = refract(wo, [zero, zero, one], c, eta);
        let direction = vector::select(eta.eq(one), negate(wo), bent);
        let (exists, delta) = (p.lt(one), sample.delta);
        let refracted = SampleLanes { direction, weight, pdf: one - p, eta, exists, delta };
        sample = sample.select(reflects, refracted);
    }
    sample
}

impl SpecularSamples<'_> {
    /// Samples by the instructions of `level`, into the lanes of smooth surfaces. Returns the set of samples.
    pub fn compute(&self, level: Level, out: &mut ScatterBlock) -> u32 {
        level.dispatch((self, out))
    }
}

impl Kernel for (&SpecularSamples<'_>, &mut ScatterBlock) {
    type Out = u32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        let (SpecularSamples { surface, specular, lobe }, out) = self;
        let (wo, color) = (viewer(load3(simd, &surface.wo)), load3(simd, &specular.color));
        let weight = vector::select(simd.mask16(specular.metal), schlick(color, wo[2]), color);
        let mut sample = SampleLanes::mirrored(wo, weight, simd.splat16(1.0));
        let dielectric = simd.mask16(specular.dielectric);
        if dielectric.any() {
            let glass = sample_dielectric(color, simd.load16(&specular.eta), wo, simd.load16(lobe));
            sample = glass.select(dielectric, sample);
        }
        let is = simd.mask16(specular.exists);
        out.set(simd, is, &sample);
        (sample.exists & is).bits()
    }
}
