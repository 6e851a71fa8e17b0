//! Block of sixteen vertices in structures of arrays: inputs and results of the shading kernels.

use crate::Rgb;
use crate::bsdf::{Bsdf, CoatView, Diffuse};
use crate::geometry::Frame;
use crate::light::LightSample;
use crate::scene::{Material, SurfacePoint};
use crate::transport::wavefront::BLOCK;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::bsdf::BsdfBlock;
use halflight_simd::kernels::shade::direct::{LightBlock, ShadowBlock};
use halflight_simd::kernels::shade::emitter::EmitterBlock;
use halflight_simd::kernels::shade::numbers::{SampleBlock, VertexNumbers};
use halflight_simd::kernels::shade::scatter::{NextBlock, ScatterBlock};
use halflight_simd::kernels::shade::surface::SurfaceBlock;
use halflight_simd::kernels::shade::{Row, Row3, at, put};

/// Inputs and results of the kernels, and parts of the vertices that only loops use. Rows of vertices that a
/// stage does not use keep old values.
pub(super) struct Block<'a> {
    pub(super) corners: [Row3; 3],
    pub(super) normals: [Row3; 3],
    pub(super) weights: [Row; 2],
    pub(super) surface: SurfaceBlock,
    pub(super) bsdf: BsdfBlock,
    pub(super) samples: SampleBlock,
    pub(super) numbers: VertexNumbers,
    pub(super) emitters: EmitterBlock,
    pub(super) probability: Row,
    pub(super) light: LightBlock,
    pub(super) value: Row3,
    pub(super) pdf: Row,
    pub(super) given: ScatterBlock,
    pub(super) shadows: ShadowBlock,
    pub(super) next: NextBlock,
    pub(super) throughput: Row3,
    /// Factors from the light of the paths to that of their pixels.
    pub(super) factor: Row3,
    pub(super) eta_squared: Row,
    pub(super) most: Row,
    /// Numbers of light samples, and one over them.
    pub(super) light_samples: [u32; BLOCK],
    pub(super) each: Row,
    /// Normals for light sampling; zero if the surface transmits.
    pub(super) side: Row3,
    pub(super) path: [u32; BLOCK],
    pub(super) segments: [u32; BLOCK],
    pub(super) triangle: [u32; BLOCK],
    pub(super) material: [&'a Material; BLOCK],
    pub(super) uv: [Vec2; BLOCK],
    /// BSDFs that lanes do not evaluate.
    pub(super) others: [Bsdf; BLOCK],
    /// Their coats for the viewers.
    pub(super) coats: [CoatView; BLOCK],
    /// First triangles of the sampled area lights.
    pub(super) lamp: [u32; BLOCK],
    /// True if the only light is in `emitters`, at every vertex.
    pub(super) is_lone: bool,
}

/// Vertices of a block by the stages that they pass.
#[derive(Clone, Copy, Default)]
pub(super) struct Stages {
    /// Those that scatter in lanes.
    pub(super) met: u32,
    /// Those among `met` that take light samples.
    pub(super) lit: u32,
    /// Those among `met` whose paths go on.
    pub(super) onward: u32,
    /// Those that are shaded one by one.
    pub(super) single: u32,
}

/// Set of vertices of a block.
#[derive(Clone, Copy)]
pub(super) struct Set(pub(super) u32);

impl Iterator for Set {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let i = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (i < BLOCK).then_some(i)
    }
}

impl Set {
    /// Vertices whose number in `row` has the property `is`.
    #[inline(always)]
    pub(super) fn of(row: &[u32; BLOCK], is: impl Fn(u32) -> bool) -> u32 {
        let mut set = 0;
        for (i, value) in row.iter().enumerate() {
            set |= u32::from(is(*value)) << i;
        }
        set
    }
}

static GREY: Material = Material::GREY;

impl<'a> Block<'a> {
    /// Without vertices.
    pub(super) fn new() -> Self {
        Self {
            corners: [[[0.0; BLOCK]; 3]; 3],
            normals: [[[0.0; BLOCK]; 3]; 3],
            weights: [[0.0; BLOCK]; 2],
            surface: SurfaceBlock::EMPTY,
            bsdf: BsdfBlock::EMPTY,
            samples: SampleBlock::EMPTY,
            numbers: VertexNumbers::EMPTY,
            emitters: EmitterBlock::EMPTY,
            probability: [0.0; BLOCK],
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
            triangle: [0; BLOCK],
            material: [&GREY; BLOCK],
            uv: [Vec2::ZERO; BLOCK],
            others: [Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }); BLOCK],
            coats: [CoatView::default(); BLOCK],
            lamp: [0; BLOCK],
            is_lone: false,
        }
    }

    /// Stores a surface point computed without lanes.
    pub(super) fn put_point(&mut self, i: usize, point: &SurfacePoint, direction: Vec3) {
        let surface = &mut self.surface;
        put(&mut surface.position, i, point.position.to_array());
        surface.error[i & 15] = point.error;
        put(&mut surface.geometric_normal, i, point.geometric_normal.to_array());
        let Frame { tangent, bitangent, normal } = point.frame;
        for (rows, axis) in surface.frame.iter_mut().zip([tangent, bitangent, normal]) {
            put(rows, i, axis.to_array());
        }
        put(&mut surface.wo, i, point.frame.to_local(-direction).to_array());
        surface.front = surface.front & !(1 << i) | u32::from(point.front) << i;
    }

    /// Surface point of vertex `i`.
    #[inline]
    pub(super) fn point(&self, i: usize) -> SurfacePoint<'a> {
        let i = i & 15;
        let Self { surface, .. } = self;
        let [tangent, bitangent, normal] = &surface.frame;
        SurfacePoint {
            position: at(&surface.position, i).into(),
            error: surface.error[i & 15],
            geometric_normal: at(&surface.geometric_normal, i).into(),
            frame: Frame {
                tangent: at(tangent, i).into(),
                bitangent: at(bitangent, i).into(),
                normal: at(normal, i).into(),
            },
            uv: self.uv[i],
            front: surface.front >> i & 1 == 1,
            material: self.material[i],
            triangle: self.triangle[i],
        }
    }
}

/// Stores a light sample of the vertex `i` at `position`; `balance`: weighted by the balance heuristic.
pub(super) fn put_light(
    light: &mut LightBlock,
    i: usize,
    sample: &LightSample,
    position: Vec3,
    balance: bool,
) {
    let LightSample { direction, distance, target, radiance, pdf, delta, .. } = *sample;
    put(&mut light.direction, i, direction.to_array());
    put(&mut light.radiance, i, radiance.to_array());
    light.pdf[i & 15] = pdf;
    let end = match target {
        // Offset from the light's surface, to the side of the vertex.
        Some(target) => Some(target.position + target.error * target.normal),
        None if distance < f32::INFINITY => Some(position + distance * direction),
        None => None,
    };
    put(&mut light.end, i, end.unwrap_or(position).to_array());
    light.exists |= 1 << i;
    light.bounded |= u32::from(end.is_some()) << i;
    light.area |= u32::from(target.is_some()) << i;
    light.alone |= u32::from(delta) << i;
    light.balance |= u32::from(balance) << i;
}
