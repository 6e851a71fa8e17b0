//! The rounds of a picture, from the first sample to the last estimate.

use super::audit::ThreadedAudit;
use super::files::{self, FilmHeader, FilmReader, Identity, RewrittenFile};
use super::gaps::Sketch;
use super::history::{Clock, Reference, Round};
use super::image::{Pictures, image};
use super::memory::Memory;
use super::method::Renderer;
use super::rejected_tiles::{self, empty_pixels};
use super::setup::RenderSetup;
use super::survey::Survey;
use super::threads::{RoundLimits, ThreadedRound, Threads};
use super::{Ending, ErrorEstimate, Layer, Method, Progress, RenderError, RenderResult, Seconds};
use crate::save::Patience;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use halflight_core::audit::{ErrorReport, ExtraTime, Spent};
use halflight_core::bsdf::Features;
use halflight_core::findings::{Findings, Value};
use halflight_core::method::hidden_light::HiddenLight;
use halflight_core::method::{RenderState, Shard};
use halflight_core::reconstruction::FilmReconstruction;
use halflight_core::renderer::{OutOfReach, Plan, Rounds};
use std::path::Path;
use std::time::Instant;

/// Seconds after which a thread checks the clock and the interrupt flag.
const STEP_SECONDS: f64 = 0.01;

/// Samples of a tile that fill a wave; steps are multiples of it if time allows.
const FULL_STEP: u32 = 8;

/// Seconds per pixel and thread reserved for an error estimate before one has been timed.
const ESTIMATING: f64 = 1e-7;

/// Seconds per pixel reserved for the choice of audited pixels and their first samples.
const OPENING_AUDIT: f64 = 6e-7;

/// A picture to be rendered.
pub(super) struct Picture<'a, 'm, F> {
    pub(super) method: Method,
    pub(super) setup: RenderSetup<'a>,
    pub(super) state: RenderState<'a>,
    pub(super) audit: Option<ThreadedAudit<'a, F>>,
    pub(super) reconstruction: Option<FilmReconstruction<'a>>,
    /// Light that the method cannot find.
    pub(super) hidden: Option<HiddenLight>,
    /// Memory that the audit borrows.
    pub(super) memory: &'a mut Memory<'m>,
    pub(super) identity: Identity,
    pub(super) resumed: Option<FilmReader>,
    pub(super) clock: &'a mut Clock,
    pub(super) progress: &'a mut dyn FnMut(&Progress),
    pub(super) interrupt: &'a AtomicBool,
    /// Path tracing of single pixels for a picture without samples.
    pub(super) sketch: &'a Sketch<'a>,
}

impl<F: Features> Picture<'_, '_, F> {
    /// Renders until a stop rule holds. The caller adds times and memory of the structures that it built.
    pub(super) fn render(self, renderer: &mut dyn Renderer<F>) -> Result<RenderResult, RenderError> {
        let mut render = Progressive::new(self)?;
        while let Some(plan) = render.plan() {
            render.round(&plan, renderer)?;
            if render.is_ended(&plan) {
                break;
            }
        }
        render.finish(renderer)
    }
}

/// A picture in progress.
struct Progressive<'a, 'm, F> {
    picture: Picture<'a, 'm, F>,
    rounds: Rounds,
    history: Vec<Round>,
    reference: Option<Reference<'a>>,
    /// The last estimate of the error.
    latest: Option<ErrorEstimate>,
    /// Parts of the last estimate, if the last round had one.
    report: Option<ErrorReport>,
    /// Seconds of the last estimate, and of all estimates.
    estimating: f64,
    estimated: f64,
    /// Seconds reserved for the end of the picture.
    ending: f64,
    /// The film file, and the time of its last write.
    kept: RewrittenFile<'a>,
    saved: Instant,
    began: Instant,
    /// Why the requested error is out of reach.
    lost: Option<Ending>,
}

