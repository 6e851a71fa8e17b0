//! The rounds of a picture, from the first sample to the last estimate.

use super::audit::Audit;
use super::crew::{self, Crew};
use super::film_file::{self, Header, Identity, Reader};
use super::gaps::{self, Sketch};
use super::history::{Clock, Reference, Round};
use super::kept::Kept;
use super::ledger::{self, empty_pixels};
use super::method::{Method, Renderer, Stage};
use super::rounds::{Plan, Rounds};
use super::told::Told;
use super::workers::Workers;
use super::{Ending, Progress, RenderError, RenderResult, Seconds, WindowUse};
use crate::save::{Image, Patience};
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use halflight_core::film::{Film, Pixel};
use halflight_core::method::{RenderState, Shard};
use std::path::Path;
use std::time::Instant;

/// A thread looks at the clock, and at the flag, after about so many seconds.
const STEP_SECONDS: f64 = 0.01;

/// Samples of a tile that fill a wave: steps are multiples of it where time allows.
const FULL_STEP: u32 = 8;

/// Seconds that are kept free for an estimate of the error, for each pixel and thread, before the first has been made.
const ESTIMATING: f64 = 1e-7;

/// A picture to be rendered.
pub(super) struct Picture<'a> {
    pub(super) method: Method,
    pub(super) stage: Stage<'a>,
    pub(super) state: RenderState<'a>,
    pub(super) audit: Option<Audit<'a>>,
    pub(super) identity: Identity,
    pub(super) resumed: Option<Reader>,
    pub(super) clock: Clock,
    pub(super) progress: &'a mut dyn FnMut(&Progress),
    pub(super) interrupt: &'a AtomicBool,
    /// For a picture without samples.
    pub(super) sketch: &'a Sketch<'a>,
}

