//! Blur of density estimates in a picture: each sample gathers photons from a disc, and estimates the
//! difference to a finer disc (docs/decisions/photon-map.md).
//!
//! The halves of a pixel estimate its blur as a and b with independent noise, so that a b has the squared
//! blur as mean. It is divided by R² + 0.01 m², averaged over R = I − a and R = I − b: beside a focus a pixel
//! is really many times darker than it appears, and each denominator is independent of one factor. R is at
//! least I / 2, since a noisy finer disc may estimate no light at all.

use super::audit::BiasEstimate;
use super::metric::RELMSE_OFFSET;
use super::tile::{BLOCK, BLOCKS};
use crate::Rgb;
use crate::film::{PIXELS_PER_TILE, Pixel};

/// Relative uncertainty of blur: finer discs are blurred as well, at an edge more than assumed.
const RELATIVE_UNCERTAINTY: f64 = 0.25;

/// Sums of squared blur over the pixels of one tile, in units of relMSE.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileBlur {
    pixels: u64,
    squared: f64,
    /// Squared sums over blocks of (a² − b²) / 2, which has the variance of a b and the mean 0.
    squares: f64,
}

impl TileBlur {
    /// Sums of the `pixels` of one tile of a picture of mean `mean` > 0.
    pub fn of(pixels: &[Pixel], mean: f64) -> Self {
        let mut sums = Self::default();
        // Blocks of 4 × 4 neighbours along the Z-curve, which share photons.
        let mut blocks = [0.0; BLOCKS];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            if pixel.even.count() == 0 || pixel.odd.count() == 0 {
                continue;
            }
            sums.pixels += 1;
            let [a, b] = [pixel.even.blur(), pixel.odd.blur()].map(|blur| f64::from(blur) / mean);
            if a == 0.0 && b == 0.0 || pixel.mean() == Rgb::ZERO {
                continue;
            }
            let colour = pixel.mean().to_array().map(f64::from);
            let sum: f64 = colour.iter().sum();
            let light = sum / (3.0 * mean);
            // The blur of a channel is proportional to its radiance.
            let over_square = |blur: f64| {
                let r = (light - blur).max(0.5 * light);
                let channel = |shine: f64| shine * shine / (shine * shine * r * r + RELMSE_OFFSET) / 3.0;
                colour.iter().map(|channel_of| channel(3.0 * channel_of / sum)).sum::<f64>()
            };
            let weight = 0.5 * (over_square(a) + over_square(b));
            sums.squared += a * b * weight;
            blocks[i / BLOCK] += 0.5 * (a * a - b * b) * weight;
        }
        for block in blocks {
            sums.squares += block * block;
        }
        sums
    }
}

impl core::ops::AddAssign for TileBlur {
    fn add_assign(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.squared += other.squared;
        self.squares += other.squares;
    }
}

