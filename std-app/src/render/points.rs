//! Irradiance at points on the threads of the program, with its rounds and stop rules.

use super::back_faces::back_faces;
use super::built::Built;
use super::deadline::{Deadline, End};
use super::files::{BakeHeader, BakeReader, Beside, Identity, RewrittenFile, write_bake};
use super::memory::{Bank, Memory};
use super::threads::{Pool, Threads, Workers};
use super::{Checkpoint, RenderError, Stop};
use crate::file_error::FileError;
use crate::save::Patience;
use core::sync::atomic::AtomicBool;
use halflight_core::bsdf::All;
use halflight_core::findings::Findings;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::method::{Shard, rays_per_second};
use halflight_core::scene::Scene;
use halflight_core::transport::{Counters, SceneContext};
use halflight_core::{
    Goal, IrradiancePoint, IrradianceRenderer, Level, LightPart, PointIrradiance, PointMethod, PointSettings,
    Until,
};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Samples of the first round.
const FIRST_SAMPLES: u32 = 4;

/// Longest round in seconds, for regular progress.
const LONGEST_ROUND: f64 = 0.5;

/// Points whose fractions of back faces are counted between two reports.
const BACK_FACES_AT_ONCE: usize = 1 << 16;

/// Settings of irradiance at points.
#[derive(Clone, Debug)]
pub struct BakeSettings {
    /// Stop rules; the first that holds ends the work. An error is the half-width of the intervals of 95 % of
    /// the points of each tile of near points, relative to the value and a tenth of the mean.
    pub stop: Stop,
    /// Light to estimate.
    pub light: LightPart,
    /// Caustic photons where a pilot finds that they pay.
    pub caustics: bool,
    /// Source of the indirect light. Shards have paths alone.
    pub method: PointMethod,
    /// Part of the points to estimate, in tiles of 256 near points; the others have no samples.
    pub shard: Shard,
    /// Bake file to write.
    pub checkpoint: Option<Checkpoint>,
    /// Bytes that the file keeps for [`crate::bake::merge`].
    pub attached: Vec<u8>,
    /// Bake file to resume: a checkpoint of the same bake.
    pub resume: Option<PathBuf>,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 2 is direct light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Number of threads; `None`: all of the machine.
    pub threads: Option<usize>,
    /// Memory limit in bytes for the scene and all structures; `None`: no limit.
    pub memory: Option<usize>,
    /// Instruction set of the kernels.
    pub level: Level,
    /// True if [`Baked::back_faces`] are counted.
    pub back_faces: bool,
}

impl BakeSettings {
    /// Rules without a flag: intervals of 2 %, or a minute.
    pub const SENSIBLE: Stop = Stop { spp: None, seconds: Some(60.0), error: Some(0.02) };
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self {
            stop: Self::SENSIBLE,
            light: LightPart::All,
            caustics: true,
            method: PointMethod::Path,
            shard: Shard::WHOLE,
            checkpoint: None,
            attached: Vec::new(),
            resume: None,
            seed: 0,
            max_depth: None,
            threads: None,
            memory: None,
            level: Level::detect(),
            back_faces: false,
        }
    }
}

/// Progress of a bake.
#[derive(Clone, Copy, Debug)]
pub struct BakeProgress {
    /// Samples of the least sampled point.
    pub samples: u32,
    /// Part of the points whose fractions of back faces are counted, until all are.
    pub counting: Option<f64>,
    /// Tiles of near points, and those within the error.
    pub tiles: [usize; 2],
    /// Seconds so far.
    pub seconds: f64,
    /// Seconds left, by the time limit or by the number of samples.
    pub seconds_left: Option<f64>,
}

impl BakeProgress {
    fn after(start: Instant, settings: &BakeSettings, samples: u32, tiles: [usize; 2]) -> Self {
        let seconds = start.elapsed().as_secs_f64();
        let of_limit = settings.stop.seconds.map(|limit| (limit - seconds).max(0.0));
        let most = settings.stop.spp.filter(|_| samples > 0);
        let of_samples = most.map(|most| seconds * (f64::from(most) / f64::from(samples) - 1.0).max(0.0));
        let seconds_left = of_limit.into_iter().chain(of_samples).reduce(f64::min);
        Self { samples, counting: None, tiles, seconds, seconds_left }
    }
}

/// Irradiance of all points.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Values, in the order of the points.
    pub values: Vec<PointIrradiance>,
    /// Fraction of the rays of each point that first meet the back of a surface; 0 where half of the time
    /// after the first samples did not suffice, empty if not requested.
    pub back_faces: Vec<f32>,
    /// Tiles of near points, and those within the error.
    pub tiles: [usize; 2],
    /// Decisions and numbers of caustic photons and of a cache.
    pub findings: Findings,
    /// Rays and rejected samples.
    pub counters: Counters,
    /// Seconds of building and of sampling.
    pub seconds: [f64; 2],
    /// True if the user ended the work.
    pub is_interrupted: bool,
    /// Reason why the bake file is missing or out of date.
    pub unsaved: Option<FileError>,
}

