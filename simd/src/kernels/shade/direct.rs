//! Next-event estimation at the vertices of a block (Veach 1997, chapter 9): shadow rays of light samples
//! with their contributions, weighted against BSDF sampling.
//!
//! Values of BSDFs without lanes come from the caller.

use super::bsdf::{BsdfBlock, VertexLanes, diffuse, metal, to_local, vertices};
use super::surface::SurfaceBlock;
use super::vector::{self, mul, scale, sub};
use super::{Row, Row3, load3};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};

/// Largest `t` of a ray whose direction has its length: just below 1, the `t` of its target.
pub const BOUNDED: f32 = 1.0 - f32::EPSILON;

/// Light samples of a block.
#[derive(Clone, Debug)]
pub struct LightBlock {
    /// Unit directions to the lights.
    pub direction: Row3,
    /// Ends of the shadow rays, if `bounded`.
    pub end: Row3,
    /// Densities in solid angle; probabilities of delta lights.
    pub pdf: Row,
    /// Unoccluded radiances.
    pub radiance: Row3,
    /// Bit `i`: there is a sample.
    pub exists: u32,
    /// Bit `i`: the light is at a finite distance.
    pub bounded: u32,
    /// Bit `i`: the light has a surface, which may be behind the vertex by rounding.
    pub area: u32,
    /// Bit `i`: BSDF sampling does not find this light, so that the sample has the whole weight.
    pub alone: u32,
    /// Bit `i`: weighted by the balance heuristic in place of the power heuristic.
    pub balance: u32,
}

impl LightBlock {
    /// No sample.
    pub const EMPTY: Self = Self {
        direction: [[0.0; 16]; 3],
        end: [[0.0; 16]; 3],
        pdf: [0.0; 16],
        radiance: [[0.0; 16]; 3],
        exists: 0,
        bounded: 0,
        area: 0,
        alone: 0,
        balance: 0,
    };
}

/// Next-event estimation of a block.
#[derive(Debug)]
pub struct Direct<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their BSDFs.
    pub bsdf: &'b BsdfBlock,
    /// Light samples.
    pub light: &'b LightBlock,
    /// f |cos| at the sampled directions, for surfaces that are neither diffuse nor rough metals.
    pub value: &'b Row3,
    /// Densities of BSDF sampling there.
    pub pdf: &'b Row,
    /// Shares of the samples, one over the number of light samples of the vertices.
    pub each: &'b Row,
    /// Throughputs of the paths.
    pub throughput: &'b Row3,
}

/// Shadow rays of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowBlock {
    /// Rays: origin, end, direction, zero. The direction has the length of the ray if the light is bounded.
    pub rays: [[f32; 8]; 16],
    /// Unoccluded contributions to the pixels, and zero; f |cos| and densities by [`Direct::reach`].
    pub contribution: [[f32; 4]; 16],
    /// Bit `i`: there is a ray.
    pub exists: u32,
}

impl ShadowBlock {
    /// No ray.
    pub const EMPTY: Self = Self { rays: [[0.0; 8]; 16], contribution: [[0.0; 4]; 16], exists: 0 };
}

/// Light samples over lanes.
pub(super) struct LightLanes<L: Lanes> {
    pub(super) direction: [L; 3],
    end: [L; 3],
    pub(super) pdf: L,
    pub(super) radiance: [L; 3],
    exists: L::Mask,
    bounded: L::Mask,
    area: L::Mask,
    alone: L::Mask,
    balance: L::Mask,
}

impl<L: Lanes> LightLanes<L> {
    /// Light samples of a block.
    #[inline(always)]
    pub(super) fn of<S: Simd<F16 = L>>(simd: S, light: &LightBlock) -> Self {
        Self {
            direction: load3(simd, &light.direction),
            end: load3(simd, &light.end),
            pdf: simd.load16(&light.pdf),
            radiance: load3(simd, &light.radiance),
            exists: simd.mask16(light.exists),
            bounded: simd.mask16(light.bounded),
            area: simd.mask16(light.area),
            alone: simd.mask16(light.alone),
            balance: simd.mask16(light.balance),
        }
    }

