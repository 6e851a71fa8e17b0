//! An audit in progress: choice of its pixels, samples in step with the picture, and its verdict.

use super::choice;
use super::method::AuditedMethod;
use super::pixels::{AuditState, AuditedPixels};
use super::region::SUFFICIENT_PIXELS;
use super::risks::Risks;
use super::verdict::{AuditWork, Audited};
use crate::bsdf::Features;
use crate::estimate::ErrorEstimate;
use crate::film::{Film, Pixel};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::caustics::{unseen, unseen_footprint};
use crate::method::{Executor, MethodKind, Passed, RenderContext, Shard};
use crate::reconstruction::FilmReconstruction;
use crate::transport::caustics::tracer::CausticPhotonTracer;
use crate::transport::path::WAVE;
use crate::transport::{CausticMerging, PathIntegrator, PathSettings};
use core::ops::Range;

/// Default fraction of the work that goes into the audit of a biased picture.
const FRACTION: f64 = 0.05;

/// Samples of audited pixels per step, a multiple of four for equal parts of both half-films.
const STEP: u32 = 4;

/// Audited pixels of one task.
const PIXELS_PER_TASK: usize = 8;

/// Samples per audited pixel within which audit paths must find all light of the picture.
const VISIBILITY_SAMPLES: f64 = 256.0;

/// Longest run of samples, seconds, between questions whether the audit may go on.
const MAX_RUN_SECONDS: f64 = 0.25;

/// Makes the audit's random numbers differ from those of the picture.
const AUDIT_SEED: u32 = 0x5eed_a0d1;

/// Name of its memory in reports.
const AUDIT: &str = "audit";

/// Fraction of the work for the audit of a method, where one is `requested` or not; `None` without an audit.
pub fn audit_fraction(requested: Option<f64>, is_biased: bool) -> Option<f64> {
    let fraction = requested.unwrap_or(if is_biased { FRACTION } else { 0.0 });
    (fraction > 0.0).then_some(fraction)
}

/// Settings of an audit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditSettings {
    /// Fraction of the total work of picture and audit, below 1.
    pub fraction: f64,
    /// Shard whose pixels are audited.
    pub shard: Shard,
    /// True if work is measured in seconds. Otherwise it is counted in rays, which are the same in each run.
    pub by_clock: bool,
}

/// Work of the picture so far, and the time of the caller. Without a clock, time stands still at 0.
#[derive(Clone, Copy)]
pub struct Spent<'c> {
    /// Rays of the picture.
    pub rays: u64,
    /// Seconds of picture and audit.
    pub seconds: f64,
    /// Seconds until the picture is to end, if they are limited.
    pub left: Option<f64>,
    /// Seconds since any fixed time.
    pub clock: &'c dyn Fn() -> f64,
}

/// Time of an audit that continues alone.
pub struct ExtraTime<'t> {
    /// True if it may take the seconds that it expects.
    pub may_take: &'t mut dyn FnMut(f64) -> bool,
    /// Seconds since any fixed time; without a clock, time stands still at 0.
    pub clock: &'t dyn Fn() -> f64,
}

/// An audit in progress.
pub struct Audit<'m, F> {
    tracer: PathIntegrator<'m, F>,
    settings: AuditSettings,
    seed: u32,
    pixels: AuditedPixels<'m>,
    /// Samples before a run, which may be cut.
    before: &'m mut [Pixel],
}

