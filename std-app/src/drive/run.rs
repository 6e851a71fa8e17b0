//! One render from the first structure to the last round.

use super::canvas::Canvas;
use super::film_file::{self, Header, Identity, Reader};
use super::history::{Clock, Reference, Round};
use super::ledger::empty_pixels;
use super::memory::Memory;
use super::rounds::{Plan, Rounds};
use super::workers::{self, Workers};
use super::{
    Ending, ErrorEstimate, FilmError, Progress, RenderError, RenderResult, Reuse, Seconds, Settings, adapt,
};
use crate::save::Image;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::census::WithFeatures;
use halflight_core::film::{Film, Pixel};
use halflight_core::light::Lights;
use halflight_core::memory::{Arena, Line};
use halflight_core::scene::Scene;
use halflight_core::transport::{PathSettings, PathTracer, UNLIMITED, path::WAVE};
use std::time::Instant;

/// A thread looks at the clock, and at the flag, after about so many seconds.
const STEP_SECONDS: f64 = 0.01;

/// Samples of a tile that fill a wave: steps are multiples of it where time allows.
const FULL_STEP: u32 = 8;

/// A render to be compiled for the features of its scene.
pub(super) struct Render<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) settings: &'a Settings,
    pub(super) method: &'static str,
    pub(super) progress: &'a mut dyn FnMut(&Progress),
    pub(super) interrupt: &'a AtomicBool,
}

