//! Adaptive sampling: more samples where the noise is, without a bias.
//!
//! The error of a picture falls fastest where samples are in proportion to the root of noise over cost. How many a group
//! of pixels gets is told by the other groups of its block of 8 x 8 pixels and, less, by the blocks around it; its cost by
//! the tiles around: by samples that are independent of its own, which would bias it (docs/decisions/0024).

use super::canvas::Canvas;
use core::borrow::Borrow;
use core::ops::Range;
use halflight_core::estimate::{BLOCKS, BlockNoise};
use halflight_core::film::{GROUPS, TILE};
use serde::{Deserialize, Serialize};

/// Below this many samples of each pixel the noise is not known well enough.
pub(super) const FROM: u32 = 16;

/// What a pixel of a block around counts, next to one of the same block.
const AROUND: f64 = 1.0 / 16.0;

/// The least weight: nothing is left behind where its neighbours know nothing of its noise.
const LEAST: f64 = 0.3;

/// The greatest weight.
const MOST: f64 = 4.0;

/// The least gain for which it is done unasked.
pub(super) const PAYS: f64 = 1.15;

/// Groups of a block.
const ASKING: usize = GROUPS / BLOCKS;

/// What a sample of each tile costs, in rays: as the tiles around tell and as it is.
pub(super) struct Costs {
    told: Vec<f64>,
    own: Vec<f64>,
}

/// Those of a picture `width` pixels across.
pub(super) fn costs(canvas: &Canvas, width: u32) -> Costs {
    let across = width.div_ceil(TILE) as usize;
    let samples =
        |tile: usize| canvas.taken.get(tile).map(|taken| taken.iter().map(|n| u64::from(*n)).sum::<u64>());
    let cost = |tile: usize| Some((*canvas.rays.get(tile)? as f64, samples(tile)? as f64));
    let around = |tile: usize| {
        let (x, y) = (tile % across, tile / across);
        let others = near(y).flat_map(|row| near(x).map(move |column| (column, row)));
        let others = others.filter(|(column, row)| *column < across && (*column, *row) != (x, y));
        let all = others.filter_map(|(column, row)| cost(row * across + column));
        let (rays, samples) = all.fold((0.0, 0.0), |sum, more| (sum.0 + more.0, sum.1 + more.1));
        if rays > 0.0 { rays / samples } else { 1.0 }
    };
    let tiles = || 0..canvas.taken.len();
    let own = |tile| cost(tile).map_or(1.0, |(rays, samples)| rays / f64::max(samples, 1.0));
    Costs { told: tiles().map(around).collect(), own: tiles().map(own).collect() }
}

/// A row or column and those beside it.
fn near(c: usize) -> Range<usize> {
    c.saturating_sub(1)..c + 2
}

/// How many samples groups should have.
pub(super) struct Spread {
    /// Of each group, over their mean; 0 for groups that lie outside of the picture.
    pub(super) weights: Vec<[f32; GROUPS]>,
    /// By which factor error times cost are smaller than with the same number for all.
    pub(super) gain: f64,
}

impl Spread {
    /// For a picture `width` pixels across.
    pub(super) fn of(tiles: &[[BlockNoise; BLOCKS]], costs: &Costs, width: u32) -> Self {
        let across = 2 * width.div_ceil(TILE) as usize;
        let block = |x: usize, y: usize| {
            let tile = tiles.get(y / 2 * (across / 2) + x / 2).filter(|_| x < across);
            tile.map(|tile| tile[y % 2 * 2 + x % 2])
        };
        let cost = |costs: &[f64], tile: usize| costs.get(tile).copied().unwrap_or(1.0);
        let wanted = |tile: usize, group: usize| {
            let (number, asking) = (group / ASKING, group % ASKING);
            let (x, y) = (tile % (across / 2) * 2 + number % 2, tile / (across / 2) * 2 + number / 2);
            let own = block(x, y).unwrap_or_default();
            if own.own[asking].pixels == 0 {
                return 0.0;
            }
            let around = near(y).flat_map(|row| near(x).map(move |column| (column, row)));
            let around = around.filter(|place| *place != (x, y)).filter_map(|(x, y)| block(x, y));
            let (mut sum, mut pixels) = (own.others[asking].sum, f64::from(own.others[asking].pixels));
            for other in around.map(|block| block.all()) {
                sum += AROUND * other.sum;
                pixels += AROUND * f64::from(other.pixels);
            }
            // Where there is nobody to tell, as if it were quiet.
            (sum / pixels.max(1.0) / cost(&costs.told, tile)).sqrt().max(f64::MIN_POSITIVE)
        };
        let wanted: Vec<[f64; GROUPS]> =
            (0..tiles.len()).map(|tile| core::array::from_fn(|group| wanted(tile, group))).collect();
        let inside = || wanted.iter().flatten().filter(|wanted| **wanted > 0.0);
        let mean = inside().sum::<f64>() / inside().count().max(1) as f64;
        let weight = |wanted: f64| match wanted > 0.0 {
            true if mean > f64::MIN_POSITIVE => (LEAST + (1.0 - LEAST) * wanted / mean).min(MOST) as f32,
            true => 1.0,
            false => 0.0,
        };
        let weights: Vec<[f32; GROUPS]> = wanted.iter().map(|groups| groups.map(weight)).collect();

        // What groups see and cost themselves has had no part in their weights, so that it may judge them.
        let (mut even, mut spread, mut even_cost, mut spread_cost) = (0.0, 0.0, 0.0, 0.0);
        for (tile, (weights, blocks)) in weights.iter().zip(tiles).enumerate() {
            let own = blocks.iter().flat_map(|block| block.own);
            for (weight, own) in weights.iter().zip(own).filter(|(weight, _)| **weight > 0.0) {
                let (weight, cost) = (f64::from(*weight), cost(&costs.own, tile) * f64::from(own.pixels));
                even += own.sum;
                spread += own.sum / weight;
                even_cost += cost;
                spread_cost += weight * cost;
            }
        }
        let gain = if spread > 0.0 { even * even_cost / (spread * spread_cost) } else { 1.0 };
        Self { weights, gain }
    }
}

