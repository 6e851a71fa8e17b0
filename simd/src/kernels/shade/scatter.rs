//! Next rays of the paths at the vertices of a block: BSDF sampling and Russian roulette.
//!
//! Samples of BSDFs without lanes come from the caller.

use super::bsdf::{BsdfBlock, SampleLanes, VertexLanes, sample_diffuse, sample_metal, vertices};
use super::surface::SurfaceBlock;
use super::vector::{self, divide, mul, scale};
use super::{Row, Row3, load2, load3, warp};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Throughput from which a path survives with certainty; below, the probability is proportional to it. There
/// is no minimum number of segments: early ends of dark paths save the most time
/// (docs/decisions/path-tracing.md).
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

    /// Stores the samples of the lanes `of`.
    #[inline(always)]
    pub(super) fn set<S: Simd>(
        &mut self,
        simd: S,
        of: <S::F16 as Lanes>::Mask,
        sample: &SampleLanes<S::F16>,
    ) {
        let (direction, weight) = (load3(simd, &self.direction), load3(simd, &self.weight));
        let pdf = simd.splat16(f32::INFINITY).select(sample.delta, sample.pdf);
        self.direction = vector::to_arrays(vector::select(of, sample.direction, direction));
        self.weight = vector::to_arrays(vector::select(of, sample.weight, weight));
        self.pdf = pdf.select(of, simd.load16(&self.pdf)).to_array();
        self.eta = sample.eta.select(of, simd.load16(&self.eta)).to_array();
    }
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
    given: SampleLanes<L>,
    u: [L; 2],
    roulette: L,
    most: L,
    factor: [L; 3],
    eta_squared: L,
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

/// Samples diffuse surfaces and rough metals at `u`; `given` is the sample of the others.
#[inline(always)]
fn sample<L: Lanes>(vertex: &VertexLanes<L>, u: [L; 2], given: SampleLanes<L>) -> SampleLanes<L> {
    let lambert = sample_diffuse(vertex.reflectance, u);
    let mut sample = SampleLanes { eta: given.eta, ..lambert.select(vertex.diffuse, given) };
    let is_metal = vertex.metal & given.exists;
    if is_metal.any() {
        let metal = sample_metal(vertex.reflectance, vertex.alpha, vertex.viewer(), u);
        sample = SampleLanes { eta: given.eta, ..metal.select(is_metal, sample) };
    }
    SampleLanes { exists: given.exists & sample.exists, ..sample }
}

/// Samples BSDFs and plays roulette.
#[inline(always)]
fn scatter<L: Lanes>(vertex: &VertexLanes<L>, given: &ScatterLanes<L>) -> NextLanes<L> {
    let (zero, one) = (given.most.all(0.0), given.most.all(1.0));
    let SampleLanes { direction: local, weight, pdf, eta, exists, .. } = sample(vertex, given.u, given.given);
    let direction = warp::to_world(vertex.frame, local);
    let throughput = mul(vertex.throughput, weight);
    let eta_squared = given.eta_squared * (eta * eta);
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
    fn load<S: Simd>(&self, simd: S) -> (VertexLanes<S::F16>, ScatterLanes<S::F16>) {
        let given = SampleLanes {
            direction: load3(simd, &self.given.direction),
            weight: load3(simd, &self.given.weight),
            pdf: simd.load16(&self.given.pdf),
            eta: simd.load16(&self.given.eta),
            exists: simd.mask16(self.active),
            delta: simd.mask16(0),
        };
        let inputs = ScatterLanes {
            given,
            u: load2(simd, self.u),
            roulette: simd.load16(self.roulette),
            most: simd.load16(self.most),
            factor: load3(simd, self.factor),
            eta_squared: simd.load16(self.eta_squared),
            certain: simd.mask16(self.certain),
        };
        (vertices(simd, self.surface, self.bsdf, self.throughput), inputs)
    }

    /// Samples of all BSDFs by the instructions of `level`, without roulette: for walks with other weights.
    /// Returns the set of samples as well.
    #[must_use]
    pub fn samples(&self, level: Level) -> (ScatterBlock, u32) {
        level.dispatch(self)
    }

    /// Next rays by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut NextBlock) {
        level.dispatch((self, block));
    }
}

impl Kernel for (&Scatter<'_>, &mut NextBlock) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (vertex, inputs) = self.0.load(simd);
        let next = scatter(&vertex, &inputs);
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

impl Kernel for &Scatter<'_> {
    type Out = (ScatterBlock, u32);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (ScatterBlock, u32) {
        let (vertex, inputs) = self.load(simd);
        let sample = sample(&vertex, inputs.u, inputs.given);
        let block = ScatterBlock {
            direction: vector::to_arrays(sample.direction),
            weight: vector::to_arrays(sample.weight),
            pdf: sample.pdf.to_array(),
            eta: self.given.eta,
        };
        (block, sample.exists.bits())
    }
}
