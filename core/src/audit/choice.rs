//! Stratified choice of the audited pixels: one random pixel per stratum. Strata are equal parts of the
//! picture in an order that puts similar pixels together: by region, and by brightness within each region.
//! Dark corners and bright patches thus get audited pixels in proportion to their area.
//!
//! The choice is unbiased, because every pixel of a stratum has the same probability whatever its noise. A
//! method may know risks of pixels; riskier pixels then have a greater probability and an inversely smaller
//! weight, so that the audit does not miss a few pixels that carry most of the error.

use super::region::Grid;
use super::risks::Risks;
use crate::Rgb;
use crate::estimate::filtered;
use crate::film::{Film, PIXELS_PER_TILE, Tile};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::Shard;
use crate::sampling::Random;
use bytemuck::{Pod, Zeroable};
use core::cmp::Ordering;

/// Fewest audited pixels, if the picture has as many.
const MIN_PIXELS: usize = 256;

/// Most audited pixels.
const MAX_PIXELS: usize = 8192;

/// Largest ratio of a pixel's probability to the usual one.
const MAX_RISK_RATIO: f64 = 16.0;

/// Random stream of the choice.
const STREAM: u32 = 0x6175_6469;

/// Number of audited pixels of a picture.
pub(super) fn count([width, height]: [u32; 2]) -> usize {
    Tile::count(width, height).clamp(MIN_PIXELS, MAX_PIXELS).min(width as usize * height as usize)
}

/// Memory that the choice borrows.
pub(super) fn footprint([width, height]: [u32; 2]) -> Footprint {
    let pixels = width as usize * height as usize;
    Footprint::default().slice::<Ranked>(pixels).slice::<f32>(pixels)
}

/// A pixel in the order of strata.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Ranked {
    region: u32,
    /// Ascending in one region and descending in the next, so that adjacent strata of two regions are
    /// similar.
    brightness: f32,
    pub(super) pixel: [u32; 2],
}

impl Ranked {
    /// A pixel of this filtered `colour`.
    pub(super) fn new(pixel: [u32; 2], colour: Rgb, grid: Grid) -> Self {
        let (region, sum) = (grid.region(pixel), colour.element_sum());
        let brightness = if region.is_multiple_of(2) { sum } else { -sum };
        Self { region: region as u32, brightness, pixel }
    }

    /// Order of strata.
    pub(super) fn compare(&self, other: &Self) -> Ordering {
        let brightness = self.brightness.total_cmp(&other.brightness);
        self.region.cmp(&other.region).then(brightness).then(self.pixel.cmp(&other.pixel))
    }
}

/// Chooses audited pixels of a `shard` of `film`, whose mean is `mean`: writes them in the order of strata,
/// and their parts of the picture relative to the mean part as weights. Returns their number.
///
/// # Errors
/// [`OutOfMemory`] where `arena` has less than [`footprint`] bytes.
pub(super) fn choose(
    film: &Film,
    (shard, mean, seed): (Shard, f64, u32),
    risks: Option<&Risks>,
    arena: &mut Arena,
    (pixels, weights): (&mut [[u32; 2]], &mut [f32]),
) -> Result<usize, OutOfMemory> {
    let size = [film.width(), film.height()];
    let (area, all) = (size[0] as usize * size[1] as usize, count(size));
    let (order, known) = (arena.slice::<Ranked>(area)?, arena.slice::<f32>(area)?);
    let order = ordered(film, (shard, mean), Grid::new(size, all), order);
    let strata = (all * order.len()).div_ceil(area).min(pixels.len()).min(weights.len());
    let median = risks.and_then(|risks| median(order.iter().map(|ranked| risks.at(ranked.pixel)), known));
    // Limited so that no pixel fills a stratum alone.
    let most = MAX_RISK_RATIO.min(order.len() as f64 / strata as f64);
    let probability = |index: usize| match (risks, median, order.get(index)) {
        (Some(risks), Some(median), Some(ranked)) => {
            (f64::from(risks.at(ranked.pixel)) / median).max(1.0).min(most)
        }
        _ => 1.0,
    };
    let sum = (0..order.len()).fold(0.0, |sum, index| sum + probability(index));
    let random = Random::new(seed, STREAM);
    let mut cursor = Cursor::default();
    for (i, (pixel, weight)) in (0..strata).zip(pixels.iter_mut().zip(weights)) {
        let border = |i: usize| i as f64 * sum / strata as f64;
        let first = cursor.up_to(border(i), order.len(), probability);
        let next = match i + 1 == strata {
            true => Cursor { index: order.len(), sum },
            false => first.up_to(border(i + 1), order.len(), probability),
        };
        let end = if next.index > first.index { next } else { first.step(probability) };
        let number = i as u32 * shard.count + shard.index;
        let size = end.sum - first.sum;
        let at = first.sum + f64::from(random.single(number)) * size;
        let pick = first.up_to(at, order.len(), probability).index.min(end.index - 1);
        *pixel = order.get(pick).map_or([0; 2], |ranked| ranked.pixel);
        *weight = (size / probability(pick) * strata as f64 / order.len() as f64) as f32;
        cursor = next;
    }
    Ok(strata)
}