    /// Weights against BSDF sampling of `density`, times the shares `each` of the samples.
    #[inline(always)]
    pub(super) fn weight(&self, each: L, density: L) -> L {
        let one = density.all(1.0);
        let ratio = each * density / self.pdf;
        let weight = each * (one / (one + ratio.select(self.balance, ratio * ratio)));
        each.select(self.alone, weight)
    }
}

/// Shadow rays over lanes.
struct ShadowLanes<L: Lanes> {
    origin: [L; 3],
    end: L,
    direction: [L; 3],
    contribution: [L; 3],
    exists: L::Mask,
}

/// Shadow rays over lanes, with f |cos| in place of the contributions, and the densities of BSDF sampling;
/// `given` are both of other surfaces.
#[inline(always)]
fn reach<L: Lanes>(
    vertex: &VertexLanes<L>,
    light: &LightLanes<L>,
    given: ([L; 3], L),
) -> (ShadowLanes<L>, L) {
    let (zero, (value, density)) = (given.1.all(0.0), given);
    let direction = light.direction;
    let wi = to_local(vertex.frame, direction);
    let (f, pdf) = diffuse(vertex.reflectance, wi);
    let mut value = vector::select(vertex.diffuse, f, value);
    let mut density = pdf.select(vertex.diffuse, density);
    if (vertex.metal & light.exists).any() {
        let (f, pdf) = metal(vertex.reflectance, vertex.alpha, vertex.viewer(), wi);
        value = vector::select(vertex.metal, f, value);
        density = pdf.select(vertex.metal, density);
    }
    let is_black = value[0].eq(zero) & value[1].eq(zero) & value[2].eq(zero);
    let heights = dot(sub(light.end, vertex.position), vertex.geometric_normal)
        * dot(direction, vertex.geometric_normal);
    let exists =
        light.exists & vertex.sides_agree(wi[2], direction) & !is_black & (!light.area | zero.lt(heights));

    let way = vector::select(light.bounded, sub(light.end, vertex.position), direction);
    let origin = vertex.origin(way);
    let direction = vector::select(light.bounded, sub(light.end, origin), direction);
    let end = zero.all(BOUNDED).select(light.bounded, zero.all(f32::INFINITY));
    (ShadowLanes { origin, end, direction, contribution: value, exists }, density)
}

/// Weights light samples against BSDF sampling; given are f |cos| and density of other surfaces, and the
/// share of each sample.
#[inline(always)]
fn direct<L: Lanes>(
    vertex: &VertexLanes<L>,
    light: &LightLanes<L>,
    given: ([L; 3], L),
    each: L,
) -> ShadowLanes<L> {
    let (rays, density) = reach(vertex, light, given);
    let weight = light.weight(each, density);
    let value = mul(mul(vertex.throughput, rays.contribution), light.radiance);
    ShadowLanes { contribution: scale(value, weight / light.pdf), ..rays }
}

impl Direct<'_> {
    /// Shadow rays by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut ShadowBlock) {
        level.dispatch(DirectKernel::<false>(self, block));
    }

    /// Shadow rays with f |cos| and the densities of BSDF sampling in place of contributions, into `block`:
    /// for estimators with other weights.
    pub fn reach(&self, level: Level, block: &mut ShadowBlock) {
        level.dispatch(DirectKernel::<true>(self, block));
    }
}

struct DirectKernel<'k, 'b, const REACH: bool>(&'k Direct<'b>, &'k mut ShadowBlock);

impl<const REACH: bool> Kernel for DirectKernel<'_, '_, REACH> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self(Direct { surface, bsdf, light, value, pdf, each, throughput }, block) = self;
        let (vertex, light) = (vertices(simd, surface, bsdf, throughput), LightLanes::of(simd, light));
        let (given, each) = ((load3(simd, value), simd.load16(pdf)), simd.load16(each));
        let (ray, last) = match REACH {
            true => reach(&vertex, &light, given),
            false => (direct(&vertex, &light, given, each), simd.splat16(0.0)),
        };
        let ([ox, oy, oz], [dx, dy, dz], [r, g, b]) = (ray.origin, ray.direction, ray.contribution);
        simd.octets16([ox, oy, oz, ray.end, dx, dy, dz, simd.splat16(0.0)], &mut block.rays);
        block.contribution = simd.records16([r, g, b, last]);
        block.exists = ray.exists.bits();
    }
}
