//! The audit of a picture: a few of its pixels are rendered by the unbiased path tracer as well, in step with it. What
//! both differ by beyond their noise is bias (docs/decisions/0011).

mod choice;
mod shards;
mod verdict;

pub use verdict::{Audited, Region};

use super::memory::Memory;
use super::method::{Method, Stage};
use super::threads::Threads;
use super::workers::Workers;
use super::{ErrorEstimate, RenderError, Settings, Shard};
use choice::Grid;
use core::ops::Range;
use halflight_core::bsdf::Features;
use halflight_core::film::{Film, Pixel};
use halflight_core::memory::{Arena, Footprint, Line, OutOfMemory};
use halflight_core::method::caustics::{unseen, unseen_footprint};
use halflight_core::transport::{CausticMerging, Counters, PathIntegrator, path::WAVE};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The share of the work of a biased picture that goes into its audit where nothing else is asked for.
pub(super) const SHARE: f64 = 0.05;

/// Pixels are audited so many samples at a time, which keeps the parts of their halves equal.
const STEP: u32 = 4;

/// Audited pixels of one task.
const PIXELS_PER_TASK: usize = 8;

/// Samples of each audited pixel by which it must have seen all light of the picture.
const SEEN: f64 = 256.0;

/// Seconds of samples after which the clock, and whoever waits, are asked again.
const LONGEST: f64 = 0.25;

/// Makes the random numbers of the audit others than those of the picture.
const OTHER_SEED: u32 = 0x5eed_a0d1;

/// Samples of single pixels by the path tracer, joined with photons of caustics if there are any.
type Truth<'a> = dyn Fn(Samples, Option<CausticMerging>, &mut Arena, &mut [Pixel]) -> Result<Counters, OutOfMemory>
    + Sync
    + 'a;

/// Samples of the pixels in these columns and rows.
type Samples<'s> = (&'s [[u32; 2]], Range<u32>);

/// Working memory of a thread.
fn scratch<F: Features>() -> Footprint {
    PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE)
}

/// See the file.
pub(super) struct Audit<'a> {
    truth: Box<Truth<'a>>,
    /// Whose pixels are audited.
    shard: Shard,
    /// Whether work is time. Otherwise it is rays, which are the same each time.
    by_clock: bool,
    seed: u32,
    scratch: Vec<Vec<Line>>,
    /// Of each pixel, where the method knows them, until pixels are chosen.
    risks: Vec<f32>,
    state: State,
}

/// All that a film file keeps of an audit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    /// Of the work of picture and audit together.
    share: f64,
    places: Vec<[u32; 2]>,
    shares: Vec<f32>,
    /// The bits of the audited pixels.
    pixels: Vec<[u32; size_of::<Pixel>() / 4]>,
    taken: u32,
    rays: u64,
    seconds: f64,
    /// Whether paths were joined with photons of the picture, whose blur they do not see.
    #[serde(default)]
    has_photons: bool,
    /// The share of the picture's light that its paths as good as never find, by a first look with photons.
    #[serde(default)]
    unseen: f64,
}

impl State {
    /// Whether it is one that was written.
    pub(super) fn is_whole(&self) -> bool {
        self.places.len() == self.pixels.len() && self.places.len() == self.shares.len()
    }

    /// What is known of the bias of `film`, of mean `mean`, whose own noise tells `noise`.
    pub(super) fn verdict(&self, film: &Film, mean: f64, noise: ErrorEstimate) -> Option<Audited> {
        let Self { share, places, shares, pixels, taken, rays, seconds, has_photons, unseen } = self;
        let truth: &[Pixel] = bytemuck::cast_slice(pixels);
        let grid = Grid::new([film.width(), film.height()], places.len());
        let findings = verdict::findings(film, mean, places, truth);
        let audited = verdict::verdict(&findings, shares, places, grid, noise)?.by_a_judge_without(*unseen);
        Some(Audited {
            share: *share,
            samples: *taken,
            rays: *rays,
            seconds: *seconds,
            has_photons: *has_photons,
            ..audited
        })
    }
}

/// The share of the work that the audit of a picture has; `None` where there is none.
fn share(settings: &Settings, is_biased: bool) -> Option<f64> {
    let share = settings.audit.unwrap_or(if is_biased { SHARE } else { 0.0 });
    (share > 0.0).then_some(share)
}

