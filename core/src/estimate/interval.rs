//! Error of a picture from itself: relMSE and its 95 % interval (docs/decisions/error-estimate.md).
//!
//! The plain algorithm: half-films A and B are independent and unbiased, so that ((A − B) / 2)² has the
//! variance of their mean I as mean; its mean over pixels, over I² + 0.01 m², is the relMSE. Departures:
//! 1. I is not R. A firefly enlarges its own denominator and hides itself; where samples missed light the
//!    denominator is too small. Denominators are therefore class means ([`super::Shrinkage`]), and quotients
//!    are averaged over the denominators of both pairs of quarters.
//! 2. The remaining error shows if numerator and denominator are independent: the variance of one pair over
//!    the squared R of the *other* is too large, since where light is rare a large variance meets a small R.
//!    The error lies in between: with δ the logarithm of their quotient, the logarithm of the estimate rises
//!    by δ / (1 + 10 δ), with an uncertainty from no rise to all of δ. The correction for pixels whose R is
//!    uncertain has its own size as uncertainty in both directions.
//! 3. The error of this picture minus its estimate is exactly the mean product of the errors of both halves.
//!    For a pixel of variance V the product has the variance 4 V², and the squared estimate the mean 3 V²
//!    (more with heavy tails). Student's t accounts for few pixels. The correlation of errors between pixels
//!    that share paths, and within a region where all is shared, shows in the differences of the halves. The
//!    upper end is nearer if single samples have the noise: the error of a pixel with a firefly hardly
//!    exceeds its variance, if such pixels are many. If they are few, the lower end is at most the error if
//!    all fireflies were legitimate light. Where the pairs disagree on R the darker one may have missed
//!    light, as in pixels at the edge of a lamp: the lower end starts from the R of the brighter pair.
//!
//! The price: about a tenth of the time of a sample per pixel.

use super::TileError;
use super::student::{NORMAL_95, student_quantile};
use super::tile::{BLOCK, Parts};
use crate::film::{CIRCLE, GROUP};
use libm::{exp, fmax, fmin, hypot, log, sqrt};

/// Estimate of the relMSE and its 95 % interval, as far as one picture shows: light that no sample has met is
/// not included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Estimated relMSE.
    pub relmse: f64,
    /// Lower end of the interval.
    pub lower: f64,
    /// Upper end of the interval.
    pub upper: f64,
}

/// Number of independent pixels with nearly all noise below which intervals follow Student's t, with this
/// many degrees of freedom. Above, they follow the normal distribution: squares of heavy tails tend to be too
/// large, and Student's t would apply to squares that are as often too small.
const MIN_FREEDOM: f64 = 8.0;

/// Number of independent pixels with nearly all noise below which an interval reaches as far up as down, and
/// down to the error if all fireflies were legitimate light: so few do not show their frequency, and pixels
/// like them are unknown.
const FEW_FIREFLIES: f64 = 4.0;

/// Factor of the doubt of δ: a small δ counts in full, since both bounds are right to first order; where
/// light is rare the estimate rises by a tenth at most.
const DELTA_DAMPING: f64 = 10.0;

/// The share of the estimate that is there at least, whatever light samples missed.
const LEAST_SEEN: f64 = 0.01;

impl ErrorEstimate {
    /// The larger of two estimates of which each has parts that the other lacks.
    pub(crate) fn larger(self, other: Self) -> Self {
        Self {
            relmse: self.relmse.max(other.relmse),
            lower: self.lower.max(other.lower),
            upper: self.upper.max(other.upper),
        }
    }

    /// Estimate from all tiles of a picture whose pixels share nothing, or share paths within groups and
    /// photons with neighbours; `None` if no pixel has four samples.
    #[doc(hidden)]
    pub fn of(tiles: impl Iterator<Item = TileError>) -> Option<Self> {
        let mut sum = TileError::default();
        tiles.for_each(|tile| sum += tile);
        Self::with_shared(&sum, shared(&sum), sum.above)
    }