impl BiasEstimate {
    /// Blur of all tiles of a picture; `None` without photons.
    #[doc(hidden)]
    pub fn of_blur(tiles: impl Iterator<Item = TileBlur>) -> Option<Self> {
        let mut sum = TileBlur::default();
        tiles.for_each(|tile| sum += tile);
        let TileBlur { pixels, squared, squares } = sum;
        if pixels == 0 || squares == 0.0 {
            return None;
        }
        let count = pixels as f64;
        Some(Self::from_moments(squared / count, squares / (count * count), 0.0, RELATIVE_UNCERTAINTY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::ErrorEstimate;
    use crate::film::Dropped;
    use crate::sampling::Random;
    use std::vec::Vec;

    /// Tiles of radiance 1, too bright by `blur` in a quarter of the pixels; samples estimate the blur with
    /// `noise`.
    fn picture(blur: f32, noise: f32, seed: u32) -> Vec<Vec<Pixel>> {
        let pixel = |tile: u32, i: u32| {
            let random = Random::new(seed, tile << 8 | i);
            let mut pixel = Pixel::default();
            for sample in 0..8 {
                let blur = if i.is_multiple_of(4) { blur } else { 0.0 };
                let off = blur + noise * (2.0 * random.single(sample) - 1.0);
                pixel.add(sample, Rgb::splat(1.0 + blur), &mut Dropped::default());
                pixel.add_blur(sample, Rgb::splat(off));
            }
            pixel
        };
        (0..4).map(|tile| (0..PIXELS_PER_TILE as u32).map(|i| pixel(tile, i)).collect()).collect()
    }

    fn estimate(blur: f32, noise: f32, seed: u32) -> Option<BiasEstimate> {
        BiasEstimate::of_blur(picture(blur, noise, seed).iter().map(|tile| TileBlur::of(tile, 1.0)))
    }

    #[test]
    fn blur_is_told_from_noise() {
        let truth = 0.25 * 0.2 * 0.2 / 1.01;
        let (mut held, mut found, runs) = (0, 0, 100);
        for seed in 0..runs {
            let with = estimate(0.2, 0.3, seed).unwrap();
            held += u32::from((with.lower..=with.upper).contains(&truth));
            assert!(with.is_significant(), "{with:?}");
            found += u32::from(estimate(0.0, 0.3, seed).unwrap().is_significant());
        }
        // 95 % of 100, and more due to the relative uncertainty of a quarter; 2.5 % of 100.
        assert!(held >= 90 && found <= 8, "{held} {found}");
    }

    #[test]
    fn dark_pixels_beside_a_focus_count_for_what_they_are() {
        // Radiance 0.5 that appears as 1: half of it is blur.
        let mut pixel = Pixel::default();
        for sample in 0..4 {
            pixel.add(sample, Rgb::ONE, &mut Dropped::default());
            pixel.add_blur(sample, Rgb::splat(0.5));
        }
        let sums = TileBlur::of(&[pixel; PIXELS_PER_TILE], 1.0);
        let expected = 0.25 / (0.25 + 0.01) * PIXELS_PER_TILE as f64;
        assert!((sums.squared / expected - 1.0).abs() < 1e-6, "{sums:?} {expected}");
    }

    #[test]
    fn coloured_light_is_blurred_in_its_channel() {
        let mut pixel = Pixel::default();
        for sample in 0..4 {
            pixel.add(sample, Rgb::new(3.0, 0.0, 0.0), &mut Dropped::default());
            pixel.add_blur(sample, Rgb::new(0.3, 0.0, 0.0));
        }
        let sums = TileBlur::of(&[pixel; PIXELS_PER_TILE], 1.0);
        let expected = 0.3 * 0.3 / (2.7 * 2.7 + 0.01) / 3.0 * PIXELS_PER_TILE as f64;
        assert!((sums.squared / expected - 1.0).abs() < 1e-5, "{sums:?} {expected}");
    }

    #[test]
    fn what_is_not_known_of_blur_reaches_both_ways() {
        let noise = ErrorEstimate { relmse: 1e-4, lower: 0.9e-4, upper: 1.1e-4 };
        let blur = BiasEstimate::from_moments(5e-3, 1e-10, 0.0, RELATIVE_UNCERTAINTY);
        let sum = noise.with_bias(blur);
        assert!(sum.lower < 1e-4 + 0.8 * 5e-3 && sum.upper > 1e-4 + 1.2 * 5e-3, "{sum:?}");
    }

    #[test]
    fn pictures_without_photons_have_none() {
        assert_eq!(BiasEstimate::of_blur([TileBlur::of(&[Pixel::default(); 256], 1.0)].into_iter()), None);
        let mut pixel = Pixel::default();
        for sample in 0..4 {
            pixel.add(sample, Rgb::ONE, &mut Dropped::default());
            pixel.add_blur(sample, Rgb::splat(f32::NAN));
        }
        assert_eq!(BiasEstimate::of_blur([TileBlur::of(&[pixel; 256], 1.0)].into_iter()), None);
    }
}
