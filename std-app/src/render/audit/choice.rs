//! Stratified choice of the audited pixels: one random pixel per stratum. Strata are equal parts of the
//! picture in an order that puts similar pixels together: by region, and by brightness within each region.
//! Dark corners and bright patches thus get audited pixels in proportion to their area.
//!
//! The choice is unbiased, because every pixel of a stratum has the same probability whatever its noise. A
//! method may know risks of pixels; riskier pixels then have a greater probability and an inversely smaller
//! weight, so that the audit does not miss a few pixels that carry most of the error.

use crate::render::Shard;
use halflight_core::Rgb;
use halflight_core::estimate::filtered;
use halflight_core::film::{Film, PIXELS_PER_TILE, Tile};
use halflight_core::sampling::Random;

/// Fewest audited pixels, if the picture has as many.
const MIN_PIXELS: usize = 256;

/// Most audited pixels.
const MAX_PIXELS: usize = 8192;

/// Fewest audited pixels of a region, enough for a mean deviation with a standard error.
const PIXELS_PER_REGION: usize = 12;

/// Most regions along each side.
const MAX_REGIONS_PER_SIDE: u32 = 8;

/// Audited pixels that suffice for all regions.
pub(super) const SUFFICIENT_PIXELS: usize =
    PIXELS_PER_REGION * (MAX_REGIONS_PER_SIDE * MAX_REGIONS_PER_SIDE) as usize;

/// Largest ratio of a pixel's probability to the usual one.
const MAX_RISK_RATIO: f64 = 16.0;

/// Regions of a picture: a grid of `side` x `side`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    size: [u32; 2],
    pub(super) side: u32,
}

impl Grid {
    /// The grid for `pixels` audited pixels.
    pub(super) fn new(size: [u32; 2], pixels: usize) -> Self {
        let side = ((pixels / PIXELS_PER_REGION).isqrt() as u32)
            .clamp(1, MAX_REGIONS_PER_SIDE)
            .min(size[0])
            .min(size[1]);
        Self { size, side }
    }

    /// Region of a pixel, row by row from the upper left.
    pub(super) fn region(&self, pixel: [u32; 2]) -> usize {
        let [column, row] =
            [0, 1].map(|i| (u64::from(pixel[i]) * u64::from(self.side) / u64::from(self.size[i])) as usize);
        row * self.side as usize + column
    }

    /// Column range and row range of a region, each with its end excluded.
    pub(super) fn bounds(&self, region: usize) -> [[u32; 2]; 2] {
        let place = [region as u32 % self.side, region as u32 / self.side];
        let border =
            |i: usize, n: u32| (u64::from(n) * u64::from(self.size[i])).div_ceil(u64::from(self.side)) as u32;
        [0, 1].map(|i| [border(i, place[i]), border(i, place[i] + 1)])
    }
}

/// Number of audited pixels of a picture.
pub(super) fn count(width: u32, height: u32) -> usize {
    Tile::count(width, height).clamp(MIN_PIXELS, MAX_PIXELS).min(width as usize * height as usize)
}

