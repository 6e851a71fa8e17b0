//! The prepass of caustic photons: light paths aimed at all mirrors and dielectrics teach the emission guide
//! which of them the camera sees, and show whether photons pay.

use super::benefit::{Benefit, missing};
use super::emission::{CausticEmission, CausticSettings, FIRST_RADIUS, least_footprint, photon_tracer};
use super::receivers::Receivers;
use crate::bsdf::Features;
use crate::light::{EmissionSampler, GuideStats};
use crate::memory::{Arena, Footprint, Line, MemorySource, OutOfMemory};
use crate::method::{Executor, RenderContext, pilot};
use crate::photon::{PhotonMap, Photons};
use crate::transport::caustics::tracer::{GuideSample, PATHS_PER_TASK};
use crate::transport::{CausticMerging, RadiusSchedule};
use core::marker::PhantomData;

/// Light paths of the first test, which ends the prepass where there is next to nothing to find, and of each
/// later step; where memory is short, fewer, but no fewer than those of the test.
const FIRST_TEST: usize = 4 * PATHS_PER_TASK;
const STEP: usize = 32 * PATHS_PER_TASK;

/// Numbers of the photon maps whose light paths are used.
const AIMED_MAP: u32 = 0;
const LEARNED_MAP: u32 = 1;
const AUDIT_MAP: u32 = 0x7fff_ff00;

/// Fewest hits by the paths of an audit at which they measure a light.
const FEWEST_HITS: f64 = 64.0;

/// The name of the emission sampler and its guide in reports of memory.
const EMISSION: &str = "emission";

/// Decision of the prepass: paths alone, or with photons.
pub enum Decision<'a> {
    /// Paths alone.
    Paths,
    /// Paths joined with caustic photons.
    Photons(CausticEmission<'a>),
}

/// The result of a prepass.
pub struct Prepass<'a> {
    /// Choice for the picture.
    pub decision: Decision<'a>,
    /// Estimated fraction of the picture's light that photons carry and path tracing finds badly; `None` if
    /// there was not enough memory.
    pub share: Option<f64>,
    /// There was not enough memory for a prepass.
    pub lacks_memory: bool,
}

/// Memory that a picture with photons and so many lights keeps of its prepass.
pub(in crate::method) fn kept(lights: usize) -> Footprint {
    EmissionSampler::footprint(lights).and(GuideStats::guide_footprint(lights))
}

/// Memory of the prepass itself, with so many light paths in a step.
fn lent(lights: usize, step: usize) -> Footprint {
    let stats = GuideStats::footprint(lights).and(GuideStats::guide_footprint(lights));
    EmissionSampler::footprint(lights).and(stats).slice::<GuideSample>(step)
}

/// Least memory with which a prepass runs in a scene of so many lights, beside `reserved` bytes.
pub(in crate::method) fn least(lights: usize, reserved: usize) -> usize {
    let later = kept(lights).and(least_footprint()).bytes().saturating_add(reserved);
    later.max(kept(lights).and(lent(lights, FIRST_TEST)).bytes())
}

/// Memory of a prepass whose steps have a light path for each of so many pixels.
pub(in crate::method) fn footprint(lights: usize, pixels: usize) -> Footprint {
    let step = pixels.next_multiple_of(PATHS_PER_TASK).clamp(FIRST_TEST, STEP);
    kept(lights).and(lent(lights, step))
}

/// Light paths of a step that there is memory for within `available` bytes.
fn step(context: &RenderContext, available: usize) -> usize {
    let (lights, wanted) =
        (context.lights.count(), PATHS_PER_TASK * context.pilots.of(STEP / PATHS_PER_TASK));
    let left = available.saturating_sub(kept(lights).and(lent(lights, 0)).bytes());
    let task = Footprint::default().slice::<GuideSample>(PATHS_PER_TASK);
    (left / task.bytes() * PATHS_PER_TASK).clamp(FIRST_TEST, wanted.max(FIRST_TEST))
}