impl WithFeatures for Render<'_> {
    type Out = Result<RenderResult, RenderError>;

    fn run<F: Features>(self) -> Self::Out {
        let Render { scene, settings, method, progress, interrupt } = self;
        let (width, height) = (settings.width, settings.height);
        let max_depth = settings.max_depth.unwrap_or(UNLIMITED);
        let path_settings = PathSettings { width, height, seed: settings.seed, max_depth, reuse: false };
        let identity = Identity::of(scene, method, &path_settings, settings);
        // A film of something else should not cost the time of building.
        let resumed = settings.resume.as_deref().map(Reader::open).transpose()?;
        if let Some(film) = &resumed {
            film.check(&identity, settings.shard)?;
        }

        let workers = Workers::new(settings.threads)?;
        let mut memory = Memory::new(scene, settings.memory);
        let build_start = Instant::now();
        // First, for the working memory of its build is free again for the others.
        let mut bvh_lines = Vec::new();
        let bvh = build_bvh(scene, &workers, &mut memory, &mut bvh_lines)?;
        let mut film_lines = memory.take("film", Film::footprint(width, height))?;
        let scratch = PathTracer::<F>::scratch(WAVE);
        let mut scratch_lines =
            (0..workers.count()).map(|_| memory.take("paths", scratch)).collect::<Result<Vec<_>, _>>()?;
        let mut lights_lines = memory.take("lights", Lights::footprint(scene).and(Lights::scratch(scene)))?;
        let lights = Lights::build(scene, &mut Arena::new(bytemuck::cast_slice_mut(&mut lights_lines)))?;
        let build = build_start.elapsed().as_secs_f64();

        let film = Film::new(width, height, &mut Arena::new(bytemuck::cast_slice_mut(&mut film_lines)))?;
        let mut canvas = Canvas::new(film, settings.shard);
        let tracer = PathTracer::<F>::new(scene, &bvh, &lights, path_settings, settings.level);

        let (mut rounds, mut history, before) = match resumed {
            None => (Rounds::new(settings.stop), Vec::new(), 0.0),
            Some(film) => {
                let header = film.header.clone();
                film.read_into(&mut canvas)?;
                canvas.weights = header.weights(canvas.taken.len());
                let Header { spp, rounds, seconds, estimates, .. } = header;
                let rounds = Rounds::new(settings.stop).resumed(spp, rounds, seconds, estimates);
                (rounds, header.history(), seconds)
            }
        };
        let mut clock = Clock::start(before);
        let reuse = match settings.reuse {
            Some(used) => Reuse { used, pilot: None },
            None => {
                let pilot = workers.pilot(&tracer, &mut scratch_lines)?;
                Reuse { used: pilot.pays(), pilot: Some(pilot) }
            }
        };
        let tracer = tracer.with_reuse(reuse.used);
        let mut reference = settings.reference.as_deref().map(Reference::new);
        let mut latest = history.iter().rev().find_map(|round: &Round| round.error);
        let mut estimating = 0.0;
        let mut saved = Instant::now();
        let save = |canvas: &Canvas, rounds: &Rounds, seconds: f64, history: &[Round]| {
            let Some(checkpoint) = &settings.checkpoint else { return Ok::<(), FilmError>(()) };
            let header = Header::new(identity.clone(), canvas, rounds, seconds, history);
            film_file::write(&checkpoint.path, &header, canvas)
        };

        while let Some(plan) = rounds.next(clock.seconds(), estimating) {
            let now = clock.seconds();
            // Later than any clock can tell is never.
            let later = |at: f64| Duration::try_from_secs_f64((at - now).max(0.0)).ok();
            let deadline = plan.deadline.and_then(later).and_then(|later| Instant::now().checked_add(later));
            let round = workers::Round {
                targets: canvas.targets(plan.target),
                step: step(&plan, canvas.tiles(), workers.count()),
                deadline,
                interrupt: (!plan.first).then_some(interrupt),
            };
            workers.run(&tracer, &round, &mut canvas, &mut scratch_lines)?;
            rounds.completed(canvas.spp().min(plan.target), clock.seconds());
            let mut error = None;
            if rounds.estimate_is_due() {
                let start = Instant::now();
                let tiles = workers.errors(&canvas.film);
                error = tiles.as_ref().and_then(|tiles| ErrorEstimate::of(tiles.iter().copied()));
                if let (true, Some(tiles)) = (settings.adaptive && rounds.spp() >= adapt::FROM, tiles) {
                    canvas.weights = Some(adapt::weights(&tiles, &canvas.taken, width));
                }
                rounds.estimated(error);
                estimating = start.elapsed().as_secs_f64();
                latest = error;
            }
            let seconds = clock.seconds();
            let against =
                reference.as_mut().map(|r| clock.pause(|| r.compare(&image(&canvas.film), seconds)));
            let (spp, rays) = (rounds.spp(), canvas.counters.rays + canvas.counters.shadow_rays);
            history.push(Round { seconds, spp, rays, error, reference: against });
            let known = Progress {
                seconds,
                seconds_left: rounds.seconds_left(seconds, latest),
                spp,
                rounds: rounds.count(),
                error: latest,
            };
            clock.pause(|| progress(&known));
            let due = |every: f64| saved.elapsed().as_secs_f64() >= every;
            if plan.first || settings.checkpoint.as_ref().is_some_and(|checkpoint| due(checkpoint.every)) {
                clock.pause(|| save(&canvas, &rounds, seconds, &history))?;
                saved = Instant::now();
            }
            if interrupt.load(Ordering::Relaxed) && !plan.first {
                break;
            }
        }
        let interrupted = interrupt.load(Ordering::Relaxed);
        let render = clock.seconds();
        let error = workers.estimate(&canvas.film);
        if let Some(last) = history.last_mut() {
            last.error = error;
        }
        save(&canvas, &rounds, render, &history)?;
        let film = &canvas.film;
        Ok(RenderResult {
            image: image(film),
            spp: rounds.spp(),
            rounds: rounds.count(),
            history,
            variance: map(film, |pixel| pixel.variance().to_array()),
            samples: by_rows(film).map(|pixel| pixel.count()).collect(),
            threads: workers.count(),
            seconds: Seconds { build, render },
            counters: canvas.counters,
            reuse,
            places: canvas.ledger.places(width, height),
            empty_pixels: empty_pixels(film, |task| canvas.shard.owns(task)),
            error,
            memory: memory.uses(),
            memory_peak: memory.peak(),
            ending: if interrupted { Ending::Interrupted } else { Ending::Done },
        })
    }
}

/// Samples of a tile between two looks at the clock.
fn step(plan: &Plan, tiles: usize, threads: usize) -> u32 {
    let Some(each) = plan.each else { return FULL_STEP };
    let tile = each * threads as f64 / tiles.max(1) as f64;
    let step = (STEP_SECONDS / tile) as u32;
    if step >= FULL_STEP { step / FULL_STEP * FULL_STEP } else { step.max(1) }
}

/// The hierarchy, built on all cores, then moved out of the working memory of its build into `lines`.
fn build_bvh<'m>(
    scene: &Scene,
    workers: &Workers,
    memory: &mut Memory,
    lines: &'m mut Vec<Line>,
) -> Result<Bvh<'m>, RenderError> {
    let mut working = memory.take("bvh build", Bvh::footprint(scene.mesh.triangles.len()))?;
    let built = workers.build_bvh(&scene.mesh, &mut Arena::new(bytemuck::cast_slice_mut(&mut working)))?;
    *lines = memory.take("bvh", built.used())?;
    let bvh = built.copied(&mut Arena::new(bytemuck::cast_slice_mut(lines)))?;
    memory.give_back("bvh build");
    Ok(bvh)
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
