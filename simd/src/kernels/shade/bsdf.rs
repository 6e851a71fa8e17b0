//! BSDFs at the vertices of a block, over lanes.

use super::fresnel::schlick;
use super::ggx::Ggx;
use super::surface::SurfaceBlock;
use super::vector::{self, add, scale};
use super::{Row, Row3, load3, load33, warp};
use crate::lanes::{Lanes, Simd, dot};
use core::f32::consts::FRAC_1_PI;

/// Least height of a viewer above the horizon: squares of half-vectors are normal floats.
const RESOLUTION: f32 = 1e-7;

/// BSDFs of a block.
#[derive(Clone, Debug)]
pub struct BsdfBlock {
    /// Reflectances of diffuse surfaces, reflectances of metals at normal incidence.
    pub reflectance: Row3,
    /// GGX alpha of metals.
    pub alpha: Row,
    /// Bit `i`: surface `i` is diffuse.
    pub diffuse: u32,
    /// Bit `i`: surface `i` is a rough metal.
    pub metal: u32,
}

impl BsdfBlock {
    /// Zeros.
    pub const EMPTY: Self = Self { reflectance: [[0.0; 16]; 3], alpha: [0.0; 16], diffuse: 0, metal: 0 };
}

/// Vertex over lanes.
pub(super) struct VertexLanes<L: Lanes> {
    pub(super) position: [L; 3],
    pub(super) error: L,
    pub(super) geometric_normal: [L; 3],
    pub(super) frame: [[L; 3]; 3],
    pub(super) wo: [L; 3],
    pub(super) throughput: [L; 3],
    pub(super) reflectance: [L; 3],
    pub(super) alpha: L,
    pub(super) diffuse: L::Mask,
    pub(super) metal: L::Mask,
}

impl<L: Lanes> VertexLanes<L> {
    /// Position, offset from the surface to the side of `direction`.
    #[inline(always)]
    pub(super) fn origin(&self, direction: [L; 3]) -> [L; 3] {
        let step = self.error.copysign(dot(direction, self.geometric_normal));
        add(self.position, scale(self.geometric_normal, step))
    }

    /// Direction to the viewer, raised above the horizon.
    #[inline(always)]
    pub(super) fn viewer(&self) -> [L; 3] {
        viewer(self.wo)
    }

    /// True where both normals have the direction on the same side.
    #[inline(always)]
    pub(super) fn sides_agree(&self, local_z: L, world: [L; 3]) -> L::Mask {
        local_z.all(0.0).lt(local_z * dot(world, self.geometric_normal))
    }
}

/// Samples of BSDFs over lanes.
#[derive(Clone, Copy)]
pub struct SampleLanes<L: Lanes> {
    /// Local unit directions.
    pub direction: [L; 3],
    /// f |cos| / pdf.
    pub weight: [L; 3],
    /// Densities in solid angle; probabilities of the choices of delta lobes.
    pub pdf: L,
    /// Indices of refraction on the side of the directions over those of the viewer.
    pub eta: L,
    /// Lanes with a sample.
    pub exists: L::Mask,
    /// Those of delta lobes.
    pub delta: L::Mask,
}

impl<L: Lanes> SampleLanes<L> {
    /// Mirrored directions of delta lobes, chosen with the `probability`.
    #[inline(always)]
    pub fn mirrored([x, y, z]: [L; 3], weight: [L; 3], probability: L) -> Self {
        let one = z.all(1.0);
        let always = one.eq(one);
        Self { direction: [-x, -y, z], weight, pdf: probability, eta: one, exists: always, delta: always }
    }

    /// `self` in lanes where `mask` is set, `other` elsewhere.
    #[inline(always)]
    pub(super) fn select(self, mask: L::Mask, other: Self) -> Self {
        Self {
            direction: vector::select(mask, self.direction, other.direction),
            weight: vector::select(mask, self.weight, other.weight),
            pdf: self.pdf.select(mask, other.pdf),
            eta: self.eta.select(mask, other.eta),
            exists: mask & self.exists | !mask & other.exists,
            delta: mask & self.delta | !mask & other.delta,
        }
    }
}