/// Audited pixels of a shard, in the order of strata, each with its share of the picture relative to the mean
/// share. `risks` holds per pixel, row by row, an upper estimate of the squared bias; it may be empty.
pub(super) fn choose(
    film: &Film,
    shard: Shard,
    mean: f64,
    seed: u32,
    risks: &[f32],
) -> (Vec<[u32; 2]>, Vec<f32>) {
    let (width, height) = (film.width(), film.height());
    let all = count(width, height);
    let order = ordered(film, shard, mean, Grid::new([width, height], all));
    let strata = (all * order.len()).div_ceil(width as usize * height as usize);

    let random = Random::new(seed, STREAM);
    let place = |[x, y]: [u32; 2]| y as usize * width as usize + x as usize;
    let risks: Vec<f32> =
        order.iter().map(|pixel| risks.get(place(*pixel)).copied().unwrap_or(0.0)).collect();
    // Limited so that no pixel fills a stratum alone.
    let probabilities = probabilities(&risks, MAX_RISK_RATIO.min(order.len() as f64 / strata as f64));
    let mut sums = vec![0.0];
    sums.extend(probabilities.iter().scan(0.0, |sum, probability| {
        *sum += probability;
        Some(*sum)
    }));
    let all = sums.last().copied().unwrap_or(0.0);
    let border = |i: usize| match i {
        _ if i == strata => order.len(),
        _ => sums.partition_point(|sum| *sum <= i as f64 * all / strata as f64) - 1,
    };
    let stratum = |i: usize| {
        let (first, end) = (border(i), border(i + 1).max(border(i) + 1));
        let number = i as u32 * shard.count + shard.index;
        let size = sums[end] - sums[first];
        let at = sums[first] + f64::from(random.single(number)) * size;
        let pick = (sums.partition_point(|sum| *sum <= at) - 1).clamp(first, end - 1);
        (order[pick], (size / probabilities[pick] * strata as f64 / order.len() as f64) as f32)
    };
    (0..strata).map(stratum).unzip()
}

/// Relative probabilities of pixels: risk over the median of all known risks, clamped to 1 … `most`.
fn probabilities(risks: &[f32], most: f64) -> Vec<f64> {
    let mut known: Vec<f32> = risks.iter().copied().filter(|risk| *risk > 0.0 && risk.is_finite()).collect();
    if known.is_empty() {
        return vec![1.0; risks.len()];
    }
    known.sort_by(f32::total_cmp);
    let median = f64::from(known[known.len() / 2]);
    risks.iter().map(|risk| (f64::from(*risk) / median).max(1.0).min(most)).collect()
}

/// Joins neighbouring strata until `many` are left. `shares` are the picture shares of their pixels. Returns
/// for each the index of the pixel that stays, chosen uniformly, and its new share.
pub(super) fn join(shares: &[f32], many: usize, seed: u32) -> Vec<(usize, f32)> {
    let random = Random::new(seed, STREAM ^ u32::MAX);
    let border = |i: usize| i * shares.len() / many;
    let joined = |i: usize| {
        let all = &shares[border(i)..border(i + 1)];
        let kept = ((random.single(i as u32) * all.len() as f32) as usize).min(all.len() - 1);
        (border(i) + kept, all[kept] * (all.len() * many) as f32 / shares.len() as f32)
    };
    (0..many).map(joined).collect()
}

/// Pixels of a shard by region, and by brightness within each.
pub(super) fn ordered(film: &Film, shard: Shard, mean: f64, grid: Grid) -> Vec<[u32; 2]> {
    let (width, height) = (film.width(), film.height());
    let mut order: Vec<(usize, f32, [u32; 2])> = Vec::with_capacity(width as usize * height as usize);
    let tiles = film.pixels().chunks(PIXELS_PER_TILE).enumerate();
    for (task, pixels) in tiles.filter(|(task, _)| shard.owns(*task)) {
        let tile = Tile::new(width, height, task);
        let colours = filtered(tile, pixels, mean);
        for (i, colour) in colours.into_iter().enumerate() {
            if let Some((x, y)) = tile.pixel(i) {
                let region = grid.region([x, y]);
                order.push((region, brightness(colour, region), [x, y]));
            }
        }
    }
    order.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    order.into_iter().map(|(_, _, place)| place).collect()
}

/// Random stream of the choice.
const STREAM: u32 = 0x6175_6469;

