//! Stochastic progressive photon mapping (Hachisuka and Jensen 2009), with the radii of Knaus and Zwicker 2011: for each
//! sample of the picture photons are shot anew, paths from the eye end at the first surface with a diffuse part and
//! gather there, and radii shrink from sample to sample such that noise and blur both vanish:
//!
//! r² (i + 1) = r² (i) (i + a) / (i + 1), a = 2/3
//!
//! No pixel keeps anything but its sum, and memory is the same for any number of samples. Even and odd samples count
//! their radii apart, so that the halves of the film are two such pictures of their own.

use super::aiming::{Aim, Wanted};
use super::photon_view::{self, PhotonView};
use super::photons::Drawer;
use super::{Method, Renderer, Stage};
use crate::drive::RenderError;
use crate::drive::audit::Audit;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use halflight_core::bsdf::Features;
use halflight_core::memory::{Arena, Line};
use halflight_core::method::{MapUse, PhotonUse};
use halflight_core::photon::{PhotonMap, Photons};
use halflight_core::transport::photon_mapping::deposit::{
    PATHS, PhotonFilter, PhotonTracer, PhotonTracerSettings, ROOM,
};
use halflight_core::transport::{PathIntegrator, PhotonLight, RadiusSchedule, path::WAVE};
use std::time::Instant;

/// Radius of the discs of the first sample, in pixels.
pub(super) const FIRST_RADIUS: f64 = 3.0;

/// Photons that a disc of the first sample needs, if they lie evenly: where they crowd, it is smaller.
const ENOUGH: f64 = 12.0;

/// Light paths for a sample: one for each pixel of the picture, but no fewer and no more than these.
const FEWEST_PATHS: usize = 16 * PATHS;
const MOST_PATHS: usize = 1024 * PATHS;

/// See the file.
pub(super) struct ProgressivePhotons<'a, F> {
    stage: Stage<'a>,
    tracer: PathIntegrator<'a, F>,
    discs: RadiusSchedule,
    paths: usize,
    used: PhotonUse,
    photons: Drawer,
    /// The sample that they are of.
    sample: Option<u32>,
    aim: Aim<'a>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> ProgressivePhotons<'a, F> {
    /// What it knows of lights is kept in `lamps`.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory,
        lamps: &'a mut Vec<Line>,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let scratch = PathIntegrator::<F>::scratch(WAVE).or(PhotonTracer::<F>::scratch());
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let pixels = settings.width as usize * settings.height as usize;
        let usual = pixels.clamp(FEWEST_PATHS, MOST_PATHS);
        let wanted = settings.photons.global.map_or(usual, |paths| paths as usize).div_ceil(PATHS).max(1);
        let of_task = Photons::footprint(ROOM).bytes();
        let others = Audit::bytes::<F>(stage, Method::ProgressivePhotons.is_biased());
        let look = (PhotonFilter::Reflected, path_settings(settings).max_depth);
        let seen = Wanted::Seen(FIRST_RADIUS as f32);
        let least = others.saturating_add(FEWEST_PATHS / PATHS * of_task);
        let aim = Aim::look_first::<F>(stage, look, seen, &mut scratch, (memory, lamps), least)?;
        let tasks = wanted.min(memory.available().saturating_sub(others) / of_task).max(1);
        let photons = Drawer::new(tasks * ROOM, memory)?;
        let tracer = stage.paths::<F>(settings.seed);
        let (seen, by_power) = (aim.seen, aim.by_power);
        let global = Some(MapUse { seen, by_power, ..MapUse::of_tasks(wanted, tasks) });
        let used = PhotonUse { global, ..PhotonUse::default() };
        Ok(Self {
            stage: *stage,
            tracer,
            discs: stage.discs(),
            paths: tasks * PATHS,
            used,
            photons,
            sample: None,
            aim,
            scratch,
        })
    }
}

impl<F: Features> Renderer for ProgressivePhotons<'_, F> {
    fn chosen(&self) -> Option<Method> {
        Some(Method::ProgressivePhotons)
    }

    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { stage, tracer, discs, paths, used, photons, sample: shot_for, aim, scratch } = self;
        let Stage { scene, bvh, lights, settings, .. } = *stage;
        let emission = &aim.emission;
        let shot = PhotonTracerSettings {
            keep: PhotonFilter::Reflected,
            seed: settings.seed,
            paths: *paths as u32,
            max_depth: path_settings(settings).max_depth,
        };
        let shooter = PhotonTracer::<F>::new(scene, bvh, lights, emission, shot, settings.level);
        while let Some(sample) = crew.next_sample() {
            // A round that was cut in the middle of a sample has left its photons.
            if *shot_for != Some(sample) {
                let start = Instant::now();
                *shot_for = None;
                let shoot =
                    |task: usize, arena: &mut Arena, out: &mut [_]| shooter.run(task, sample, arena, out);
                if !photons.fill(ROOM, crew, scratch, &shoot)? {
                    return Ok(());
                }
                *shot_for = Some(sample);
                used.maps += 1;
                if let Some(used) = &mut used.global {
                    used.shot += *paths as u64;
                    used.stored += photons.map()?.map_or(0, |map| map.len()) as u64;
                }
                stage.workers.spent("photons", start.elapsed().as_secs_f64());
            }
            let Some(map) = photons.map()? else { return Ok(()) };
            let light = progressive(&map, *discs, sample / 2);
            let tracer = tracer.with_photons(light.with_kernel(settings.photons.kernel));
            crew.tiles(sample + 1, scratch, &|task, samples, arena, pixels| {
                tracer.run(task, samples, WAVE, arena, pixels)
            })?;
        }
        Ok(())
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        let Some(map) = self.photons.map()? else { return Ok(None) };
        Ok(Some(photon_view::look::<F>(&self.stage, Some(&map), None)?))
    }

    fn photons(&self) -> Option<PhotonUse> {
        Some(self.used)
    }
}

/// The light of `map` from discs of one pixel, made as large as they are after `samples`.
pub(super) fn progressive<'a>(
    map: &'a PhotonMap<'a>,
    discs: RadiusSchedule,
    samples: u32,
) -> PhotonLight<'a> {
    let enough = ENOUGH * RadiusSchedule::shrinkage(samples);
    PhotonLight::new(map, discs.after(FIRST_RADIUS, samples)).with_enough(enough as f32)
}
