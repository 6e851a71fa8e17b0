//! Sums over the pixels of one tile of the differences of their halves, input of [`super::ErrorEstimate`].

use super::empirical_bayes::{Neighbourhood, Pair, Posterior, Shrinkage};
use super::metric::RELMSE_OFFSET;
use super::tile_statistics::{TileStatistics, brightness};
use crate::film::{GROUPS, PIXELS_PER_TILE, Pixel, Tile};
use glam::Vec4;

/// Pixels per block, 4 × 4 neighbours along the Z-curve, which may share photons.
pub(super) const BLOCK: usize = 16;

/// Number of blocks of a tile.
pub(super) const BLOCKS: usize = PIXELS_PER_TILE / BLOCK;

/// Light of a tile; summed over all tiles it gives the m of relMSE.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileLight {
    sum: f64,
    pixels: u64,
}

impl TileLight {
    /// Light of the pixels of one tile.
    pub fn of(pixels: &[Pixel]) -> Self {
        let filled = pixels.iter().filter(|pixel| pixel.count() > 0);
        filled.fold(Self::default(), |light, pixel| Self {
            sum: light.sum + f64::from(pixel.mean().element_sum()),
            pixels: light.pixels + 1,
        })
    }

    /// Mean over pixels and channels; 0 without pixels.
    pub fn mean(&self) -> f64 {
        self.sum / (3 * self.pixels.max(1)) as f64
    }
}

impl core::ops::AddAssign for TileLight {
    fn add_assign(&mut self, other: Self) {
        self.sum += other.sum;
        self.pixels += other.pixels;
    }
}

/// Sums over the pixels and channels of one tile, of squared differences over R² + 0.01 m². A and B are the
/// means of the halves, A₁, A₂, B₁, B₂ of the quarters. The pairs (A₁, B₁) and (A₂, B₂) each have an estimate
/// R of the pixel ([`Shrinkage`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileError {
    /// Number of values, three per pixel.
    pub(super) values: u64,
    /// Variance of the picture by (A − B)² over R², averaged over both R.
    pub(super) halves: f64,
    /// `halves` if the estimates R were certain.
    pub(super) certain: f64,
    /// `halves` if R were the value of the pixel itself: a firefly hides itself.
    pub(super) least: f64,
    /// Sum of the squares of `least` per pixel.
    pub(super) least_squares: f64,
    /// Decrease of `halves` with the R of the brighter pair alone: the other may have missed light.
    pub(super) unseen: f64,
    /// Variance of the pictures of both pairs over R², averaged over both R.
    pub(super) parts: f64,
    /// `parts`, with each variance over the R² of the other pair: numerator and denominator are independent.
    /// Too large if one pair missed light that the other met.
    pub(super) crossed: f64,
    /// Sum of the squares of `halves` per pixel.
    pub(super) squares: f64,
    /// Sum of the fourth powers of `halves` per pixel.
    pub(super) fourths: f64,
    /// Sum of the squared bounds of errors above the variances ([`above`]).
    pub(super) above: f64,
    /// Sum of (A − B) / R, which is correlated between pixels as the errors are.
    pub(super) difference: f64,
    /// Sum of the squares of `difference` per pixel.
    pub(super) differences: f64,
    /// Sums over groups, which may share paths.
    pub(super) groups: Parts,
    /// Sums over blocks of 4 × 4 neighbours, which may share photons.
    pub(super) blocks: Parts,
}

/// Sums over parts of a picture with correlated errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Parts {
    /// Squares of the sums of (A − B) / R over the pixels of a part.
    pub(super) differences: f64,
    /// Squares of the sums of the variances in `halves`.
    pub(super) variances: f64,
}

impl Parts {
    /// Squares of both sums of each part.
    pub(super) fn of<const N: usize>(parts: [[f64; 2]; N]) -> Self {
        let [differences, variances] = [0, 1].map(|i| parts.iter().map(|part| part[i] * part[i]).sum());
        Self { differences, variances }
    }
}

impl core::ops::AddAssign for Parts {
    fn add_assign(&mut self, other: Self) {
        self.differences += other.differences;
        self.variances += other.variances;
    }
}