/// Ascending in one region and descending in the next, so that adjacent strata of two regions are similar.
fn brightness(colour: Rgb, region: usize) -> f32 {
    let sum = colour.element_sum();
    if region.is_multiple_of(2) { sum } else { -sum }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::film::Dropped;
    use halflight_core::memory::{Arena, Line};

    fn film<T>(width: u32, height: u32, light: impl Fn(u32, u32) -> f32, work: impl FnOnce(&Film) -> T) -> T {
        let mut lines = vec![Line([0; 64]); Film::footprint(width, height).bytes() / 64];
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

    #[test]
    fn every_pixel_has_its_chance_and_strata_add_up() {
        let light = |x: u32, y: u32| 1.0 + ((x * 7 + y * 3) % 11) as f32;
        let mut times = vec![0; 40 * 30];
        for seed in 0..400 {
            film(40, 30, light, |film| {
                let (pixels, shares) = choose(film, Shard::WHOLE, 5.0, seed, &[]);
                assert_eq!(pixels.len(), 256);
                assert!((shares.iter().sum::<f32>() / 256.0 - 1.0).abs() < 1e-5);
                for ([x, y], share) in pixels.into_iter().zip(shares) {
                    times[(y * 40 + x) as usize] += 1;
                    assert!((0.8..1.2).contains(&share));
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
                    let shard = Shard { index, count: 3 };
                    let (pixels, shares) = choose(film, shard, 25.0, 1, &[]);
                    // A third of 256, as closely as tiles of 16 x 16 divide 50 x 40.
                    assert!((70..105).contains(&pixels.len()), "{}", pixels.len());
                    assert!((shares.iter().sum::<f32>() / pixels.len() as f32 - 1.0).abs() < 1e-5);
                    let tile = |[x, y]: [u32; 2]| Tile::position([50, 40], x, y) / PIXELS_PER_TILE;
                    assert!(pixels.into_iter().all(|pixel| shard.owns(tile(pixel))));
                }
            },
        );
    }

    #[test]
    fn what_is_rare_has_its_share() {
        // A bright stripe of a hundredth of the picture: 2 or 3 of 256 audited pixels.
        film(
            100,
            100,
            |x, _| if x == 17 { 50.0 } else { 1.0 },
            |film| {
                let (pixels, _) = choose(film, Shard::WHOLE, 1.5, 3, &[]);
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
                    let (pixels, shares) = choose(film, Shard::WHOLE, 50.0, seed, &risks);
                    assert_eq!(pixels.len(), 256);
                    for (_, share) in pixels.iter().zip(&shares).filter(|(pixel, _)| is_wrong(**pixel)) {
                        (found, sum) = (found + 1, sum + f64::from(*share));
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
        let shares: Vec<f32> = (0..1000).map(|i| if i % 3 == 0 { 0.8 } else { 1.1 }).collect();
        let mut kept = [0; 2];
        for seed in 0..20 {
            let joined = join(&shares, 300, seed);
            assert_eq!(joined.len(), 300);
            assert!(joined.windows(2).all(|pair| pair[0].0 < pair[1].0));
            let sum: f32 = joined.iter().map(|(_, share)| share).sum();
            assert!((sum / 300.0 - 1.0).abs() < 0.05, "{sum}");
            joined.iter().for_each(|(i, _)| kept[usize::from(i % 3 == 0)] += 1);
        }
        // A third of 6000, with a standard deviation of 37.
        assert!((2000 - 150..2000 + 150).contains(&kept[1]), "{kept:?}");
        assert_eq!(
            join(&shares, 1000, 1).iter().map(|(i, _)| *i).collect::<Vec<_>>(),
            (0..1000).collect::<Vec<_>>()
        );
    }

    #[test]
    fn small_pictures_are_audited_whole() {
        film(
            5,
            3,
            |_, _| 1.0,
            |film| {
                let (mut pixels, shares) = choose(film, Shard::WHOLE, 1.0, 0, &[]);
                pixels.sort_unstable();
                pixels.dedup();
                assert_eq!((pixels.len(), shares), (15, vec![1.0; 15]));
            },
        );
    }

    #[test]
    fn regions_tile_the_picture() {
        let grid = Grid::new([37, 21], 256);
        let mut area = 0;
        for region in 0..(grid.side * grid.side) as usize {
            let [columns, rows] = grid.bounds(region);
            for y in rows[0]..rows[1] {
                for x in columns[0]..columns[1] {
                    assert_eq!(grid.region([x, y]), region);
                    area += 1;
                }
            }
        }
        assert_eq!((grid.side, area), (4, 37 * 21));
    }
}
