//! Scattering at the vertices of a block: shadow rays of light samples with their contributions (next-event
//! estimation), and next rays of paths by BSDF sampling and Russian roulette.
//!
//! Diffuse surfaces and rough metals are evaluated and sampled here; values of other surfaces come from the
//! caller.

use super::ggx::{Ggx, schlick};
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale, sub};
use super::{Row, Row3, load3, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};
use core::f32::consts::FRAC_1_PI;

/// Least height of a viewer above the horizon: squares of half-vectors are normal floats.
const RESOLUTION: f32 = 1e-7;

/// Throughput from which a path survives with certainty; below, the probability is proportional to it. There
/// is no minimum number of segments: early ends of dark paths save the most time
/// (docs/decisions/0023-russian-roulette.md).
pub const CERTAIN_FROM: f32 = 0.25;

/// Largest `t` of a ray whose direction has its length: just below 1, the `t` of its target.
pub const BOUNDED: f32 = 1.0 - f32::EPSILON;

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
    /// Bit `i`: no path hits the light.
    pub delta: u32,
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
        delta: 0,
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
    /// Throughputs of the paths.
    pub throughput: &'b Row3,
}

/// Shadow rays of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowBlock {
    /// Rays: origin, end, direction, zero. The direction has the length of the ray if the light is bounded.
    pub rays: [[f32; 8]; 16],
    /// Unoccluded contributions to the pixels, and zero.
    pub contribution: [[f32; 4]; 16],
    /// Bit `i`: there is a ray.
    pub exists: u32,
}

impl ShadowBlock {
    /// No ray.
    pub const EMPTY: Self = Self { rays: [[0.0; 8]; 16], contribution: [[0.0; 4]; 16], exists: 0 };
}

/// Vertex over lanes.
struct VertexLanes<L: Lanes> {
    position: [L; 3],
    error: L,
    geometric_normal: [L; 3],
    frame: [[L; 3]; 3],
    wo: [L; 3],
    throughput: [L; 3],
    reflectance: [L; 3],
    alpha: L,
    diffuse: L::Mask,
    metal: L::Mask,
}

impl<L: Lanes> VertexLanes<L> {
    /// Position, offset from the surface to the side of `direction`.
    #[inline(always)]
    fn origin(&self, direction: [L; 3]) -> [L; 3] {
        let step = self.error.copysign(dot(direction, self.geometric_normal));
        add(self.position, scale(self.geometric_normal, step))
    }

    /// Direction to the viewer, raised above the horizon.
    #[inline(always)]
    fn viewer(&self) -> [L; 3] {
        let [x, y, z] = self.wo;
        [x, y, z.max(z.all(RESOLUTION))]
    }

    /// True where both normals have the direction on the same side.
    #[inline(always)]
    fn sides_agree(&self, local_z: L, world: [L; 3]) -> L::Mask {
        local_z.all(0.0).lt(local_z * dot(world, self.geometric_normal))
    }
}

/// Light samples over lanes.
struct LightLanes<L: Lanes> {
    direction: [L; 3],
    end: [L; 3],
    pdf: L,
    radiance: [L; 3],
    exists: L::Mask,
    bounded: L::Mask,
    area: L::Mask,
    delta: L::Mask,
    balance: L::Mask,
}

/// Shadow rays over lanes.
struct ShadowLanes<L: Lanes> {
    origin: [L; 3],
    end: L,
    direction: [L; 3],
    contribution: [L; 3],
    exists: L::Mask,
}

/// f |cos| and density of a rough metal.
#[inline(always)]
fn metal<L: Lanes>(f0: [L; 3], alpha: L, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
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

/// Weights light samples against BSDF sampling; `given` are f |cos| and density of other surfaces.
#[inline(always)]
fn direct<L: Lanes>(
    vertex: &VertexLanes<L>,
    light: &LightLanes<L>,
    (value, density): ([L; 3], L),
) -> ShadowLanes<L> {
    let (zero, one) = (density.all(0.0), density.all(1.0));
    let direction = light.direction;
    let [tangent, bitangent, normal] = vertex.frame;
    let wi = [dot(direction, tangent), dot(direction, bitangent), dot(direction, normal)];
    let lambert = wi[2].max(zero) * zero.all(FRAC_1_PI);
    let (mut value, mut density) = (
        vector::select(vertex.diffuse, scale(vertex.reflectance, lambert), value),
        lambert.select(vertex.diffuse, density),
    );
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
    let ratio = density / light.pdf;
    let weight = one / (one + ratio.select(light.balance, ratio * ratio));
    let weight = one.select(light.delta, weight);
    let contribution = scale(mul(mul(vertex.throughput, value), light.radiance), weight / light.pdf);
    let direction = vector::select(light.bounded, sub(light.end, origin), direction);
    let end = zero.all(BOUNDED).select(light.bounded, zero.all(f32::INFINITY));
    ShadowLanes { origin, end, direction, contribution, exists }
}

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
    /// Products of their squared relative indices of refraction.
    pub eta_squared: &'b Row,
    /// Bit `i`: path `i` scatters.
    pub active: u32,
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
    /// Bit `i`: the path continues.
    pub exists: u32,
}