impl<'m, F: Features> Audit<'m, F> {
    /// Working memory of a worker, also of the prepass.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE)
            .or(CausticPhotonTracer::<F>::scratch())
    }

    /// Memory that the audit of a picture of `size` pixels keeps.
    pub fn footprint(size: [u32; 2]) -> Footprint {
        let count = choice::count(size);
        AuditedPixels::footprint(count).slice::<Pixel>(count)
    }

    /// Memory that the choice of pixels borrows, with risks of caches or without.
    pub fn choice_footprint(size: [u32; 2], has_risks: bool) -> Footprint {
        let order = choice::footprint(size);
        match has_risks {
            true => {
                let [risks, borrowed] = Risks::footprint(size);
                risks.and(order.or(borrowed))
            }
            false => order,
        }
    }

    /// Memory that a method leaves free for its audit in a scene of so many lights; `is_biased` if the method
    /// may be biased.
    pub fn reserve(size: [u32; 2], lights: usize, is_biased: bool) -> Footprint {
        let unseen = if is_biased { unseen_footprint(lights) } else { Footprint::default() };
        Self::footprint(size).and(Self::choice_footprint(size, is_biased).or(unseen))
    }

    /// Audit of a picture of `context` by the method of `kind`. A prepass measures light that audit paths do
    /// not find.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has less than [`Audit::reserve`], or the scratch of `executor` is
    /// smaller than [`Audit::scratch`].
    pub fn new<'a: 'm>(
        context: &RenderContext<'a>,
        kind: MethodKind,
        settings: AuditSettings,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let size = [context.settings.width, context.settings.height];
        let count = choice::count(size);
        let mut arena = memory.take(AUDIT, Self::footprint(size))?;
        let mut pixels = AuditedPixels::new(size, count, &mut arena)?;
        let before = arena.slice(count)?;
        let choice = Self::choice_footprint(size, kind.has_records());
        if !memory.has(choice) {
            return Err(OutOfMemory { needed: choice.bytes(), available: memory.available() });
        }
        // Other methods lend the audit their photons, or find no more light than its paths.
        let samples = VISIBILITY_SAMPLES * count as f64 / context.pixels() as f64;
        let unseen = match kind.finds_caustics() {
            true => unseen::<F>(context, samples, memory, executor)?.unwrap_or(0.0),
            false => 0.0,
        };
        pixels.work = AuditWork { fraction: settings.fraction, unseen, ..AuditWork::default() };
        let seed = context.settings.seed ^ AUDIT_SEED;
        let context = RenderContext { settings: PathSettings { seed, ..context.settings }, ..*context };
        Ok(Self { tracer: context.integrator(), settings, seed, pixels, before })
    }

    /// True if its pixels are still to be chosen.
    pub fn is_open(&self) -> bool {
        self.pixels.count == 0
    }

    /// State for files.
    pub fn state(&self) -> AuditState<'_> {
        self.pixels.state()
    }

    /// Continues from the state of a file.
    pub fn resume(&mut self, state: &AuditState) {
        self.pixels.resume(state);
    }

    /// Takes the samples that are due after the work `spent`, or fewer if time is short. The first step
    /// chooses the pixels by `film`; a black one has none. Paths are merged with caustic photons that
    /// `method` lends, in each half-film with photons unknown to the other half; their blur is in both and
    /// stays undetected.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has less than [`Audit::reserve`] without [`Audit::footprint`], or the
    /// scratch of `executor` is smaller than [`Audit::scratch`].
    pub fn step<'s>(
        &mut self,
        method: &mut (impl AuditedMethod<F> + ?Sized),
        (film, spent): (&Film, &Spent),
        memory: &mut impl MemorySource<'s>,
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        let start = (spent.clock)();
        if self.is_open() {
            self.choose(method, film, memory, executor)?;
        }
        match self.is_open() {
            true => Ok(()),
            false => method.lend_photons(&mut |photons| self.take_samples(photons, (start, spent), executor)),
        }
    }

    /// Chooses the pixels by `film`, and by the caches of `method`.
    fn choose<'s>(
        &mut self,
        method: &mut (impl AuditedMethod<F> + ?Sized),
        film: &Film,
        memory: &mut impl MemorySource<'s>,
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        let size = [film.width(), film.height()];
        let Some(mean) = film.mean_radiance(executor) else { return Ok(()) };
        let caches = method.caches();
        let footprint = Self::choice_footprint(size, caches.is_some());
        memory.lend(AUDIT, footprint, |_, arena| {
            let risks = match caches {
                Some((tracer, caches)) => Risks::of_caches(tracer, caches, size, arena, executor)?,
                None => None,
            };
            let of = (self.settings.shard, mean, self.seed);
            let AuditedPixels { pixels, weights, .. } = &mut self.pixels;
            let count = choice::choose(film, of, risks.as_ref(), arena, (pixels, weights))?;
            self.pixels.begin(count);
            Ok(())
        })
    }

    /// Takes the samples that are due in a step that began at `start` of the clock.
    fn take_samples(
        &mut self,
        photons: Option<CausticMerging>,
        (start, spent): (f64, &Spent),
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        let elapsed = || (spent.clock)() - start;
        let AuditWork { fraction, seconds: before, .. } = self.pixels.work;
        let per_picture = fraction / (1.0 - fraction);
        loop {
            let AuditWork { samples: taken, rays, seconds, .. } = self.pixels.work;
            let (own, due) = match self.settings.by_clock {
                true => (seconds, per_picture * (spent.seconds - before)),
                false => (rays as f64, per_picture * spent.rays as f64),
            };
            // The cost of a sample is estimated better in each iteration.
            let samples = match taken {
                0 => STEP,
                _ => {
                    (((due - own) * f64::from(taken) / own) as u32).min(taken.saturating_mul(3)) / STEP * STEP
                }
            };
            let spare = spent.left.map(|left| left - elapsed());
            let cost = f64::from(samples) * seconds / f64::from(taken.max(1));
            if samples == 0 || spare.is_some_and(|spare| spare < cost) {
                return Ok(());
            }
            if !self.run(taken..taken.saturating_add(samples), photons, executor)? {
                return Ok(());
            }
            self.pixels.work.seconds = before + elapsed();
        }
    }

    /// Reduces the number of audited pixels after their first samples, if they will be noisier than the
    /// picture's: fewer pixels with more samples then estimate the bias better. The picture has taken `spp`
    /// samples per pixel and `rays` rays.
    pub fn reduce_pixels(&mut self, audited: &Audited, (rays, spp): (u64, u32)) {
        let AuditWork { fraction, samples: taken, rays: own, .. } = self.pixels.work;
        let count = self.pixels.count;
        if taken != STEP || own == 0 {
            return;
        }
        // Samples of an audited pixel per sample of a picture's pixel.
        let rate = fraction / (1.0 - fraction) * rays as f64 / f64::from(spp) * f64::from(taken) / own as f64;
        let wanted = count as f64 * rate * f64::from(spp) / (f64::from(taken) * audited.imbalance);
        let many = (wanted as usize).max(SUFFICIENT_PIXELS);
        if many >= count {
            return;
        }
        for to in 0..many {
            let (from, weight) = choice::join(self.state().weights, (to, many), self.seed);
            self.pixels.keep((from, to), weight);
        }
        self.pixels.count = many;
    }

    /// Takes a quarter more samples in steps while its `time` allows; returns whether all were taken.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of `executor` is smaller than [`Audit::scratch`].
    pub fn extend(
        &mut self,
        method: &mut (impl AuditedMethod<F> + ?Sized),
        time: &mut ExtraTime,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let end = |taken: u32| taken.saturating_add(taken / 4).checked_next_multiple_of(STEP);
        let Some(end) = end(self.pixels.work.samples) else { return Ok(false) };
        while self.pixels.work.samples < end {
            let AuditWork { samples: taken, seconds, .. } = self.pixels.work;
            let each = seconds / f64::from(taken.max(1));
            let samples = ((MAX_RUN_SECONDS / each) as u32 / STEP * STEP).max(STEP).min(end - taken);
            if !(time.may_take)(each * f64::from(samples)) {
                return Ok(false);
            }
            let start = (time.clock)();
            let mut is_complete = false;
            method.lend_photons(&mut |photons| {
                is_complete = self.run(taken..taken + samples, photons, executor)?;
                Ok(())
            })?;
            if !is_complete {
                return Ok(false);
            }
            self.pixels.work.seconds += (time.clock)() - start;
        }
        Ok(true)
    }

    /// Takes `samples` of all audited pixels; returns false if interrupted.
    fn run(
        &mut self,
        samples: Range<u32>,
        photons: Option<CausticMerging>,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let Self { tracer, pixels, before, .. } = self;
        let AuditedPixels { work, count, pixels, truth, .. } = pixels;
        let (pixels, truth, before) = (&pixels[..*count], &mut truth[..*count], &mut before[..*count]);
        before.copy_from_slice(truth);
        let pieces = pixels.chunks(PIXELS_PER_TASK).zip(truth.chunks_mut(PIXELS_PER_TASK));
        let passed = executor.pass(pieces, |_, (pixels, out), worker| {
            let (samples, scratch) = (samples.clone(), &mut worker.scratch);
            match photons {
                Some(photons) => {
                    tracer.with_caustics(photons).sample_pixels(pixels, samples, WAVE, scratch, out)
                }
                None => tracer.sample_pixels(pixels, samples, WAVE, scratch, out),
            }
        });
        let is_complete = passed.is_ok_and(|passed| passed.is_complete);
        if !is_complete {
            // Either all pixels have these samples or none.
            truth.copy_from_slice(before);
        }
        let Passed { counters, .. } = passed?;
        work.rays += counters.all_rays();
        if is_complete {
            work.has_photons |= photons.is_some();
            work.samples = samples.end;
        }
        Ok(is_complete)
    }

    /// Compares the audited pixels with `film`, whose mean is `mean`, or with its `reconstruction`.
    pub fn compare(
        &mut self,
        film: &Film,
        reconstruction: Option<&FilmReconstruction>,
        mean: f64,
        executor: &mut impl Executor,
    ) {
        self.pixels.compare(film, reconstruction, mean, executor);
    }

    /// Estimated bias of the picture that was last compared, whose noise is `noise`.
    pub fn verdict(&self, noise: ErrorEstimate) -> Option<Audited> {
        self.pixels.verdict(noise)
    }
}
