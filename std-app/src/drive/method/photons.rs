//! Photon maps of one scene: how many photons there is memory for, how they are shot and built on all threads, and what
//! became of them.

use super::Stage;
use super::aiming::{Aim, Wanted};
use super::photon_view::{self, PhotonView};
use super::sppm::{FIRST_RADIUS, progressive};
use crate::drive::crew::{Crew, Task};
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::workers::Workers;
use crate::drive::{RenderError, Settings};
use halflight_core::bsdf::Features;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::method::{MapUse, PhotonUse};
use halflight_core::photon::{Kernel, MapShape, Photon, PhotonMap, Photons};
use halflight_core::transport::photon_mapping::deposit::{
    PATHS, PhotonFilter, PhotonTracer, PhotonTracerSettings, ROOM,
};
use halflight_core::transport::photon_mapping::final_gather::{
    GlobalMapLookup, IRRADIANCES, PhotonMaps, PrecomputedIrradiance, STRIDE, may_have_caustics,
};
use halflight_core::transport::{PathIntegrator, RadiusSchedule};
use std::time::Instant;

/// How photons are used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonSettings {
    /// How the weight of a photon falls with its distance.
    pub kernel: Kernel,
    /// Light paths of a map of all photons; `None`: by the number of pixels.
    pub global: Option<u32>,
    /// Light paths of a map of caustics; `None`: by the number of pixels.
    pub caustic: Option<u32>,
}

/// Pixels of the picture for each light path of a map.
const PIXELS_PER_PATH: usize = 2;

/// Tasks of a map, at least and at most, where their number follows from the picture.
const FEWEST: usize = 16;
const MOST: usize = 1024;

/// Largest radius of a disc of the global map, in diagonals of the scene.
const FARTHEST: f32 = 0.03;

/// Other random numbers for maps of caustics.
const CAUSTIC_SEED: u32 = 0x6361_7573;

/// Memory of what a [`Laboratory`] knows of lights.
pub(super) type Lamps = [Vec<Line>; 2];

/// Shoots photons and builds maps.
pub(super) struct Laboratory<'a> {
    stage: Stage<'a>,
    discs: RadiusSchedule,
    aim: Aim<'a>,
    /// For maps of caustics, where there are any.
    caustics: Option<Aim<'a>>,
    global: usize,
    caustic: usize,
    pub(super) used: PhotonUse,
}

/// The maps of one half of the film, and their memory.
#[derive(Default)]
pub(super) struct Shelf {
    global: Drawer,
    irradiances: Drawer,
    caustic: Drawer,
    /// Which maps they are.
    number: Option<u32>,
}

/// One map and its memory.
#[derive(Default)]
pub(super) struct Drawer {
    lines: Vec<Line>,
    capacity: usize,
    shape: Option<MapShape>,
}

impl Drawer {
    pub(super) fn new(capacity: usize, memory: &mut Memory) -> Result<Self, RenderError> {
        Self::of("photons", capacity, memory)
    }

    /// In memory of that name.
    pub(super) fn of(
        structure: &'static str,
        capacity: usize,
        memory: &mut Memory,
    ) -> Result<Self, RenderError> {
        let lines = memory.take(structure, Photons::footprint(capacity))?;
        Ok(Self { lines, capacity, shape: None })
    }

    pub(super) fn fill(
        &mut self,
        size: usize,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
        task: &Task<Photon>,
    ) -> Result<bool, RenderError> {
        let workers = crew.workers;
        self.fill_with(workers, |photons| Ok(crew.pass(photons, size, scratch, task)?))
    }

    /// Lets `shoot` write the photons, all of them, and builds the map, unless it says that it was not done.
    pub(super) fn fill_with(
        &mut self,
        workers: &Workers,
        shoot: impl FnOnce(&mut [Photon]) -> Result<bool, RenderError>,
    ) -> Result<bool, RenderError> {
        let capacity = self.capacity;
        let mut photons = Photons::new(capacity, &mut Arena::new(bytemuck::cast_slice_mut(&mut self.lines)))?;
        if !shoot(photons.as_mut_slice())? {
            return Ok(false);
        }
        self.shape = Some(workers.build_photons(photons, capacity).shape());
        Ok(true)
    }

