//! Next rays of the paths at the vertices of a block: BSDF sampling and Russian roulette.
//!
//! Samples of BSDFs without lanes come from the caller.

use super::bsdf::{BsdfBlock, VertexLanes, vertices};
use super::fresnel::schlick;
use super::ggx::Ggx;
use super::load::{All, Load, One};
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale};
use super::{Row, Row3, put, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};
use core::f32::consts::FRAC_1_PI;

/// Throughput from which a path survives with certainty; below, the probability is proportional to it. There
/// is no minimum number of segments: early ends of dark paths save the most time
/// (docs/decisions/sampling.md).
pub const CERTAIN_FROM: f32 = 0.25;

/// BSDF sampling of a block.
#[derive(Debug)]
pub struct Scatter<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their BSDFs.
    pub bsdf: &'b BsdfBlock,
    /// Samples of surfaces that are neither diffuse nor rough metals.
    pub given: &'b ScatterBlock,
    /// Positions in the unit square.
    pub u: &'b [Row; 2],
    /// Numbers of roulette.
    pub roulette: &'b Row,
    /// Largest continuation probabilities.
    pub most: &'b Row,
    /// Throughputs of the paths.
    pub throughput: &'b Row3,
    /// Factors from the light of the paths to that of their pixels.
    pub factor: &'b Row3,
    /// Products of their squared relative indices of refraction.
    pub eta_squared: &'b Row,
    /// Bit `i`: path `i` scatters.
    pub active: u32,
    /// Bit `i`: path `i` survives if it carries light.
    pub certain: u32,
}

/// Samples of BSDFs that lanes do not sample.
#[derive(Clone, Debug)]
pub struct ScatterBlock {
    /// Local directions.
    pub direction: Row3,
    /// f |cos| / pdf.
    pub weight: Row3,
    /// Densities, infinite for delta lobes.
    pub pdf: Row,
    /// Relative indices of refraction.
    pub eta: Row,
}

impl ScatterBlock {
    /// Zeros.
    pub const EMPTY: Self =
        Self { direction: [[0.0; 16]; 3], weight: [[0.0; 16]; 3], pdf: [0.0; 16], eta: [1.0; 16] };
}

/// Next rays of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct NextBlock {
    /// Rays: origin, infinity, unit direction, zero.
    pub rays: [[f32; 8]; 16],
    /// Throughputs behind the vertices, densities of the directions, positions of the vertices, products of
    /// the squared relative indices of refraction.
    pub states: [[f32; 8]; 16],
    /// Shading normals of the vertices, and zero.
    pub normals: [[f32; 4]; 16],
    /// Local directions of the rays.
    pub local: Row3,
    /// Bit `i`: the path continues.
    pub exists: u32,
}

impl NextBlock {
    /// No ray.
    pub const EMPTY: Self = Self {
        rays: [[0.0; 8]; 16],
        states: [[0.0; 8]; 16],
        normals: [[0.0; 4]; 16],
        local: [[0.0; 16]; 3],
        exists: 0,
    };
}

/// Inputs of [`scatter`] over lanes.
struct ScatterLanes<L: Lanes> {
    direction: [L; 3],
    weight: [L; 3],
    pdf: L,
    eta: L,
    u: [L; 2],
    roulette: L,
    most: L,
    factor: [L; 3],
    eta_squared: L,
    active: L::Mask,
    certain: L::Mask,
}

/// Next rays over lanes.
struct NextLanes<L: Lanes> {
    origin: [L; 3],
    direction: [L; 3],
    local: [L; 3],
    throughput: [L; 3],
    pdf: L,
    eta_squared: L,
    exists: L::Mask,
}

/// Samples of BSDFs over lanes: local directions, f |cos| / pdf, and densities.
struct SampleLanes<L: Lanes> {
    local: [L; 3],
    weight: [L; 3],
    pdf: L,
    exists: L::Mask,
}

impl<L: Lanes> ScatterLanes<L> {
    /// The given samples.
    #[inline(always)]
    fn samples(&self) -> SampleLanes<L> {
        SampleLanes { local: self.direction, weight: self.weight, pdf: self.pdf, exists: self.active }
    }
}

/// Samples diffuse surfaces and rough metals at `u`; `given` is the sample of the others.
#[inline(always)]
fn sample<L: Lanes>(vertex: &VertexLanes<L>, u: [L; 2], given: SampleLanes<L>) -> SampleLanes<L> {
    let (zero, active) = (u[0].all(0.0), given.exists);
    let lambert = warp::cosine_hemisphere(u);
    let mut local = vector::select(vertex.diffuse, lambert, given.local);
    let mut weight = vector::select(vertex.diffuse, vertex.reflectance, given.weight);
    let mut pdf = (lambert[2] * zero.all(FRAC_1_PI)).select(vertex.diffuse, given.pdf);
    let mut exists = active;
    let is_metal = vertex.metal & active;
    if is_metal.any() {
        let (ggx, wo) = (Ggx::new(vertex.alpha), vertex.viewer());
        let wi = ggx.sample_reflection(wo, u);
        let h = add(wo, wi);
        let reflectance = schlick(vertex.reflectance, dot(wo, h) / vector::length(h));
        local = vector::select(is_metal, wi, local);
        weight = vector::select(is_metal, scale(reflectance, ggx.reflection_weight(wo, wi)), weight);
        pdf = ggx.reflection_density(wo, h).select(is_metal, pdf);
        exists = exists & (!is_metal | zero.lt(wi[2]));
    }
    SampleLanes { local, weight, pdf, exists }
}