/// A pixel in the order, and the sum of the probabilities of those before it.
#[derive(Clone, Copy, Default)]
struct Cursor {
    index: usize,
    sum: f64,
}

impl Cursor {
    fn step(self, probability: impl Fn(usize) -> f64) -> Self {
        Self { index: self.index + 1, sum: self.sum + probability(self.index) }
    }

    /// The last of `count` pixels, or their end, whose sum is at most `sum`.
    fn up_to(self, sum: f64, count: usize, probability: impl Fn(usize) -> f64) -> Self {
        let mut cursor = self;
        while cursor.index < count {
            let next = cursor.step(&probability);
            if next.sum > sum {
                break;
            }
            cursor = next;
        }
        cursor
    }
}

/// Median of the `risks` that are known; `None` without any.
fn median(risks: impl Iterator<Item = f32>, known: &mut [f32]) -> Option<f64> {
    let mut count = 0;
    for (risk, known) in risks.filter(|risk| *risk > 0.0 && risk.is_finite()).zip(known.iter_mut()) {
        (*known, count) = (risk, count + 1);
    }
    let known = known.get_mut(..count).filter(|known| !known.is_empty())?;
    let (_, median, _) = known.select_nth_unstable_by(count / 2, f32::total_cmp);
    Some(f64::from(*median))
}

/// Joins neighbouring strata until `many` are left. `weights` are those of their pixels. Returns for stratum
/// `i` of these the index of the pixel that stays, chosen uniformly, and its new weight.
pub(super) fn join(weights: &[f32], (i, many): (usize, usize), seed: u32) -> (usize, f32) {
    let random = Random::new(seed, STREAM ^ u32::MAX);
    let border = |i: usize| i * weights.len() / many;
    let all = &weights[border(i)..border(i + 1)];
    let kept = ((random.single(i as u32) * all.len() as f32) as usize).min(all.len() - 1);
    (border(i) + kept, all[kept] * (all.len() * many) as f32 / weights.len() as f32)
}