/// How many samples groups get. What has been taken is not asked: a render that is cut, at whatever place, goes on as if it
/// had not been.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Weights {
    /// Samples over their mean; 0 for groups that lie outside of the picture.
    of: Vec<[f32; GROUPS]>,
    /// Samples that all had when this was found.
    even: u32,
}

impl Weights {
    pub(super) fn new(of: Vec<[f32; GROUPS]>, even: u32) -> Self {
        Self { of, even }
    }

    pub(super) fn tiles(&self) -> usize {
        self.of.len()
    }

    /// Samples for each group, `target` in the mean, none less than all had already.
    pub(super) fn targets(&self, target: u32) -> Vec<[u32; GROUPS]> {
        let at = |scale: f64| {
            let samples = move |weight: f32| ((f64::from(weight) * scale) as u32).max(self.even);
            self.of.iter().map(move |weights| weights.map(samples))
        };
        let (mut low, mut high) = (0.0, f64::from(target) / LEAST + 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.mean(at(middle)) < target { low = middle } else { high = middle }
        }
        at(high).collect()
    }

    /// How many samples of those `taken` pixels have in the mean, those outside of the picture not counted.
    pub(super) fn mean(&self, taken: impl IntoIterator<Item = impl Borrow<[u32; GROUPS]>>) -> u32 {
        let (mut sum, mut count) = (0u64, 0u64);
        for (weights, taken) in self.of.iter().zip(taken) {
            for (_, taken) in weights.iter().zip(taken.borrow()).filter(|(weight, _)| **weight > 0.0) {
                sum += u64::from(*taken);
                count += 1;
            }
        }
        (sum / count.max(1)) as u32
    }

    /// The target that is being worked on when so many samples are `taken`: all lower ones are reached.
    pub(super) fn next(&self, taken: &[[u32; GROUPS]]) -> u32 {
        let mean = self.mean(taken);
        let targets = self.targets(mean);
        let reached =
            taken.iter().flatten().zip(targets.iter().flatten()).all(|(taken, target)| taken >= target);
        if reached { mean } else { mean.saturating_sub(1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::estimate::Noise;

    fn weights() -> Weights {
        let mut of = vec![[1.0; GROUPS]; 2];
        of[0][..5].copy_from_slice(&[0.3, 0.5, 1.0, 2.2, 0.0]);
        Weights::new(of, 16)
    }

    #[test]
    fn targets_add_up_and_take_nothing_back() {
        let weights = weights();
        let targets = weights.targets(32);
        assert_eq!(weights.mean(&targets), 32);
        assert!(targets.iter().flatten().all(|target| *target >= 16));
        assert!(targets[0][3] > 2 * targets[1][4] && targets[0][4] == 16);
    }

    #[test]
    fn the_last_group_belongs_to_the_others() {
        let weights = weights();
        for target in 17..200 {
            let (before, after) = (weights.targets(target - 1), weights.targets(target));
            assert_eq!(weights.next(&before), target - 1);
            // Group after group, up to the last one that lacks a sample.
            let mut taken = before.clone();
            for (tile, group) in (0..2).flat_map(|tile| (0..GROUPS).map(move |group| (tile, group))) {
                assert!(taken == after || weights.next(&taken) < target, "{target}");
                taken[tile][group] = after[tile][group];
            }
            assert_eq!(weights.next(&taken), target);
        }
    }

    /// A block in which each pixel has so much noise.
    fn block(noise: f64) -> BlockNoise {
        let of = |pixels: u32| Noise { sum: noise * f64::from(pixels), pixels };
        BlockNoise { own: [of(32); ASKING], others: [of(32); ASKING] }
    }

    fn even(costs: &[f64]) -> Costs {
        Costs { told: costs.to_vec(), own: costs.to_vec() }
    }

    #[test]
    fn without_noise_all_are_equal() {
        let spread = Spread::of(&[[block(0.0); BLOCKS]; 6], &even(&[7.0; 6]), 40);
        assert_eq!((spread.weights, spread.gain), (vec![[1.0; GROUPS]; 6], 1.0));
    }

    #[test]
    fn blocks_hear_of_their_neighbours() {
        let mut tiles = [[block(1.0); BLOCKS]; 4];
        // The lower right block of the upper left tile.
        tiles[0][3] = block(100.0);
        let Spread { weights, gain } = Spread::of(&tiles, &even(&[1.0; 4]), 32);
        let far = weights[3][6];
        assert!(weights[0][6..].iter().all(|weight| *weight > 3.0 * far), "{weights:?}");
        assert!([weights[3][0], weights[1][4], weights[1][0]].iter().all(|near| *near > 1.3 * far));
        assert_eq!(weights[1][2], far);
        assert!(gain > 1.5, "{gain}");
    }

    #[test]
    fn what_costs_more_gets_less() {
        let tiles = [[block(1.0); BLOCKS]; 2];
        let Spread { weights, gain } = Spread::of(&tiles, &even(&[1.0, 9.0]), 32);
        assert!(weights[0][0] > 1.4 * weights[1][0] && gain > 1.05, "{weights:?} {gain}");
        // It is the other way round, in truth.
        let wrong = Costs { told: vec![1.0, 9.0], own: vec![9.0, 1.0] };
        assert!(Spread::of(&tiles, &wrong, 32).gain < 0.95);
    }
}
