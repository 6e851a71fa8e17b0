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

/// Pixels whose paths may be shared lie within blocks of 8 x 8, a quarter of a tile and of its Z-curve each.
const BLOCK: usize = PIXELS_PER_TILE / 4;

/// Sums over the pixels and channels of one tile, of squared differences over R² + 0.01 m². A and B are the means of
/// the halves, A₁, A₂, B₁, B₂ of their parts; the R of each pair, of A₁ and B₁ and of A₂ and B₂, is filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileError {
    /// Values: three for each pixel.
    pub(super) values: u64,
    /// Variance of the picture by (A − B)² over the square of the mean of both R: too small where light is rare, for
    /// what made the difference made R bright.
    pub(super) filtered: f64,
    /// The same over the squares of both R: the mean of both quotients.
    pub(super) halves: f64,
    /// Variance of the pictures of both pairs over the squares of both R.
    pub(super) parts: f64,
    /// The same, each over the square of the other R: numerator and denominator are independent. Too large where a pair
    /// saw nothing of a light that the other met.
    pub(super) crossed: f64,
    /// Squares of the variances of pixels, of the mean of `filtered` and `halves`.
    pub(super) squares: f64,
    /// The squares of those squares.
    pub(super) fourths: f64,
    /// Sum of (A₁ − A₂)(B₁ − B₂) / 4, which has the mean 0 and hangs together between pixels as the errors do.
    pub(super) product: f64,
    /// Squares of that sum in blocks of 8 x 8 pixels.
    pub(super) blocks: f64,
    /// Squares of that sum in pixels.
    pub(super) pixels: f64,
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
        let mut blocks = [0.0; 4];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            let Some([a1, a2, b1, b2]) = parts(pixel, scale) else { continue };
            let place = raster(i);
            // Light that two quarters have seen is there, even if its neighbours have not.
            let second_largest = a1.max(a2).min(b1.max(b2)).max(a1.min(a2).max(b1.min(b2)));
            let least = second_largest / SEEN_TWICE;
            let [first, second] = [weight[place].max(least), other[place].max(least)];
            let (by_first, by_second) = (over_square(first), over_square(second));
            let by_both = 0.5 * (by_first + by_second);
            let by_mean = over_square(0.5 * (first + second));
            let [noise1, noise2] = [first_noise[place], second_noise[place]];
            let variance = colour(pixel.scaled_variance(scale));
            sums.values += 3;
            let (filtered, halves) = (total(variance * by_mean), total(variance * by_both));
            sums.filtered += filtered;
            sums.halves += halves;
            let middle = 0.5 * (filtered + halves);
            let squared = middle * middle;
            sums.squares += squared;
            sums.fourths += squared * squared;
            sums.parts += total(0.5 * (noise1 + noise2) * by_both);
            sums.crossed += total(0.5 * (noise1 * by_second + noise2 * by_first));
            let product = total((a1 - a2) * (b1 - b2) * (by_both + by_mean)) / 8.0;
            sums.product += product;
            sums.pixels += product * product;
            blocks[i / BLOCK % 4] += product;
        }
        sums.blocks = blocks.iter().map(|block| block * block).sum();
        sums
    }
}

/// Tiles whose errors hang together count as one.
impl core::ops::AddAssign for TileError {
    fn add_assign(&mut self, other: Self) {
        self.values += other.values;
        self.filtered += other.filtered;
        self.halves += other.halves;
        self.parts += other.parts;
        self.crossed += other.crossed;
        self.squares += other.squares;
        self.fourths += other.fourths;
        self.product += other.product;
        self.blocks += other.blocks;
        self.pixels += other.pixels;
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
