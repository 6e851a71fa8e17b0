//! The end of subpaths: Russian roulette, and limits of length that make termination a fact.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample};

/// Surfaces passed by cut-out after which a path is cut and counted as unfinished. Roulette makes this limit,
/// and [`MAX_VERTICES`], as good as unreachable.
pub(in crate::transport) const MAX_CROSSINGS: u32 = 1024;
/// Vertices after which a path is cut.
pub(in crate::transport) const MAX_VERTICES: u32 = 1 << 13;

/// Vertices after which total reflection ends a path as well. Light that glass has held for so long does not
/// leave it in theory; in practice a ray in 10⁴ slips out by rounding where it meets an edge, and over
/// thousands of reflections that is much of the light. A light guide has a hundred.
const TRAPPED_FROM: u32 = 256;

/// Whether a path is cut, and so unfinished, at the end of its `segments`th segment, which it leaves by
/// `sample` of `bsdf`.
#[inline]
pub(in crate::transport) fn is_cut(segments: u32, bsdf: &Bsdf, sample: &BsdfSample) -> bool {
    if segments < TRAPPED_FROM {
        return false;
    }
    let is_total = bsdf.transmits() && sample.delta && !sample.transmitted && sample.pdf >= 1.0;
    is_total || segments >= MAX_VERTICES
}

/// A path of at least this throughput goes on for certain; one of half of it, every other time. There is no
/// fewest number of segments: early ends of dark paths are what pays
/// (docs/decisions/0023-russian-roulette.md).
const CERTAIN_FROM: f32 = 0.25;

/// From this many segments on no path survives for certain, so that paths end even between perfect mirrors:
/// of those that lose nothing 1 / n come to n times this length, and carry n times the light. Any fixed
/// probability would make the variance of light that loses less than half as much infinite.
const CERTAIN_BELOW: u32 = 16;

/// From this many segments on paths end soon.
const ENDLESS: u32 = 2048;

/// The continuation probability of a path of `segments` segments with this `throughput` (without the factor
/// of refraction, which comes back where the light leaves the glass).
#[inline]
pub(in crate::transport) fn continuation_probability(segments: u32, throughput: Rgb) -> f32 {
    let most = match segments {
        0..CERTAIN_BELOW => 1.0,
        CERTAIN_BELOW..ENDLESS => 1.0 - 1.0 / segments as f32,
        _ => 0.99,
    };
    (throughput.max_element() / CERTAIN_FROM).min(most)
}

/// The fraction of light subpaths that come to so many segments at most. Between perfect mirrors, and by
/// total reflection in glass, nothing else ends them; where a fortieth of the light is lost at each surface,
/// fewer come so far. The survivors carry more power instead, so that there is no bias.
pub(in crate::transport) fn survival_limit(segments: u32) -> f32 {
    CERTAIN_BELOW as f32 / segments.max(CERTAIN_BELOW) as f32
}
