//! Fireflies of one half: light far above the neighbours of the same cluster is spread over the cluster
//! nearby. Its sum stays.
//!
//! Each half is treated alone, so that the halves stay independent. Windows of overlapping blocks sum to one,
//! so that the light of each pixel is divided among its blocks, and each block spreads its part.

use super::Both;
use super::fit::{MOST_AROUND, View};
use super::surfaces::NO_CLUSTER;

/// Multiple of the spread of the neighbours above their median that is no firefly.
const LIMIT: f32 = 8.0;

/// Standard deviation of the normal distribution over its median absolute deviation.
const OF_MEDIAN_DEVIATION: f32 = 1.4826;

/// Excess in units of the median that is no firefly.
const OF_MEDIAN: f32 = 0.02;

/// Fewest neighbours of the same cluster.
const FEWEST: usize = 10;

/// The part of the light of both halves of a pixel that exceeds its neighbours.
pub(super) fn excess(view: &View, [x, y]: [usize; 2]) -> Both {
    let own = y * view.width + x;
    let cluster = view.whole[own];
    let mut excess = [0.0; 6];
    if cluster == NO_CLUSTER {
        return excess;
    }
    let (mut near, mut count) = ([[0.0f32; MOST_AROUND]; 2], 0);
    for other in view.around([x, y]).filter(|other| view.whole[*other] == cluster) {
        let light = brightness(&view.values[other]);
        (near[0][count], near[1][count]) = (light[0], light[1]);
        count += 1;
    }
    if count < FEWEST {
        return excess;
    }
    let light = brightness(&view.values[own]);
    for half in 0..2 {
        let near = &mut near[half][..count];
        // At least half of the neighbours are as dark as the median.
        if 2 * near.iter().filter(|other| **other <= light[half]).count() < count {
            continue;
        }
        let middle = median(near);
        near.iter_mut().for_each(|other| *other = (*other - middle).abs());
        let spread = OF_MEDIAN_DEVIATION * median(near);
        let over = light[half] - middle - LIMIT * spread - OF_MEDIAN * middle;
        if over > 0.0 {
            let fraction = over / light[half];
            (3 * half..3 * half + 3).for_each(|c| excess[c] = fraction * view.values[own][c]);
        }
    }
    excess
}

/// Mean of the channels of each half.
pub(super) fn brightness(value: &Both) -> [f32; 2] {
    [(value[0] + value[1] + value[2]) / 3.0, (value[3] + value[4] + value[5]) / 3.0]
}

/// Upper median.
pub(super) fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let (_, middle, _) = values.select_nth_unstable_by(values.len() / 2, f32::total_cmp);
    *middle
}
