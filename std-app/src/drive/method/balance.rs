//! How many rays the records of caches are worth. Caches of few rays are tried out on a few tiles: the same samples by one cache
//! and by the other tell the noise of records, the variance of some more that of samples, and what each has cost tells where
//! more work leaves less error. Whether several points of lights are worth their rays is tried out as well.

use super::caster::MOST_SAMPLES;
use crate::drive::crew::Crew;
use crate::drive::held_out::luminance;
use crate::drive::{RenderError, Stop};
use core::ops::Range;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::IrradianceCache;
use halflight_core::film::{Dropped, PIXELS_PER_TILE, Pixel};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::path::{LIGHTS, WAVE};
use halflight_core::transport::{Counters, PathTracer};

/// Samples that are tried out: far from those of any picture, and the last whose rays to lamps have numbers of their own. Many
/// tell what the noise of samples comes to, which falls faster while they are few; of pictures that have no more than these,
/// coarse records are good enough.
const FEW: Range<u32> = (1 << 28) - 2..1 << 28;
const MANY: Range<u32> = (1 << 28) - 16..1 << 28;

/// Many are taken of one tile in so many of a small picture, but of so many at least.
const LARGE_PART: usize = 8;
const FEWEST_TILES: usize = 4;

/// By what factor one point of lights must leave more noise, for its rays, before several are asked.
const WORTH: f64 = 1.25;

/// The part of the pixels that is left out where caches differ most: what no record reaches flashes, of which so few samples
/// have too many or none.
const FLASHES: usize = 100;

/// The share of the noise of records that is that of photons, where rays end in these, however many they are.
const OF_PHOTONS: f64 = 0.5;

/// The share of the time that is left which finer caches may take.
const MOST_TIME: f64 = 0.5;

/// What was found of a tile: of each pixel its light, the variance of its samples by one point of lights and by several, and the
/// squared difference of two caches.
#[derive(Clone)]
struct Tried {
    light: [f64; PIXELS_PER_TILE],
    samples: [[f64; PIXELS_PER_TILE]; 2],
    caches: [f64; PIXELS_PER_TILE],
    /// By one point of lights and by several.
    rays: [u64; 2],
}

impl Default for Tried {
    fn default() -> Self {
        let none = [0.0; PIXELS_PER_TILE];
        Self { light: none, samples: [none; 2], caches: none, rays: [0; 2] }
    }
}

/// What a trial tells of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trial {
    /// Points of lights that are asked.
    pub(super) lights: usize,
    /// relMSE by the noise of records, where it was asked for.
    records: f64,
    /// Rays of one sample of each pixel.
    rays: f64,
}

/// What caches have cost, and what there is, in rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Account {
    /// Of both caches of which the trial was made.
    pub(super) records: f64,
    /// For which there is time, where it is limited.
    pub(super) left: Option<f64>,
    /// Whether rays end in photons.
    pub(super) by_photons: bool,
}

