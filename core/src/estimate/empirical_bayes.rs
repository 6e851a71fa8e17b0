//! Empirical Bayes estimate of pixels from the picture itself (Robbins 1956, "An empirical Bayes approach to
//! statistics"). A class holds the pixels that, in one pair of their quarters, exceed their neighbours by a
//! certain factor and disagree by a certain degree. The share of this excess that the *other* pair confirms
//! is believed. A firefly that no other sample meets shrinks to its neighbours; texture stays. Reasons:
//! docs/decisions/error-estimate.md.

use super::metric::RELMSE_OFFSET;
use super::tile_statistics::{DARK_OFFSET, TileStatistics, brightness};
use crate::film::{Pixel, Tile};
use glam::Vec4;

/// Range of octaves of the excess of a pixel over its neighbours, relative to them; a smaller excess counts
/// as none.
const FIRST_OCTAVE: i32 = -5;
const LAST_OCTAVE: i32 = 18;
const BRIGHTER: usize = (LAST_OCTAVE - FIRST_OCTAVE + 1) as usize;

/// Number of octaves below 1, for darker pixels: nothing is darker than black.
const DARKER: usize = -FIRST_OCTAVE as usize;

/// Class limits of disagreement: the difference of the two quarters of a pair over their sum.
const DISAGREEMENT: [f32; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];

const DISAGREEMENT_CLASSES: usize = DISAGREEMENT.len() + 1;

const CLASSES: usize = (BRIGHTER + DARKER) * DISAGREEMENT_CLASSES;

/// Weight of the prior in pixels. The prior believes half of the octaves of an excess, and all of a deficit.
const PRIOR_PIXELS: f64 = 4.0;

/// Maximum negative share of a deficit: where light is rare, a pixel darker than its neighbours in one pair
/// may be brighter in the other.
const MAX_CONTRARY_SHARE: f64 = 2.0;

/// Maximum relative variance of R in a class; beyond it light is so rare that noise is proportional to it.
const MAX_RELATIVE_VARIANCE: f64 = 0.1;

/// Number of tiles that suffice: twice 16,384 pixels for two hundred classes.
const MAX_TILES: u64 = 64;

/// Unit of integer sums, which do not depend on the order of tiles.
const FIXED_POINT_UNIT: f64 = 1.0 / (1 << 20) as f64;

/// Limit of each summand, in units of the middle of its class.
const MAX_SUMMAND: f64 = 4096.0;

/// Sums over the pixels of one class. x is the excess of a pixel over its neighbours, relative to them, in
/// units of the middle of its class, with the sign that it has in the asked pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Class {
    pixels: u64,
    /// x of the asked pair.
    own: i64,
    /// x of the other pair.
    other: i64,
    /// x² of the asked pair.
    own_squared: i64,
    /// x² of the other pair, as the product of its two quarters, which are independent.
    other_squared: i64,
}

/// Sums over classes of similar pixels of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrightnessClasses {
    classes: [Class; CLASSES],
}

impl Default for BrightnessClasses {
    fn default() -> Self {
        Self { classes: [Class::default(); CLASSES] }
    }
}

impl core::ops::AddAssign<&Self> for BrightnessClasses {
    fn add_assign(&mut self, other: &Self) {
        for (class, other) in self.classes.iter_mut().zip(&other.classes) {
            class.pixels += other.pixels;
            class.own += other.own;
            class.other += other.other;
            class.own_squared += other.own_squared;
            class.other_squared += other.other_squared;
        }
    }
}

impl BrightnessClasses {
    /// True for each tile `tile` of `count` to learn from: all of small pictures, otherwise 64 tiles,
    /// spread evenly by multiples of the golden ratio for any width.
    pub fn uses_tile(tile: usize, count: usize) -> bool {
        let golden = (tile as u32).wrapping_mul(0x9e37_79b9);
        (u64::from(golden) * count as u64) >> 32 < MAX_TILES
    }

