//! Weights of squared errors: 1 / (R² + 0.01 m²), with R from the neighbours of a pixel.
//!
//! A weight that knew the noise of its own pixel would make the error look too small, and a fit spreads
//! highlights and fireflies over their surroundings. R of a whole pixel is the median of the neighbours of
//! its cluster, or the pixel itself where both halves agree that it is a highlight. R of a mixed pixel is the
//! fit of its clusters, near the median of all neighbours.

use super::Both;
use super::despike::median;
use super::fit::{MOST_AROUND, View};
use super::surfaces::NO_CLUSTER;
use crate::estimate::RELMSE_OFFSET;

/// Ratio of the darker half of a highlight to the median of its neighbours.
const HIGHLIGHT: f32 = 4.0;

/// Largest ratio of the halves of a highlight.
const AGREEMENT: f32 = 3.0;

/// Largest ratio of a fit to the median of the neighbours.
const MOST_RATIO: f32 = 3.0;

/// Mean of both halves by their parts of the samples.
#[inline]
pub(super) fn mean(value: &Both, parts: [f32; 2]) -> [f32; 3] {
    core::array::from_fn(|c| parts[0] * value[c] + parts[1] * value[3 + c])
}

/// Weights of the channels of the pixel in column `x` and row `y`. `fitted` is the fit of a mixed pixel,
/// `parts` are those of the samples, `level` is the mean of the picture.
pub(super) fn weights(
    view: &View,
    [x, y]: [usize; 2],
    fitted: impl FnOnce() -> [f32; 3],
    parts: [f32; 2],
    level: f32,
) -> [f32; 3] {
    let own = y * view.width + x;
    let cluster = view.whole[own];
    let is_mixed = cluster == NO_CLUSTER;
    let (mut around, mut count) = ([[0.0; MOST_AROUND]; 3], 0);
    for other in view.around([x, y]).filter(|other| is_mixed || view.whole[*other] == cluster) {
        let light = mean(&view.values[other], parts);
        (0..3).for_each(|c| around[c][count] = light[c]);
        count += 1;
    }
    let fitted = if is_mixed { fitted() } else { [0.0; 3] };
    let value = &view.values[own];
    core::array::from_fn(|c| {
        let middle = median(&mut around[c][..count]);
        let (low, high) = (value[c].min(value[3 + c]), value[c].max(value[3 + c]));
        let is_highlight = low > HIGHLIGHT * middle && high < AGREEMENT * low;
        let light = match is_mixed {
            true => fitted[c].min(MOST_RATIO * middle).max(middle / MOST_RATIO),
            false => middle,
        };
        let light = if is_highlight { low } else { light };
        1.0 / (light * light + RELMSE_OFFSET as f32 * level * level)
    })
}