    pub(super) fn map(&mut self) -> Result<Option<PhotonMap<'_>>, RenderError> {
        let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut self.lines));
        Ok(self.shape.map(|shape| PhotonMap::again(&shape, self.capacity, &mut arena)).transpose()?)
    }
}

/// The maps of one half of the film.
pub(super) struct Built<'m> {
    global: PhotonMap<'m>,
    irradiances: PhotonMap<'m>,
    caustic: Option<PhotonMap<'m>>,
}

/// Bytes of the maps of one half.
fn bytes(global: usize, caustic: usize) -> usize {
    let irradiances = Photons::footprint(global * ROOM / STRIDE).bytes();
    let both = Photons::footprint(global * ROOM).bytes().saturating_add(irradiances);
    both.saturating_add(Photons::footprint(caustic * PATHS).bytes())
}

impl<'a> Laboratory<'a> {
    /// For maps of all photons of the scene, and of caustics if there may be any; and the memory for both halves, of which
    /// so many `others` bytes are left free.
    pub(super) fn new<F: Features>(
        stage: &Stage<'a>,
        scratch: &mut [Vec<Line>],
        (memory, lamps): (&mut Memory, &'a mut Lamps),
        others: usize,
    ) -> Result<(Self, [Shelf; 2]), RenderError> {
        let Stage { scene, bvh, settings, .. } = *stage;
        let has_caustics = may_have_caustics(scene);
        let least = others.saturating_add(2 * bytes(1, 1));
        let [all, caustics] = lamps;
        let gathered = Wanted::Gathered(FARTHEST * bvh.bounds().diagonal());
        let of = (PhotonFilter::All, shortened(settings));
        let aim = Aim::look_first::<F>(stage, of, gathered, scratch, (memory, all), least)?;
        let caustics = if has_caustics {
            let of = (PhotonFilter::Caustic, path_settings(settings).max_depth);
            let seen = Wanted::Seen(FIRST_RADIUS as f32);
            Some(Aim::look_first::<F>(stage, of, seen, scratch, (memory, caustics), least)?)
        } else {
            None
        };
        let pixels = settings.width as usize * settings.height as usize;
        let usual = (pixels / PIXELS_PER_PATH).div_ceil(PATHS).clamp(FEWEST, MOST);
        let tasks = |asked: Option<u32>| asked.map_or(usual, |paths| (paths as usize).div_ceil(PATHS).max(1));
        let wanted =
            [tasks(settings.photons.global), if has_caustics { tasks(settings.photons.caustic) } else { 0 }];
        // Where memory is short, both get the same share of what they want.
        let available = memory.available().saturating_sub(others) / 2;
        let share = (available as f64 / bytes(wanted[0], wanted[1]) as f64).min(1.0);
        let [global, caustic] =
            wanted.map(|tasks| ((share * tasks as f64) as usize).max(usize::from(tasks > 0)));
        let shelf = |memory: &mut Memory| -> Result<Shelf, RenderError> {
            Ok(Shelf {
                global: Drawer::new(global * ROOM, memory)?,
                irradiances: Drawer::new(global * ROOM / STRIDE, memory)?,
                caustic: Drawer::new(caustic * PATHS, memory)?,
                number: None,
            })
        };
        let shelves = [shelf(memory)?, shelf(memory)?];
        let used = |aim: &Aim, wanted: usize, given: usize| MapUse {
            seen: aim.seen,
            by_power: aim.by_power,
            ..MapUse::of_tasks(wanted, given)
        };
        let used = PhotonUse {
            global: Some(used(&aim, wanted[0], global)),
            caustic: caustics.as_ref().map(|aim| used(aim, wanted[1], caustic)),
            ..PhotonUse::default()
        };
        Ok((Self { stage: *stage, discs: stage.discs(), aim, caustics, global, caustic, used }, shelves))
    }

    /// Working memory of each thread.
    pub(super) fn scratch<F: Features>() -> Footprint {
        PhotonTracer::<F>::scratch().or(PrecomputedIrradiance::scratch())
    }

    /// The maps of number `map`, made where they are not yet on the shelf. `None` where the round is over before they are
    /// done.
    pub(super) fn build<'m, F: Features>(
        &mut self,
        shelf: &'m mut Shelf,
        map: u32,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<Built<'m>>, RenderError> {
        if shelf.number != Some(map) {
            shelf.number = None;
            if !self.fill::<F>(shelf, map, crew, scratch)? {
                return Ok(None);
            }
            shelf.number = Some(map);
        }
        let (Some(global), Some(irradiances)) = (shelf.global.map()?, shelf.irradiances.map()?) else {
            return Ok(None);
        };
        Ok(Some(Built { global, irradiances, caustic: shelf.caustic.map()? }))
    }

