//! Photon mapping in two passes (Jensen 1996; 2001, chapters 9 and 10):
//!
//! 1. Photons are traced into a global map, and those of caustics into a map of their own. Irradiances are
//!    precomputed at photons of the global map (Christensen 1999).
//! 2. Camera paths sample direct light, take caustics from the caustic map, and end gather rays in the global
//!    map (`transport/photon_mapping/final_gather.rs`).
//!
//! Photons are traced anew for every [`GROUP`] of samples, into maps of the even and maps of the odd samples:
//! the halves of the film are independent. Discs of caustics shrink from group to group as those of `sppm`;
//! the blur of the global map stays, behind a bounce.

use super::emission_guide::{EmissionGuide, GuideSettings, Target};
use super::executor::Executor;
use super::photons::{PhotonSettings, PhotonUse};
use super::sppm::{FIRST_RADIUS, progressive};
use super::{LastMaps, PhotonMapStore, RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::findings::Decision::LeftOut;
use crate::findings::{Finding, Findings};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::photon::{Kernel, PhotonMap};
use crate::scene::Scene;
use crate::transport::photon_mapping::deposit::{
    PATHS_PER_TASK, PhotonFilter, PhotonTracer, PhotonTracerSettings, VERTICES_PER_TASK,
};
use crate::transport::photon_mapping::final_gather::{
    GlobalMapLookup, IRRADIANCES, PhotonMaps, PrecomputedIrradiance, STRIDE, may_have_caustics,
};
use crate::transport::{PathIntegrator, PathSettings, RadiusSchedule, path::WAVE};

/// Samples that share two sets of maps: enough that maps are the smaller part of the work.
const GROUP: u32 = 8;

/// Pixels of the picture for each light path of a map.
const PIXELS_PER_PATH: usize = 2;

/// Limits of the tasks of a map whose number follows from the picture.
const FEWEST: usize = 16;
const MOST: usize = 1024;

/// Largest radius of a disc of the global map, in diagonals of the scene.
const FARTHEST: f32 = 0.03;

/// Makes the random numbers of caustic maps others than those of global maps.
const CAUSTIC_SEED: u32 = 0x6361_7573;

/// Photon mapping of one picture.
pub struct PhotonMapping<'a, F> {
    context: RenderContext<'a>,
    integrator: PathIntegrator<'a, F>,
    global: Photons<'a>,
    /// `None` where nothing in the scene makes caustics.
    caustic: Option<Photons<'a>>,
    /// Largest radius of a disc of the global map.
    farthest: f32,
    /// Radii of one pixel.
    radii: RadiusSchedule,
    kernel: Kernel,
    /// Maps of even and of odd samples.
    halves: [Maps<'a>; 2],
    used: PhotonUse,
}

/// The photons of maps of one kind.
struct Photons<'m> {
    guide: EmissionGuide<'m>,
    settings: PhotonTracerSettings,
}

/// The maps of one half of the film.
struct Maps<'m> {
    global: PhotonMapStore<'m>,
    irradiances: PhotonMapStore<'m>,
    caustic: PhotonMapStore<'m>,
    /// The number of these maps; `None` while one is missing.
    number: Option<u32>,
}

/// Complete maps of one half.
struct Built<'m> {
    global: PhotonMap<'m>,
    irradiances: PhotonMap<'m>,
    caustic: Option<PhotonMap<'m>>,
}

/// Capacities of the maps of one half, for tasks of global and caustic light paths.
fn capacities(global: usize, caustic: usize) -> [usize; 3] {
    let global = global.saturating_mul(VERTICES_PER_TASK);
    [global, global / STRIDE, caustic.saturating_mul(PATHS_PER_TASK)]
}

impl<'m> Maps<'m> {
    fn footprint(global: usize, caustic: usize) -> Footprint {
        let [global, irradiances, caustic] = capacities(global, caustic).map(PhotonMapStore::footprint);
        global.and(irradiances).and(caustic)
    }

