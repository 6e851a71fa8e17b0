//! What the halves of one tile disagree by: sums from which [`super::ErrorEstimate`] is made.

use super::empirical_bayes::{Neighbourhood, Pair, Posterior, Shrinkage};
use super::metric::DARK;
use super::tile_statistics::{TileStatistics, brightness};
use crate::film::{GROUPS, PIXELS_PER_TILE, Pixel, Tile};
use glam::Vec4;

/// Pixels of a block, 4 × 4 neighbours along the Z-curve, which may share photons.
pub(super) const BLOCK: usize = 16;

/// Blocks of a tile.
pub(super) const BLOCKS: usize = PIXELS_PER_TILE / BLOCK;

/// The light of a tile: over all tiles it gives the m of relMSE.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileLight {
    sum: f64,
    pixels: u64,
}

impl TileLight {
    /// Of the pixels of one tile.
    pub fn of(pixels: &[Pixel]) -> Self {
        let filled = pixels.iter().filter(|pixel| pixel.count() > 0);
        filled.fold(Self::default(), |light, pixel| Self {
            sum: light.sum + f64::from(pixel.mean().element_sum()),
            pixels: light.pixels + 1,
        })
    }

    /// The mean over pixels and channels; 0 where there are none.
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
/// means of the halves, A₁, A₂, B₁, B₂ of their parts; the R of each pair, of A₁ and B₁ and of A₂ and B₂, is
/// what the pair says that the pixel is ([`Shrinkage`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileError {
    /// Values: three for each pixel.
    pub(super) values: u64,
    /// Variance of the picture by (A − B)² over the squares of both R: the mean of both quotients.
    pub(super) halves: f64,
    /// The same, as if what pixels probably are was what they are.
    pub(super) certain: f64,
    /// The same, as if pixels were what they look like: a flash hides itself.
    pub(super) least: f64,
    /// Squares of that in pixels.
    pub(super) least_squares: f64,
    /// Variance of the pictures of both pairs over the squares of both R.
    pub(super) parts: f64,
    /// The same, each over the square of the other R: numerator and denominator are independent. Too large
    /// where a pair saw nothing of a light that the other met.
    pub(super) crossed: f64,
    /// Squares of the variances of pixels in `halves`.
    pub(super) squares: f64,
    /// The squares of those squares.
    pub(super) fourths: f64,
    /// Squares of what the errors of pixels may be above their variances ([`above`]).
    pub(super) above: f64,
    /// Sum of (A − B) / R, which hangs together between pixels as the errors do,
    pub(super) difference: f64,
    /// and of its squares in pixels.
    pub(super) differences: f64,
    /// Of groups, which may share their paths.
    pub(super) groups: Parts,
    /// Of blocks of 4 × 4 neighbours, which may share photons.
    pub(super) blocks: Parts,
}

/// Sums over parts of a picture whose errors may hang together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Parts {
    /// Squares of the sums of (A − B) / R over their pixels.
    pub(super) differences: f64,
    /// Squares of the sums of the variances in `halves`.
    pub(super) variances: f64,
}

impl Parts {
    /// From both sums of each part.
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
    /// The error of the `pixels` of `tile` in a picture of mean `mean` > 0, with what its tiles tell of it.
    /// Pixels whose halves have no two samples each are left out.
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
            let least = total(noise / (seen * seen + DARK as f32));
            sums.least += least;
            sums.least_squares += least * least;
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

/// Tiles whose errors hang together count as one.
impl core::ops::AddAssign for TileError {
    fn add_assign(&mut self, other: Self) {
        self.values += other.values;
        self.halves += other.halves;
        self.certain += other.certain;
        self.least += other.least;
        self.least_squares += other.least_squares;
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

/// The square of what the error of a pixel may be above its variance V: 4 V² in the mean, and little where a
/// single sample has nearly all of V. Such a flash is one too many, and the error is V; or one of the few
/// that there should be, and it is less. `seen` is the pixel, `around` its neighbours; V and how much more it
/// would be with the R of the `darker` pair are weighed by `weights`.
///
/// With T = (A − R)(B − R) = (I − R)² − V for the difference, and v for what is not known of R: T² + 4 (I −
/// R)² v, and 4/3 V² for as much as the pixel itself is believed. Where pixels like it are not known, R may
/// be that of the darker pair.
fn above(
    [variance, darker]: [f64; 2],
    posterior: [Posterior; 2],
    seen: Vec4,
    around: Vec4,
    weights: Vec4,
) -> f64 {
    /// (I − R)² over V at most: more comes from an edge that R does not follow.
    const MOST: f64 = 3.0;
    /// The mean of T² over 4 V², for normal noise, where that is the most.
    const CUT: f64 = 0.563;
    /// What is believed with 95 % is two standard errors.
    const BELIEVED: f64 = 0.25;
    let square = |light: Vec4| total(light * light * weights);
    let light = 0.5 * (posterior[0].light + posterior[1].light);
    let share = f64::from(0.5 * (posterior[0].share + posterior[1].share)).clamp(0.0, 1.0);
    let distance = square(seen - light).min(MOST * variance);
    let unknown = square(light - around).min(share * variance);
    let difference = distance - variance;
    let darker = f64::from(posterior[0].doubt.max(posterior[1].doubt)) * darker;
    (1.0 - share) / CUT * difference * difference
        + 4.0 / 3.0 * share * share * variance * variance
        + 4.0 * distance * unknown
        + BELIEVED * darker * darker
}

fn total(values: Vec4) -> f64 {
    f64::from(brightness(values))
}