    /// Learns from the `pixels` of `tile` in a picture of mean `mean` > 0. Skips pixels whose halves have
    /// fewer than two samples each.
    pub fn add(&mut self, tile: Tile, pixels: &[Pixel], mean: f64) {
        let seen = TileStatistics::new(tile, pixels, (1.0 / mean) as f32);
        let whole = |value: f64| (value.clamp(-MAX_SUMMAND, MAX_SUMMAND) / FIXED_POINT_UNIT) as i64;
        for (quarters, around) in seen.quarters.iter().zip(&seen.around) {
            let Some(quarters) = quarters else { continue };
            let ([first, second], around) = (Pair::both(*quarters), Neighbourhood::new(*around));
            for (asked, other) in [(first, second), (second, first)] {
                let excess = around.excess(asked.light);
                let class = asked.class(excess);
                let unit = f64::from(excess.signum()) / middle(class);
                let [own, x, a, b] =
                    [excess, around.excess(other.light), around.excess(other.a), around.excess(other.b)]
                        .map(|x| f64::from(x) * unit);
                let class = &mut self.classes[class];
                class.pixels += 1;
                class.own += whole(own);
                class.other += whole(x);
                class.own_squared += whole(own * own);
                class.other_squared += whole(a * b);
            }
        }
    }

    /// Shrinkage of the pixels of each class.
    pub fn shrinkage(&self) -> Shrinkage {
        let mut shrinkage =
            Shrinkage { classes: [ClassShrinkage { share: 0.0, spread: 1.0, prior_weight: 1.0 }; CLASSES] };
        for (class, (Class { pixels, own, other, own_squared, other_squared }, out)) in
            self.classes.into_iter().zip(&mut shrinkage.classes).enumerate()
        {
            let [own, other, own_squared, other_squared] =
                [own, other, own_squared, other_squared].map(|sum| sum as f64 * FIXED_POINT_UNIT);
            let (middle, pixels) = (middle(class), pixels as f64);
            let (before, least, sign) = if is_darker(class) {
                (1.0, -MAX_CONTRARY_SHARE, -1.0)
            } else {
                ((libm::sqrt(1.0 + middle) - 1.0) / middle, 0.0, 1.0)
            };
            let believed = ((other + PRIOR_PIXELS * before) / (own + PRIOR_PIXELS)).clamp(least, 1.0);
            // V of rare light is nearly proportional to R, so that the mean of V / R² is the mean of V
            // times ⟨R²⟩ / ⟨R⟩⁴.
            let there = 1.0 + sign * middle * believed * own / pixels.max(1.0);
            let spread = middle * middle * (other_squared - believed * believed * own_squared)
                / ((pixels + PRIOR_PIXELS) * there * there);
            let spread = 1.0 + spread.clamp(0.0, MAX_RELATIVE_VARIANCE) as f32;
            *out = ClassShrinkage {
                share: believed as f32,
                spread,
                prior_weight: (PRIOR_PIXELS / (pixels + PRIOR_PIXELS)) as f32,
            };
        }
        shrinkage
    }
}

/// Belief in the pixels of a class.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ClassShrinkage {
    /// Share of their excess or deficit that is believed.
    share: f32,
    /// ⟨R²⟩ / ⟨R⟩².
    spread: f32,
    /// Weight of the prior in both.
    prior_weight: f32,
}

/// Belief in the pixels of a picture, by class.
#[derive(Clone, Debug, PartialEq)]
pub struct Shrinkage {
    classes: [ClassShrinkage; CLASSES],
}

impl Shrinkage {
    /// Estimate of a pixel of value `pair` with neighbours `around` (m = 1).
    pub(super) fn posterior(&self, pair: Pair, around: &Neighbourhood) -> Posterior {
        let ClassShrinkage { share, spread, prior_weight } =
            self.classes[pair.class(around.excess(pair.light))];
        // If the sum is darker but a channel brighter, a negative share would lead through black.
        let light = (around.light + share * (pair.light - around.light)).max(around.light.min(pair.light));
        Posterior {
            light,
            over_square: (light * light + RELMSE_OFFSET as f32).recip(),
            spread,
            share,
            prior_weight,
        }
    }
}

/// Estimate of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posterior {
    /// R.
    pub(super) light: Vec4,
    /// 1 / (R² + 0.01).
    pub(super) over_square: Vec4,
    /// Factor from `over_square` to its mean over the distribution of R.
    pub(super) spread: f32,
    /// Share of the excess that is believed.
    pub(super) share: f32,
    /// Weight of the prior in that share.
    pub(super) prior_weight: f32,
}

/// Mean light of the neighbours of a pixel.
pub(super) struct Neighbourhood {
    light: Vec4,
    brightness: f32,
    reciprocal: f32,
}

impl Neighbourhood {
    pub(super) fn new(light: Vec4) -> Self {
        let brightness = brightness(light);
        Self { light, brightness, reciprocal: (brightness + 3.0 * DARK_OFFSET).recip() }
    }