impl NextBlock {
    /// No ray.
    pub const EMPTY: Self =
        Self { rays: [[0.0; 8]; 16], states: [[0.0; 8]; 16], normals: [[0.0; 4]; 16], exists: 0 };
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
    eta_squared: L,
    active: L::Mask,
}

/// Next rays over lanes.
struct NextLanes<L: Lanes> {
    origin: [L; 3],
    direction: [L; 3],
    throughput: [L; 3],
    pdf: L,
    eta_squared: L,
    exists: L::Mask,
}

/// Samples BSDFs and plays roulette.
#[inline(always)]
fn scatter<L: Lanes>(vertex: &VertexLanes<L>, given: &ScatterLanes<L>) -> NextLanes<L> {
    let (zero, one) = (given.pdf.all(0.0), given.pdf.all(1.0));
    let lambert = warp::cosine_hemisphere(given.u);
    let mut local = vector::select(vertex.diffuse, lambert, given.direction);
    let mut weight = vector::select(vertex.diffuse, vertex.reflectance, given.weight);
    let mut pdf = (lambert[2] * zero.all(FRAC_1_PI)).select(vertex.diffuse, given.pdf);
    let mut exists = given.active;
    let is_metal = vertex.metal & given.active;
    if is_metal.any() {
        let (ggx, wo) = (Ggx::new(vertex.alpha), vertex.viewer());
        let wi = ggx.sample_reflection(wo, given.u);
        let h = add(wo, wi);
        let reflectance = schlick(vertex.reflectance, dot(wo, h) / vector::length(h));
        local = vector::select(is_metal, wi, local);
        weight = vector::select(is_metal, scale(reflectance, ggx.reflection_weight(wo, wi)), weight);
        pdf = ggx.reflection_density(wo, h).select(is_metal, pdf);
        exists = exists & (!is_metal | zero.lt(wi[2]));
    }
    let direction = warp::to_world(vertex.frame, local);
    let throughput = mul(vertex.throughput, weight);
    let eta_squared = given.eta_squared * (given.eta * given.eta);
    let bright = vector::largest(scale(throughput, eta_squared)) / zero.all(CERTAIN_FROM);
    let survival = bright.min(given.most);
    let is_certain = !survival.lt(one);
    let throughput = vector::select(is_certain, throughput, divide(throughput, survival));
    let is_black = throughput[0].eq(zero) & throughput[1].eq(zero) & throughput[2].eq(zero);
    let exists = exists
        & vertex.sides_agree(local[2], direction)
        & (is_certain | given.roulette.lt(survival))
        & !is_black;
    NextLanes { origin: vertex.origin(direction), direction, throughput, pdf, eta_squared, exists }
}

/// Lane `i` of vertices.
#[inline(always)]
fn lane(surface: &SurfaceBlock, bsdf: &BsdfBlock, throughput: &Row3, i: usize) -> VertexLanes<f32> {
    let at = |rows: &Row3| [rows[0][i], rows[1][i], rows[2][i]];
    VertexLanes {
        position: at(&surface.position),
        error: surface.error[i],
        geometric_normal: at(&surface.geometric_normal),
        frame: [at(&surface.frame[0]), at(&surface.frame[1]), at(&surface.frame[2])],
        wo: at(&surface.wo),
        throughput: at(throughput),
        reflectance: at(&bsdf.reflectance),
        alpha: bsdf.alpha[i],
        diffuse: bsdf.diffuse >> i & 1 == 1,
        metal: bsdf.metal >> i & 1 == 1,
    }
}

/// Vertices of a block over lanes.
#[inline(always)]
fn vertices<S: Simd>(
    simd: S,
    surface: &SurfaceBlock,
    bsdf: &BsdfBlock,
    throughput: &Row3,
) -> VertexLanes<S::F16> {
    let [tangent, bitangent, normal] = &surface.frame;
    VertexLanes {
        position: load3(simd, &surface.position),
        error: simd.load16(&surface.error),
        geometric_normal: load3(simd, &surface.geometric_normal),
        frame: [load3(simd, tangent), load3(simd, bitangent), load3(simd, normal)],
        wo: load3(simd, &surface.wo),
        throughput: load3(simd, throughput),
        reflectance: load3(simd, &bsdf.reflectance),
        alpha: simd.load16(&bsdf.alpha),
        diffuse: simd.mask16(bsdf.diffuse),
        metal: simd.mask16(bsdf.metal),
    }
}