impl Picture<'_> {
    /// Renders until a stop rule holds. What was built, and the memory of it, is for the caller to tell.
    pub(super) fn render(self, renderer: &mut dyn Renderer) -> Result<RenderResult, RenderError> {
        let Picture {
            method,
            stage,
            mut state,
            mut audit,
            identity,
            resumed,
            mut clock,
            progress,
            interrupt,
            sketch,
        } = self;
        let Stage { settings, workers, .. } = stage;
        let (width, height) = (settings.width, settings.height);
        state.is_correlated = method.shares();
        let (mut rounds, mut history) = match resumed {
            None => (Rounds::new(settings.stop), Vec::new()),
            Some(film) => {
                let header = film.header.clone();
                clock.pause(|| film.read_into(&mut state))?;
                let Header { spp, rounds, seconds, estimates, .. } = header;
                if let (Some(audit), Some(earlier)) = (&mut audit, header.audit()) {
                    audit.resume(earlier);
                }
                let rounds = Rounds::new(settings.stop).resumed(spp, rounds, seconds, estimates);
                (rounds, header.history())
            }
        };
        let reference = clock.pause(|| settings.reference.as_deref().map(Reference::new));
        let mut latest = history.iter().rev().find_map(|round: &Round| round.error);
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let (mut estimating, mut estimate) = (ESTIMATING * pixels / workers.count() as f64, 0.0);
        let mut told = None;
        let mut saved = Instant::now();
        let mut lost = None;
        let mut kept =
            Kept::in_file(settings.checkpoint.as_ref().map(|checkpoint| checkpoint.path.as_path()));
        let began = Instant::now();
        let header =
            |state: &RenderState, rounds: &Rounds, audit: Option<&Audit>, seconds: f64, history: &[Round]| {
                Header::new(identity.clone(), state, rounds, audit, seconds, history)
            };

        while let Some(plan) = rounds.next(clock.seconds(), estimating) {
            let now = clock.seconds();
            // Later than any clock can tell is never.
            let later = |at: f64| Duration::try_from_secs_f64((at - now).max(0.0)).ok();
            let deadline = plan.deadline.and_then(later).and_then(|later| Instant::now().checked_add(later));
            let round = crew::Round {
                target: plan.target,
                step: step(&plan, state.tiles(), workers.count()),
                deadline,
                watch: &workers.watch,
                is_first: plan.first,
            };
            renderer.round(&mut Crew { workers, round: &round, canvas: &mut state })?;
            rounds.completed(state.spp().min(plan.target), clock.seconds());
            let mut error = None;
            if rounds.estimate_is_due() {
                if let Some(audit) = &mut audit {
                    let left = settings.stop.seconds.map(|limit| limit - estimating - clock.seconds());
                    let work = (state.counters.all_rays(), clock.seconds());
                    if audit.is_open() {
                        audit.weigh(renderer.risks(workers)?);
                    }
                    renderer
                        .lend_photons(&mut |photons| audit.step(workers, &state.film, photons, work, left))?;
                }
                let start = Instant::now();
                let mut found = Told::of(workers, &state, audit.as_ref());
                estimate += start.elapsed().as_secs_f64();
                estimating = start.elapsed().as_secs_f64();
                if let Some(audit) = &mut audit {
                    if let Some(audited) = &found.audited {
                        audit.focus(audited, (state.counters.all_rays(), rounds.spp()));
                    }
                    let left = settings.stop.seconds.map(|limit| limit - estimating);
                    let so_far = found.error();
                    let mut may = |cost: f64| {
                        let known = rounds.progress(clock.seconds(), so_far);
                        clock.pause(|| progress(&known));
                        let is_time = left.is_none_or(|left| clock.seconds() + cost < left);
                        is_time && !interrupt.load(Ordering::Relaxed)
                    };
                    if settings.audit.is_none() {
                        found = go_on_alone(audit, &rounds, found, renderer, (workers, &state), &mut may)?;
                    }
                }
                let start = Instant::now();
                let has_floor = found.noise.is_some_and(|noise| rounds.has_floor(noise));
                let is_biased = found.audited.as_ref().is_some_and(|audited| rounds.is_out_of_reach(audited));
                lost = match () {
                    () if method.converges() => None,
                    () if is_biased => Some(Ending::Biased),
                    () => has_floor.then_some(Ending::NoiseFloor),
                };
                error = found.error();
                rounds.estimated(error);
                estimating += start.elapsed().as_secs_f64();
                latest = error;
                told = Some(found);
            } else {
                told = None;
            }
            let seconds = clock.seconds();
            let against = reference.as_ref().map(|r| clock.pause(|| r.compare(&image(&state.film))));
            let spp = rounds.spp();
            history.push(Round { seconds, spp, rays: state.counters.all_rays(), error, reference: against });
            let due = |every: f64| saved.elapsed().as_secs_f64() >= every;
            if plan.first || settings.checkpoint.as_ref().is_some_and(|checkpoint| due(checkpoint.every)) {
                clock.pause(|| {
                    kept.update(|path, patience| {
                        let header = header(&state, &rounds, audit.as_ref(), seconds, &history);
                        film_file::write(path, &header, &state, patience)
                    });
                });
                saved = Instant::now();
            }
            let unsaved = kept.news().or_else(|| renderer.kept()?.news());
            let known = Progress { unsaved, ..rounds.progress(seconds, latest) };
            clock.pause(|| progress(&known));
            // Where the first round was cut, others would be as well.
            if lost.is_some() || rounds.spp() == 0 || interrupt.load(Ordering::Relaxed) && !plan.first {
                break;
            }
        }
        let interrupted = interrupt.load(Ordering::Relaxed);
        let patience = Patience { since: began, interrupt };
        let is_known = history.last().is_some_and(|last| last.error.is_some());
        let goes_on = audit.is_some() && !(interrupted || is_known);
        // A shard is merged with the last steps of its audit, a render that goes on would not take them here.
        let is_last = !goes_on || settings.shard == Shard::WHOLE;
        let seconds = clock.seconds();
        clock.pause(|| {
            let write = |path: &Path, patience: Patience| {
                let header = header(&state, &rounds, audit.as_ref(), seconds, &history);
                film_file::write(path, &header, &state, patience)
            };
            if is_last {
                kept.finish(patience, write)
            } else {
                kept.update(write)
            }
            renderer.finish(patience);
        });
        if let Some(audit) = audit.as_mut().filter(|_| goes_on) {
            let left = settings.stop.seconds.map(|limit| limit - estimating - clock.seconds());
            let work = (state.counters.all_rays(), clock.seconds());
            if audit.is_open() {
                audit.weigh(renderer.risks(workers)?);
            }
            renderer.lend_photons(&mut |photons| audit.step(workers, &state.film, photons, work, left))?;
        }
        if !is_last {
            let seconds = clock.seconds();
            clock.pause(|| {
                kept.finish(patience, |path, patience| {
                    let header = header(&state, &rounds, audit.as_ref(), seconds, &history);
                    film_file::write(path, &header, &state, patience)
                });
            });
        }
        let start = Instant::now();
        // The last round may have asked already.
        let told = told.unwrap_or_else(|| Told::of(workers, &state, audit.as_ref()));
        estimate += start.elapsed().as_secs_f64();
        let render = clock.seconds();
        let error = told.error();
        if let Some(last) = history.last_mut() {
            last.error = error;
        }
        let film = &state.film;
        let (image, filled_pixels) = without_gaps(&state, sketch, workers);
        Ok(RenderResult {
            method,
            image,
            spp: rounds.spp(),
            rounds: rounds.count(),
            history,
            variance: map(film, |pixel| pixel.variance().to_array()),
            samples: by_rows(film).map(|pixel| pixel.count()).collect(),
            threads: workers.count(),
            seconds: Seconds { build: 0.0, render, estimate },
            counters: state.counters,
            reuse: renderer.reuse(),
            caustics: renderer.caustics(),
            cache: renderer.cache(),
            // The picture is there: what there is no memory to look at is left out.
            survey: if interrupted { None } else { renderer.survey(workers).unwrap_or_default() },
            photons: renderer.photons(),
            photon_view: if settings.photon_view && !interrupted {
                renderer.photon_view().unwrap_or_default()
            } else {
                None
            },
            windows: WindowUse::default(),
            places: ledger::places(state.dropped, width, height),
            empty_pixels: empty_pixels(film, |task| state.shard.owns(task) && state.samples[task] > 0),
            filled_pixels,
            error,
            blurred: told.blurred,
            audit: told.audited,
            memory: Vec::new(),
            memory_peak: 0,
            unsaved: kept.failed().into_iter().chain(renderer.kept().and_then(Kept::failed)).collect(),
            ending: if interrupted { Ending::Interrupted } else { lost.unwrap_or(Ending::Done) },
        })
    }
}

