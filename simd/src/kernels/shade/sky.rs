//! Samples of the environment at the vertices of a block, over lanes: directions of points of a map, or of a
//! sky of constant radiance.

use super::vector::{self, add, scale};
use super::warp::{self, sin_cos_turns};
use super::{Row, Row3, load2, load3};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};
use core::f32::consts::{FRAC_1_PI, PI, TAU};

/// Density of uniform directions in solid angle.
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Points of the environment of a block.
#[derive(Clone, Debug)]
pub struct SkyBlock {
    /// Azimuths and polar angles on the map in turns; points of the unit square without a map.
    pub at: [Row; 2],
    /// Densities over the unit square of the map; 1 without a map.
    pub density: Row,
    /// Factors on the densities: those of visibility tables, and the probabilities of the choice.
    pub factors: [Row; 2],
    /// Normals around which a sky of constant radiance is sampled; zero for all directions alike.
    pub normal: Row3,
}

impl SkyBlock {
    /// Zeros.
    pub const EMPTY: Self =
        Self { at: [[0.0; 16]; 2], density: [1.0; 16], factors: [[1.0; 16]; 2], normal: [[0.0; 16]; 3] };
}

/// Samples of the environment of a block.
#[derive(Debug)]
pub struct SkySamples<'b> {
    /// Points.
    pub sky: &'b SkyBlock,
    /// Columns of the rotation from the map to the world; `None` for a sky of constant radiance.
    pub to_world: Option<[[f32; 3]; 3]>,
    /// Bit `i`: vertex `i` takes a sample.
    pub active: u32,
}

/// Directions over lanes.
struct SkyLanes<L: Lanes> {
    direction: [L; 3],
    pdf: L,
    exists: L::Mask,
}

/// Direction of a map, rotated to the world by `columns`.
#[inline(always)]
fn of_map<L: Lanes>(columns: [[L; 3]; 3], [azimuth, polar]: [L; 2], density: L) -> SkyLanes<L> {
    let zero = polar.all(0.0);
    let ((sin_phi, cos_phi), (sin, cos)) = (sin_cos_turns(azimuth), sin_cos_turns(polar));
    let [x, y, z] = columns;
    let direction = add(add(scale(x, sin * cos_phi), scale(y, cos)), scale(z, sin * sin_phi));
    // dω = 2π² sin θ du dv.
    let pdf = density / (zero.all(TAU * PI) * sin);
    let pdf = pdf.select(zero.lt(sin), zero);
    SkyLanes { direction, pdf, exists: zero.lt(pdf) }
}

/// Direction of a sky of constant radiance: by the cosine at the receiver, or of any direction without one.
#[inline(always)]
fn of_constant<L: Lanes>(normal: [L; 3], u: [L; 2]) -> SkyLanes<L> {
    let (zero, one, two) = (u[0].all(0.0), u[0].all(1.0), u[0].all(2.0));
    let local = warp::cosine_hemisphere(u);
    let [tangent, bitangent] = warp::frame(normal);
    let direction = warp::to_world([tangent, bitangent, normal], local);
    let is_free = normal[0].eq(zero) & normal[1].eq(zero) & normal[2].eq(zero);
    let radius = two * (u[0] * (one - u[0])).sqrt();
    let (sin, cos) = sin_cos_turns(u[1]);
    let uniform = [radius * cos, radius * sin, one - two * u[0]];
    let pdf = local[2].max(zero) * zero.all(FRAC_1_PI);
    let pdf = zero.all(UNIFORM_SPHERE_PDF).select(is_free, pdf);
    SkyLanes { direction: vector::select(is_free, uniform, direction), pdf, exists: zero.eq(zero) }
}

/// Samples the environment. `map` is its rotation.
#[inline(always)]
fn sample<L: Lanes>(
    map: Option<[[L; 3]; 3]>,
    at: [L; 2],
    density: L,
    normal: [L; 3],
    [factor, probability]: [L; 2],
) -> SkyLanes<L> {
    let sample = match map {
        Some(columns) => of_map(columns, at, density),
        None => of_constant(normal, at),
    };
    SkyLanes { pdf: sample.pdf * factor * probability, ..sample }
}

impl SkySamples<'_> {
    /// Directions and densities by the instructions of `level`, into the lanes of samples. Returns their set.
    pub fn compute(&self, level: Level, direction: &mut Row3, pdf: &mut Row) -> u32 {
        level.dispatch((self, direction, pdf))
    }
}

impl Kernel for (&SkySamples<'_>, &mut Row3, &mut Row) {
    type Out = u32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        let (SkySamples { sky, to_world, active }, direction, pdf) = self;
        let splat = |[x, y, z]: [f32; 3]| [simd.splat16(x), simd.splat16(y), simd.splat16(z)];
        let map = to_world.map(|[x, y, z]| [splat(x), splat(y), splat(z)]);
        let (places, factors) = (load2(simd, &sky.at), load2(simd, &sky.factors));
        let found = sample(map, places, simd.load16(&sky.density), load3(simd, &sky.normal), factors);
        let exists = found.exists & simd.mask16(*active);
        *direction = vector::to_arrays(vector::select(exists, found.direction, load3(simd, direction)));
        *pdf = found.pdf.select(exists, simd.load16(pdf)).to_array();
        exists.bits()
    }
}