    /// Estimate from the sums over regions, for a method that also shares between distant pixels.
    pub(super) fn of_regions(regions: impl Iterator<Item = TileError>) -> Option<Self> {
        let (mut sum, mut parts, mut count) = (TileError::default(), Parts::default(), 0);
        for region in regions.filter(|region| region.values > 0) {
            parts += Parts::of([[region.difference, region.halves]]);
            sum += region;
            count += 1;
        }
        let pixels = (sum.values / 3) as f64 / f64::from(count.max(1));
        Self::with_shared(&sum, shared(&sum) + sharing_factor(&sum, parts, pixels), f64::INFINITY)
    }

    /// `shared`: factor of the variance of the estimate due to sharing. `above`: squared standard error to
    /// the upper end as if nothing were shared, if less than to the lower end.
    fn with_shared(sum: &TileError, shared: f64, above: f64) -> Option<Self> {
        let fireflies = degrees_of_freedom(sum.squares, sum.fourths) / shared;
        let quantile =
            if fireflies < MIN_FREEDOM { student_quantile(NORMAL_95, MIN_FREEDOM) } else { NORMAL_95 };
        Self::with_half_width(sum, quantile * sqrt(shared), above, fireflies)
    }

    /// `half_width`: standard errors from the estimate to an end of its interval, as if pixels were
    /// independent. `above`: squared standard error to the upper end, if less. `fireflies`: number of pixels
    /// with nearly all noise.
    fn with_half_width(sum: &TileError, half_width: f64, above: f64, fireflies: f64) -> Option<Self> {
        if sum.values == 0 {
            return None;
        }
        if !(sum.halves > 0.0 && sum.parts > 0.0) {
            // No noise, unless the sums overflow.
            return (sum.halves == 0.0).then_some(Self { relmse: 0.0, lower: 0.0, upper: 0.0 });
        }
        // 4 V² over the mean square of an estimate of V with normal noise, 3 V².
        const OF_SQUARE: f64 = 4.0 / 3.0;
        let below = OF_SQUARE * sum.squares;
        let above = if fireflies < FEW_FIREFLIES { below } else { fmin(above, below) };
        let certain = fmax(log(sum.halves / sum.certain), 0.0);
        let doubt = |square: f64| hypot(half_width * sqrt(square) / sum.halves, certain);
        let plain = sum.halves / sum.values as f64;
        let delta = fmax(log(sum.crossed / sum.parts), 0.0);
        let added = delta / (1.0 + DELTA_DAMPING * delta);
        let relmse = plain * exp(added);
        let upper = relmse * exp(hypot(doubt(above), delta - added));
        let unseen = log(sum.halves / fmax(sum.halves - sum.unseen, LEAST_SEEN * sum.halves));
        let mut lower = plain / exp(doubt(below) + unseen);
        if fireflies < FEW_FIREFLIES {
            let least = sum.least / sum.values as f64;
            lower = fmin(lower, least / exp(half_width * sqrt(OF_SQUARE * sum.least_squares) / sum.least));
        }
        Some(Self { relmse, lower, upper }).filter(|estimate| estimate.upper.is_finite())
    }
}

/// Factor of the variance of the sum of products of both halves' errors, due to errors that pixels of a group
/// or a block share.
fn shared(sum: &TileError) -> f64 {
    // A pixel shares each sample with half of its group: ρ² of the pairs that share is four times the square
    // of the mean ρ.
    const CIRCLES: f64 = (GROUP - 1) as f64 / (CIRCLE - 1) as f64;
    1.0 + CIRCLES * sharing_factor(sum, sum.groups, GROUP as f64)
        + sharing_factor(sum, sum.blocks, BLOCK as f64)
}

