//! Means of pixels nearby with the same surfaces and alike light: a filter for shadows and caustics, whose
//! borders no surface shows (joint bilateral filter, Petschnigg et al. 2004).
//!
//! The finest fits of a half are the guide of that half alone, so that the halves stay independent. Light is
//! alike where the fits differ by less than the noise around: the mean squared difference of samples and
//! fits over neighbours of the same cluster. Mixed pixels take the mean of those that see nearly the same
//! fractions of the same clusters.

use super::Both;
use super::alike::common;
use super::fit::View;
use super::surfaces::NO_CLUSTER;

/// Pixels on each side.
const RADIUS: usize = 5;

/// Pixels on each side in the rows of a disc, by their distance from its middle.
const REACH: [usize; RADIUS + 1] = [5, 5, 5, 4, 3, 2];

/// Squared difference of light in units of the noise of both pixels at which they are no longer alike.
const MOST_DIFFERENCE: f32 = 3.0;

/// Difference of the fractions of mixed pixels at which they are no longer alike.
const TOLERANCE: f32 = 0.6;

/// Least noise, for pixels without any.
const LEAST_NOISE: f32 = 1e-10;

/// Squared noise of each half around a pixel, the sum of the channels.
pub(super) fn noise(view: &View, finest: &[Both], [x, y]: [usize; 2]) -> [f32; 2] {
    let own = y * view.width + x;
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    let alike = view.around([x, y]).filter(|other| view.whole[*other] == view.whole[own]);
    for pixel in alike.chain([own]) {
        let (value, fit) = (&view.values[pixel], &finest[pixel]);
        let square = |c: usize| (value[c] - fit[c]) * (value[c] - fit[c]);
        sums[0] += square(0) + square(1) + square(2);
        sums[1] += square(3) + square(4) + square(5);
        count += 1.0;
    }
    sums.map(|sum| sum / count)
}

/// Mean of the pixels like the one in column `x` and row `y`.
pub(super) fn light(view: &View, finest: &[Both], noise: &[[f32; 2]], [x, y]: [usize; 2]) -> Both {
    let own = y * view.width + x;
    let cluster = view.whole[own];
    let mut mean = Mean { guide: &finest[own], noise: noise[own], sums: [[0.0; 3]; 2], totals: [0.0; 2] };
    for row in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(view.height) {
        let reach = REACH[y.abs_diff(row)];
        let first = row * view.width + x.saturating_sub(reach);
        let end = row * view.width + (x + reach + 1).min(view.width);
        let pixels = view.whole[first..end].iter().zip(&finest[first..end]).zip(&noise[first..end]);
        for (i, (((whole, fit), noise), value)) in pixels.zip(&view.values[first..end]).enumerate() {
            if *whole != cluster {
                continue;
            }
            let similar = match cluster {
                NO_CLUSTER => {
                    let common = common(&view.surfaces[own], &view.surfaces[first + i]);
                    (1.0 - (1.0 - common) / TOLERANCE).max(0.0)
                }
                _ => 1.0,
            };
            mean.add(fit, *noise, value, similar);
        }
    }
    let Mean { guide, sums, totals, .. } = mean;
    core::array::from_fn(|i| {
        let (half, c) = (i / 3, i % 3);
        if totals[half] > 0.0 { sums[half][c] / totals[half] } else { guide[i] }
    })
}

/// Weighted sums of both halves around a pixel.
struct Mean<'p> {
    guide: &'p Both,
    noise: [f32; 2],
    sums: [[f32; 3]; 2],
    totals: [f32; 2],
}

impl Mean<'_> {
    /// Adds a pixel by its fit, its noise and its light, as far as it is alike.
    #[inline(always)]
    fn add(&mut self, fit: &Both, noise: [f32; 2], value: &Both, similar: f32) {
        let apart: Both = core::array::from_fn(|c| self.guide[c] - fit[c]);
        for half in 0..2 {
            let [r, g, b] = [0, 1, 2].map(|c| apart[3 * half + c]);
            let most = MOST_DIFFERENCE * (self.noise[half] + noise[half] + LEAST_NOISE);
            let weight = (1.0 - (r * r + g * g + b * b) / most).max(0.0);
            let weight = similar * weight * weight;
            self.totals[half] += weight;
            (0..3).for_each(|c| self.sums[half][c] += weight * value[3 * half + c]);
        }
    }
}
