//! Emission guide: lights and directions are chosen by what earlier photons brought to visible surfaces
//! (Peter and Pietrek 1998), in cells of primary sample space (Grittmann et al. 2018).
//!
//! 1. Camera rays find visible points; for final gathering, points that light those.
//! 2. A pilot traces light paths and counts those that leave photons near these points.
//! 3. Where few do, cells are chosen by what they have brought, from pilot to pilot, until enough is known.
//!    If next to none does, lights are chosen evenly once: a lamp in the room of the camera may have next to
//!    no share of all power.
//! 4. The last pilot shows whether the variance falls. If not, lights are chosen by power.

use super::executor::Executor;
use super::photons::MapUse;
use super::{PhotonMapStore, RenderContext};
use crate::bsdf::Features;
use crate::light::{EmissionSampler, GuideStats};
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::transport::photon_mapping::deposit::{
    PATHS_PER_TASK, PhotonFilter, PhotonTracer, PhotonTracerSettings,
};
use crate::transport::photon_mapping::visible_points::{VisiblePointSampler, VisiblePoints};

/// Light paths of each pilot, the map that those of the first belong to, which no sample has, and the most
/// pilots after it.
const PILOT: usize = 16 * PATHS_PER_TASK;
const FIRST_MAP: u32 = 0x7fff_fff0;
const MOST_PILOTS: u32 = 3;

/// The fraction of light paths that reach visible points from which on power is good enough; the fewest paths
/// to begin with, and the fewest of all pilots that the guide is learned from.
const MOST_SEEN: f64 = 0.5;
const FEWEST_TO_BEGIN: usize = 8;
const FEWEST_SEEN: usize = 512;

/// The highest variance of light at visible points with the guide, relative to that without, at which guiding
/// pays.
const LESS: f64 = 0.5;

/// Photons that a guide is for.
#[derive(Clone, Copy)]
pub struct GuideSettings {
    /// Photons that are kept.
    pub filter: PhotonFilter,
    /// The largest number of segments of a path.
    pub max_depth: u32,
    /// Points at which photons are gathered.
    pub target: Target,
    /// Bytes that have to stay free; with less, lights are chosen by power.
    pub reserve: usize,
}

/// Points at which photons are gathered.
#[derive(Clone, Copy)]
pub enum Target {
    /// At visible points, in discs of this radius in pixels.
    Visible(f32),
    /// At ends of gather rays from visible points, within this distance.
    Gathered(f32),
}

/// The emission of photons of one kind.
pub struct EmissionGuide<'m> {
    /// Samples lights and directions.
    pub emission: EmissionSampler<'m>,
    /// Fraction of light paths that reach visible points; `None` without a pilot.
    pub seen: Option<f64>,
    /// The same with lights chosen by power; `None` where they are.
    pub by_power: Option<f64>,
}

/// Memory that a guide of so many lights keeps.
fn kept(lights: usize, is_caustic: bool) -> Footprint {
    let stats = match is_caustic {
        true => GuideStats::footprint(lights).and(GuideStats::guide_footprint(lights)),
        false => GuideStats::footprint_of_all(lights),
    };
    EmissionSampler::footprint(lights).and(stats)
}

/// Memory that [`EmissionGuide::learn`] takes for a picture of this `size` in a scene of so many lights.
pub(super) fn footprint(lights: usize, size: [u32; 2], filter: PhotonFilter) -> Footprint {
    let sampler = VisiblePointSampler::new(size);
    let working = Pilot::footprint(&sampler).or(Pilot::footprint(&sampler.gathering()));
    kept(lights, filter == PhotonFilter::Caustic).and(working)
}

impl<'m> EmissionGuide<'m> {
    /// Lights by power.
    fn by_power(context: &RenderContext, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let emission = context.emission(arena)?;
        Ok(Self { emission, seen: None, by_power: None })
    }

