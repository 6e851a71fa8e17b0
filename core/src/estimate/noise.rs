//! Where the noise of a picture is, told to each group of pixels by others: what adaptive sampling goes by.
//!
//! A group that its own samples tell how many more it gets has a biased mean (Kirk and Arvo 1991, "Unbiased
//! sampling techniques for image synthesis"). So what a group is told comes from the other group of its block
//! of 8 × 8 pixels, which lies between its pixels and shares no path with them. Nor is it in their
//! denominators: light at a place is what a pixel itself has seen, or what the pixels around it have that are
//! not of the group that asks, whichever is less. The former is too large for a pixel that was hit by a
//! firefly, the latter beside a lamp.

use super::metric::DARK;
use crate::Rgb;
use crate::film::{GROUP, GROUPS, Pixel, TILE, Tile};

/// Blocks of a tile, quarters of its Z-curve.
pub const BLOCKS: usize = 4;

/// Groups of a block.
const ASKING: usize = GROUPS / BLOCKS;

/// Pixels of a block.
const PIXELS: usize = GROUP * ASKING;

/// Noise of some pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Relative variance of one sample, added up over pixels.
    pub sum: f64,
    /// How many they are.
    pub pixels: u32,
}

/// Noise of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockNoise {
    /// Of each of its groups.
    pub own: [Noise; ASKING],
    /// Of the pixels that are not of a group, as that may know it.
    pub others: [Noise; ASKING],
}

impl BlockNoise {
    /// Of all of its pixels.
    pub fn all(&self) -> Noise {
        self.own.iter().fold(Noise::default(), |all, own| Noise {
            sum: all.sum + own.sum,
            pixels: all.pixels + own.pixels,
        })
    }

    /// Of the four blocks of a tile of a picture of mean `mean` > 0, in their order along the Z-curve.
    pub fn of(pixels: &[Pixel], mean: f64) -> [Self; BLOCKS] {
        let scale = (1.0 / mean) as f32;
        let mut blocks = [Self::default(); BLOCKS];
        for (number, (block, pixels)) in blocks.iter_mut().zip(pixels.chunks(PIXELS)).enumerate() {
            *block = Self::of_block(number, pixels, scale);
        }
        blocks
    }

    fn of_block(number: usize, pixels: &[Pixel], scale: f32) -> Self {
        const SIDE: usize = TILE as usize / 2;
        let group_of = |i: usize| Tile::group(number * PIXELS + i) % ASKING;
        let mut light = [None; PIXELS];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS).filter(|(_, pixel)| pixel.count() > 0) {
            let (x, y) = Tile::place(i);
            light[y as usize * SIDE + x as usize] = Some((pixel.mean() * scale, group_of(i)));
        }
        let mut block = Self::default();
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS).filter(|(_, pixel)| pixel.count() > 0) {
            let (x, y) = Tile::place(i);
            let near = |c: u32| (c as usize).saturating_sub(1)..(c as usize + 2).min(SIDE);
            let own = pixel.mean() * scale;
            let variance = pixel.scaled_variance(scale) * pixel.count() as f32;
            let mut sums = [(Rgb::ZERO, 0.0); ASKING];
            for (there, group) in near(y).flat_map(|row| near(x).filter_map(move |x| light[row * SIDE + x])) {
                let (sum, count) = &mut sums[group];
                *sum += there;
                *count += 1.0;
            }
            // Added up anew for each: subtracting would leave nothing but rounding beside a firefly.
            let without = |asking: usize| {
                let parts = sums.iter().enumerate().filter(|(group, _)| *group != asking);
                let (sum, count) =
                    parts.fold((Rgb::ZERO, 0.0), |all, (_, part)| (all.0 + part.0, all.1 + part.1));
                let light = (sum / count).min(own);
                f64::from((variance / (light * light + DARK as f32)).element_sum())
            };
            block.own[group_of(i)].add(without(ASKING));
            for asking in (0..ASKING).filter(|asking| *asking != group_of(i)) {
                block.others[asking].add(without(asking));
            }
        }
        block
    }
}

impl Noise {
    fn add(&mut self, noise: f64) {
        if noise.is_finite() {
            self.sum += noise;
            self.pixels += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Dropped, PIXELS_PER_TILE};
    use std::vec::Vec;

    /// A tile of light 1 whose halves differ by `difference`.
    fn tile(difference: impl Fn(u32, u32) -> f32) -> [Pixel; PIXELS_PER_TILE] {
        core::array::from_fn(|i| {
            let (x, y) = Tile::place(i);
            let mut pixel = Pixel::default();
            for sample in 0..4 {
                let sign = if sample % 2 == 0 { 0.5 } else { -0.5 };
                pixel.add(sample, Rgb::splat(1.0 + sign * difference(x, y)), &mut Dropped::default());
            }
            pixel
        })
    }

    #[test]
    fn even_noise_is_the_same_for_everybody() {
        let expected = 3.0 * 0.1 * 0.1 / 4.0 * 4.0 / (1.0 + DARK);
        for block in BlockNoise::of(&tile(|_, _| 0.1), 1.0) {
            assert_eq!((block.all().pixels, block.others.map(|other| other.pixels)), (64, [32; 2]));
            for noise in block.others.into_iter().chain([block.all()]) {
                assert!((noise.sum / f64::from(noise.pixels) / expected - 1.0).abs() < 1e-5, "{noise:?}");
            }
        }
    }

    #[test]
    fn no_group_is_told_of_itself() {
        let quiet = BlockNoise::of(&tile(|_, _| 0.1), 1.0);
        // Two pixels of the first group of the first block; what they see is theirs alone.
        let group = (0..PIXELS).filter(|i| Tile::group(*i) == 0);
        let hit: Vec<usize> = group.filter(|i| [5, 11].contains(&(i / 4))).step_by(2).collect();
        for firefly in [1e3, 1e9] {
            let mut pixels = tile(|_, _| 0.1);
            for (i, pixel) in pixels.iter_mut().enumerate() {
                if hit.contains(&i) {
                    pixel.add(4, Rgb::splat(firefly), &mut Dropped::default());
                }
            }
            let noisy = BlockNoise::of(&pixels, 1.0);
            assert_eq!(noisy[1..], quiet[1..]);
            assert_eq!(noisy[0].others[0], quiet[0].others[0]);
            assert!(noisy[0].others[1].sum > 10.0 * quiet[0].others[1].sum);
        }
    }
}