/// Runs a prepass for `receivers` in the scene of `context`.
///
/// # Errors
/// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`](super::scratch).
pub fn prepass<'a, F: Features>(
    context: &RenderContext<'a>,
    receivers: &mut impl Receivers<'a, F>,
    settings: CausticSettings,
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<Prepass<'a>, OutOfMemory> {
    let RenderContext { ref lights, .. } = *context;
    let step = step(context, memory.available());
    let (kept, lent) = (kept(lights.count()), lent(lights.count(), step));
    let later = kept.and(least_footprint()).bytes().saturating_add(settings.reserved);
    if !memory.has(kept.and(lent)) || later > memory.available() {
        return Ok(Prepass { decision: Decision::Paths, share: None, lacks_memory: true });
    }
    memory.lend(EMISSION, lent, |memory, arena| {
        let light_paths = LightPaths {
            context,
            radii: receivers.radii(context).after(FIRST_RADIUS, 0),
            beside_records: settings.beside_records,
            found: arena.slice(step)?,
            executor,
        };
        let by_power = receivers.emission(context, arena)?;
        let mut learning = Learning { light_paths, receivers, share: None, features: PhantomData };
        let decision = match learning.run(&by_power, arena)? {
            Learned::Paths => Decision::Paths,
            Learned::Photons(stats, benefit) => {
                let mut arena = memory.take(EMISSION, kept)?;
                let by_power = learning.receivers.emission(context, &mut arena)?;
                let sampler = stats.guide(&by_power, &mut arena)?;
                let radii = learning.receivers.radii(context);
                Decision::Photons(CausticEmission { sampler, radii, benefit })
            }
        };
        Ok(Prepass { decision, share: learning.share, lacks_memory: false })
    })
}

/// As [`Decision`], with what the emission guide is built from.
enum Learned<'l> {
    Paths,
    Photons(GuideStats<'l>, Benefit),
}

/// A prepass at work.
struct Learning<'p, 'a, F, R, E> {
    light_paths: LightPaths<'p, 'a, E>,
    receivers: &'p mut R,
    share: Option<f64>,
    features: PhantomData<F>,
}

impl<'a, F: Features, R: Receivers<'a, F>, E: Executor> Learning<'_, 'a, F, R, E> {
    fn run<'l>(
        &mut self,
        by_power: &EmissionSampler<'l>,
        arena: &mut Arena<'l>,
    ) -> Result<Learned<'l>, OutOfMemory> {
        let RenderContext { scene, ref lights, .. } = *self.light_paths.context;
        let Some(mut stats) = GuideStats::aimed(scene, lights, by_power, arena)? else {
            return Ok(Learned::Paths);
        };
        let aimed = stats.guide(by_power, &mut arena.scratch())?;
        self.trace(&aimed, FIRST_TEST, AIMED_MAP)?;
        let mean = self.receivers.mean(self.light_paths.executor)?;
        if !self.benefit(FIRST_TEST, mean).may_pay() {
            return Ok(Learned::Paths);
        }
        let step = self.light_paths.found.len();
        self.trace(&aimed, step, AIMED_MAP)?;
        self.light_paths.teach(&mut stats);
        let learned = stats.guide(by_power, &mut arena.scratch())?;
        self.trace(&learned, step, LEARNED_MAP)?;
        self.light_paths.teach(&mut stats);
        let mean = self.other_light(&learned)?;
        let benefit = self.benefit(step, mean);
        Ok(if self.pays(&benefit)? { Learned::Photons(stats, benefit) } else { Learned::Paths })
    }

    fn trace(&mut self, sampler: &EmissionSampler, count: usize, map: u32) -> Result<(), OutOfMemory> {
        self.light_paths.trace::<F>((sampler, self.receivers.points()), count, map)
    }

    /// The benefit by the first `count` light paths, in a picture in which all other light has a `mean`
    /// radiance.
    fn benefit(&mut self, count: usize, mean: f32) -> Benefit {
        let LightPaths { context, found, .. } = &mut self.light_paths;
        let found = found.get_mut(..count).unwrap_or_default();
        let radius = self.receivers.first_radius();
        let benefit = Benefit::new(found, radius, context.pixels() as f64, f64::from(mean));
        self.share = Some(benefit.share);
        benefit
    }

    /// Mean radiance of light that photons of `sampler` do not carry. It is not that of the picture: a
    /// visible lamp, or a path that meets one through glass, may be nearly all of that, or be absent by
    /// chance.
    fn other_light(&mut self, sampler: &EmissionSampler) -> Result<f32, OutOfMemory> {
        let LightPaths { radii, beside_records, ref found, ref mut executor, .. } = self.light_paths;
        // Weights alone: an empty map adds no light.
        let mut line = [Line([0; _])];
        let empty = Photons::new(0, &mut Arena::over(&mut line))?.build(0);
        let merging = CausticMerging::new([&empty; 2], sampler, radii, found.len() as u32);
        self.receivers.mean_beside(merging.beside_records(beside_records), *executor)
    }

    /// True if photons may pay. Records supply indirect light without its noise.
    fn pays(&mut self, benefit: &Benefit) -> Result<bool, OutOfMemory> {
        if benefit.pays() {
            return Ok(true);
        }
        let LightPaths { beside_records, ref mut executor, .. } = self.light_paths;
        let noise = self.receivers.noise((benefit.mean as f32, beside_records), *executor)?;
        Ok(benefit.pays_beside(noise))
    }
}