    /// Learns where photons are used in the picture of `context`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small for lights by power, or the executor's scratch
    /// for light paths.
    pub fn learn<F: Features>(
        context: &RenderContext,
        settings: GuideSettings,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let GuideSettings { filter, max_depth, target, reserve } = settings;
        let RenderContext { scene, ref lights, settings: paths, level, .. } = *context;
        let sampler = VisiblePointSampler::new([paths.width, paths.height]);
        let sampler = if matches!(target, Target::Gathered(_)) { sampler.gathering() } else { sampler };
        let is_caustic = filter == PhotonFilter::Caustic;
        let (power, working) = (EmissionSampler::footprint(lights.count()), Pilot::footprint(&sampler));
        let kept = kept(lights.count(), is_caustic);
        if kept.and(working).bytes().saturating_add(reserve) > memory.available() {
            return Self::by_power(context, &mut memory.take("emission", power)?);
        }
        let mut arena = memory.take("emission", kept)?;
        let mut guide = Self::by_power(context, &mut arena)?;
        let stats = if is_caustic {
            GuideStats::aimed(scene, lights, &guide.emission, &mut arena)?.map(GuideStats::with_bounded_power)
        } else {
            Some(GuideStats::of_all(lights, &mut arena)?)
        };
        let Some(mut stats) = stats else { return Ok(guide) };
        memory.lend("places", working, |_, working| {
            let paths = [working.slice(PILOT)?, working.slice(PILOT)?];
            let mut store = PhotonMapStore::over(working.scratch());
            find_visible_points::<F>(context, &sampler, &mut store, executor)?;
            let Some(map) = store.map()? else { return Ok(()) };
            let points = match target {
                Target::Visible(pixels) => VisiblePoints::new(&map, &sampler, context.radii(), pixels, level),
                Target::Gathered(radius) => VisiblePoints::within(&map, radius, level),
            };
            let points = points.by_area(guide.emission.is_focused());
            let mut pilot = Pilot::new(context, (filter, max_depth), points, paths);
            guide.train::<F>(&mut stats, &mut arena, &mut pilot, executor)
        })?;
        Ok(guide)
    }

    /// Runs pilots, and keeps the guide that they teach where it pays.
    fn train<F: Features>(
        &mut self,
        stats: &mut GuideStats<'m>,
        arena: &mut Arena<'m>,
        pilot: &mut Pilot,
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        let by_power = self.emission;
        let is_caustic = pilot.settings.keep == PhotonFilter::Caustic;
        // Photons of all light go by power in the guide's cells, so that their cells are known.
        let first = if is_caustic { by_power } else { stats.guide(&by_power, &mut arena.scratch())? };
        let Some(first) = pilot.run::<F>(&first, 0, executor)? else { return Ok(()) };
        self.seen = Some(first.share());
        if first.share() >= MOST_SEEN {
            return Ok(());
        }
        // Caustic photons are aimed at casters before any was seen.
        let explores = !is_caustic && first.count < FEWEST_TO_BEGIN;
        let first = match explores {
            true => {
                let evenly = stats.evenly(&by_power, &mut arena.scratch())?;
                let Some(found) = pilot.run::<F>(&evenly, MOST_PILOTS + 1, executor)? else { return Ok(()) };
                found
            }
            false => first,
        };
        if explores && first.count < FEWEST_TO_BEGIN {
            return Ok(());
        }
        let teach = |stats: &mut GuideStats, pilot: &Pilot| {
            pilot.useful().for_each(|(cell, power)| stats.learn(cell, power));
            if !is_caustic {
                stats.average_per_light(&by_power);
            }
        };
        let mut seen = 0;
        if !is_caustic {
            teach(stats, pilot);
            seen += first.count;
        }
        // Without a photon the spread by power is unknown, but large.
        let most = if explores || first.count == 0 { f64::INFINITY } else { LESS * first.spread };
        for number in 1..=MOST_PILOTS {
            let before = seen;
            let guided = stats.guide(&by_power, &mut arena.scratch())?;
            let Some(outcome) = pilot.run::<F>(&guided, number, executor)? else { break };
            teach(stats, pilot);
            seen += outcome.count;
            if before == 0 || seen < FEWEST_SEEN {
                continue;
            }
            if outcome.spread <= most {
                self.emission = stats.guide(&by_power, arena)?;
                (self.seen, self.by_power) = (Some(outcome.share()), self.seen);
            }
            break;
        }
        Ok(())
    }

