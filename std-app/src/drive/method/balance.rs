//! How many rays the records of caches are worth. Caches of few rays are tried out on a few tiles: the same samples by one cache
//! and by the other tell the noise of records, their variance that of samples, and what each has cost tells where more
//! work leaves less error. Whether several points of lights are worth their rays is told by the same samples.

use crate::drive::RenderError;
use crate::drive::Stop;
use crate::drive::crew::Crew;
use crate::drive::held_out::luminance;
use core::ops::Range;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::IrradianceCache;
use halflight_core::film::{Dropped, PIXELS_PER_TILE, Pixel};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::path::{LIGHTS, WAVE};
use halflight_core::transport::{Counters, PathTracer};

/// Samples that are tried out: far from those of any picture, and the last whose rays to lamps have numbers of their own.
const TRIALS: Range<u32> = (1 << 28) - 2..1 << 28;

/// By what factor one point of lights must leave more noise, for its rays, before several are asked.
const WORTH: f64 = 1.25;

/// The part of the pixels that is left out, those of most noise: flashes, of which so few samples have too many or none.
const FLASHES: usize = 100;

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
    /// relMSE of one sample of each pixel, but for the noise of records,
    sample: f64,
    /// and of records.
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
}

impl Trial {
    /// Tries out two caches; `None` where the round is over.
    pub(super) fn of<F: Features>(
        tracer: &PathTracer<F>,
        [even, odd]: [&IrradianceCache; 2],
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
            for ((tracer, rays), pixels) in tracers.iter().zip(&mut rays).zip(&mut pixels) {
                let counters = tracer.run(tiles[task], TRIALS, WAVE, arena, pixels)?;
                *rays = counters.rays + counters.shadow_rays;
                all += counters;
            }
            if let Some(out) = out.first_mut() {
                let [one, several, other] = &pixels;
                out.light = several.map(|pixel| luminance(pixel.mean()));
                out.samples = [one, several].map(|pixels| pixels.map(|pixel| luminance(pixel.variance())));
                let squared = |i: usize| luminance(one[i].mean() - other[i].mean()).powi(2);
                out.caches = core::array::from_fn(squared);
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
        let mean = light.iter().sum::<f64>() / light.len().max(1) as f64;
        let relative = |squared: &dyn Fn(&Tried) -> [f64; PIXELS_PER_TILE]| {
            let squared = tried.iter().flat_map(squared);
            let weighed =
                squared.zip(&light).map(|(squared, light)| squared / (light * light + 0.01 * mean * mean));
            let mut all: Vec<f64> = weighed.filter(|squared| squared.is_finite()).collect();
            all.sort_by(f64::total_cmp);
            let kept = all.len() - all.len() / FLASHES;
            all[..kept].iter().sum::<f64>() / kept.max(1) as f64
        };
        let [one, several] = [0, 1].map(|i| relative(&|tile| tile.samples[i]));
        let rays = [0, 1].map(|i| tried.iter().map(|tile| tile.rays[i]).sum::<u64>() as f64);
        let is_several = WORTH * several * rays[1] < one * rays[0];
        let samples = TRIALS.len() as f64;
        let share = tried.len().max(1) as f64 / tiles.max(1) as f64;
        let (sample, rays) = if is_several { (several, rays[1]) } else { (one, rays[0]) };
        Self {
            lights: if is_several { LIGHTS } else { 1 },
            sample: sample * samples,
            // A picture has the mean of both.
            records: 0.25 * relative(&|tile| tile.caches),
            rays: rays / (samples * share),
        }
    }

    /// By how many times as many rays records are to be made anew, of `finer`; `None`: they are good as they are. It is where
    /// error times work is least.
    pub(super) fn finer(&self, finer: &[f64], stop: &Stop, account: &Account) -> Option<f64> {
        let worth = |times: f64| {
            // Before finer ones, coarse ones were made.
            let records = if times > 1.0 { times * account.records } else { 0.0 };
            let (noise, left) = (self.records / times, account.left.map(|left| left - records));
            let by_time = left.map(|left| left / self.rays);
            let by_error = stop.error.map(|error| self.sample / (error - noise).max(0.0));
            let by_count = stop.most_samples().map(f64::from);
            let samples = [by_time, by_error, by_count].into_iter().flatten().fold(f64::INFINITY, f64::min);
            let work = account.records + records + samples * self.rays;
            (noise + self.sample / samples.max(1.0)) * work
        };
        let has_time =
            |times: f64| account.left.is_none_or(|left| times * account.records <= MOST_TIME * left);
        let now = worth(1.0);
        let finer = finer.iter().filter(|times| has_time(**times)).map(|times| (*times, worth(*times)));
        let best = finer.min_by(|(_, a), (_, b)| a.total_cmp(b));
        best.filter(|(_, best)| now.is_infinite() || *best < now).map(|(times, _)| times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACCOUNT: Account = Account { records: 10.0, left: None };

    fn trial(sample: f64, records: f64) -> Trial {
        Trial { lights: 1, sample, records, rays: 1.0 }
    }

    #[test]
    fn finer_records_are_made_where_their_noise_is_most_of_it() {
        let spp = |spp| Stop { spp: Some(spp), ..Stop::default() };
        let finer = |records, stop| trial(1.0, records).finer(&[4.0, 16.0], &stop, &ACCOUNT);
        assert_eq!(finer(1e-6, spp(100)), None);
        // (1 / 100 + 0.01) 110 = 2.2, (1 / 100 + 0.01 / 4) 150 = 1.9, (1 / 100 + 0.01 / 16) 270 = 2.9.
        assert_eq!(finer(0.01, spp(100)), Some(4.0));
        assert_eq!(finer(1.0, spp(100)), Some(16.0));
        // The more samples, the finer.
        assert_eq!([10, 10_000].map(|n| finer(0.01, spp(n))), [None, Some(16.0)]);
        // An error below that of these records needs others, however few samples there are.
        let error = |error| Stop { error: Some(error), ..Stop::default() };
        assert_eq!([0.1, 0.009, 1e-3].map(|e| finer(0.01, error(e))), [None, Some(4.0), Some(16.0)]);
        assert_eq!(trial(1.0, 1.0).finer(&[], &spp(100), &ACCOUNT), None);
    }

    #[test]
    fn what_there_is_no_time_for_is_not_made() {
        let finer = |left| {
            let account = Account { left: Some(left), ..ACCOUNT };
            trial(1.0, 1.0).finer(&[4.0, 16.0], &Stop { seconds: Some(1e3), ..Stop::default() }, &account)
        };
        assert_eq!([79.0, 81.0, 321.0].map(finer), [None, Some(4.0), Some(16.0)]);
    }

    #[test]
    fn a_trial_tells_noise_and_rays_of_one_sample() {
        let mut tile = Tried { light: [1.0; PIXELS_PER_TILE], rays: [100, 300], ..Tried::default() };
        tile.samples = [[1.01; PIXELS_PER_TILE], [0.505; PIXELS_PER_TILE]];
        tile.caches = [4.04; PIXELS_PER_TILE];
        // Flashes do not count, nor what is not a number.
        (tile.samples[0][7], tile.caches[9]) = (1e9, f64::NAN);
        let told = Trial::told(&vec![tile.clone(); 16], 64);
        // Two samples, a quarter of the tiles; several points leave half of the noise for three times the rays.
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(told.lights == 1 && told.rays == 3200.0, "{told:?}");
        assert!(near(told.sample, 2.0) && near(told.records, 1.0), "{told:?}");
        tile.rays[1] = 150;
        let told = Trial::told(&vec![tile; 16], 64);
        assert!(told.lights == LIGHTS && near(told.sample, 1.0) && told.rays == 4800.0, "{told:?}");
    }
}