/// Contribution of `parts` of `pixels` pixels to that factor. With the correlation ρ between pixels, from the
/// squares of sums over parts and over pixels, it is ρ² Σ V_p V_q / Σ V_p² over all p ≠ q of a part.
/// Estimates of V have 1 + 2 ρ² times the former sum and 3 times the latter.
fn sharing_factor(sum: &TileError, parts: Parts, pixels: f64) -> f64 {
    let others = pixels - 1.0;
    if !(sum.differences > 0.0 && sum.squares > 0.0 && others > 0.0) {
        return 0.0;
    }
    let rho = fmax(parts.differences / sum.differences - 1.0, 0.0) / others;
    let pairs = 3.0 * fmax(parts.variances / sum.squares - 1.0, 0.0) / (1.0 + 2.0 * rho * rho);
    rho * rho * fmin(pairs, others)
}

/// Degrees of freedom of a sum, from the sums of squares and of fourth powers of its summands.
fn degrees_of_freedom(squares: f64, fourths: f64) -> f64 {
    if fourths > 0.0 { squares * squares / fourths } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::estimate::{BrightnessClasses, TileLight};
    use crate::film::{Dropped, PIXELS_PER_TILE, Pixel, TILE, Tile};
    use crate::sampling::Random;
    use std::vec::Vec;

    /// A picture of one tile.
    const ALONE: Tile = Tile::new(TILE, TILE, 0);

    /// A picture of `tiles` tiles of radiance 1 with uniform noise: samples between 1 − `noise` and 1 +
    /// `noise`.
    fn picture(tiles: u32, samples: u32, noise: f32, seed: u32) -> Vec<Vec<Pixel>> {
        shared_picture(tiles, samples, noise, 0.0, Tile::group, seed)
    }

    /// A picture in which the fraction `common` of the variance is noise that the pixels of each `part` of a
    /// tile share.
    fn shared_picture(
        tiles: u32,
        samples: u32,
        noise: f32,
        common: f32,
        part: fn(usize) -> usize,
        seed: u32,
    ) -> Vec<Vec<Pixel>> {
        let tile = |tile: u32| {
            (0..PIXELS_PER_TILE).map(move |i| {
                let own = Random::new(seed, tile << 8 | i as u32);
                let group = Random::new(!seed, tile << 8 | part(i) as u32);
                let mut pixel = Pixel::default();
                for sample in 0..samples {
                    let [own, group] = [own, group].map(|random| 2.0 * random.single(sample) - 1.0);
                    let value = 1.0 + noise * ((1.0 - common).sqrt() * own + common.sqrt() * group);
                    pixel.add(sample, Rgb::splat(value), &mut Dropped::default());
                }
                pixel
            })
        };
        (0..tiles).map(|i| tile(i).collect()).collect()
    }

    fn estimate(picture: &[Vec<Pixel>]) -> Option<ErrorEstimate> {
        ErrorEstimate::of(errors(picture).into_iter())
    }

    fn errors(picture: &[Vec<Pixel>]) -> Vec<TileError> {
        let mut light = TileLight::default();
        picture.iter().for_each(|tile| light += TileLight::of(tile));
        let (mean, mut alike) = (light.mean(), BrightnessClasses::default());
        picture.iter().for_each(|tile| alike.add(ALONE, tile, mean));
        let shrinkage = alike.shrinkage();
        picture.iter().map(|tile| TileError::of(ALONE, tile, mean, &shrinkage)).collect()
    }

    /// Error of a picture of radiance 1.
    fn truth(picture: &[Vec<Pixel>]) -> f64 {
        let errors = picture.iter().flatten().map(|pixel| f64::from(pixel.mean().x) - 1.0);
        errors.map(|e| e * e / 1.01).sum::<f64>() / (picture.len() * PIXELS_PER_TILE) as f64
    }

    #[test]
    fn known_noise_is_estimated() {
        // Sharing makes the errors of pictures scatter twice as much.
        for (common, tolerance) in [(0.0, 0.12), (0.5, 0.24)] {
            let (mut held, pictures) = (0, 60);
            for seed in 0..pictures {
                let picture = shared_picture(12, 16, 0.5, common, Tile::group, seed);
                let found = estimate(&picture).unwrap();
                // σ² = noise² / 3 for a sample; R² + 0.01 m² = 1.01.
                let expected = 0.25 / 3.0 / 16.0 / 1.01;
                assert!((found.relmse / expected - 1.0).abs() < tolerance, "{found:?} {expected}");
                held += u32::from((found.lower..=found.upper).contains(&truth(&picture)));
            }
            // 95 % of 60 are 57; fewer than 51 have a chance of 1 %.
            assert!(held >= 51, "{common}: {held} of {pictures}");
        }
    }

    #[test]
    fn what_regions_share_is_doubted_and_no_more() {
        // Without sharing, the interval of regions is hardly wider than that of pixels.
        let still = errors(&picture(64, 16, 0.5, 1));
        let [alone, together] =
            [ErrorEstimate::of(still.iter().copied()), ErrorEstimate::of_regions(still.into_iter())]
                .map(Option::unwrap);
        assert!(
            alone.relmse == together.relmse && together.upper / together.relmse < 1.1,
            "{alone:?} {together:?}"
        );
        let (mut held, mut held_by_pixels, pictures) = (0, 0, 60);
        for seed in 0..pictures {
            let picture = shared_picture(64, 16, 0.5, 0.3, |_| 0, seed);
            let (truth, tiles) = (truth(&picture), errors(&picture));
            let found = ErrorEstimate::of_regions(tiles.iter().copied()).unwrap();
            held += u32::from((found.lower..=found.upper).contains(&truth));
            let pixels = ErrorEstimate::of(tiles.into_iter()).unwrap();
            held_by_pixels += u32::from((pixels.lower..=pixels.upper).contains(&truth));
        }
        // 95 % of 60 are 57; fewer than 51 have a chance of 1 %.
        assert!(held >= 51 && held_by_pixels < 51, "{held}, {held_by_pixels} of {pictures}");
    }

    #[test]
    fn the_unit_of_light_does_not_matter() {
        let plain = estimate(&picture(2, 8, 0.5, 1)).unwrap();
        let mut bright = picture(2, 8, 0.5, 1);
        for pixel in bright.iter_mut().flatten() {
            let (old, mut new) = (*pixel, Pixel::default());
            for (index, half) in [old.even, old.odd].into_iter().enumerate() {
                for (part, mean) in half.parts().unwrap().into_iter().enumerate() {
                    for repeat in 0..2 {
                        new.add((index + 2 * part + 4 * repeat) as u32, mean * 1e20, &mut Dropped::default());
                    }
                }
            }
            *pixel = new;
        }
        let bright = estimate(&bright).unwrap();
        assert!((bright.relmse / plain.relmse - 1.0).abs() < 1e-4, "{bright:?} {plain:?}");
    }

    #[test]
    fn too_few_samples_and_pictures_without_noise() {
        assert_eq!(estimate(&picture(1, 3, 0.5, 0)), None);
        assert!(estimate(&picture(1, 4, 0.5, 0)).is_some());
        let still = estimate(&picture(1, 4, 0.0, 0)).unwrap();
        assert_eq!((still.relmse, still.lower, still.upper), (0.0, 0.0, 0.0));
    }

    #[test]
    fn a_firefly_is_seen_and_doubted() {
        let mut picture = picture(4, 16, 0.5, 3);
        let before = estimate(&picture).unwrap();
        picture[2][100].add(16, Rgb::splat(10_000.0), &mut Dropped::default());
        let after = estimate(&picture).unwrap();
        // Its contribution to the picture's 1: 10,000 / 17, squared, over 1024 pixels of three channels each.
        let truth = (1e4f64 / 17.0).powi(2) / 1.01 / 1024.0;
        assert!(after.relmse > 10.0 * before.relmse, "{before:?} {after:?}");
        assert!(after.lower < truth && truth < after.upper, "{truth} {after:?}");
        // One firefly does not show its frequency: the interval reaches as far up as down.
        assert!(after.upper > 10.0 * after.relmse, "{after:?}");
    }

    #[test]
    fn rare_flashes_are_no_more_than_they_add() {
        // About five fireflies per picture have nine tenths of its error.
        const FIREFLY: f32 = 50.0;
        let (chance, pictures) = (3e-4, 60);
        let (mut held, mut narrower) = (0, 0);
        for seed in 0..pictures {
            let tile = |tile: u32| {
                (0..PIXELS_PER_TILE).map(move |i| {
                    let random = Random::new(seed, tile << 8 | i as u32);
                    let mut pixel = Pixel::default();
                    for sample in 0..16 {
                        let [noise, flash] = [0, 1].map(|kind| random.single(2 * sample + kind));
                        let value = if flash < chance { FIREFLY } else { 0.5 + noise };
                        pixel.add(sample, Rgb::splat(value), &mut Dropped::default());
                    }
                    pixel
                })
            };
            let picture: Vec<Vec<Pixel>> = (0..4).map(|i| tile(i).collect()).collect();
            let found = estimate(&picture).unwrap();
            let truth = f64::from(1.0 - chance + chance * FIREFLY);
            let errors = picture.iter().flatten().map(|pixel| f64::from(pixel.mean().x) - truth);
            let error = errors.map(|e| e * e / (1.01 * truth * truth)).sum::<f64>() / 1024.0;
            held += u32::from((found.lower..=found.upper).contains(&error));
            narrower += u32::from(found.upper / found.relmse < 0.8 * found.relmse / found.lower);
        }
        // 95 % of 60 are 57; fewer than 51 have a chance of 1 %.
        assert!(held >= 51, "{held} of {pictures}");
        assert!(narrower > pictures / 2, "{narrower} of {pictures}");
    }

    #[test]
    fn light_that_few_samples_meet() {
        // A row of pixels of 0.1 touches a lamp of 20 with a hundredth of its area, beside rows that are all
        // lamp: in most pixels one of both pairs has not met it. The row has most of the error.
        const LAMP: f32 = 20.0;
        let (share, samples, pictures) = (0.01, 128, 200);
        let (mut ratios, mut held) = (Vec::new(), 0);
        for seed in 0..pictures {
            let tile = |tile: u32| {
                (0..PIXELS_PER_TILE).map(move |i| {
                    let (column, row) = ALONE.pixel(i).unwrap();
                    let random = Random::new(seed, tile << 8 | Tile::index_of_place(column, row) as u32);
                    let mut pixel = Pixel::default();
                    for sample in 0..samples {
                        let met = row == 8 && random.single(2 * sample) < share;
                        let noise = 0.05 * (2.0 * random.single(2 * sample + 1) - 1.0);
                        let light = if met || row == 7 { LAMP } else { 0.1 + noise };
                        pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
                    }
                    pixel
                })
            };
            let picture: Vec<Vec<Pixel>> = (0..4).map(|i| tile(i).collect()).collect();
            let found = estimate(&picture).unwrap();
            let light = |row: u32| match row {
                7 => LAMP,
                8 => share * LAMP + (1.0 - share) * 0.1,
                _ => 0.1,
            };
            let mean = (0..16).map(|row| f64::from(light(row)) / 16.0).sum::<f64>();
            let errors = picture.iter().flat_map(|tile| tile.iter().enumerate()).map(|(i, pixel)| {
                let truth = f64::from(light(ALONE.pixel(i).unwrap().1));
                let error = f64::from(pixel.mean().x) - truth;
                error * error / (truth * truth + 0.01 * mean * mean)
            });
            let error = errors.sum::<f64>() / (4.0 * 256.0);
            ratios.push(found.relmse / error);
            held += u32::from((found.lower..=found.upper).contains(&error));
        }
        ratios.sort_by(f64::total_cmp);
        // With denominators of single quarters it would be several times the error.
        assert!((0.6..1.6).contains(&ratios[100]), "{ratios:?}");
        // 95 % of 200 are 190; fewer than 183 have a chance of 1 %.
        assert!(held >= 183, "{held} of {pictures}");
    }
}