impl<'a, 'm, F: Features> Progressive<'a, 'm, F> {
    fn new(mut picture: Picture<'a, 'm, F>) -> Result<Self, RenderError> {
        let Picture { method, setup, state, audit, resumed, clock, .. } = &mut picture;
        let settings = setup.settings;
        state.is_correlated = method.shares();
        let (rounds, history) = match resumed.take() {
            None => (Rounds::new(settings.stop), Vec::new()),
            Some(film) => {
                let header = film.header.clone();
                clock.pause(|| film.read_into(state, None))?;
                let FilmHeader { spp, rounds, seconds, .. } = header;
                if let (Some(audit), Some(earlier)) = (audit, header.audit()) {
                    audit.audit.resume(&earlier);
                }
                let rounds = Rounds::new(settings.stop).resumed(spp, rounds, seconds, header.estimates());
                (rounds, header.history())
            }
        };
        let reference = clock.pause(|| settings.reference.as_deref().map(Reference::new));
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let latest = history.iter().rev().find_map(|round| round.error);
        let file = settings.checkpoint.as_ref().map(|checkpoint| checkpoint.path.as_path());
        let estimating = ESTIMATING * pixels / setup.workers.count() as f64;
        Ok(Self {
            picture,
            rounds,
            history,
            reference,
            latest,
            report: None,
            estimating,
            estimated: 0.0,
            ending: settings.ending_seconds(),
            kept: RewrittenFile::in_file(file),
            saved: Instant::now(),
            began: Instant::now(),
            lost: None,
        })
    }

    /// The next round; `None` if a stop rule holds.
    fn plan(&self) -> Option<Plan> {
        let Picture { audit, setup: RenderSetup { settings, .. }, clock, .. } = &self.picture;
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let is_open = audit.as_ref().is_some_and(|audit| audit.audit.is_open());
        let opening = if is_open { OPENING_AUDIT * pixels } else { 0.0 };
        self.rounds.next(clock.seconds(), self.estimating + self.ending + opening)
    }

    /// Adds samples, estimates the error if due, writes the film file and reports progress.
    fn round(&mut self, plan: &Plan, renderer: &mut dyn Renderer<F>) -> Result<(), RenderError> {
        self.add_samples(plan, renderer)?;
        self.report = None;
        let error = match self.rounds.estimate_is_due() {
            true => self.estimate(renderer)?,
            false => None,
        };
        let Picture { setup, state, reconstruction, clock, .. } = &mut self.picture;
        let (seconds, spp) = (clock.seconds(), self.rounds.spp());
        // A picture is reconstructed with its estimate.
        let is_new = error.is_some() || reconstruction.as_ref().is_none_or(|made| made.error().is_none());
        let picture = || setup.workers.install(|| image(&state.film, reconstruction.as_ref()));
        let reference = self.reference.as_ref().filter(|_| is_new);
        let reference = reference.map(|reference| clock.pause(|| reference.compare(&picture())));
        self.history.push(Round { seconds, spp, rays: state.counters.all_rays(), error, reference });
        let is_due = |every: f64| self.saved.elapsed().as_secs_f64() >= every;
        let checkpoint = setup.settings.checkpoint.as_ref();
        if plan.first || checkpoint.is_some_and(|checkpoint| is_due(checkpoint.every)) {
            self.write_film(seconds, None);
            self.saved = Instant::now();
        }
        let unsaved = self.kept.new_failure().or_else(|| renderer.kept()?.new_failure());
        let Picture { clock, progress, state, reconstruction, .. } = &mut self.picture;
        let known = progress_of(&self.rounds, seconds, self.latest);
        let known = Progress { unsaved, film: Some((&state.film, reconstruction.as_ref())), ..known };
        clock.pause(|| progress(&known));
        Ok(())
    }

    fn add_samples(&mut self, plan: &Plan, renderer: &mut dyn Renderer<F>) -> Result<(), RenderError> {
        let Picture { setup: RenderSetup { workers, .. }, state, clock, .. } = &mut self.picture;
        let now = clock.seconds();
        // A time beyond the range of the clock is no deadline.
        let later = |at: f64| Duration::try_from_secs_f64((at - now).max(0.0)).ok();
        let deadline = plan.deadline.and_then(later).and_then(|later| Instant::now().checked_add(later));
        let limits = RoundLimits {
            target: plan.target,
            step: step(plan, state.tiles(), workers.count()),
            deadline,
            is_first: plan.first,
        };
        renderer.round(&mut ThreadedRound { workers, limits: &limits, state })?;
        self.rounds.completed(state.spp().min(plan.target), clock.seconds());
        Ok(())
    }

    /// Estimates the error: noise from the two half-films, bias by the audit or from the photons' kernels.
    fn estimate(&mut self, renderer: &mut dyn Renderer<F>) -> Result<Option<ErrorEstimate>, RenderError> {
        self.step_audit(renderer)?;
        let start = Instant::now();
        let mut report = self.judge();
        self.estimating = start.elapsed().as_secs_f64();
        self.estimated += self.estimating;
        report = self.extend_audit(report, renderer)?;
        let start = Instant::now();
        self.lost =
            self.rounds.out_of_reach(&report, self.picture.method.converges()).map(|reason| match reason {
                OutOfReach::Bias => Ending::Biased,
                OutOfReach::NoiseFloor => Ending::NoiseFloor,
            });
        self.latest = report.error();
        self.rounds.estimated(self.latest);
        self.estimating += start.elapsed().as_secs_f64();
        self.report = Some(report);
        Ok(self.latest)
    }