/// Samples BSDFs and plays roulette.
#[inline(always)]
fn scatter<L: Lanes>(vertex: &VertexLanes<L>, given: &ScatterLanes<L>) -> NextLanes<L> {
    let (zero, one) = (given.pdf.all(0.0), given.pdf.all(1.0));
    let SampleLanes { local, weight, pdf, exists } = sample(vertex, given.u, given.samples());
    let direction = warp::to_world(vertex.frame, local);
    let throughput = mul(vertex.throughput, weight);
    let eta_squared = given.eta_squared * (given.eta * given.eta);
    let bright = vector::largest(scale(mul(throughput, given.factor), eta_squared)) / zero.all(CERTAIN_FROM);
    let survival = bright.min(given.most);
    let is_certain = given.certain | !survival.lt(one);
    let throughput = vector::select(is_certain, throughput, divide(throughput, survival));
    let is_black = throughput[0].eq(zero) & throughput[1].eq(zero) & throughput[2].eq(zero);
    let exists = exists
        & vertex.sides_agree(local[2], direction)
        & (is_certain | given.roulette.lt(survival))
        & !is_black;
    NextLanes { origin: vertex.origin(direction), direction, local, throughput, pdf, eta_squared, exists }
}

impl Scatter<'_> {
    /// Vertices and inputs over lanes.
    #[inline(always)]
    fn load<F: Load>(&self, from: F) -> (VertexLanes<F::Lanes>, ScatterLanes<F::Lanes>) {
        let given = ScatterLanes {
            direction: from.row3(&self.given.direction),
            weight: from.row3(&self.given.weight),
            pdf: from.row(&self.given.pdf),
            eta: from.row(&self.given.eta),
            u: [from.row(&self.u[0]), from.row(&self.u[1])],
            roulette: from.row(self.roulette),
            most: from.row(self.most),
            factor: from.row3(self.factor),
            eta_squared: from.row(self.eta_squared),
            active: from.set(self.active),
            certain: from.set(self.certain),
        };
        (vertices(from, self.surface, self.bsdf, self.throughput), given)
    }

    /// Next rays over lanes, and their vertices.
    #[inline(always)]
    fn at<F: Load>(&self, from: F) -> (NextLanes<F::Lanes>, VertexLanes<F::Lanes>) {
        let (vertex, given) = self.load(from);
        (scatter(&vertex, &given), vertex)
    }

    /// Samples over lanes.
    #[inline(always)]
    fn sample<F: Load>(&self, from: F) -> SampleLanes<F::Lanes> {
        let (vertex, given) = self.load(from);
        sample(&vertex, given.u, given.samples())
    }

    /// Samples of all BSDFs by the instructions of `level`, without roulette: for walks with other weights.
    /// Returns the set of samples as well.
    #[must_use]
    pub fn samples(&self, level: Level) -> (ScatterBlock, u32) {
        level.dispatch(SamplesKernel(self))
    }

    /// Scalar reference; equals [`Scatter::samples`] to the bit in lanes that exist.
    #[must_use]
    pub fn samples_reference(&self) -> (ScatterBlock, u32) {
        let (mut block, mut exists) = (self.given.clone(), 0);
        for i in 0..super::BLOCK {
            let sample = self.sample(One(i));
            put(&mut block.direction, i, sample.local);
            put(&mut block.weight, i, sample.weight);
            block.pdf[i] = sample.pdf;
            exists |= u32::from(sample.exists) << i;
        }
        (block, exists)
    }

    /// Next rays by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut NextBlock) {
        level.dispatch(ScatterKernel(self, block));
    }

    /// Scalar reference; equals [`Scatter::compute`] to the bit in lanes that exist.
    pub fn reference(&self) -> NextBlock {
        let mut block = NextBlock::EMPTY;
        for i in 0..super::BLOCK {
            let (next, vertex) = self.at(One(i));
            let ([ox, oy, oz], [dx, dy, dz]) = (next.origin, next.direction);
            block.rays[i] = [ox, oy, oz, f32::INFINITY, dx, dy, dz, 0.0];
            let ([r, g, b], [x, y, z]) = (next.throughput, vertex.position);
            block.states[i] = [r, g, b, next.pdf, x, y, z, next.eta_squared];
            let [nx, ny, nz] = vertex.frame[2];
            block.normals[i] = [nx, ny, nz, 0.0];
            put(&mut block.local, i, next.local);
            block.exists |= u32::from(next.exists) << i;
        }
        block
    }
}

struct ScatterKernel<'k, 'b>(&'k Scatter<'b>, &'k mut NextBlock);

impl Kernel for ScatterKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (next, vertex) = self.0.at(All(simd));
        let (zero, end) = (simd.splat16(0.0), simd.splat16(f32::INFINITY));
        let ([ox, oy, oz], [dx, dy, dz]) = (next.origin, next.direction);
        let ([r, g, b], [x, y, z]) = (next.throughput, vertex.position);
        let [nx, ny, nz] = vertex.frame[2];
        let block = self.1;
        simd.octets16([ox, oy, oz, end, dx, dy, dz, zero], &mut block.rays);
        simd.octets16([r, g, b, next.pdf, x, y, z, next.eta_squared], &mut block.states);
        block.normals = simd.records16([nx, ny, nz, zero]);
        block.local = vector::to_arrays(next.local);
        block.exists = next.exists.bits();
    }
}

struct SamplesKernel<'k, 'b>(&'k Scatter<'b>);

impl Kernel for SamplesKernel<'_, '_> {
    type Out = (ScatterBlock, u32);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (ScatterBlock, u32) {
        let sample = self.0.sample(All(simd));
        let block = ScatterBlock {
            direction: vector::to_arrays(sample.local),
            weight: vector::to_arrays(sample.weight),
            pdf: sample.pdf.to_array(),
            eta: self.0.given.eta,
        };
        (block, sample.exists.bits())
    }
}