    fn fill<F: Features>(
        &mut self,
        shelf: &mut Shelf,
        map: u32,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let Stage { scene, bvh, lights, settings, .. } = self.stage;
        let start = Instant::now();
        let farthest = self.farthest();
        let shot = |keep: PhotonFilter, tasks: usize, seed: u32, max_depth: u32| PhotonTracerSettings {
            keep,
            seed,
            paths: (tasks * PATHS) as u32,
            max_depth,
        };
        let all = shot(PhotonFilter::All, self.global, settings.seed, shortened(settings));
        let (seed, max_depth) = (settings.seed ^ CAUSTIC_SEED, path_settings(settings).max_depth);
        let caustic = shot(PhotonFilter::Caustic, self.caustic, seed, max_depth);
        let shots = [
            (&mut shelf.global, Some(&self.aim), all),
            (&mut shelf.caustic, self.caustics.as_ref(), caustic),
        ];
        for (drawer, aim, shot) in shots {
            let Some(aim) = aim else { continue };
            let shooter = PhotonTracer::<F>::new(scene, bvh, lights, &aim.emission, shot, settings.level);
            let task = |task: usize, arena: &mut Arena, out: &mut [_]| shooter.run(task, map, arena, out);
            if !drawer.fill(shooter.room(), crew, scratch, &task)? {
                return Ok(false);
            }
        }
        let Some(global) = shelf.global.map()? else { return Ok(false) };
        let all = PrecomputedIrradiance::new(bvh, &global, farthest, settings.photons.kernel, settings.level);
        let task = |task: usize, arena: &mut Arena, out: &mut [_]| all.run(task, arena, out);
        if !shelf.irradiances.fill(IRRADIANCES, crew, scratch, &task)? {
            return Ok(false);
        }

        let used = &mut self.used;
        used.maps += 1;
        if let Some(used) = &mut used.global {
            used.shot += (self.global * PATHS) as u64;
            used.stored += global.len() as u64;
        }
        used.irradiances += all.count() as u64;
        if let (Some(used), Some(map)) = (&mut used.caustic, shelf.caustic.map()?) {
            used.shot += (self.caustic * PATHS) as u64;
            used.stored += map.len() as u64;
        }
        self.stage.workers.spent("photons", start.elapsed().as_secs_f64());
        Ok(true)
    }

    /// What the camera sees of the maps of a shelf, where there are any.
    pub(super) fn view<F: Features>(&self, shelf: &mut Shelf) -> Result<Option<PhotonView>, RenderError> {
        let Shelf { global, caustic, .. } = shelf;
        let (Some(global), caustic) = (global.map()?, caustic.map()?) else { return Ok(None) };
        Ok(Some(photon_view::look::<F>(&self.stage, Some(&global), caustic.as_ref())?))
    }

    fn farthest(&self) -> f32 {
        FARTHEST * self.stage.bvh.bounds().diagonal()
    }

    /// What paths see of the maps; caustics in discs as they are after so many maps were `made`.
    pub(super) fn light<'m>(&self, built: &'m Built<'m>, made: u32) -> PhotonMaps<'m> {
        let kernel = self.stage.settings.photons.kernel;
        let global = GlobalMapLookup::new(&built.global, &built.irradiances, self.farthest(), kernel);
        let light = |map| progressive(map, self.discs, made).with_kernel(kernel).of_caustics();
        PhotonMaps { caustic: built.caustic.as_ref().map(light), global }
    }
}

/// Segments of the paths of a global map: one more is to come, that of the gather ray.
fn shortened(settings: &Settings) -> u32 {
    let paths = path_settings(settings);
    if paths.is_limited() { paths.max_depth - 1 } else { paths.max_depth }
}

/// Working memory of a thread that traces paths as well.
pub(super) fn scratch<F: Features>(wave: usize) -> Footprint {
    PathIntegrator::<F>::scratch(wave).or(Laboratory::scratch::<F>())
}