    fn new(global: usize, caustic: usize, memory: &mut impl MemorySource<'m>) -> Result<Self, OutOfMemory> {
        let [global, irradiances, caustic] = capacities(global, caustic);
        Ok(Self {
            global: PhotonMapStore::new(global, memory)?,
            irradiances: PhotonMapStore::new(irradiances, memory)?,
            caustic: PhotonMapStore::new(caustic, memory)?,
            number: None,
        })
    }

    fn built(&mut self) -> Result<Option<Built<'_>>, OutOfMemory> {
        let Self { global, irradiances, caustic, number } = self;
        let (Some(_), Some(global), Some(irradiances)) = (number, global.map()?, irradiances.map()?) else {
            return Ok(None);
        };
        Ok(Some(Built { global, irradiances, caustic: caustic.map()? }))
    }
}

impl<'a, F: Features> PhotonMapping<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        let photons = PhotonTracer::<F>::scratch().or(PrecomputedIrradiance::scratch());
        PathIntegrator::<F>::scratch(WAVE).or(photons)
    }

    /// Tasks of light paths of a global and of a caustic map, for a picture of so many pixels.
    fn tasks(pixels: usize, has_caustics: bool, settings: &PhotonSettings) -> [usize; 2] {
        let usual = (pixels / PIXELS_PER_PATH).div_ceil(PATHS_PER_TASK).clamp(FEWEST, MOST);
        let tasks = |asked: Option<u32>| {
            asked.map_or(usual, |paths| (paths as usize).div_ceil(PATHS_PER_TASK).max(1))
        };
        [tasks(settings.global), if has_caustics { tasks(settings.caustic) } else { 0 }]
    }

    /// Memory of the maps of both halves, for a picture of so many pixels of `scene`.
    pub(super) fn footprint(scene: &Scene, pixels: usize, settings: &PhotonSettings) -> Footprint {
        let [global, caustic] = Self::tasks(pixels, may_have_caustics(scene), settings);
        let half = Maps::footprint(global, caustic);
        half.and(half)
    }

    /// Photon mapping of `context`. Maps are as large as `memory` allows, of which `reserve` bytes stay free.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small for the smallest maps, or the executor's scratch
    /// for a task.
    pub fn new(
        context: &RenderContext<'a>,
        settings: PhotonSettings,
        reserve: usize,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let farthest = FARTHEST * context.bvh.bounds().diagonal();
        let has_caustics = may_have_caustics(context.scene);
        let least = reserve.saturating_add(2 * Maps::footprint(1, 1).bytes());
        let mut learn = |filter, max_depth, target| {
            let settings = GuideSettings { filter, max_depth, target, reserve: least };
            EmissionGuide::learn::<F>(context, settings, memory, executor)
        };
        let PathSettings { seed, max_depth, .. } = context.settings;
        // One segment more is to come: that of the gather ray.
        let shortened = if context.settings.is_limited() { max_depth - 1 } else { max_depth };
        let of_global = learn(PhotonFilter::All, shortened, Target::Gathered(farthest))?;
        let seen = Target::Visible(FIRST_RADIUS as f32);
        let of_caustics = has_caustics.then(|| learn(PhotonFilter::Caustic, max_depth, seen)).transpose()?;

        let wanted = Self::tasks(context.pixels(), has_caustics, &settings);
        // If memory is short, both maps get the same fraction of their footprints.
        let available = memory.available().saturating_sub(reserve) / 2;
        let share = (available as f64 / Maps::footprint(wanted[0], wanted[1]).bytes() as f64).min(1.0);
        let [global, caustic] =
            wanted.map(|tasks| ((share * tasks as f64) as usize).max(usize::from(tasks > 0)));
        let used = PhotonUse {
            global: Some(of_global.map_use(wanted[0], global)),
            caustic: of_caustics.as_ref().map(|guide| guide.map_use(wanted[1], caustic)),
            ..PhotonUse::default()
        };
        let photons = |guide, keep, seed, tasks: usize, max_depth| {
            let paths = u32::try_from(tasks.saturating_mul(PATHS_PER_TASK)).unwrap_or(u32::MAX);
            Photons { guide, settings: PhotonTracerSettings { keep, seed, paths, max_depth } }
        };
        let caustic_photons =
            |guide| photons(guide, PhotonFilter::Caustic, seed ^ CAUSTIC_SEED, caustic, max_depth);
        Ok(Self {
            context: *context,
            integrator: context.integrator(),
            global: photons(of_global, PhotonFilter::All, seed, global, shortened),
            caustic: of_caustics.map(caustic_photons),
            farthest,
            radii: context.radii(),
            kernel: settings.kernel,
            halves: [Maps::new(global, caustic, memory)?, Maps::new(global, caustic, memory)?],
            used,
        })
    }

    /// Its maps so far.
    pub fn photons(&self) -> PhotonUse {
        self.used
    }

    /// The first pass: the maps of number `number`, unless they are there. Returns whether they are complete.
    fn make_maps<E: Executor>(
        &mut self,
        half: usize,
        number: u32,
        round: &mut Round<E>,
    ) -> Result<bool, OutOfMemory> {
        let Self { context, global, caustic, farthest, kernel, halves, used, .. } = self;
        let RenderContext { scene, ref bvh, ref lights, level, .. } = *context;
        let Some(maps) = halves.get_mut(half) else { return Ok(false) };
        if maps.number == Some(number) {
            return Ok(true);
        }
        maps.number = None;
        let kinds = [(Some(&*global), &mut maps.global), (caustic.as_ref(), &mut maps.caustic)];
        for (photons, store) in kinds {
            let Some(Photons { guide, settings }) = photons else { continue };
            let tracer = PhotonTracer::<F>::new(scene, bvh, lights, &guide.emission, *settings, level);
            let passed = store.trace(round.executor, &tracer, number)?;
            if !round.count(passed) {
                return Ok(false);
            }
        }
        let Some(map) = maps.global.map()? else { return Ok(false) };
        let all = PrecomputedIrradiance::new(bvh, &map, *farthest, *kernel, level);
        let [_, count, _] = capacities(global.settings.paths as usize / PATHS_PER_TASK, 0);
        let size = (count, IRRADIANCES);
        let irradiances = &mut maps.irradiances;
        let passed = round.executor.timed("photons", |executor| {
            irradiances.fill(executor, size, |task, scratch, out| all.run(task, scratch, out))
        })?;
        if !round.count(passed) {
            return Ok(false);
        }
        used.maps += 1;
        used.irradiances += all.count() as u64;
        if let Some(used) = &mut used.global {
            used.add(global.settings.paths as usize, map.len());
        }
        if let (Some(used), Some(photons), Some(map)) = (&mut used.caustic, caustic, maps.caustic.map()?) {
            used.add(photons.settings.paths as usize, map.len());
        }
        maps.number = Some(number);
        Ok(true)
    }
}

