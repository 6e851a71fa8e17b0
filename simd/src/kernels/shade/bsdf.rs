//! BSDFs at the vertices of a block, over lanes.

use super::fresnel::schlick;
use super::ggx::Ggx;
use super::load::Load;
use super::surface::SurfaceBlock;
use super::vector::{self, add, scale};
use super::{Row, Row3};
use crate::lanes::{Lanes, dot};

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

/// Local direction to a viewer, raised above the horizon.
#[inline(always)]
pub(super) fn viewer<L: Lanes>([x, y, z]: [L; 3]) -> [L; 3] {
    [x, y, z.max(z.all(RESOLUTION))]
}

/// f |cos| and density of a rough metal.
#[inline(always)]
pub(super) fn metal<L: Lanes>(f0: [L; 3], alpha: L, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
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

/// Vertices of a block over lanes.
#[inline(always)]
pub(super) fn vertices<F: Load>(
    from: F,
    surface: &SurfaceBlock,
    bsdf: &BsdfBlock,
    throughput: &Row3,
) -> VertexLanes<F::Lanes> {
    VertexLanes {
        position: from.row3(&surface.position),
        error: from.row(&surface.error),
        geometric_normal: from.row3(&surface.geometric_normal),
        frame: frame(from, surface),
        wo: from.row3(&surface.wo),
        throughput: from.row3(throughput),
        reflectance: from.row3(&bsdf.reflectance),
        alpha: from.row(&bsdf.alpha),
        diffuse: from.set(bsdf.diffuse),
        metal: from.set(bsdf.metal),
    }
}

/// Shading frames of a block over lanes.
#[inline(always)]
pub(super) fn frame<F: Load>(from: F, surface: &SurfaceBlock) -> [[F::Lanes; 3]; 3] {
    let [tangent, bitangent, normal] = &surface.frame;
    [from.row3(tangent), from.row3(bitangent), from.row3(normal)]
}

/// Local direction of `direction` in the frame of `axes`.
#[inline(always)]
pub(super) fn to_local<L: Lanes>([tangent, bitangent, normal]: [[L; 3]; 3], direction: [L; 3]) -> [L; 3] {
    [dot(direction, tangent), dot(direction, bitangent), dot(direction, normal)]
}