    /// Takes the samples of the audit that are due.
    fn step_audit(&mut self, renderer: &mut dyn Renderer<F>) -> Result<(), RenderError> {
        let Picture { setup: RenderSetup { settings, workers, .. }, state, audit, clock, memory, .. } =
            &mut self.picture;
        let Some(audit) = audit else { return Ok(()) };
        let (seconds, start) = (clock.seconds(), Instant::now());
        let spent = Spent {
            rays: state.counters.all_rays(),
            seconds,
            left: settings.stop.seconds.map(|limit| limit - self.estimating - seconds),
            clock: &|| start.elapsed().as_secs_f64(),
        };
        let (audit, mut executor) = audit.at_work(workers);
        Ok(audit.step(renderer, (&state.film, &spent), *memory, &mut executor)?)
    }

    /// Focuses the audit after its first samples, and continues the audit alone if only the bias estimate is
    /// still too uncertain.
    fn extend_audit(
        &mut self,
        report: ErrorReport,
        renderer: &mut dyn Renderer<F>,
    ) -> Result<ErrorReport, RenderError> {
        let Picture { setup, state, audit, reconstruction: made, clock, progress, interrupt, .. } =
            &mut self.picture;
        let (RenderSetup { settings, workers, .. }, rounds) = (*setup, &self.rounds);
        let Some(audit) = audit else { return Ok(report) };
        let (left, start) = (settings.stop.seconds.map(|limit| limit - self.estimating), Instant::now());
        let error = report.error();
        let mut may_take = |cost: f64| {
            let known = progress_of(rounds, clock.seconds(), error);
            clock.pause(|| progress(&known));
            let is_time = left.is_none_or(|left| clock.seconds() + cost < left);
            is_time && !interrupt.load(Ordering::Relaxed)
        };
        let time = ExtraTime { may_take: &mut may_take, clock: &|| start.elapsed().as_secs_f64() };
        let (audit, mut executor) = audit.at_work(workers);
        let time = settings.audit.is_none().then_some(time);
        Ok(rounds.extend_audit((audit, renderer), (state, made.as_ref(), report), time, &mut executor)?)
    }

    /// Reconstructs the picture, if that is wanted, and estimates its error.
    fn judge(&mut self) -> ErrorReport {
        let Picture { setup, state, audit, reconstruction, hidden, .. } = &mut self.picture;
        let audit = audit.as_mut().map(|audit| &mut audit.audit);
        let new = |executor: &mut Threads| ErrorReport::new(state, reconstruction.as_mut(), audit, executor);
        setup.workers.estimating(new).lacking(hidden.as_ref(), &state.film)
    }

    /// Writes the film file, during the render or at the end with patience `last`.
    fn write_film(&mut self, seconds: f64, last: Option<Patience>) {
        let Picture { method, state, audit, reconstruction, identity, clock, .. } = &mut self.picture;
        let (kept, rounds, history) = (&mut self.kept, &self.rounds, &self.history);
        clock.pause(|| {
            let write = |path: &Path, patience: Patience| {
                let surfaces = reconstruction.as_ref().map(FilmReconstruction::surfaces);
                let beside = (audit.as_ref().map(|audit| audit.audit.state()), surfaces.is_some());
                let header = FilmHeader::new((identity, *method), state, rounds, beside, seconds, history);
                files::write_film(path, &header, (state, surfaces), patience)
            };
            match last {
                Some(patience) => kept.finish(patience, write),
                None => kept.update(write),
            }
        });
    }

    /// True if rounds end although no stop rule holds. A first round that was cut would be cut again.
    fn is_ended(&self, plan: &Plan) -> bool {
        self.lost.is_some() || self.rounds.spp() == 0 || self.is_interrupted() && !plan.first
    }

    fn is_interrupted(&self) -> bool {
        self.picture.interrupt.load(Ordering::Relaxed)
    }