/// Light paths of the prepass, and what they found.
struct LightPaths<'p, 'a, E> {
    context: &'p RenderContext<'a>,
    radii: RadiusSchedule,
    beside_records: bool,
    found: &'p mut [GuideSample],
    executor: &'p mut E,
}

impl<E: Executor> LightPaths<'_, '_, E> {
    /// Replaces what was found by `count` light paths of `sampler`, those of a `map`, near `points` or by the
    /// camera. If the executor ends early, the paths that are missing found nothing.
    fn trace<F: Features>(
        &mut self,
        (sampler, points): (&EmissionSampler, Option<&PhotonMap>),
        count: usize,
        map: u32,
    ) -> Result<(), OutOfMemory> {
        let Self { context, radii, beside_records, found, executor } = self;
        let tracer = photon_tracer::<F>(context, sampler, count, *radii, *beside_records).near(points);
        found.fill(GuideSample::default());
        let pieces = found.get_mut(..count).unwrap_or_default().chunks_mut(PATHS_PER_TASK);
        let _ = executor
            .pass(pieces, |task, found, worker| tracer.sample_guide(task, map, &mut worker.scratch, found))?;
        Ok(())
    }

    fn teach(&self, stats: &mut GuideStats) {
        self.found.iter().for_each(|path| stats.learn(path.cell, path.benefit));
    }
}

/// Memory that [`unseen`] borrows in a scene of so many lights.
pub fn unseen_footprint(lights: usize) -> Footprint {
    EmissionSampler::footprint(lights).slice::<GuideSample>(STEP)
}

/// Estimated fraction of the picture's light that photons find and path tracing with `samples` of each pixel
/// hardly ever does: that of very small lights by mirrors and dielectrics. `None` if it is zero, or without
/// memory.
///
/// # Errors
/// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`](super::scratch).
pub fn unseen<'m, F: Features>(
    context: &RenderContext,
    samples: f64,
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Option<f64>, OutOfMemory> {
    let RenderContext { scene, ref lights, .. } = *context;
    let lent = unseen_footprint(lights.count());
    if !super::are_possible(scene) || !memory.has(lent) {
        return Ok(None);
    }
    memory.lend("audit", lent, |_, arena| {
        let found = arena.slice(STEP)?;
        let by_power = context.emission(arena)?;
        let radii = context.radii().after(FIRST_RADIUS, 0);
        let mut light_paths = LightPaths { context, radii, beside_records: false, found, executor };
        light_paths.trace::<F>((&by_power, None), STEP, AUDIT_MAP)?;
        let LightPaths { found, executor, .. } = light_paths;
        let missing = missing(found, FIRST_RADIUS, context.pixels() as f64, (samples, FEWEST_HITS));
        let mean = f64::from(pilot::mean_radiance(&context.integrator::<F>(), context.pilots, executor)?);
        Ok((missing > 0.0).then(|| missing / (missing + mean)))
    })
}
