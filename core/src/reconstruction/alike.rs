//! Mixed pixels whose clusters no block fits, such as needles and leaves: mean over the mixed pixels nearby
//! that see nearly the same fractions of the same clusters.

use super::fit::View;
use super::surfaces::PixelSurfaces;
use super::{Both, VALUES};

/// Pixels on each side.
const RADIUS: usize = 5;

/// Difference of fractions at which a pixel is no longer alike.
const TOLERANCE: f32 = 0.3;

/// Mean of the pixels like the mixed one in column `x` and row `y`.
pub(super) fn light(view: &View, [x, y]: [usize; 2]) -> Both {
    let own = &view.surfaces[y * view.width + x];
    let (mut sum, mut total) = ([0.0; VALUES], 0.0);
    for row in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(view.height) {
        for column in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(view.width) {
            let square = |a: usize, b: usize| (a.abs_diff(b) * a.abs_diff(b)) as f32;
            let reach = RADIUS as f32 + 0.5;
            let far = (square(x, column) + square(y, row)) / (reach * reach);
            let other = &view.surfaces[row * view.width + column];
            if far >= 1.0 || other.is_whole() {
                continue;
            }
            let weight = (1.0 - far) * (1.0 - (1.0 - common(own, other)) / TOLERANCE).max(0.0);
            total += weight;
            let value = &view.values[row * view.width + column];
            (0..VALUES).for_each(|c| sum[c] += weight * value[c]);
        }
    }
    if total > 0.0 { sum.map(|sum| sum / total) } else { view.values[y * view.width + x] }
}

/// Fraction of two pixels that sees the same clusters.
pub(super) fn common(a: &PixelSurfaces, b: &PixelSurfaces) -> f32 {
    let of_a = |(cluster, fraction): (u32, f32)| {
        let same = b.parts().filter(move |(other, _)| *other == cluster);
        same.map(|(_, other)| other.min(fraction)).sum::<f32>()
    };
    a.parts().map(of_a).sum()
}