impl Baked {
    /// Mean irradiance over all points, linear sRGB.
    pub fn mean(&self) -> [f64; 3] {
        let sum = self.values.iter().map(|value| value.irradiance.as_dvec3()).sum::<glam::DVec3>();
        (sum / self.values.len().max(1) as f64).to_array()
    }

    /// Median of the half-widths of the intervals of points with samples, relative to the value; `None` where
    /// most of them are black or have no interval.
    pub fn median_half_width(&self) -> Option<f64> {
        let relative = |value: &PointIrradiance| (value.upper - value.value()) / value.value();
        let sampled = self.values.iter().filter(|value| value.samples > 0);
        let mut widths: Vec<f32> = sampled.map(relative).collect();
        widths.sort_unstable_by(f32::total_cmp);
        let median = widths.get(widths.len() / 2).copied()?;
        median.is_finite().then_some(median.into())
    }
}

impl BakeSettings {
    /// The settings of the core for a scene of so many `triangles` on so many threads.
    fn of_core(&self, triangles: usize, threads: usize) -> PointSettings {
        let Self { seed, max_depth, level, light, caustics, shard, ref stop, .. } = *self;
        let method = if shard == Shard::WHOLE { self.method } else { PointMethod::Path };
        let rays = rays_per_second(triangles) * threads as f64;
        let rays = stop.seconds.map(|seconds| seconds * rays);
        let goal = Goal { rays, samples: stop.most_samples(), error: stop.error };
        PointSettings { seed, max_depth, level, light, caustics, shard, method, goal }
    }
}

/// The bake file, written at intervals and at the end.
struct Kept<'a> {
    file: RewrittenFile<'a>,
    settings: &'a BakeSettings,
    identity: &'a Identity,
    points: usize,
    goal: Goal,
    back_faces: Vec<f32>,
    /// Start of this run, and seconds of the earlier ones.
    start: Instant,
    before: f64,
    /// Time of the last write.
    saved: Instant,
    interrupt: &'a AtomicBool,
}