    /// Excess of `light` over the neighbours, relative to them.
    fn excess(&self, light: Vec4) -> f32 {
        (brightness(light) - self.brightness) * self.reciprocal
    }
}

/// Middle of the excess or deficit of a class.
fn middle(class: usize) -> f64 {
    let octave = class / DISAGREEMENT_CLASSES - if is_darker(class) { BRIGHTER } else { 0 };
    // 2^(octave + 1/2).
    f64::from_bits(((octave as i32 + FIRST_OCTAVE + 1023) as u64) << 52) * core::f64::consts::SQRT_2
}

fn is_darker(class: usize) -> bool {
    class / DISAGREEMENT_CLASSES >= BRIGHTER
}

/// Pair of quarters of a pixel, one from each half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    a: Vec4,
    b: Vec4,
    /// Mean of both quarters.
    light: Vec4,
}

impl Pair {
    /// Both pairs of a pixel.
    pub(super) fn both([a1, a2, b1, b2]: [Vec4; 4]) -> [Self; 2] {
        [(a1, b1), (a2, b2)].map(|(a, b)| Self { a, b, light: 0.5 * (a + b) })
    }

    /// Variance of the mean.
    pub(super) fn noise(&self) -> Vec4 {
        0.25 * (self.a - self.b) * (self.a - self.b)
    }

