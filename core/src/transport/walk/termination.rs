//! End of subpaths: Russian roulette, and limits of length that guarantee termination.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample};
use halflight_simd::kernels::shade::scatter::CERTAIN_FROM;

/// Skipped surfaces after which a path is cut and counted as unfinished. Roulette makes this limit and
/// [`MAX_VERTICES`] practically unreachable.
pub(crate) const MAX_CROSSINGS: u32 = 1024;
/// Number of vertices after which a path is cut.
pub(crate) const MAX_VERTICES: u32 = 1 << 13;

/// Number of vertices after which total reflection also ends a path. In theory light inside glass for so long
/// never leaves it; in practice one ray in 10⁴ escapes by rounding at an edge, over thousands of reflections
/// much of the light. A light guide has a hundred reflections.
pub(crate) const TRAPPED_FROM: u32 = 256;

/// True if a path is cut, and so unfinished, at the vertex that ends segment `segments` and that it leaves by
/// `sample` of `bsdf`.
#[inline]
pub(crate) fn is_cut(segments: u32, bsdf: &Bsdf, sample: &BsdfSample) -> bool {
    if segments < TRAPPED_FROM {
        return false;
    }
    let is_total = bsdf.transmits() && sample.delta && !sample.transmitted && sample.pdf >= 1.0;
    is_total || segments >= MAX_VERTICES
}

/// Number of segments from which no path survives with certainty, so that paths end even between perfect
/// mirrors. A fraction 1 / n of lossless paths reaches n times this length, with n times the light. Any fixed
/// probability would make the variance of light that loses less than half as much infinite.
pub(crate) const CERTAIN_BELOW: u32 = 16;

/// Number of segments from which the continuation probability is at most 0.99.
const ENDLESS: u32 = 2048;

/// Continuation probability of a path of `segments` segments and this `throughput`, without the factor of
/// refraction, which cancels when the light leaves the glass.
#[inline]
pub(crate) fn continuation_probability(segments: u32, throughput: Rgb) -> f32 {
    (throughput.max_element() / CERTAIN_FROM).min(most_probable(segments))
}

/// Plays Russian roulette at the vertex that ends segment `segments` with a path that leaves it with this
/// `throughput`, as in [`continuation_probability`], which is returned if the path survives.
#[inline]
pub(crate) fn survive(segments: u32, throughput: Rgb, random: impl FnOnce() -> f32) -> Option<f32> {
    let probability = continuation_probability(segments, throughput);
    (probability >= 1.0 || random() < probability).then_some(probability)
}

/// Largest continuation probability of a path of `segments` segments.
#[inline]
pub(crate) fn most_probable(segments: u32) -> f32 {
    match segments {
        0..CERTAIN_BELOW => 1.0,
        CERTAIN_BELOW..ENDLESS => 1.0 - 1.0 / segments as f32,
        _ => 0.99,
    }
}

/// Upper bound of the fraction of light subpaths that reach `segments` segments. Nothing else ends paths
/// between perfect mirrors and by total reflection in glass; where each surface absorbs a fortieth of the
/// light, fewer paths get this far. Survivors carry more power, so that there is no bias.
pub(crate) fn survival_limit(segments: u32) -> f32 {
    CERTAIN_BELOW as f32 / segments.max(CERTAIN_BELOW) as f32
}