    /// The use of maps of `given` tasks of these photons, of `wanted` ones.
    pub fn map_use(&self, wanted: usize, given: usize) -> MapUse {
        MapUse { seen: self.seen, by_power: self.by_power, ..MapUse::of_tasks(wanted, given) }
    }
}

/// Fills `store` with the map of the points that the camera rays of `sampler` find.
fn find_visible_points<F: Features>(
    context: &RenderContext,
    sampler: &VisiblePointSampler,
    store: &mut PhotonMapStore,
    executor: &mut impl Executor,
) -> Result<(), OutOfMemory> {
    let scene = context.scene_context::<F>();
    let size = (sampler.rays(), VisiblePointSampler::TASK);
    let _ = store.fill(executor, size, |task, _, points| {
        Ok(sampler.run(task, &scene, context.settings.seed, points))
    })?;
    Ok(())
}

/// Light paths that show where photons are used.
struct Pilot<'p, 'a> {
    context: &'p RenderContext<'a>,
    settings: PhotonTracerSettings,
    points: VisiblePoints<'p>,
    /// The guide's cell of each path.
    cells: &'p mut [u32],
    /// Benefit of the photons of each path near visible points.
    powers: &'p mut [f32],
}

/// The result of a pilot.
#[derive(Clone, Copy)]
struct Outcome {
    /// Light paths that leave photons near visible points.
    count: usize,
    /// Mean squared benefit of a path there over the square of its mean.
    spread: f64,
}

impl Outcome {
    /// Fraction of light paths that leave photons near visible points.
    fn share(self) -> f64 {
        self.count as f64 / PILOT as f64
    }
}

impl<'p, 'a> Pilot<'p, 'a> {
    /// Memory of pilots, and of the map of the visible points of `sampler`.
    fn footprint(sampler: &VisiblePointSampler) -> Footprint {
        Footprint::default().slice::<u32>(PILOT).slice::<u32>(PILOT).and(sampler.footprint())
    }

    fn new(
        context: &'p RenderContext<'a>,
        (keep, max_depth): (PhotonFilter, u32),
        points: VisiblePoints<'p>,
        [cells, powers]: [&'p mut [u32]; 2],
    ) -> Self {
        let seed = context.settings.seed;
        let settings = PhotonTracerSettings { keep, seed, paths: PILOT as u32, max_depth };
        Self { context, settings, points, cells, powers: bytemuck::cast_slice_mut(powers) }
    }

    /// Traces the paths of pilot `number` by `emission`; `None` where the executor ends early.
    fn run<F: Features>(
        &mut self,
        emission: &EmissionSampler,
        number: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<Outcome>, OutOfMemory> {
        let Self { context, settings, points, cells, powers } = self;
        let RenderContext { scene, ref bvh, ref lights, level, .. } = **context;
        let tracer = PhotonTracer::<F>::new(scene, bvh, lights, emission, *settings, level);
        cells.fill(0);
        powers.fill(0.0);
        let pieces = cells.chunks_mut(PATHS_PER_TASK).zip(powers.chunks_mut(PATHS_PER_TASK));
        let passed = executor.pass(pieces, |task, (cells, powers), worker| {
            tracer.trace_visible((task, FIRST_MAP + number), *points, &mut worker.scratch, &mut |photon| {
                // All photons of a path come from one cell.
                if let (Some(cell), Some(power)) = (cells.get_mut(photon.path), powers.get_mut(photon.path)) {
                    *cell = photon.cell;
                    *power += photon.light;
                }
            })
        })?;
        Ok(passed.is_complete.then(|| self.outcome()))
    }

    fn outcome(&self) -> Outcome {
        let powers = || self.useful().map(|(_, power)| f64::from(power));
        let (sum, squares) = (powers().sum::<f64>(), powers().map(|power| power * power).sum::<f64>());
        Outcome { count: powers().count(), spread: PILOT as f64 * squares / (sum * sum) }
    }

    /// Cell and power of each path that leaves photons near visible points.
    fn useful(&self) -> impl Iterator<Item = (u32, f32)> {
        let paths = self.cells.iter().copied().zip(self.powers.iter().copied());
        paths.filter(|(_, power)| *power > 0.0 && power.is_finite())
    }
}