    /// Writes the files for the last time, takes the last samples of the audit, and returns the result.
    fn finish(mut self, renderer: &mut dyn Renderer<F>) -> Result<RenderResult, RenderError> {
        let interrupted = self.is_interrupted();
        let patience = Patience { since: self.began, interrupt: self.picture.interrupt };
        let is_known = self.history.last().is_some_and(|last| last.error.is_some());
        let is_open = self.picture.audit.is_some() && !(interrupted || is_known);
        // The film of a shard is written after the last audit samples, which belong to the merged audit.
        // Otherwise the film is written before them, so that a resumed render takes the same samples.
        let is_last = !is_open || self.picture.setup.settings.shard == Shard::WHOLE;
        let seconds = self.picture.clock.seconds();
        self.write_film(seconds, is_last.then_some(patience));
        self.picture.clock.pause(|| renderer.finish(patience));
        if is_open {
            self.step_audit(renderer)?;
        }
        if !is_last {
            self.write_film(self.picture.clock.seconds(), Some(patience));
        }
        let start = Instant::now();
        let report = self.report.take().unwrap_or_else(|| self.judge());
        self.estimated += start.elapsed().as_secs_f64();
        self.result(report, renderer, interrupted)
    }

    fn result(
        mut self,
        report: ErrorReport,
        renderer: &mut dyn Renderer<F>,
        interrupted: bool,
    ) -> Result<RenderResult, RenderError> {
        let Picture { method, setup, state, reconstruction, clock, sketch, .. } = &self.picture;
        let RenderSetup { settings, workers, .. } = *setup;
        let render = clock.seconds();
        let error = report.error();
        if let Some(last) = self.history.last_mut() {
            last.error = error;
        }
        let (film, made) = (&state.film, reconstruction.as_ref());
        let halves = settings.layers.as_ref().is_some_and(|layers| layers.has(Layer::Halves));
        let pictures = workers.install(|| Pictures::of(film, made, halves));
        let (pictures, filled_pixels) = pictures.without_gaps((state, sketch, workers));
        let Pictures { image, variance, samples, layers } = pictures.in_window(state.shard);
        let ending = if interrupted { Ending::Interrupted } else { self.lost.unwrap_or(Ending::Done) };
        let is_viewed = settings.photon_view && !interrupted;
        // A report that does not fit into memory is omitted: the picture is complete.
        let survey = if interrupted { None } else { renderer.survey().unwrap_or_default() };
        let findings = Findings::default().and(renderer.findings().into_iter().map(|finding| {
            let seconds = finding.phase.map(|phase| Value::Seconds(workers.seconds_of(phase)));
            finding.with_some("seconds", seconds)
        }));
        Ok(RenderResult {
            method: *method,
            image,
            spp: self.rounds.spp(),
            rounds: self.rounds.count(),
            history: self.history,
            variance,
            samples,
            layers,
            threads: workers.count(),
            seconds: Seconds { build: 0.0, render, estimate: self.estimated },
            counters: state.counters,
            findings: findings
                .and(report.lacking.map(|lacking| lacking.finding()))
                .and(made.map(FilmReconstruction::finding))
                .and(survey.as_ref().map(Survey::finding)),
            survey,
            photon_view: if is_viewed { renderer.photon_view().unwrap_or_default() } else { None },
            rejected_tiles: rejected_tiles::rejected_tiles(state.dropped, settings.width, settings.height),
            empty_pixels: empty_pixels(film, |task| state.shard.owns(task) && state.samples[task] > 0),
            filled_pixels,
            error,
            noise_and_blur: report.noise_and_blur,
            audit: report.audited,
            memory: Vec::new(),
            memory_peak: 0,
            unsaved: self
                .kept
                .failed()
                .into_iter()
                .chain(renderer.kept().and_then(RewrittenFile::failed))
                .collect(),
            ending,
            stop_rule: (ending == Ending::Done).then(|| self.rounds.rule()),
        })
    }
}

/// Progress to report at `seconds`.
fn progress_of(rounds: &Rounds, seconds: f64, error: Option<ErrorEstimate>) -> Progress<'static> {
    let seconds_left = rounds.seconds_left(seconds, error);
    let (spp, rounds) = (rounds.spp(), rounds.count());
    Progress { seconds, seconds_left, spp, rounds, error, unsaved: None, film: None }
}

/// Samples of a tile between two checks of the clock.
fn step(plan: &Plan, tiles: usize, threads: usize) -> u32 {
    let Some(each) = plan.each else { return FULL_STEP };
    let tile = each * threads as f64 / tiles.max(1) as f64;
    let step = (STEP_SECONDS / tile) as u32;
    if step >= FULL_STEP { step / FULL_STEP * FULL_STEP } else { step.max(1) }
}