impl TileError {
    /// Sums of the `pixels` of `tile` in a picture of mean `mean` > 0. Skips pixels whose halves have fewer
    /// than two samples each.
    pub fn of(tile: Tile, pixels: &[Pixel], mean: f64, shrinkage: &Shrinkage) -> Self {
        let scale = (1.0 / mean) as f32;
        let seen = TileStatistics::new(tile, pixels, scale);
        let mut sums = Self::default();
        let (mut groups, mut blocks) = ([[0.0; 2]; GROUPS], [[0.0; 2]; BLOCKS]);
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            let place = tile.index_in_square(i);
            let Some(quarters @ [a1, a2, b1, b2]) = seen.quarters[place] else { continue };
            let (pairs, around) = (Pair::both(quarters), Neighbourhood::new(seen.around[place]));
            let posterior = pairs.map(|pair| shrinkage.posterior(pair, &around));
            let by = posterior.map(|posterior| posterior.spread * posterior.over_square);
            let [first, second] = pairs.map(|pair| pair.noise());
            let by_both = 0.5 * (by[0] + by[1]);
            sums.values += 3;
            let noise = pixel.scaled_variance(scale).extend(0.0);
            sums.certain += total(noise * (posterior[0].over_square + posterior[1].over_square) * 0.5);
            let variance = total(noise * by_both);
            let squared = variance * variance;
            sums.halves += variance;
            sums.squares += squared;
            sums.fourths += squared * squared;
            let darker = total(noise * (by[0].max(by[1]) - by_both));
            let (seen, around) = (0.25 * (a1 + a2 + b1 + b2), seen.around[place]);
            let least = total(noise / (seen * seen + RELMSE_OFFSET as f32));
            sums.least += least;
            sums.least_squares += least * least;
            sums.unseen += total(noise * (by_both - by[0].min(by[1])));
            sums.above += above([variance, darker], posterior, seen, around, by_both);
            sums.parts += total((first + second) * by_both * 0.5);
            sums.crossed += total(0.5 * (first * by[1] + second * by[0]));
            let difference = total(a1 + a2 - b1 - b2) * libm::sqrt(total(by_both));
            sums.difference += difference;
            sums.differences += difference * difference;
            for part in [&mut groups[Tile::group(i)], &mut blocks[i / BLOCK]] {
                part[0] += difference;
                part[1] += variance;
            }
        }
        (sums.groups, sums.blocks) = (Parts::of(groups), Parts::of(blocks));
        sums
    }
}

/// Sum over tiles; a region of tiles with correlated errors is such a sum.
impl core::ops::AddAssign for TileError {
    fn add_assign(&mut self, other: Self) {
        self.values += other.values;
        self.halves += other.halves;
        self.certain += other.certain;
        self.least += other.least;
        self.least_squares += other.least_squares;
        self.unseen += other.unseen;
        self.parts += other.parts;
        self.crossed += other.crossed;
        self.squares += other.squares;
        self.fourths += other.fourths;
        self.above += other.above;
        self.difference += other.difference;
        self.differences += other.differences;
        self.groups += other.groups;
        self.blocks += other.blocks;
    }
}

/// Squared bound of the error of a pixel above its variance V: 4 V² in the mean, and little if a single
/// sample has nearly all of V. Such a firefly is either one too many, and the error is V, or one of the few
/// that belong there, and the error is less. `seen` is the pixel, `around` its neighbours. V, and its excess
/// `darker` with the R of the darker pair, are weighted by `weights`.
///
/// With the difference T = (A − R)(B − R) = (I − R)² − V and the uncertainty v of R, the bound is T² + 4 (I −
/// R)² v, and 4/3 V² for the share of the pixel that is believed. For unknown classes, R may be that of the
/// darker pair.
fn above(
    [variance, darker]: [f64; 2],
    posterior: [Posterior; 2],
    seen: Vec4,
    around: Vec4,
    weights: Vec4,
) -> f64 {
    /// Maximum of (I − R)² over V; more is due to an edge that R does not follow.
    const MAX_DISTANCE: f64 = 3.0;
    /// Mean of T² over 4 V² for normal noise, with that maximum.
    const MEAN_SQUARE: f64 = 0.563;
    /// A belief of 95 % is two standard errors.
    const BELIEVED: f64 = 0.25;
    let square = |light: Vec4| total(light * light * weights);
    let light = 0.5 * (posterior[0].light + posterior[1].light);
    let share = f64::from(0.5 * (posterior[0].share + posterior[1].share)).clamp(0.0, 1.0);
    let distance = square(seen - light).min(MAX_DISTANCE * variance);
    let unknown = square(light - around).min(share * variance);
    let difference = distance - variance;
    let darker = f64::from(posterior[0].prior_weight.max(posterior[1].prior_weight)) * darker;
    (1.0 - share) / MEAN_SQUARE * difference * difference
        + 4.0 / 3.0 * share * share * variance * variance
        + 4.0 * distance * unknown
        + BELIEVED * darker * darker
}

fn total(values: Vec4) -> f64 {
    f64::from(brightness(values))
}