/// What is known after `told`, where the audit alone keeps a picture from its end: it goes on as long as it `may` take so many
/// seconds more.
fn go_on_alone(
    audit: &mut Audit,
    rounds: &Rounds,
    mut told: Told,
    renderer: &mut dyn Renderer,
    (workers, state): (&Workers, &RenderState),
    may: &mut dyn FnMut(f64) -> bool,
) -> Result<Told, RenderError> {
    while told.audited.as_ref().is_some_and(|audited| rounds.waits_for(audited)) {
        let mut went = false;
        renderer.lend_photons(&mut |photons| {
            went = audit.go_on(workers, photons, may)?;
            Ok(())
        })?;
        if !went {
            break;
        }
        told = Told::beside(told.noise, workers, state, |noise| audit.verdict(workers, &state.film, noise));
    }
    Ok(told)
}

/// Samples of a tile between two looks at the clock.
fn step(plan: &Plan, tiles: usize, threads: usize) -> u32 {
    let Some(each) = plan.each else { return FULL_STEP };
    let tile = each * threads as f64 / tiles.max(1) as f64;
    let step = (STEP_SECONDS / tile) as u32;
    if step >= FULL_STEP { step / FULL_STEP * FULL_STEP } else { step.max(1) }
}

/// The picture of `state`, its gaps filled, and how many pixels were gaps: those of tiles that were not reached.
fn without_gaps(state: &RenderState, sketch: &Sketch, workers: &Workers) -> (Image, u64) {
    let mut image = image(&state.film);
    // A shard has gaps that others fill.
    if state.shard != Shard::WHOLE || !state.samples.contains(&0) {
        return (image, 0);
    }
    let mut known: Vec<bool> = by_rows(&state.film).map(|pixel| pixel.count() > 0).collect();
    let gaps = known.iter().filter(|known| !**known).count() as u64;
    if known.iter().all(|known| !known) {
        for ([x, y], light) in sketch(workers) {
            let index = y as usize * image.width as usize + x as usize;
            (image.pixels[index], known[index]) = (light, true);
        }
    }
    gaps::fill(&mut image, &known);
    (image, gaps)
}

pub(super) fn image(film: &Film) -> Image {
    map(film, |pixel| pixel.mean().to_array())
}

fn map(film: &Film, value: impl Fn(Pixel) -> [f32; 3]) -> Image {
    Image { width: film.width(), height: film.height(), pixels: by_rows(film).map(value).collect() }
}

fn by_rows(film: &Film) -> impl Iterator<Item = Pixel> {
    (0..film.height()).flat_map(move |y| (0..film.width()).map(move |x| film.pixel(x, y)))
}
