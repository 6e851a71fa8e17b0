//! Irradiance at points on the threads of the program, with its rounds and stop rules.

use super::built::Built;
use super::deadline::{Deadline, End};
use super::memory::{Bank, Memory};
use super::threads::{Pool, Threads, Workers};
use super::{RenderError, Stop};
use crate::bake::{BakeProgress, BakeSettings, Baked};
use core::sync::atomic::AtomicBool;
use core::time::Duration;
use halflight_core::memory::{Arena, Footprint};
use halflight_core::scene::Scene;
use halflight_core::{IrradiancePoint, IrradianceRenderer, PointSettings, Until};
use std::time::Instant;

/// Samples of the first round.
const FIRST_SAMPLES: u32 = 4;

/// Longest round in seconds, for regular progress.
const LONGEST_ROUND: f64 = 0.5;

/// Estimates the irradiance of `points` with the structures of `built`.
pub(crate) fn with_points(
    (scene, built): (&Scene, &Built),
    (points, settings): (&[IrradiancePoint], &BakeSettings),
    pool: &Pool,
    progress: &mut dyn FnMut(&BakeProgress),
    interrupt: &AtomicBool,
) -> Result<Baked, RenderError> {
    let start = Instant::now();
    let bank = Bank::new();
    let mut memory = Memory::of_scene(scene, settings.memory, &bank);
    built.count_in(&mut memory)?;
    let given = Footprint::default().slice::<IrradiancePoint>(points.len());
    memory.set_aside("given points", given)?;
    let mut lines = memory.take("points", IrradianceRenderer::footprint(points.len()))?;
    let each = IrradianceRenderer::required_memory(scene, points.len()).scratch.div_ceil(64);
    let mut scratch = Vec::new();
    for _ in 0..Workers::new(pool).count() {
        scratch.push(memory.take("working memory", Footprint::default().slice::<[u8; 64]>(each))?);
    }
    let workers = Workers::new(pool).ending_at(Deadline::until(interrupt));
    let end = |stop: &Stop| {
        let limit = stop.seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        limit.and_then(|limit| start.checked_add(limit))
    };
    let deadline = end(&settings.stop);
    let mut executor = Threads::new(&workers, &mut scratch).until(End::FirstRound(None));
    let core = PointSettings {
        seed: settings.seed,
        max_depth: settings.max_depth,
        level: settings.level,
        light: settings.light,
        ..PointSettings::default()
    };
    let lights = built.lights.with_level(settings.level);
    let structures = (scene, built.bvh, lights);
    let mut arena = Arena::over(&mut lines);
    let mut renderer = IrradianceRenderer::over(structures, points, &core, &mut arena, &mut executor)?;

    let mut target = FIRST_SAMPLES;
    let mut is_first = true;
    loop {
        let most = settings.stop.most_samples();
        target = most.map_or(target, |most| target.min(most));
        // Every point has samples, whatever the time.
        let end = if is_first { End::FirstRound(deadline) } else { End::Round(deadline) };
        let mut executor = Threads::new(&workers, &mut scratch).until(end);
        let round = Instant::now();
        match settings.stop.error {
            Some(error) => renderer.step_within(&mut executor, error, target)?,
            None => renderer.step(&mut executor, Until::Samples(target))?,
        }
        is_first = false;
        let seconds = start.elapsed().as_secs_f64();
        let tiles = renderer.tiles();
        let seconds_left = settings.stop.seconds.map(|limit| (limit - seconds).max(0.0));
        progress(&BakeProgress { samples: renderer.samples(), tiles, seconds, seconds_left });
        let is_exact = settings.stop.error.is_some() && tiles[0] == tiles[1];
        let is_full = most.is_some_and(|most| renderer.samples() >= most);
        let is_over = deadline.is_some_and(|deadline| Instant::now() >= deadline);
        if is_exact || is_full || is_over || workers.deadline.is_interrupted() {
            break;
        }
        // Rounds double until they are long.
        let growth = (LONGEST_ROUND / round.elapsed().as_secs_f64().max(1e-6)).clamp(0.125, 1.0);
        target = target.saturating_add((f64::from(target) * growth).ceil() as u32).min(1 << 30);
    }
    Ok(Baked {
        values: renderer.values().collect(),
        tiles: renderer.tiles(),
        counters: renderer.counters(),
        seconds: [built.seconds(), start.elapsed().as_secs_f64()],
        is_interrupted: workers.deadline.is_interrupted(),
    })
}
