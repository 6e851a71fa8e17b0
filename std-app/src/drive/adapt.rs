//! Adaptive sampling: more samples where the noise is, without a bias.
//!
//! The error of a picture falls fastest where each tile has samples in proportion to the root of its noise. But a pixel
//! whose own samples decide how many it gets has a biased mean: what looks bright by chance is corrected, what looks
//! dark is left (Kirk and Arvo 1991, "Unbiased sampling techniques for image synthesis"). So a tile gets its samples by
//! the noise of the tiles around it, whose samples are independent of its own.

use halflight_core::estimate::TileError;
use halflight_core::film::TILE;

/// Below this many samples of each pixel the noise is not known well enough.
pub(super) const FROM: u32 = 16;

/// The least weight: no tile is left behind where its neighbours know nothing of its noise.
const LEAST: f64 = 0.3;

/// The greatest weight.
const MOST: f64 = 4.0;

/// How many samples each tile of a picture `width` pixels across should have, over their mean. `taken` is what each has.
pub(super) fn weights(tiles: &[TileError], taken: &[u32], width: u32) -> Vec<f32> {
    // Noise of one sample.
    let noise: Vec<f64> =
        tiles.iter().zip(taken).map(|(tile, taken)| tile.noise() * f64::from(*taken)).collect();
    let across = width.div_ceil(TILE) as usize;
    let down = tiles.len().div_ceil(across.max(1));
    let around = |task: usize| {
        let (x, y) = (task % across, task / across);
        let near = |c: usize, end: usize| c.saturating_sub(1)..(c + 2).min(end);
        let others = near(y, down).flat_map(|row| near(x, across).map(move |column| row * across + column));
        let others = others.filter(|other| *other != task).filter_map(|other| noise.get(other));
        let (sum, count) = others.fold((0.0, 0u32), |(sum, count), noise| (sum + noise, count + 1));
        (sum / f64::from(count.max(1))).sqrt()
    };
    let wanted: Vec<f64> = (0..tiles.len()).map(around).collect();
    let mean = wanted.iter().sum::<f64>() / wanted.len().max(1) as f64;
    if mean.is_nan() || mean <= 0.0 {
        return vec![1.0; tiles.len()];
    }
    wanted.iter().map(|wanted| (LEAST + (1.0 - LEAST) * wanted / mean).min(MOST) as f32).collect()
}

/// Samples for each tile: in proportion to `weights`, not fewer than are `taken`, `target` for a tile in the mean.
pub(super) fn targets(weights: &[f32], taken: &[u32], target: u32) -> Vec<u32> {
    let at = |scale: f64| {
        let tile = move |(weight, taken): (&f32, &u32)| ((f64::from(*weight) * scale) as u32).max(*taken);
        weights.iter().zip(taken).map(tile)
    };
    let wanted = u64::from(target) * weights.len() as u64;
    let (mut low, mut high) = (0.0, f64::from(target) / LEAST + 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if at(middle).map(u64::from).sum::<u64>() < wanted { low = middle } else { high = middle }
    }
    at(high).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_add_up_and_take_nothing_back() {
        let weights = [0.3, 0.5, 1.0, 2.2, 1.0];
        let taken = [16, 16, 40, 16, 16];
        let targets = targets(&weights, &taken, 32);
        let sum: u32 = targets.iter().sum();
        assert!((5 * 32..5 * 32 + 5).contains(&sum), "{targets:?}");
        assert!(targets.iter().zip(&taken).all(|(target, taken)| target >= taken));
        assert!(targets[3] > 2 * targets[4] && targets[2] == 40);
    }

    #[test]
    fn without_noise_all_are_equal() {
        assert_eq!(weights(&[TileError::default(); 6], &[16; 6], 40), [1.0; 6]);
    }
}
