//! Block of sixteen vertices of subpaths in structures of arrays: inputs and results of the shading kernels.

use crate::Rgb;
use crate::bsdf::{Bsdf, Diffuse};
use crate::transport::walk::points::PointBlock;
use halflight_simd::kernels::shade::bsdf::BsdfBlock;
use halflight_simd::kernels::shade::coat::CoatBlock;
use halflight_simd::kernels::shade::coat_apart::ApartBlock;
use halflight_simd::kernels::shade::direct::{LightBlock, ShadowBlock};
use halflight_simd::kernels::shade::emitter::EmitterBlock;
use halflight_simd::kernels::shade::numbers::{SampleBlock, VertexNumbers};
use halflight_simd::kernels::shade::rough::RoughBlock;
use halflight_simd::kernels::shade::scatter::{NextBlock, ScatterBlock};
use halflight_simd::kernels::shade::sky::SkyBlock;
use halflight_simd::kernels::shade::specular::SpecularBlock;
use halflight_simd::kernels::shade::{BLOCK, Row, Row3};

/// Inputs and results of the kernels, and parts of the vertices that only loops use. Rows of vertices that a
/// stage does not use keep old values.
pub(crate) struct Block<'a> {
    pub(crate) points: PointBlock<'a>,
    pub(crate) bsdf: BsdfBlock,
    pub(crate) coats: CoatBlock,
    pub(crate) apart: ApartBlock,
    /// Set of coats apart from bases that take no light sample.
    pub(crate) supplied: u32,
    pub(crate) specular: SpecularBlock,
    pub(crate) rough: RoughBlock,
    /// Set of coats without a base and without a rough lobe.
    pub(crate) smooth_coats: u32,
    pub(crate) samples: SampleBlock,
    pub(crate) numbers: VertexNumbers,
    pub(crate) emitters: EmitterBlock,
    pub(crate) probability: Row,
    pub(crate) sky: SkyBlock,
    pub(crate) light: LightBlock,
    pub(crate) value: Row3,
    pub(crate) pdf: Row,
    pub(crate) given: ScatterBlock,
    pub(crate) shadows: ShadowBlock,
    pub(crate) next: NextBlock,
    pub(crate) throughput: Row3,
    /// Factors from the light of the paths to that of their pixels.
    pub(crate) factor: Row3,
    pub(crate) eta_squared: Row,
    pub(crate) most: Row,
    /// Numbers of light samples, and one over them.
    pub(crate) light_samples: [u32; BLOCK],
    pub(crate) each: Row,
    /// Normals for light sampling; zero if the surface transmits.
    pub(crate) side: Row3,
    pub(crate) path: [u32; BLOCK],
    pub(crate) segments: [u32; BLOCK],
    /// BSDFs that lanes do not sample, and coats; all BSDFs on subpaths of bidirectional methods.
    pub(crate) others: [Bsdf; BLOCK],
    /// First triangles of the sampled area lights.
    pub(crate) lamp: [u32; BLOCK],
    /// Numbers of the sampled lights, in the order of emission, and distances to those at finite places.
    pub(crate) sampled: [u32; BLOCK],
    pub(crate) distance: Row,
    /// Set of light samples whose radiance is still to be multiplied by that of the environment.
    pub(crate) environment: u32,
    /// True if the only light is in `emitters`, at every vertex.
    pub(crate) is_lone: bool,
}

/// Vertices of a block by the stages that they pass.
#[derive(Clone, Copy, Default)]
pub(crate) struct Stages {
    /// Those that scatter in lanes.
    pub(crate) met: u32,
    /// Those among `met` that take light samples.
    pub(crate) lit: u32,
    /// Those among `met` whose paths go on.
    pub(crate) onward: u32,
    /// Those that are shaded one by one.
    pub(crate) single: u32,
}

impl<'a> Block<'a> {
    /// Without vertices.
    pub(crate) fn new() -> Self {
        Self {
            points: PointBlock::new(),
            bsdf: BsdfBlock::EMPTY,
            coats: CoatBlock::EMPTY,
            apart: ApartBlock::EMPTY,
            supplied: 0,
            specular: SpecularBlock::EMPTY,
            rough: RoughBlock::EMPTY,
            smooth_coats: 0,
            samples: SampleBlock::EMPTY,
            numbers: VertexNumbers::EMPTY,
            emitters: EmitterBlock::EMPTY,
            probability: [0.0; BLOCK],
            sky: SkyBlock::EMPTY,
            light: LightBlock::EMPTY,
            value: [[0.0; BLOCK]; 3],
            pdf: [0.0; BLOCK],
            given: ScatterBlock::EMPTY,
            shadows: ShadowBlock::EMPTY,
            next: NextBlock::EMPTY,
            throughput: [[0.0; BLOCK]; 3],
            factor: [[1.0; BLOCK]; 3],
            eta_squared: [0.0; BLOCK],
            most: [1.0; BLOCK],
            light_samples: [1; BLOCK],
            each: [1.0; BLOCK],
            side: [[0.0; BLOCK]; 3],
            path: [0; BLOCK],
            segments: [1; BLOCK],
            others: [Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }); BLOCK],
            lamp: [0; BLOCK],
            sampled: [0; BLOCK],
            distance: [0.0; BLOCK],
            environment: 0,
            is_lone: false,
        }
    }

    /// Set of the vertices whose BSDFs lanes sample.
    #[inline]
    pub(crate) fn in_lanes(&self) -> u32 {
        self.bsdf.diffuse | self.bsdf.metal | self.coats.exists | self.specular.exists | self.rough.exists
    }

    /// Set that has the vertices that are neither diffuse nor rough metals.
    #[inline]
    pub(crate) fn has_others(&self) -> u32 {
        !(self.bsdf.diffuse | self.bsdf.metal)
    }
}