impl Direct<'_> {
    /// Shadow rays by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut ShadowBlock) {
        level.dispatch(DirectKernel(self, block));
    }

    /// Scalar reference; equals [`Direct::compute`] to the bit in lanes that exist.
    pub fn reference(&self) -> ShadowBlock {
        let mut block = ShadowBlock::EMPTY;
        for i in 0..super::BLOCK {
            let at = |rows: &Row3| [rows[0][i], rows[1][i], rows[2][i]];
            let bit = |bits: u32| bits >> i & 1 == 1;
            let light = LightLanes {
                direction: at(&self.light.direction),
                end: at(&self.light.end),
                pdf: self.light.pdf[i],
                radiance: at(&self.light.radiance),
                exists: bit(self.light.exists),
                bounded: bit(self.light.bounded),
                area: bit(self.light.area),
                delta: bit(self.light.delta),
                balance: bit(self.light.balance),
            };
            let vertex = lane(self.surface, self.bsdf, self.throughput, i);
            let ray = direct(&vertex, &light, (at(self.value), self.pdf[i]));
            let ([ox, oy, oz], [dx, dy, dz], [r, g, b]) = (ray.origin, ray.direction, ray.contribution);
            block.rays[i] = [ox, oy, oz, ray.end, dx, dy, dz, 0.0];
            block.contribution[i] = [r, g, b, 0.0];
            block.exists |= u32::from(ray.exists) << i;
        }
        block
    }
}

impl Scatter<'_> {
    /// Next rays by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut NextBlock) {
        level.dispatch(ScatterKernel(self, block));
    }

    /// Scalar reference; equals [`Scatter::compute`] to the bit in lanes that exist.
    pub fn reference(&self) -> NextBlock {
        let mut block = NextBlock::EMPTY;
        for i in 0..super::BLOCK {
            let at = |rows: &Row3| [rows[0][i], rows[1][i], rows[2][i]];
            let given = ScatterLanes {
                direction: at(&self.given.direction),
                weight: at(&self.given.weight),
                pdf: self.given.pdf[i],
                eta: self.given.eta[i],
                u: [self.u[0][i], self.u[1][i]],
                roulette: self.roulette[i],
                most: self.most[i],
                eta_squared: self.eta_squared[i],
                active: self.active >> i & 1 == 1,
            };
            let vertex = lane(self.surface, self.bsdf, self.throughput, i);
            let next = scatter(&vertex, &given);
            let ([ox, oy, oz], [dx, dy, dz]) = (next.origin, next.direction);
            block.rays[i] = [ox, oy, oz, f32::INFINITY, dx, dy, dz, 0.0];
            let ([r, g, b], [x, y, z]) = (next.throughput, vertex.position);
            block.states[i] = [r, g, b, next.pdf, x, y, z, next.eta_squared];
            let [nx, ny, nz] = vertex.frame[2];
            block.normals[i] = [nx, ny, nz, 0.0];
            block.exists |= u32::from(next.exists) << i;
        }
        block
    }
}

struct DirectKernel<'k, 'b>(&'k Direct<'b>, &'k mut ShadowBlock);

impl Kernel for DirectKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Direct { surface, bsdf, light, value, pdf, throughput } = self.0;
        let light = LightLanes {
            direction: load3(simd, &light.direction),
            end: load3(simd, &light.end),
            pdf: simd.load16(&light.pdf),
            radiance: load3(simd, &light.radiance),
            exists: simd.mask16(light.exists),
            bounded: simd.mask16(light.bounded),
            area: simd.mask16(light.area),
            delta: simd.mask16(light.delta),
            balance: simd.mask16(light.balance),
        };
        let vertex = vertices(simd, surface, bsdf, throughput);
        let ray = direct(&vertex, &light, (load3(simd, value), simd.load16(pdf)));
        let ([ox, oy, oz], [dx, dy, dz], [r, g, b]) = (ray.origin, ray.direction, ray.contribution);
        let zero = simd.splat16(0.0);
        let block = self.1;
        simd.octets16([ox, oy, oz, ray.end, dx, dy, dz, zero], &mut block.rays);
        block.contribution = simd.records16([r, g, b, zero]);
        block.exists = ray.exists.bits();
    }
}

struct ScatterKernel<'k, 'b>(&'k Scatter<'b>, &'k mut NextBlock);

impl Kernel for ScatterKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Scatter { surface, bsdf, given, u, roulette, most, throughput, eta_squared, active } = self.0;
        let given = ScatterLanes {
            direction: load3(simd, &given.direction),
            weight: load3(simd, &given.weight),
            pdf: simd.load16(&given.pdf),
            eta: simd.load16(&given.eta),
            u: [simd.load16(&u[0]), simd.load16(&u[1])],
            roulette: simd.load16(roulette),
            most: simd.load16(most),
            eta_squared: simd.load16(eta_squared),
            active: simd.mask16(*active),
        };
        let vertex = vertices(simd, surface, bsdf, throughput);
        let next = scatter(&vertex, &given);
        let (zero, end) = (simd.splat16(0.0), simd.splat16(f32::INFINITY));
        let ([ox, oy, oz], [dx, dy, dz]) = (next.origin, next.direction);
        let ([r, g, b], [x, y, z]) = (next.throughput, vertex.position);
        let [nx, ny, nz] = vertex.frame[2];
        let block = self.1;
        simd.octets16([ox, oy, oz, end, dx, dy, dz, zero], &mut block.rays);
        simd.octets16([r, g, b, next.pdf, x, y, z, next.eta_squared], &mut block.states);
        block.normals = simd.records16([nx, ny, nz, zero]);
        block.exists = next.exists.bits();
    }
}
