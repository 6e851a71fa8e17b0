//! What the halves of one tile disagree by: sums from which [`super::ErrorEstimate`] is made.

use super::filter::lee;
use super::metric::DARK;
use crate::Rgb;
use crate::film::{PIXELS_PER_TILE, Pixel, TILE, Tile};
use glam::Vec4;

/// A pixel is taken for no darker than the second brightest of its quarters over this. With 4, if all light came in one
/// flash a quarter at random, it would be too dark; with 2 the estimate is 4 % too small on the Cornell box.
const SEEN_TWICE: f32 = 3.0;

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

/// Sums over the pixels and channels of one tile, of squared differences over R² + 0.01 m². A and B are the means of
/// the halves, A₁, A₂, B₁, B₂ of their parts; R comes from the whole picture, or filtered from one part of each half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileError {
    /// Values: three for each pixel.
    pub(super) values: u64,
    /// Variance of the picture by (A − B)² over its own noisy square: too small, for what made the difference
    /// made the picture bright.
    pub(super) plain: f64,
    /// The same over the filtered square.
    pub(super) halves: f64,
    /// Variance of the pictures of A₁ and B₁, and of A₂ and B₂, over the filtered square.
    pub(super) parts: f64,
    /// The same, each over the filtered square of the other: numerator and denominator are independent.
    pub(super) crossed: f64,
    /// Variance of the picture by (A₁ − A₂)² and (B₁ − B₂)², as if parts were independent.
    pub(super) within: f64,
    /// (A₁ − A₂)(B₁ − B₂) / 4: has the mean 0, and the variance of what the estimate is off by.
    pub(super) product: f64,
}

impl TileError {
    /// Of the pixels of one tile of a picture of mean `mean` > 0. Pixels whose halves have no two samples each
    /// are left out.
    pub fn of(pixels: &[Pixel], mean: f64) -> Self {
        let scale = (1.0 / mean) as f32;
        let [mut first, mut second, mut first_noise, mut second_noise, mut weight, mut other] =
            [[Vec4::ZERO; PIXELS_PER_TILE]; 6];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            let Some([a1, a2, b1, b2]) = parts(pixel, scale) else { continue };
            let place = raster(i);
            first[place] = (0.5 * (a1 + b1)).with_w(1.0);
            second[place] = (0.5 * (a2 + b2)).with_w(1.0);
            first_noise[place] = 0.25 * (a1 - b1) * (a1 - b1);
            second_noise[place] = 0.25 * (a2 - b2) * (a2 - b2);
        }
        lee(&first, &first_noise, &mut weight);
        lee(&second, &second_noise, &mut other);

        let mut sums = Self::default();
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            let Some([a1, a2, b1, b2]) = parts(pixel, scale) else { continue };
            let place = raster(i);
            // Light that two quarters have seen is there, even if its neighbours have not.
            let second_largest = a1.max(a2).min(b1.max(b2)).max(a1.min(a2).max(b1.min(b2)));
            let least = second_largest / SEEN_TWICE;
            let [by_first, by_second] = [weight[place], other[place]].map(|r| over_square(r.max(least)));
            let by_both = 0.5 * (by_first + by_second);
            let [noise1, noise2] = [first_noise[place], second_noise[place]];
            let variance = colour(pixel.scaled_variance(scale));
            sums.values += 3;
            sums.plain += total(variance * over_square(scale * colour(pixel.mean())));
            sums.halves += total(variance * by_both);
            sums.parts += total(0.5 * (noise1 + noise2) * by_both);
            sums.crossed += total(0.5 * (noise1 * by_second + noise2 * by_first));
            let (a, b) = (a1 - a2, b1 - b2);
            sums.within += total((a * a + b * b) * by_both) / 16.0;
            sums.product += total(a * b * by_both) / 4.0;
        }
        sums
    }

    /// Relative variance of a value of the tile, in the mean: its share of the picture's relMSE.
    pub fn noise(&self) -> f64 {
        self.halves / self.values.max(1) as f64
    }
}

/// Tiles whose errors hang together count as one.
impl core::ops::AddAssign for TileError {
    fn add_assign(&mut self, other: Self) {
        self.values += other.values;
        self.plain += other.plain;
        self.halves += other.halves;
        self.parts += other.parts;
        self.crossed += other.crossed;
        self.within += other.within;
        self.product += other.product;
    }
}

/// What the pixels of a tile of a picture of mean `mean` probably are: filtered, in the order of the tile's pixels.
pub fn filtered(pixels: &[Pixel], mean: f64) -> [Rgb; PIXELS_PER_TILE] {
    let scale = (1.0 / mean) as f32;
    let [mut picture, mut noise, mut out] = [[Vec4::ZERO; PIXELS_PER_TILE]; 3];
    for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE).filter(|(_, pixel)| pixel.count() > 0) {
        picture[raster(i)] = (scale * colour(pixel.mean())).with_w(1.0);
        noise[raster(i)] = colour(pixel.scaled_variance(scale));
    }
    lee(&picture, &noise, &mut out);
    core::array::from_fn(|i| out[raster(i)].truncate() / scale)
}

/// A₁, A₂, B₁, B₂ of a pixel.
fn parts(pixel: &Pixel, scale: f32) -> Option<[Vec4; 4]> {
    let ([a1, a2], [b1, b2]) = (pixel.even.parts()?, pixel.odd.parts()?);
    Some([a1, a2, b1, b2].map(|mean| scale * colour(mean)))
}

fn colour(colour: crate::Rgb) -> Vec4 {
    colour.extend(0.0)
}

/// 1 / (R² + 0.01), with m = 1.
fn over_square(r: Vec4) -> Vec4 {
    (r * r + DARK as f32).recip()
}

fn total(values: Vec4) -> f64 {
    f64::from(values.x + values.y + values.z)
}

/// Where the `i`th pixel of a tile stands in its rows.
fn raster(i: usize) -> usize {
    let (x, y) = Tile::place(i);
    (y * TILE + x) as usize
}
