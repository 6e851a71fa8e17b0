//! Dimensions of the sampler: the index of the random number of each choice of a camera path.

use crate::sampling::Sampler;
use halflight_simd::kernels::shade::numbers::Offsets;

/// Position in the pixel.
pub(in crate::transport) const PIXEL: u32 = 0;
/// Position on the lens.
pub(in crate::transport) const LENS: u32 = 1;
/// Opacity of the surface after `n` others, scattering or skipped: `CROSSING + n`.
pub(in crate::transport) const CROSSING: u32 = 1 << 31;

/// Opacity of the next surface on segment `segments` of a subpath that has skipped `crossings` surfaces so
/// far.
#[inline]
pub(in crate::transport) const fn opacity(segments: u32, crossings: u32) -> u32 {
    CROSSING + segments - 1 + crossings
}
/// Rotation of the wall probes at the vertex that ends segment `n`: `PROBES + n`.
pub(in crate::transport) const PROBES: u32 = 1 << 30;
/// Position in the pixel of rays for the emission of lamps alone.
pub(in crate::transport) const SILHOUETTE: u32 = 1 << 29;

/// Choice of light vertices at the vertex that ends segment `n`: `CONNECTION + n`.
pub(in crate::transport) const CONNECTION: u32 = 1 << 28;

// Offsets from `vertex(n)`, for each vertex:
/// Position on the light.
pub(in crate::transport) const LIGHT: u32 = 0;
/// Choice of the light.
pub(in crate::transport) const LIGHT_CHOICE: u32 = 1;
/// Direction of scattering ([`scattering`]).
const BSDF: u32 = 2;
/// Choice of the lobe.
pub(in crate::transport) const LOBE: u32 = 3;
/// Russian roulette.
pub(in crate::transport) const ROULETTE: u32 = 4;

/// Offsets for the numbers of blocks of vertices.
pub(in crate::transport) const OFFSETS: Offsets =
    Offsets { light: LIGHT, choice: LIGHT_CHOICE, scatter: BSDF, roulette: ROULETTE };

/// First dimension of the vertex that ends segment `n`.
#[inline]
pub(in crate::transport) const fn vertex(n: u32) -> u32 {
    2 + 5 * (n - 1)
}

/// Random numbers of the scattered direction at the vertex that ends segment `n`. At the first vertex they
/// are stratified together with the position in the pixel, since radiance after one bounce is often smooth in
/// all four (docs/decisions/sampling.md#pairs-and-quads).
#[inline]
pub(in crate::transport) fn scattering(sampler: &Sampler, n: u32) -> [f32; 2] {
    if n == 1 {
        let [.., u, v] = sampler.quad(PIXEL);
        return [u, v];
    }
    sampler.pair(vertex(n) + BSDF)
}