impl<'a> Audit<'a> {
    /// The audit that the settings ask for.
    pub(super) fn new<F: Features>(
        stage: &Stage<'a>,
        memory: &mut Memory,
        method: Method,
    ) -> Result<Option<Self>, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let Some(share) = share(settings, method.is_biased()) else { return Ok(None) };
        let mut scratch = memory.take_each("audit", scratch::<F>(), workers.count())?;
        // The pixels themselves are counted and not taken: they are kept where a film file can find them.
        let pixels = choice::count(settings.width, settings.height);
        memory.set_aside("audit", Footprint::default().slice::<Pixel>(pixels))?;
        let seed = settings.seed ^ OTHER_SEED;
        let tracer = stage.paths::<F>(seed);
        // Others lend the audit the photons that they have, or find no more than its paths.
        let samples = SEEN * pixels as f64 / (f64::from(settings.width) * f64::from(settings.height));
        let unseen = match method.finds_caustics() {
            true => {
                let mut executor = Threads::new(workers, &mut scratch);
                unseen::<F>(&stage.context(), samples, memory, &mut executor)?.unwrap_or(0.0)
            }
            false => 0.0,
        };
        Ok(Some(Self {
            truth: Box::new(move |(places, samples), photons, arena, out| match photons {
                Some(photons) => tracer.with_caustics(photons).probe(places, samples, WAVE, arena, out),
                None => tracer.probe(places, samples, WAVE, arena, out),
            }),
            shard: settings.shard,
            by_clock: settings.stop.error.is_none(),
            seed,
            scratch,
            risks: Vec::new(),
            state: State { share, unseen, ..State::default() },
        }))
    }

    /// Bytes that it is going to take: a method that takes what it can get leaves so many.
    pub(super) fn bytes<F: Features>(stage: &Stage, is_biased: bool) -> usize {
        let Stage { settings, workers, lights, .. } = *stage;
        if share(settings, is_biased).is_none() {
            return 0;
        }
        let pixels = Footprint::default().slice::<Pixel>(choice::count(settings.width, settings.height));
        let threads = scratch::<F>().bytes().saturating_mul(workers.count());
        let unseen = if is_biased { unseen_footprint(lights).bytes() } else { 0 };
        threads.saturating_add(pixels.bytes()).saturating_add(unseen)
    }

    /// Whether its pixels are still to be chosen.
    pub(super) fn is_open(&self) -> bool {
        self.state.places.is_empty()
    }

    /// Chooses its pixels by these risks ([`choice::choose`]).
    pub(super) fn weigh(&mut self, risks: Vec<f32>) {
        self.risks = risks;
    }

    /// What a film file keeps.
    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// Goes on where a film file ended.
    pub(super) fn resume(&mut self, state: State) {
        self.state = State { share: self.state.share, ..state };
    }

    /// Takes the samples that are due after so many `rays` of the picture, or `seconds` of picture and audit; fewer where
    /// there is no time for all of them. Pixels are chosen in the first step, by the film. Where the picture has `photons` of
    /// caustics, paths are joined with the same ones, those of each half with photons that the other half does not know; their
    /// blur is in both, and not seen.
    pub(super) fn step(
        &mut self,
        workers: &Workers,
        film: &Film,
        photons: Option<CausticMerging>,
        (rays, seconds): (u64, f64),
        time_left: Option<f64>,
    ) -> Result<(), RenderError> {
        let start = Instant::now();
        if self.state.places.is_empty() {
            let Some(mean) = workers.mean(film) else { return Ok(()) };
            (self.state.places, self.state.shares) =
                choice::choose(film, self.shard, mean, self.seed, &self.risks);
            self.risks = Vec::new();
            self.state.pixels = vec![bytemuck::cast(Pixel::default()); self.state.places.len()];
        }
        let before = self.state.seconds;
        let per_picture = self.state.share / (1.0 - self.state.share);
        loop {
            let (spent, due) = match self.by_clock {
                true => (self.state.seconds, per_picture * (seconds - before)),
                false => (self.state.rays as f64, per_picture * rays as f64),
            };
            let State { taken, .. } = self.state;
            // What a sample costs is known better and better.
            let samples = match taken {
                0 => STEP,
                _ => (((due - spent) * f64::from(taken) / spent) as u32).min(3 * taken) / STEP * STEP,
            };
            let spare = time_left.map(|left| left - start.elapsed().as_secs_f64());
            let cost = f64::from(samples) * self.state.seconds / f64::from(taken.max(1));
            if samples == 0 || spare.is_some_and(|spare| spare < cost) {
                return Ok(());
            }
            if !self.run(workers, taken..taken + samples, photons)? {
                return Ok(());
            }
            self.state.seconds = before + start.elapsed().as_secs_f64();
        }
    }

    /// After its first samples, and as many as `spp` of each pixel of the picture in so many `rays`: where audited pixels are going
    /// to be noisier than those of the picture, more samples of fewer of them tell more.
    pub(super) fn focus(&mut self, audited: &Audited, (rays, spp): (u64, u32)) {
        let State { share, places, shares, taken, rays: own, .. } = &self.state;
        if *taken != STEP || *own == 0 {
            return;
        }
        // Samples of an audited pixel for each of the picture's.
        let rate = share / (1.0 - share) * rays as f64 / f64::from(spp) * f64::from(*taken) / *own as f64;
        let wanted = places.len() as f64 * rate * f64::from(spp) / (f64::from(*taken) * audited.imbalance);
        let many = (wanted as usize).max(choice::ENOUGH);
        if many >= places.len() {
            return;
        }
        let kept = choice::join(shares, many, self.seed);
        self.state.places = kept.iter().map(|(i, _)| self.state.places[*i]).collect();
        self.state.pixels = kept.iter().map(|(i, _)| self.state.pixels[*i]).collect();
        self.state.shares = kept.into_iter().map(|(_, share)| share).collect();
    }

    /// Takes a quarter more samples than there are, whatever is due, some at a time, as long as it `may`; whether it did.
    pub(super) fn go_on(
        &mut self,
        workers: &Workers,
        photons: Option<CausticMerging>,
        may: &mut dyn FnMut(f64) -> bool,
    ) -> Result<bool, RenderError> {
        let end = (self.state.taken + self.state.taken / 4).next_multiple_of(STEP);
        while self.state.taken < end {
            let each = self.state.seconds / f64::from(self.state.taken.max(1));
            let samples = ((LONGEST / each) as u32 / STEP * STEP).clamp(STEP, end - self.state.taken);
            if !may(each * f64::from(samples)) {
                return Ok(false);
            }
            let start = Instant::now();
            if !self.run(workers, self.state.taken..self.state.taken + samples, photons)? {
                return Ok(false);
            }
            self.state.seconds += start.elapsed().as_secs_f64();
        }
        Ok(true)
    }

    /// Whether they were taken: not where the render is interrupted.
    fn run(
        &mut self,
        workers: &Workers,
        samples: Range<u32>,
        photons: Option<CausticMerging>,
    ) -> Result<bool, OutOfMemory> {
        let Self { truth, scratch, state, .. } = self;
        let places = &state.places;
        let pixels: &mut [Pixel] = bytemuck::cast_slice_mut(&mut state.pixels);
        let before = pixels.to_vec();
        let is_over = || workers.deadline.is_interrupted();
        let (counters, all) =
            workers.pass(pixels, PIXELS_PER_TASK, scratch, &is_over, &|task, arena, out| {
                let first = task * PIXELS_PER_TASK;
                truth((&places[first..first + out.len()], samples.clone()), photons, arena, out)
            })?;
        state.rays += counters.all_rays();
        if !all {
            // All have the same samples, or none of them.
            pixels.copy_from_slice(&before);
            return Ok(false);
        }
        state.has_photons |= photons.is_some();
        state.taken = samples.end;
        Ok(true)
    }

    /// What is known of the bias of `film`, whose own noise tells `noise`.
    pub(super) fn verdict(&self, workers: &Workers, film: &Film, noise: ErrorEstimate) -> Option<Audited> {
        self.state.verdict(film, workers.mean(film)?, noise)
    }
}

#[cfg(test)]
mod tests;
