//! Stochastic progressive photon mapping (Hachisuka and Jensen 2009), with the radii of Knaus and Zwicker
//! (2011). For each sample of the picture:
//!
//! 1. photons are traced and built into a map;
//! 2. camera paths end at their first vertex with a diffuse part, with the reflected light that the photons
//!    in a disc around it give;
//! 3. the radius of the disc shrinks, such that noise and blur both vanish: r² (i + 1) = r² (i) (i + a) / (i
//!    + 1), a = 2/3.
//!
//! Pixels keep nothing except their sums, and memory does not grow with samples. Even and odd samples count
//! their radii apart: the halves of the film are two independent pictures.

use super::emission_guide::{EmissionGuide, GuideSettings, Target};
use super::executor::Executor;
use super::photons::{PhotonSettings, PhotonUse};
use super::{LastMaps, PhotonMapStore, RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::findings::Findings;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::photon::{Kernel, PhotonMap};
use crate::transport::photon_mapping::deposit::{
    PATHS_PER_TASK, PhotonFilter, PhotonTracer, PhotonTracerSettings, VERTICES_PER_TASK,
};
use crate::transport::{PathIntegrator, PhotonLight, RadiusSchedule, path::WAVE};

/// Radius of the discs of the first sample, in pixels.
pub const FIRST_RADIUS: f64 = 3.0;

/// Photons that a disc of the first sample needs, if they are uniform: where they are dense, it is smaller.
const ENOUGH: f64 = 12.0;

/// Light paths for a sample: one for each pixel of the picture, within these limits.
const FEWEST_PATHS: usize = 16 * PATHS_PER_TASK;
const MOST_PATHS: usize = 1024 * PATHS_PER_TASK;

/// Progressive photon mapping of one picture.
pub struct ProgressivePhotonMapping<'a, F> {
    context: RenderContext<'a>,
    integrator: PathIntegrator<'a, F>,
    guide: EmissionGuide<'a>,
    radii: RadiusSchedule,
    kernel: Kernel,
    /// Light paths of a map.
    paths: usize,
    photons: PhotonMapStore<'a>,
    /// The sample that the map is of.
    sample: Option<u32>,
    used: PhotonUse,
}

impl<'a, F: Features> ProgressivePhotonMapping<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch(WAVE).or(PhotonTracer::<F>::scratch())
    }

    /// Tasks of light paths of a map, for a picture of so many pixels.
    fn tasks(pixels: usize, settings: &PhotonSettings) -> usize {
        let usual = pixels.clamp(FEWEST_PATHS, MOST_PATHS);
        settings.global.map_or(usual, |paths| paths as usize).div_ceil(PATHS_PER_TASK).max(1)
    }

    /// Memory of a map for a picture of so many pixels.
    pub(super) fn footprint(pixels: usize, settings: &PhotonSettings) -> Footprint {
        PhotonMapStore::footprint(Self::tasks(pixels, settings).saturating_mul(VERTICES_PER_TASK))
    }

    /// Progressive photon mapping of `context`. Maps are as large as `memory` allows, of which `reserve`
    /// bytes stay free.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small for the smallest map, or the executor's scratch
    /// for a task.
    pub fn new(
        context: &RenderContext<'a>,
        settings: PhotonSettings,
        reserve: usize,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let of_task = PhotonMapStore::footprint(VERTICES_PER_TASK).bytes();
        let guide = GuideSettings {
            filter: PhotonFilter::Reflected,
            max_depth: context.settings.max_depth,
            target: Target::Visible(FIRST_RADIUS as f32),
            reserve: reserve.saturating_add(FEWEST_PATHS / PATHS_PER_TASK * of_task),
        };
        let guide = EmissionGuide::learn::<F>(context, guide, memory, executor)?;
        let wanted = Self::tasks(context.pixels(), &settings);
        let tasks = wanted.min(memory.available().saturating_sub(reserve) / of_task).max(1);
        Ok(Self {
            context: *context,
            integrator: context.integrator(),
            radii: context.radii(),
            kernel: settings.kernel,
            paths: tasks.saturating_mul(PATHS_PER_TASK),
            photons: PhotonMapStore::new(tasks.saturating_mul(VERTICES_PER_TASK), memory)?,
            sample: None,
            used: PhotonUse { global: Some(guide.map_use(wanted, tasks)), ..PhotonUse::default() },
            guide,
        })
    }

    /// Its maps so far.
    pub fn photons(&self) -> PhotonUse {
        self.used
    }

    /// Traces the photons of `sample`, unless a round that ended early has left them. Returns whether they
    /// are there.
    fn trace_photons<E: Executor>(&mut self, sample: u32, round: &mut Round<E>) -> Result<bool, OutOfMemory> {
        if self.sample == Some(sample) {
            return Ok(true);
        }
        self.sample = None;
        let RenderContext { scene, ref bvh, ref lights, settings, level, .. } = self.context;
        let settings = PhotonTracerSettings {
            keep: PhotonFilter::Reflected,
            seed: settings.seed,
            paths: u32::try_from(self.paths).unwrap_or(u32::MAX),
            max_depth: settings.max_depth,
        };
        let tracer = PhotonTracer::<F>::new(scene, bvh, lights, &self.guide.emission, settings, level);
        let passed = self.photons.trace(round.executor, &tracer, sample)?;
        if !round.count(passed) {
            return Ok(false);
        }
        let stored = self.photons.map()?.map_or(0, |map| map.len());
        self.sample = Some(sample);
        self.used.maps += 1;
        if let Some(used) = &mut self.used.global {
            used.add(self.paths, stored);
        }
        Ok(true)
    }
}

impl<F: Features> RenderMethod for ProgressivePhotonMapping<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            if !self.trace_photons(sample, round)? {
                break;
            }
            let Some(map) = self.photons.map()? else { break };
            let light = progressive(&map, self.radii, sample / 2).with_kernel(self.kernel);
            let integrator = self.integrator.with_photons(light);
            round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                integrator.run(tile, samples, WAVE, scratch, pixels)
            })?;
        }
        Ok(())
    }

    fn findings(&self) -> Findings {
        self.used.findings()
    }

    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        Ok(LastMaps { global: self.photons.map()?, caustic: None })
    }
}

/// The light of `map` in discs that have shrunk for `samples`; `radii` are of one pixel.
pub(super) fn progressive<'a>(
    map: &'a PhotonMap<'a>,
    radii: RadiusSchedule,
    samples: u32,
) -> PhotonLight<'a> {
    let enough = ENOUGH * RadiusSchedule::shrinkage(samples);
    PhotonLight::new(map, radii.after(FIRST_RADIUS, samples)).with_min_photons(enough as f32)
}