impl<'a> Kept<'a> {
    fn new(
        settings: &'a BakeSettings,
        (identity, points, goal): (&'a Identity, usize, Goal),
        (start, before): (Instant, f64),
        interrupt: &'a AtomicBool,
    ) -> Self {
        let path = settings.checkpoint.as_ref().map(|checkpoint| checkpoint.path.as_path());
        let file = RewrittenFile::in_file(path);
        let saved = Instant::now();
        let back_faces = vec![0.0; if settings.back_faces { points } else { 0 }];
        Self { file, settings, identity, points, goal, back_faces, start, before, saved, interrupt }
    }

    /// Writes the file if it is due.
    fn update(&mut self, renderer: &IrradianceRenderer) {
        let every = self.settings.checkpoint.as_ref().map(|checkpoint| checkpoint.every);
        if every.is_some_and(|every| self.saved.elapsed().as_secs_f64() >= every) {
            self.write(renderer, None);
            self.saved = Instant::now();
        }
    }

    /// Writes the file. Returns why it could not, and the fractions of back faces.
    fn finish(mut self, renderer: &IrradianceRenderer) -> (Option<FileError>, Vec<f32>) {
        let patience = Patience { since: Instant::now(), interrupt: self.interrupt };
        self.write(renderer, Some(patience));
        (self.file.failed(), self.back_faces)
    }

    fn write(&mut self, renderer: &IrradianceRenderer, last: Option<Patience>) {
        // An end before the points were put into order leaves the file as it was.
        if renderer.film().points.is_empty() {
            return;
        }
        let beside = Beside { back_faces: &self.back_faces, attached: &self.settings.attached };
        let seconds = self.before + self.start.elapsed().as_secs_f64();
        let header = || BakeHeader::new(self.identity, (self.points, beside, self.goal), renderer, seconds);
        let write =
            |path: &Path, patience: Patience| write_bake(path, &header(), (renderer, beside), patience);
        match last {
            Some(patience) => self.file.finish(patience, write),
            None => self.file.update(write),
        }
    }
}

/// Samples after the next round, which follows one of so many `seconds`: they double until rounds are long.
fn grown(samples: u32, seconds: f64) -> u32 {
    let growth = (LONGEST_ROUND / seconds.max(1e-6)).clamp(0.125, 1.0);
    samples.saturating_add((f64::from(samples) * growth).ceil() as u32).min(1 << 30)
}

/// Counts the fractions of back faces of `points`, in half of the time that is left: the rest is for samples.
fn count_back_faces(
    context: &SceneContext<All>,
    (points, fractions): (&[IrradiancePoint], &mut [f32]),
    (workers, scratch): (&Workers, &mut [Vec<Line>]),
    report: &mut dyn FnMut(f64),
) -> Result<(), RenderError> {
    let end = End::Round(workers.deadline.after(0.5));
    let chunks = points.chunks(BACK_FACES_AT_ONCE).zip(fractions.chunks_mut(BACK_FACES_AT_ONCE));
    for (number, (chunk, fractions)) in chunks.enumerate() {
        report((number * BACK_FACES_AT_ONCE) as f64 / points.len() as f64);
        back_faces(context, chunk, fractions, &mut Threads::new(workers, scratch).until(end))?;
    }
    Ok(())
}

/// Estimates the irradiance of `points` with the structures of `built`.
pub(crate) fn with_points(
    (scene, built): (&Scene, &Built),
    (points, settings): (&[IrradiancePoint], &BakeSettings),
    pool: &Pool,
    progress: &mut dyn FnMut(&BakeProgress),
    interrupt: &AtomicBool,
) -> Result<Baked, RenderError> {
    let start = Instant::now();
    let core = settings.of_core(scene.mesh.triangles.len(), pool.count());
    let identity = BakeHeader::identity(scene, points, &core);
    let bank = Bank::new();
    let mut memory = Memory::of_scene(scene, settings.memory, &bank);
    built.count_in(&mut memory)?;
    let open = |file: &PathBuf| BakeReader::open(file, memory.for_file());
    let earlier = settings.resume.as_ref().map(open).transpose()?;
    earlier.iter().try_for_each(|file| file.check(&identity, settings.shard))?;
    let core = earlier.as_ref().map_or(core, |file| file.header.continuing(core));
    let given = Footprint::default().slice::<IrradiancePoint>(points.len()).slice::<f32>(points.len());
    memory.set_aside("given points", given)?;
    let mut lines = memory.take("points", IrradianceRenderer::footprint(scene, points.len(), core.method))?;
    let workers = Workers::new(pool).ending_at(Deadline::until(interrupt).within(settings.stop.seconds));
    let deadline = workers.deadline.after(1.0);
    let mut scratch = memory.take_each("working memory", IrradianceRenderer::scratch(), workers.count())?;
    let context = SceneContext::new(scene, &built.bvh, &built.lights, settings.level);
    let mut executor = Threads::new(&workers, &mut scratch).until(End::FirstRound(None));
    let lights = built.lights.with_level(settings.level);
    let structures = (scene, built.bvh, lights);
    let mut arena = Arena::over(&mut lines);
    let mut renderer = IrradianceRenderer::over(structures, points, &core, &mut arena, &mut executor)?;
    let before = earlier.as_ref().map_or(0.0, |file| file.header.seconds);
    earlier.map_or(Ok(()), |file| file.resume(&mut renderer))?;
    let mut kept = Kept::new(settings, (&identity, points.len(), core.goal), (start, before), interrupt);

    let mut target = FIRST_SAMPLES.max(renderer.samples());
    let mut is_first = true;
    loop {
        let most = settings.stop.most_samples();
        target = most.map_or(target, |most| target.min(most));
        // Every point has samples, two seconds after the end as well.
        let end = if is_first { End::Prepass } else { End::Round(deadline) };
        let mut executor = Threads::new(&workers, &mut scratch).until(end);
        let round = Instant::now();
        match settings.stop.error {
            Some(error) => renderer.step_within(&mut executor, error, target)?,
            None => renderer.step(&mut executor, Until::Samples(target))?,
        }
        let seconds = round.elapsed().as_secs_f64();
        let tiles = renderer.tiles();
        let report = BakeProgress::after(start, settings, renderer.samples(), tiles);
        progress(&report);
        if core::mem::take(&mut is_first) {
            let report = &mut |part| progress(&BakeProgress { counting: Some(part), ..report });
            let counted = (points, &mut kept.back_faces[..]);
            count_back_faces(&context, counted, (&workers, &mut scratch), report)?;
        }
        kept.update(&renderer);
        let is_exact = settings.stop.error.is_some() && tiles[0] == tiles[1];
        // Tiles within the error have fewer.
        let is_full = most.is_some_and(|most| target >= most);
        let is_over = deadline.is_some_and(|deadline| Instant::now() >= deadline);
        if is_exact || is_full || is_over || workers.deadline.is_interrupted() {
            break;
        }
        target = grown(target, seconds);
    }
    let (unsaved, back_faces) = kept.finish(&renderer);
    Ok(Baked {
        unsaved,
        values: renderer.values().collect(),
        back_faces,
        tiles: renderer.tiles(),
        findings: renderer.findings(),
        counters: renderer.counters(),
        seconds: [built.seconds(), start.elapsed().as_secs_f64()],
        is_interrupted: workers.deadline.is_interrupted(),
    })
}