impl<F: Features> RenderMethod for PhotonMapping<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            let group = sample / GROUP;
            if !self.make_maps(0, 2 * group, round)? || !self.make_maps(1, 2 * group + 1, round)? {
                break;
            }
            let [even, odd] = &mut self.halves;
            let (Some(even), Some(odd)) = (even.built()?, odd.built()?) else { break };
            let Self { farthest, radii, kernel, .. } = *self;
            let maps = [&even, &odd].map(|Built { global, irradiances, caustic }| PhotonMaps {
                global: GlobalMapLookup::new(global, irradiances, farthest, kernel),
                caustic: caustic
                    .as_ref()
                    .map(|map| progressive(map, radii, group).with_kernel(kernel).of_caustics()),
            });
            let integrator = self.integrator.with_maps(&maps);
            round.tiles((group + 1) * GROUP, |tile, samples, scratch, pixels| {
                integrator.run(tile, samples, WAVE, scratch, pixels)
            })?;
        }
        Ok(())
    }

    fn findings(&self) -> Findings {
        let caustic = self
            .used
            .caustic
            .map_or(Finding::new("caustic_photons", LeftOut, "no surface is specular enough"), |map| {
                map.finding("caustic_photons")
            });
        self.used.findings().and([caustic])
    }

    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        // Those of odd samples are made last.
        let [even, odd] = &mut self.halves;
        let last = if odd.number.is_some() { odd } else { even };
        let built = last.built()?;
        Ok(built.map_or_else(LastMaps::default, |Built { global, caustic, .. }| LastMaps {
            global: Some(global),
            caustic,
        }))
    }
}