/// Pixels of a shard by region, and by brightness within each.
fn ordered<'o>(
    film: &Film,
    (shard, mean): (Shard, f64),
    grid: Grid,
    order: &'o mut [Ranked],
) -> &'o [Ranked] {
    let (width, height) = (film.width(), film.height());
    let mut count = 0;
    let tiles = film.pixels().chunks(PIXELS_PER_TILE).enumerate();
    for (task, pixels) in tiles.filter(|(task, _)| shard.owns(*task)) {
        let tile = Tile::new(width, height, task);
        let colours = filtered(tile, pixels, mean);
        for (i, colour) in colours.into_iter().enumerate() {
            if let Some(((x, y), ranked)) = tile.pixel(i).zip(order.get_mut(count)) {
                *ranked = Ranked::new([x, y], colour, grid);
                count += 1;
            }
        }
    }
    let order = &mut order[..count];
    order.sort_unstable_by(Ranked::compare);
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Dropped;
    use crate::memory::Line;
    use std::vec;
    use std::vec::Vec;

    fn film<T>(width: u32, height: u32, light: impl Fn(u32, u32) -> f32, work: impl FnOnce(&Film) -> T) -> T {
        let mut lines = vec![Line::ZERO; Film::footprint(width, height).bytes() / 64];
        let mut film = Film::new(width, height, &mut Arena::over(&mut lines)).unwrap();
        for y in 0..height {
            for x in 0..width {
                let place = Tile::position([width, height], x, y);
                for sample in 0..4 {
                    let colour = Rgb::splat(light(x, y));
                    film.pixels_mut()[place].add(sample, colour, &mut Dropped::default());
                }
            }
        }
        work(&film)
    }

    /// Chosen pixels and their weights, in memory of the stated size.
    fn chosen(film: &Film, of: (Shard, f64, u32), risks: Option<&Risks>) -> (Vec<[u32; 2]>, Vec<f32>) {
        let size = [film.width(), film.height()];
        let (mut pixels, mut weights) = (vec![[0; 2]; count(size)], vec![0.0; count(size)]);
        let mut lines = vec![Line::ZERO; footprint(size).bytes() / 64];
        let short = lines.len() - 1;
        let mut few = Arena::over(&mut lines[..short]);
        assert!(choose(film, of, risks, &mut few, (&mut pixels, &mut weights)).is_err());
        let mut arena = Arena::over(&mut lines);
        let count = choose(film, of, risks, &mut arena, (&mut pixels, &mut weights)).unwrap();
        (pixels[..count].to_vec(), weights[..count].to_vec())
    }

    #[test]
    fn every_pixel_has_its_chance_and_strata_add_up() {
        let light = |x: u32, y: u32| 1.0 + ((x * 7 + y * 3) % 11) as f32;
        let mut times = vec![0; 40 * 30];
        for seed in 0..400 {
            film(40, 30, light, |film| {
                let (pixels, weights) = chosen(film, (Shard::WHOLE, 5.0, seed), None);
                assert_eq!(pixels.len(), 256);
                assert!((weights.iter().sum::<f32>() / 256.0 - 1.0).abs() < 1e-5);
                for ([x, y], weight) in pixels.into_iter().zip(weights) {
                    times[(y * 40 + x) as usize] += 1;
                    assert!((0.8..1.2).contains(&weight));
                }
            });
        }
        // Strata of 4 and 5 pixels: expected 80 to 100 of 400 times. Below 40 or above 150 is five standard
        // deviations off.
        assert!(times.iter().all(|count| (40..150).contains(count)), "{:?}", times.iter().min());
    }

    #[test]
    fn shards_have_pixels_of_their_own() {
        film(
            50,
            40,
            |x, _| x as f32,
            |film| {
                for index in 0..3 {
                    let shard = Shard::part(index, 3);
                    let (pixels, weights) = chosen(film, (shard, 25.0, 1), None);
                    // A third of 256, as closely as tiles of 16 x 16 divide 50 x 40.
                    assert!((70..105).contains(&pixels.len()), "{}", pixels.len());
                    assert!((weights.iter().sum::<f32>() / pixels.len() as f32 - 1.0).abs() < 1e-5);
                    let tile = |[x, y]: [u32; 2]| Tile::position([50, 40], x, y) / PIXELS_PER_TILE;
                    assert!(pixels.into_iter().all(|pixel| shard.owns(tile(pixel))));
                }
            },
        );
    }

    #[test]
    fn rare_light_has_its_part() {
        // A bright stripe of a hundredth of the picture: 2 or 3 of 256 audited pixels.
        film(
            100,
            100,
            |x, _| if x == 17 { 50.0 } else { 1.0 },
            |film| {
                let (pixels, _) = chosen(film, (Shard::WHOLE, 1.5, 3), None);
                let stripe = pixels.iter().filter(|[x, _]| *x == 17).count();
                assert!((1..=5).contains(&stripe), "{stripe}");
            },
        );
    }

    /// 20 of 10,000 pixels carry the error: about 8 of 256 audited pixels instead of 0.5 lie there, and the
    /// estimated error stays unbiased.
    #[test]
    fn what_may_be_wrong_is_audited_more_often_and_counts_less() {
        let is_wrong = |[x, y]: [u32; 2]| y == 40 && (30..50).contains(&x);
        let risks: Vec<f32> =
            (0..10_000).map(|i| if is_wrong([i % 100, i / 100]) { 1.0 } else { 0.01 }).collect();
        film(
            100,
            100,
            |x, _| 1.0 + x as f32,
            |film| {
                let (mut found, mut sum) = (0, 0.0);
                for seed in 0..200 {
                    let (pixels, weights) =
                        chosen(film, (Shard::WHOLE, 50.0, seed), Some(&Risks::new(&risks, 1, 100)));
                    assert_eq!(pixels.len(), 256);
                    for (_, weight) in pixels.iter().zip(&weights).filter(|(pixel, _)| is_wrong(**pixel)) {
                        (found, sum) = (found + 1, sum + f64::from(*weight));
                    }
                }
                // Expected: 16 * 20 / 10,300 * 256 = 7.95 per choice, so 1590 ± 40 in all, and 0.512 by
                // weight.
                assert!((1450..1730).contains(&found), "{found}");
                assert!((sum / 200.0 - 0.512).abs() < 0.05, "{}", sum / 200.0);
            },
        );
    }

    #[test]
    fn strata_that_are_joined_keep_the_chances_of_pixels() {
        let weights: Vec<f32> = (0..1000).map(|i| if i % 3 == 0 { 0.8 } else { 1.1 }).collect();
        let mut kept = [0; 2];
        for seed in 0..20 {
            let joined: Vec<_> = (0..300).map(|i| join(&weights, (i, 300), seed)).collect();
            assert_eq!(joined.len(), 300);
            assert!(joined.windows(2).all(|pair| pair[0].0 < pair[1].0));
            let sum: f32 = joined.iter().map(|(_, weight)| weight).sum();
            assert!((sum / 300.0 - 1.0).abs() < 0.05, "{sum}");
            joined.iter().for_each(|(i, _)| kept[usize::from(i % 3 == 0)] += 1);
        }
        // A third of 6000, with a standard deviation of 37.
        assert!((2000 - 150..2000 + 150).contains(&kept[1]), "{kept:?}");
        assert!((0..1000).all(|i| join(&weights, (i, 1000), 1).0 == i));
    }

    #[test]
    fn small_pictures_are_audited_whole() {
        film(
            5,
            3,
            |_, _| 1.0,
            |film| {
                let (mut pixels, weights) = chosen(film, (Shard::WHOLE, 1.0, 0), None);
                pixels.sort_unstable();
                pixels.dedup();
                assert_eq!((pixels.len(), weights), (15, vec![1.0; 15]));
            },
        );
    }
}
