//! Audit of a picture: the unbiased path tracer renders some of its pixels as well, in step with the picture.
//! Their difference beyond noise is bias (docs/decisions/bias-audit.md).

mod choice;
mod shards;
mod verdict;

pub use verdict::{Audited, Region};

use super::deadline::End;
use super::memory::Memory;
use super::method::{Method, RenderSetup};
use super::threads::{Threads, Workers};
use super::{ErrorEstimate, RenderError, Settings, Shard};
use choice::Grid;
use core::ops::Range;
use halflight_core::bsdf::Features;
use halflight_core::film::{Film, Pixel};
use halflight_core::memory::{Arena, Footprint, Line, OutOfMemory};
use halflight_core::method::caustics::{unseen, unseen_footprint};
use halflight_core::method::{Executor, Passed};
use halflight_core::transport::{CausticMerging, Counters, PathIntegrator, path::WAVE};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Default share of the work that goes into the audit of a biased picture.
pub(super) const SHARE: f64 = 0.05;

/// Samples of audited pixels per step, a multiple of four for equal parts of both half-films.
const STEP: u32 = 4;

/// Audited pixels of one task.
const PIXELS_PER_TASK: usize = 8;

/// Samples per audited pixel within which audit paths must find all light of the picture.
const VISIBILITY_SAMPLES: f64 = 256.0;

/// Longest run of samples, seconds, between checks of the clock and calls of `may`.
const MAX_RUN_SECONDS: f64 = 0.25;

/// Makes the audit's random numbers differ from those of the picture.
const AUDIT_SEED: u32 = 0x5eed_a0d1;

/// Counters of path-traced samples.
type Traced = Result<Counters, OutOfMemory>;

/// Path-traced samples of single pixels, merged with caustic photons if given.
type PixelTracer<'a> =
    dyn Fn(Samples, Option<CausticMerging>, &mut Arena, &mut [Pixel]) -> Traced + Sync + 'a;

/// Pixels as column and row, and the range of their samples.
type Samples<'s> = (&'s [[u32; 2]], Range<u32>);

/// Working memory of a thread.
fn scratch<F: Features>() -> Footprint {
    PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE)
}

/// An audit in progress.
pub(super) struct Audit<'a> {
    truth: Box<PixelTracer<'a>>,
    /// Shard whose pixels are audited.
    shard: Shard,
    /// True if work is measured in seconds. Otherwise it is counted in rays, which are the same in each run.
    by_clock: bool,
    seed: u32,
    scratch: Vec<Vec<Line>>,
    /// Risk of each pixel, if the method knows it, until the pixels are chosen.
    risks: Vec<f32>,
    state: State,
}

/// State of an audit in a film file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    /// Share of the total work of picture and audit.
    share: f64,
    places: Vec<[u32; 2]>,
    shares: Vec<f32>,
    /// Bits of the audited pixels.
    pixels: Vec<[u32; size_of::<Pixel>() / 4]>,
    taken: u32,
    rays: u64,
    seconds: f64,
    /// True if paths were merged with the picture's photons, whose blur the audit then cannot see.
    #[serde(default)]
    has_photons: bool,
    /// Share of the picture's light that audit paths practically never find, by a prepass with photons.
    #[serde(default)]
    unseen: f64,
}

impl State {
    /// True if the lists have equal lengths, as in every state written.
    pub(super) fn is_whole(&self) -> bool {
        self.places.len() == self.pixels.len() && self.places.len() == self.shares.len()
    }