    /// Class of the pair, given its `excess` over the neighbours.
    fn class(&self, excess: f32) -> usize {
        let exponent = (excess.abs().to_bits() >> 23) as i32 - 127;
        let octave = (exponent.clamp(FIRST_OCTAVE, LAST_OCTAVE) - FIRST_OCTAVE) as usize;
        let octave = if excess < 0.0 { BRIGHTER + octave.min(DARKER - 1) } else { octave };
        let difference = brightness(self.a - self.b).abs();
        let sum = 2.0 * brightness(self.light) + 3.0 * DARK_OFFSET;
        octave * DISAGREEMENT_CLASSES
            + DISAGREEMENT.iter().filter(|least| difference >= **least * sum).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::film::{Dropped, PIXELS_PER_TILE, SPAN, TILE};
    use crate::sampling::Random;
    use std::vec::Vec;

    /// A picture of one tile.
    const ALONE: Tile = Tile::new(TILE, TILE, 0);

    /// A tile whose pixels have `light(x, y, sample)` in each of 16 samples.
    fn tile(light: impl Fn(u32, u32, u32) -> f32) -> [Pixel; PIXELS_PER_TILE] {
        core::array::from_fn(|i| {
            let (x, y) = ALONE.pixel(i).unwrap();
            let mut pixel = Pixel::default();
            for sample in 0..16 {
                pixel.add(sample, Rgb::splat(light(x, y, sample)), &mut Dropped::default());
            }
            pixel
        })
    }

    /// R² + 0.01 as estimated by both pairs of each pixel, row by row.
    fn squares(pixels: &[Pixel; PIXELS_PER_TILE]) -> [[f32; 2]; PIXELS_PER_TILE] {
        let mut alike = BrightnessClasses::default();
        alike.add(ALONE, pixels, 1.0);
        let (shrinkage, seen) = (alike.shrinkage(), TileStatistics::new(ALONE, pixels, 1.0));
        core::array::from_fn(|pixel| {
            let place = (pixel / 16 + 4) * SPAN as usize + pixel % 16 + 4;
            let pairs = seen.quarters[place].map(Pair::both).unwrap();
            pairs.map(|pair| {
                let posterior = shrinkage.posterior(pair, &Neighbourhood::new(seen.around[place]));
                (posterior.spread * posterior.over_square.x).recip()
            })
        })
    }

    fn noise(x: u32, y: u32, sample: u32) -> f32 {
        2.0 * Random::new(1, y << 8 | x).single(sample) - 1.0
    }

    #[test]
    fn noise_shrinks_to_the_neighbours_and_texture_stays() {
        // Both differ by a fifth or so from their neighbours.
        let noisy = squares(&tile(|x, y, sample| 1.0 + 0.9 * noise(x, y, sample)));
        let off = |square: f32, r: f32| (square / (r * r + 0.01) - 1.0).abs();
        let mean = noisy.iter().flatten().map(|square| off(*square, 1.0)).sum::<f32>() / 512.0;
        assert!(mean < 0.15, "{mean}");
        let texture = |x: u32, y: u32| if (x / 3 + y / 3).is_multiple_of(2) { 0.8 } else { 1.2 };
        let textured = squares(&tile(|x, y, _| texture(x, y)));
        let off = textured.iter().enumerate().map(|(place, [square, _])| {
            // Equal in both pairs. The corners belong to classes of few pixels.
            off(*square, texture(place as u32 % TILE, place as u32 / TILE))
        });
        let (mean, most) = (off.clone().sum::<f32>() / 256.0, off.fold(0.0, f32::max));
        assert!(mean < 0.03 && most < 0.2, "{mean} {most}");
    }

    #[test]
    fn a_firefly_is_not_believed_by_the_pair_that_saw_it() {
        let pixels = tile(|x, y, sample| if (x, y, sample) == (8, 5, 3) { 1e4 } else { 1.0 });
        let [first, second] = squares(&pixels)[5 * TILE as usize + 8];
        // The pair has 1e4 / 8; only the prior is known of such pixels.
        assert!(first.max(second) < 50.0 * 50.0 && first.min(second) < 1.5, "{first} {second}");
    }

    #[test]
    fn a_lamp_next_door_does_not_brighten_a_wall() {
        let pixels = tile(|x, y, sample| if y == 7 { 100.0 } else { 0.2 + 0.1 * noise(x, y, sample) });
        for (place, pairs) in squares(&pixels).iter().enumerate().filter(|(place, _)| place / 16 != 7) {
            assert!(pairs.iter().all(|square| (0.03..0.09).contains(square)), "{place} {pairs:?}");
        }
    }

    #[test]
    fn coloured_rare_light_does_not_lead_through_black() {
        let mut alike = BrightnessClasses::default();
        // Dark in one pair, bright in the other: the learnt share is negative.
        alike.add(
            ALONE,
            &tile(|x, y, sample| if (x + y) % 4 == 0 && sample % 4 < 2 { 4.0 } else { 0.1 }),
            1.0,
        );
        let shrinkage = alike.shrinkage();
        assert!(shrinkage.classes.iter().any(|class| class.share < 0.0));
        let around = Vec4::new(1.0, 1.0, 0.1, 0.0);
        let light = Vec4::new(0.1, 0.1, 1.0, 0.0);
        for believed in [-2.0, -0.3, 0.0, 1.0] {
            let shrinkage = Shrinkage {
                classes: [ClassShrinkage { share: believed, spread: 1.0, prior_weight: 0.0 }; CLASSES],
            };
            let pair = Pair { a: light, b: light, light };
            let weight = shrinkage.posterior(pair, &Neighbourhood::new(around)).over_square;
            assert!(weight.truncate().max_element() <= 1.0 / (0.1f32.powi(2) + 0.01) * 1.0001, "{weight}");
        }
    }

    #[test]
    fn tiles_are_asked_all_over_the_picture() {
        for (across, down) in [(8, 16), (16, 16), (45, 21), (63, 63), (64, 48), (240, 135)] {
            let asked: Vec<_> = (0..across * down)
                .filter(|tile| BrightnessClasses::uses_tile(*tile, across * down))
                .collect();
            assert!((64..=67).contains(&asked.len()), "{across} x {down}: {}", asked.len());
            let distinct = |place: &dyn Fn(usize) -> usize| {
                let mut places: Vec<_> = asked.iter().map(|tile| place(*tile)).collect();
                places.sort_unstable();
                places.dedup();
                places.len()
            };
            let (columns, rows) = (distinct(&|tile| tile % across), distinct(&|tile| tile / across));
            assert!(
                columns >= across.min(30) && rows >= down.min(15),
                "{across} x {down}: {columns}, {rows}"
            );
        }
        assert!((0..64).all(|tile| BrightnessClasses::uses_tile(tile, 64)));
    }

    #[test]
    fn the_order_of_tiles_does_not_matter() {
        let tiles =
            [1, 2, 3].map(|seed| tile(|x, y, sample| (1.0 + noise(x + seed * 16, y, sample)).powi(8)));
        let learnt = |order: [usize; 3]| {
            let mut all = BrightnessClasses::default();
            for i in order {
                let mut one = BrightnessClasses::default();
                one.add(ALONE, &tiles[i], 30.0);
                all += &one;
            }
            all
        };
        assert!(learnt([0, 1, 2]) == learnt([2, 0, 1]));
    }
}
