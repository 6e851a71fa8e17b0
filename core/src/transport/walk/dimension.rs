//! Dimensions of the sampler: the index of the random number of each choice of a camera path.

use crate::sampling::Sampler;
use halflight_simd::kernels::shade::numbers::Offsets;

/// Position in the pixel.
pub(crate) const PIXEL: u32 = 0;
/// Position on the lens.
pub(crate) const LENS: u32 = 1;
/// Opacity of the surface after `n` others, scattering or skipped: `CROSSING + n`.
pub(crate) const CROSSING: u32 = 1 << 31;

/// Opacity of the next surface on segment `segments` of a subpath that has skipped `crossings` surfaces so
/// far.
#[inline]
pub(crate) const fn opacity(segments: u32, crossings: u32) -> u32 {
    CROSSING + segments - 1 + crossings
}
/// Rotation of the wall probes at the vertex that ends segment `n`: `PROBES + n`.
pub(crate) const PROBES: u32 = 1 << 30;
/// Position in the pixel of rays for the emission of lamps alone.
pub(crate) const SILHOUETTE: u32 = 1 << 29;

/// Choice of light vertices at the vertex that ends segment `n`: `CONNECTION + n`.
pub(crate) const CONNECTION: u32 = 1 << 28;

// Offsets from `vertex(n)`, for each vertex:
/// Position on the light.
pub(crate) const LIGHT: u32 = 0;
/// Choice of the light.
pub(crate) const LIGHT_CHOICE: u32 = 1;
/// Direction of scattering ([`scattering`]).
const BSDF: u32 = 2;
/// Choice of the lobe.
pub(crate) const LOBE: u32 = 3;
/// Russian roulette.
pub(crate) const ROULETTE: u32 = 4;

/// Offsets for the numbers of blocks of vertices.
pub(crate) const OFFSETS: Offsets =
    Offsets { light: LIGHT, choice: LIGHT_CHOICE, scatter: BSDF, roulette: ROULETTE };

/// First dimension of the vertex that ends segment `n`.
#[inline]
pub(crate) const fn vertex(n: u32) -> u32 {
    2 + 5 * (n - 1)
}

/// Random numbers of the scattered direction at the vertex that ends segment `n`. At the first vertex they
/// are stratified together with the position in the pixel, since radiance after one bounce is often smooth in
/// all four (docs/decisions/path-tracing.md#pairs-and-quads).
#[inline]
pub(crate) fn scattering(sampler: &Sampler, n: u32) -> [f32; 2] {
    if n == 1 {
        let [.., u, v] = sampler.quad(PIXEL);
        return [u, v];
    }
    sampler.pair(vertex(n) + BSDF)
}

/// Random numbers of the light sample at the vertex that ends segment `n`: point on a light, and its choice.
#[inline]
pub(crate) fn light_sample(sampler: &Sampler, n: u32) -> [f32; 3] {
    let first = vertex(n);
    let [u, v] = sampler.pair(first + LIGHT);
    [u, v, sampler.single(first + LIGHT_CHOICE)]
}

/// Random numbers of the BSDF sample at the vertex that ends segment `n`: direction and lobe.
#[inline]
pub(crate) fn bsdf_sample(sampler: &Sampler, n: u32) -> [f32; 3] {
    let [u, v] = scattering(sampler, n);
    [u, v, sampler.single(vertex(n) + LOBE)]
}