    /// Estimated bias of `film`, whose mean is `mean` and whose noise is `noise`.
    pub(super) fn verdict(&self, film: &Film, mean: f64, noise: ErrorEstimate) -> Option<Audited> {
        let Self { share, places, shares, pixels, taken, rays, seconds, has_photons, unseen } = self;
        let truth: &[Pixel] = bytemuck::cast_slice(pixels);
        let grid = Grid::new([film.width(), film.height()], places.len());
        let findings = verdict::findings(film, mean, places, truth);
        let audited =
            verdict::verdict(&findings, shares, places, grid, noise)?.without_bias_if_unseen(*unseen);
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

/// Share of the work for the audit; `None` without an audit.
fn share(settings: &Settings, is_biased: bool) -> Option<f64> {
    let share = settings.audit.unwrap_or(if is_biased { SHARE } else { 0.0 });
    (share > 0.0).then_some(share)
}

impl<'a> Audit<'a> {
    /// Sets up the audit that the settings ask for.
    pub(super) fn new<F: Features>(
        setup: &RenderSetup<'a>,
        memory: &mut Memory,
        method: Method,
    ) -> Result<Option<Self>, RenderError> {
        let RenderSetup { settings, workers, .. } = *setup;
        let Some(share) = share(settings, method.is_biased()) else { return Ok(None) };
        let mut scratch = memory.take_each("audit", scratch::<F>(), workers.count())?;
        // Pixels are counted but not taken here: they stay where film files can find them.
        let pixels = choice::count(settings.width, settings.height);
        memory.set_aside("audit", Footprint::default().slice::<Pixel>(pixels))?;
        let seed = settings.seed ^ AUDIT_SEED;
        let tracer = setup.paths::<F>(seed);
        // Other methods lend the audit their photons, or find no more light than its paths.
        let samples =
            VISIBILITY_SAMPLES * pixels as f64 / (f64::from(settings.width) * f64::from(settings.height));
        let unseen = match method.finds_caustics() {
            true => {
                let mut executor = Threads::new(workers, &mut scratch);
                unseen::<F>(&setup.context(), samples, memory, &mut executor)?.unwrap_or(0.0)
            }
            false => 0.0,
        };
        Ok(Some(Self {
            truth: Box::new(move |(places, samples), photons, arena, out| match photons {
                Some(photons) => {
                    tracer.with_caustics(photons).sample_pixels(places, samples, WAVE, arena, out)
                }
                None => tracer.sample_pixels(places, samples, WAVE, arena, out),
            }),
            shard: settings.shard,
            by_clock: settings.stop.error.is_none(),
            seed,
            scratch,
            risks: Vec::new(),
            state: State { share, unseen, ..State::default() },
        }))
    }

    /// Bytes that the audit will take; methods that take all available memory leave them free.
    pub(super) fn bytes<F: Features>(setup: &RenderSetup, is_biased: bool) -> usize {
        let RenderSetup { settings, workers, lights, .. } = *setup;
        if share(settings, is_biased).is_none() {
            return 0;
        }
        let pixels = Footprint::default().slice::<Pixel>(choice::count(settings.width, settings.height));
        let threads = scratch::<F>().bytes().saturating_mul(workers.count());
        let unseen = if is_biased { unseen_footprint(lights.count()).bytes() } else { 0 };
        threads.saturating_add(pixels.bytes()).saturating_add(unseen)
    }

    /// True if its pixels are still to be chosen.
    pub(super) fn is_open(&self) -> bool {
        self.state.places.is_empty()
    }

    /// Sets the risks for the choice of pixels ([`choice::choose`]).
    pub(super) fn set_risks(&mut self, risks: Vec<f32>) {
        self.risks = risks;
    }

    /// State for a film file.
    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// Continues from the state of a film file.
    pub(super) fn resume(&mut self, state: State) {
        self.state = State { share: self.state.share, ..state };
    }

    /// Takes the samples that are due after `rays` of the picture, or `seconds` of picture and audit, or
    /// fewer if time is short. The first step chooses the pixels by the film. With caustic `photons` of the
    /// picture, paths of each half-film are merged with photons unknown to the other half; their blur is in
    /// both and stays undetected.
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
            // The cost of a sample is estimated better in each iteration.
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

    /// Reduces the number of audited pixels after their first samples, if they will be noisier than the
    /// picture's: fewer pixels with more samples then estimate the bias better. The picture has taken `spp`
    /// samples per pixel and `rays` rays.
    pub(super) fn reduce_pixels(&mut self, audited: &Audited, (rays, spp): (u64, u32)) {
        let State { share, places, shares, taken, rays: own, .. } = &self.state;
        if *taken != STEP || *own == 0 {
            return;
        }
        // Samples of an audited pixel per sample of a picture's pixel.
        let rate = share / (1.0 - share) * rays as f64 / f64::from(spp) * f64::from(*taken) / *own as f64;
        let wanted = places.len() as f64 * rate * f64::from(spp) / (f64::from(*taken) * audited.imbalance);
        let many = (wanted as usize).max(choice::SUFFICIENT_PIXELS);
        if many >= places.len() {
            return;
        }
        let kept = choice::join(shares, many, self.seed);
        self.state.places = kept.iter().map(|(i, _)| self.state.places[*i]).collect();
        self.state.pixels = kept.iter().map(|(i, _)| self.state.pixels[*i]).collect();
        self.state.shares = kept.into_iter().map(|(_, share)| share).collect();
    }

    /// Takes a quarter more samples in steps while `may` allows the expected seconds; returns whether all
    /// were taken.
    pub(super) fn extend(
        &mut self,
        workers: &Workers,
        photons: Option<CausticMerging>,
        may: &mut dyn FnMut(f64) -> bool,
    ) -> Result<bool, RenderError> {
        let end = (self.state.taken + self.state.taken / 4).next_multiple_of(STEP);
        while self.state.taken < end {
            let each = self.state.seconds / f64::from(self.state.taken.max(1));
            let samples = ((MAX_RUN_SECONDS / each) as u32 / STEP * STEP).clamp(STEP, end - self.state.taken);
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

    /// Takes `samples` of all audited pixels; returns false if interrupted.
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
        let pieces = places.chunks(PIXELS_PER_TASK).zip(pixels.chunks_mut(PIXELS_PER_TASK));
        let mut executor = Threads::new(workers, scratch).until(End::Round(None));
        let Passed { counters, is_complete } = executor.pass(pieces, |_, (places, out), worker| {
            truth((places, samples.clone()), photons, &mut worker.scratch, out)
        })?;
        state.rays += counters.all_rays();
        if !is_complete {
            // Either all pixels have these samples or none.
            pixels.copy_from_slice(&before);
            return Ok(false);
        }
        state.has_photons |= photons.is_some();
        state.taken = samples.end;
        Ok(true)
    }

    /// Estimated bias of `film`, whose noise is `noise`.
    pub(super) fn verdict(&self, workers: &Workers, film: &Film, noise: ErrorEstimate) -> Option<Audited> {
        self.state.verdict(film, workers.mean(film)?, noise)
    }
}

#[cfg(test)]
mod tests;