impl Trial {
    /// Tries out the first of two caches, and, if the noise of their records `is_asked`, the other; `None` where the round is over.
    pub(super) fn of<F: Features>(
        tracer: &PathTracer<F>,
        ([even, odd], is_asked): ([&IrradianceCache; 2], bool),
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<Self>, RenderError> {
        let tiles: Vec<usize> = tracer.pilot_tasks().collect();
        let mut tried = vec![Tried::default(); tiles.len()];
        let [one, other] = [[even; 2], [odd; 2]].map(|caches| tracer.with_caches(caches));
        let look = |task: usize, arena: &mut Arena, out: &mut [Tried]| {
            let (mut all, mut rays) = (Counters::default(), [0; 3]);
            let mut pixels = [[Pixel::default(); PIXELS_PER_TILE]; 3];
            let tracers = [one.with_lights(1), one.with_lights(LIGHTS), other.with_lights(1)];
            let tracers = tracers.iter().take(if is_asked { 3 } else { 2 });
            for ((tracer, rays), pixels) in tracers.zip(&mut rays).zip(&mut pixels) {
                let counters = tracer.run(tiles[task], FEW, WAVE, arena, pixels)?;
                *rays = counters.all_rays();
                all += counters;
            }
            if let Some(out) = out.first_mut() {
                let [one, several, other] = &pixels;
                out.light = several.map(|pixel| luminance(pixel.mean()));
                out.samples = [one, several].map(|pixels| pixels.map(|pixel| luminance(pixel.variance())));
                if is_asked {
                    let squared = |i: usize| luminance(one[i].mean() - other[i].mean()).powi(2);
                    out.caches = core::array::from_fn(squared);
                }
                out.rays = [rays[0], rays[1]];
            }
            // What is dropped here is dropped from no picture.
            Ok(Counters { dropped: Dropped::default(), ..all })
        };
        let is_done = crew.pass(&mut tried, 1, scratch, &look)?;
        Ok(is_done.then(|| Self::told(&tried, tracer.tasks())))
    }

    /// By tiles of so many.
    fn told(tried: &[Tried], tiles: usize) -> Self {
        let light: Vec<f64> = tried.iter().flat_map(|tile| tile.light).collect();
        let whole = mean(light.iter().copied());
        let weigh = |(squared, light): (f64, &f64)| relative(squared, *light, whole);
        let noise = |i: usize| mean(tried.iter().flat_map(|tile| tile.samples[i]).zip(&light).map(weigh));
        let rays = [0, 1].map(|i| tried.iter().map(|tile| tile.rays[i]).sum::<u64>() as f64);
        let is_several = WORTH * noise(1) * rays[1] < noise(0) * rays[0];
        let mut caches: Vec<f64> = tried.iter().flat_map(|tile| tile.caches).zip(&light).map(weigh).collect();
        caches.sort_by(f64::total_cmp);
        let kept = caches.len() - caches.len() / FLASHES;
        let share = tried.len().max(1) as f64 / tiles.max(1) as f64;
        Self {
            lights: if is_several { LIGHTS } else { 1 },
            // A picture has the mean of both.
            records: 0.25 * mean(caches.into_iter().take(kept)),
            rays: rays[usize::from(is_several)] / (FEW.len() as f64 * share),
        }
    }

    /// relMSE of one sample of each pixel, but for the noise of records, as far as many tell; `None` where the round is over.
    pub(super) fn noise<F: Features>(
        &self,
        tracer: &PathTracer<F>,
        cache: &IrradianceCache,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<f64>, RenderError> {
        let tracer = tracer.with_caches([cache; 2]).with_lights(self.lights);
        let all = tracer.pilot_tasks().count();
        let wanted = (tracer.tasks() / LARGE_PART).clamp(FEWEST_TILES.min(all), all);
        let tiles: Vec<usize> = tracer.pilot_tasks().step_by(all.div_ceil(wanted.max(1)).max(1)).collect();
        let mut tried = vec![[Pixel::default(); PIXELS_PER_TILE]; tiles.len()];
        let look = |task: usize, arena: &mut Arena, out: &mut [[Pixel; PIXELS_PER_TILE]]| {
            let Some(pixels) = out.first_mut() else { return Ok(Counters::default()) };
            let counters = tracer.run(tiles[task], MANY, WAVE, arena, pixels)?;
            Ok(Counters { dropped: Dropped::default(), ..counters })
        };
        if !crew.pass(&mut tried, 1, scratch, &look)? {
            return Ok(None);
        }
        let pixels = || tried.iter().flatten();
        let light = mean(pixels().map(|pixel| luminance(pixel.mean())));
        let noise =
            pixels().map(|pixel| relative(luminance(pixel.variance()), luminance(pixel.mean()), light));
        Ok(Some(MANY.len() as f64 * mean(noise)))
    }

    /// Samples that the picture will have at most, where an error does not say.
    fn most(&self, stop: &Stop, left: Option<f64>) -> f64 {
        let by_time = left.map(|left| left / self.rays);
        let by_count = stop.most_samples().map(f64::from);
        [by_time, by_count].into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// Whether the picture will have so few samples that records may be coarse.
    pub(super) fn is_short(&self, stop: &Stop, account: &Account) -> bool {
        self.most(stop, account.left) <= MANY.len() as f64
    }

    /// By how many times as many rays records are to be made anew, of `finer`, where one sample has that noise, and from which
    /// sample on; `None`: they are good as they are. It is where error times work is least.
    pub(super) fn finer(
        &self,
        finer: &[f64],
        sample: f64,
        stop: &Stop,
        account: &Account,
    ) -> Option<(f64, u32)> {
        let stays = if account.by_photons { OF_PHOTONS } else { 0.0 };
        // Both caches have their part of the samples.
        let noise = |times: f64| self.records * (stays + (1.0 - stays) / (1.0 + times));
        let samples = |times: f64| {
            let most = self.most(stop, account.left.map(|left| left - times * account.records));
            let by_error = stop.error.map(|error| sample / (error - noise(times)).max(0.0));
            most.min(by_error.unwrap_or(most)).max(1.0)
        };
        let worth = |times: f64| {
            let samples = samples(times);
            let work = (1.0 + times) * account.records + samples * self.rays;
            (noise(times) + sample / samples) * work
        };
        let has_time =
            |times: f64| account.left.is_none_or(|left| times * account.records <= MOST_TIME * left);
        let now = worth(0.0);
        let finer = finer.iter().filter(|times| has_time(**times)).map(|times| (*times, worth(*times)));
        let (times, best) = finer.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        // Where photons of caustics change as well.
        let from = (samples(times) / (1.0 + times)) as u32 / MOST_SAMPLES * MOST_SAMPLES;
        (now.is_infinite() || best < now).then_some((times, from))
    }
}

/// A squared error of a pixel of that light, as relMSE counts it; none where it is not a number.
fn relative(squared: f64, light: f64, mean: f64) -> f64 {
    let relative = squared / (light * light + 0.01 * mean * mean);
    if relative.is_finite() { relative } else { 0.0 }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACCOUNT: Account = Account { records: 10.0, left: None, by_photons: false };

    fn trial(records: f64) -> Trial {
        Trial { lights: 1, records, rays: 1.0 }
    }

    #[test]
    fn finer_records_are_made_where_their_noise_is_most_of_it() {
        let spp = |spp| Stop { spp: Some(spp), ..Stop::default() };
        let finer = |records, stop| trial(records).finer(&[4.0, 16.0], 1.0, &stop, &ACCOUNT);
        assert_eq!(finer(1e-6, spp(100)), None);
        // (1 / 100 + 0.01) 110 = 2.2, (1 / 100 + 0.01 / 5) 150 = 1.8, (1 / 100 + 0.01 / 17) 270 = 2.9. A fifth of the samples
        // are left to coarse ones.
        assert_eq!(finer(0.01, spp(100)), Some((4.0, 16)));
        assert_eq!(finer(1.0, spp(100)), Some((16.0, 0)));
        // The more samples, the finer.
        assert_eq!([10, 10_000].map(|n| finer(0.01, spp(n))), [None, Some((16.0, 584))]);
        // An error below that of these records needs others, however few samples there are.
        let error = |error| finer(0.01, Stop { error: Some(error), ..Stop::default() });
        assert_eq!(
            [0.1, 0.009, 1e-3].map(|e| error(e).map(|(times, _)| times)),
            [None, Some(4.0), Some(16.0)]
        );
        assert_eq!(trial(1.0).finer(&[], 1.0, &spp(100), &ACCOUNT), None);
        // Of photons' own noise rays take nothing away.
        let photons = Account { by_photons: true, ..ACCOUNT };
        assert_eq!(trial(0.01).finer(&[4.0, 16.0], 1.0, &spp(100), &photons), None);
    }

    #[test]
    fn what_there_is_no_time_for_is_not_made() {
        let finer = |left| {
            let account = Account { left: Some(left), ..ACCOUNT };
            let stop = Stop { seconds: Some(1e3), ..Stop::default() };
            trial(1.0).finer(&[4.0, 16.0], 1.0, &stop, &account).map(|(times, _)| times)
        };
        assert_eq!([79.0, 81.0, 321.0].map(finer), [None, Some(4.0), Some(16.0)]);
    }

    #[test]
    fn a_trial_tells_the_noise_of_records_and_the_rays_of_a_sample() {
        let mut tile = Tried { light: [1.0; PIXELS_PER_TILE], rays: [100, 300], ..Tried::default() };
        tile.samples = [[1.01; PIXELS_PER_TILE], [0.505; PIXELS_PER_TILE]];
        tile.caches = [4.04; PIXELS_PER_TILE];
        // Flashes do not count, nor what is not a number.
        (tile.caches[7], tile.samples[0][9]) = (1e9, f64::NAN);
        let told = Trial::told(&vec![tile.clone(); 16], 64);
        // Two samples, a quarter of the tiles; several points leave half of the noise for three times the rays.
        assert!(told.lights == 1 && told.rays == 3200.0, "{told:?}");
        assert!((told.records - 1.0).abs() < 1e-9, "{told:?}");
        tile.rays[1] = 150;
        let told = Trial::told(&vec![tile; 16], 64);
        assert!(told.lights == LIGHTS && told.rays == 4800.0, "{told:?}");
        // How many there will be at most.
        let of = |spp, seconds| Stop { spp, seconds, error: None };
        let most = |stop, left| told.is_short(&stop, &Account { records: 1.0, left, ..ACCOUNT });
        assert!(most(of(Some(16), None), None) && !most(of(Some(17), None), None));
        assert!(most(of(None, Some(1.0)), Some(4800.0)) && !most(of(None, Some(1.0)), Some(1e6)));
    }
}