/// Local direction to a viewer, raised above the horizon.
#[inline(always)]
pub fn viewer<L: Lanes>([x, y, z]: [L; 3]) -> [L; 3] {
    [x, y, z.max(z.all(RESOLUTION))]
}

/// f |cos| and density of a diffuse surface.
#[inline(always)]
pub fn diffuse<L: Lanes>(reflectance: [L; 3], [.., z]: [L; 3]) -> ([L; 3], L) {
    let lambert = z.max(z.all(0.0)) * z.all(FRAC_1_PI);
    (scale(reflectance, lambert), lambert)
}

/// Samples a diffuse surface.
#[inline(always)]
pub fn sample_diffuse<L: Lanes>(reflectance: [L; 3], u: [L; 2]) -> SampleLanes<L> {
    let direction = warp::cosine_hemisphere(u);
    let (zero, one, pdf) = (u[0].all(0.0), u[0].all(1.0), direction[2] * u[0].all(FRAC_1_PI));
    let exists = zero.lt(direction[2]);
    SampleLanes { direction, weight: reflectance, pdf, eta: one, exists, delta: one.lt(zero) }
}

/// f |cos| and density of a rough metal.
#[inline(always)]
pub fn metal<L: Lanes>(f0: [L; 3], alpha: L, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
    let zero = alpha.all(0.0);
    let ggx = Ggx::new(alpha);
    let h = add(wo, wi);
    let reflectance = schlick(f0, dot(wo, h) / vector::length(h));
    let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi[2];
    let is_above = zero.lt(wi[2]);
    (
        vector::select(is_above, scale(reflectance, lobe), [zero; 3]),
        ggx.reflection_density(wo, h).select(is_above, zero),
    )
}

/// Samples a rough metal.
#[inline(always)]
pub fn sample_metal<L: Lanes>(f0: [L; 3], alpha: L, wo: [L; 3], u: [L; 2]) -> SampleLanes<L> {
    let (zero, one, ggx) = (alpha.all(0.0), alpha.all(1.0), Ggx::new(alpha));
    let direction = ggx.sample_reflection(wo, u);
    let h = add(wo, direction);
    let reflectance = schlick(f0, dot(wo, h) / vector::length(h));
    let weight = scale(reflectance, ggx.reflection_weight(wo, direction));
    let (pdf, exists) = (ggx.reflection_density(wo, h), zero.lt(direction[2]));
    SampleLanes { direction, weight, pdf, eta: one, exists, delta: one.lt(zero) }
}

/// Vertices of a block over lanes.
#[inline(always)]
pub(super) fn vertices<S: Simd>(
    simd: S,
    surface: &SurfaceBlock,
    bsdf: &BsdfBlock,
    throughput: &Row3,
) -> VertexLanes<S::F16> {
    VertexLanes {
        position: load3(simd, &surface.position),
        error: simd.load16(&surface.error),
        geometric_normal: load3(simd, &surface.geometric_normal),
        frame: load33(simd, &surface.frame),
        wo: load3(simd, &surface.wo),
        throughput: load3(simd, throughput),
        reflectance: load3(simd, &bsdf.reflectance),
        alpha: simd.load16(&bsdf.alpha),
        diffuse: simd.mask16(bsdf.diffuse),
        metal: simd.mask16(bsdf.metal),
    }
}

/// Local directions to the viewers of a block, and along `direction`, over lanes.
#[inline(always)]
pub(super) fn local<S: Simd>(simd: S, surface: &SurfaceBlock, direction: &Row3) -> [[S::F16; 3]; 2] {
    let wi = to_local(load33(simd, &surface.frame), load3(simd, direction));
    [viewer(load3(simd, &surface.wo)), wi]
}

/// Local direction of `direction` in the frame of `axes`.
#[inline(always)]
pub(super) fn to_local<L: Lanes>([tangent, bitangent, normal]: [[L; 3]; 3], direction: [L; 3]) -> [L; 3] {
    [dot(direction, tangent), dot(direction, bitangent), dot(direction, normal)]
}
