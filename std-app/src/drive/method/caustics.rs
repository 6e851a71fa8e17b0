//! Path tracing joined with photons of caustics (`halflight_core::transport::caustics`). Photons are shot anew for every
//! few samples, into two maps, of even and of odd ones, so that the halves of the film stay independent; and discs
//! shrink from one to the next as those of progressive photon mapping do, so that the blur vanishes.
//!
//! A first look shoots some photons at all that mirrors or refracts, and learns which of them show in the picture: where
//! that is not worth it (`caustic_look.rs`), the picture is path traced alone, as if photons had never been asked for.
//! Otherwise it is where most of them go from then on.

use super::caustic_look::{Looked, useful};
use super::path::Paths;
use super::photon_view::{self, PhotonView};
use super::photons::{MapUse, PhotonUse};
use super::sppm::{ProgressivePhotons, shrunk};
use super::{Method, Renderer, Stage};
use crate::drive::audit::Audit;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::census::Census;
use halflight_core::light::{Emission, Worth};
use halflight_core::memory::{Arena, Line};
use halflight_core::photon::{MapShape, PhotonMap, Photons};
use halflight_core::transport::caustics::{CausticShooter, Find, PATHS, ROOM};
use halflight_core::transport::shoot::{Keep, ShootSettings};
use halflight_core::transport::{Discs, GLIMPSES, Glimpse, Merging, PathTracer, path::WAVE};
use std::time::Instant;

/// Radius of the discs of the first sample, in pixels.
const FIRST_RADIUS: f64 = 1.0;

/// Light paths of a map for each pixel of the picture and each sample that the map serves, but no fewer and no more
/// than these.
const PATHS_PER_SAMPLE: f64 = 0.5;
const FEWEST_PATHS: usize = 16 * PATHS;
const MOST_PATHS: usize = 4096 * PATHS;

/// Samples that share their photons, even ones and odd ones apart, at most: less would not fill the waves of a tile.
const MOST_SAMPLES: u32 = 8;

/// Light paths of each look.
const LOOK: usize = 32 * PATHS;

/// The share of the picture's light from which on photons may have all of it, where the method is left to us: paths find
/// next to none. But those of `sppm` are not aimed: so many of them must show, to those that are.
const MOST_SHARE: f64 = 0.75;
const LEAST_BY_CHANCE: f64 = 0.25;

/// Whether paths were joined with photons of caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CausticUse {
    /// They were.
    pub used: bool,
    /// About what share of the picture's light photons bring that paths find badly, by a first look; `None` where nobody
    /// looked.
    pub share: Option<f64>,
    /// There was no memory to look for them.
    pub lacks_memory: bool,
}

/// Whether anything could throw a caustic.
pub(super) fn are_possible(stage: &Stage) -> bool {
    let census = Census::of(stage.scene);
    let kinds = &census.surfaces;
    let mirrors = kinds.mirror + kinds.conductor + kinds.glossy + kinds.dielectric + kinds.rough_dielectric;
    stage.settings.caustics && mirrors > 0 && kinds.diffuse + kinds.glossy > 0 && census.has_light()
}

/// Takes the memory, sets the method up, and hands it to `then`.
pub(super) fn with<F: Features, T>(
    stage: &Stage,
    memory: &mut Memory,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let scratch = PathTracer::<F>::scratch(WAVE).or(CausticShooter::<F>::scratch());
    let mut paths = Paths::<F>::with_scratch(stage, memory, scratch)?;
    let guide = Worth::guide_footprint(lights);
    let emission = Emission::footprint(lights).and(guide).and(Worth::footprint(lights)).and(guide).and(guide);
    let of_task = Photons::footprint(ROOM).bytes();
    let others = Audit::bytes::<F>(stage, Method::Path.is_biased());
    // Where memory is short, paths go without.
    if !memory.has((emission.bytes() + 2 * of_task).saturating_add(others)) {
        paths.caustics.lacks_memory = true;
        return then(&mut paths, memory);
    }
    let mut lines = memory.take("emission", emission)?;
    let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
    let plain = Emission::build(scene, lights, &bvh.bounds(), &mut arena)?;
    let discs = stage.discs();
    let is_open = settings.method.is_none() && settings.resume.is_none();
    let mut is_all = false;
    let emission = match Worth::aimed(scene, lights, &plain, &mut arena)? {
        Some(mut worth) => {
            let mut glimpses = vec![Glimpse::default(); GLIMPSES];
            let (seen, frame) = ((scene, bvh, settings.level), [settings.width, settings.height]);
            let found = Glimpse::find::<F>(seen, frame, settings.seed, &mut glimpses);
            let seen = (discs, &glimpses[..found]);
            let aimed = worth.guide(&plain, &mut arena)?;
            for find in look::<F>(stage, &mut paths, &aimed, (seen, 0))? {
                worth.learn(find.cell, find.worth);
            }
            let learned = worth.guide(&plain, &mut arena)?;
            let finds = look::<F>(stage, &mut paths, &learned, (seen, 1))?;
            finds.iter().for_each(|find| worth.learn(find.cell, find.worth));
            let pixels = f64::from(settings.width) * f64::from(settings.height);
            let looked = Looked::new(&finds, FIRST_RADIUS, pixels, f64::from(paths.mean(stage)?));
            drop(finds);
            paths.caustics.share = Some(looked.share);
            if is_open && looked.share >= MOST_SHARE {
                let by_chance = useful(&look::<F>(stage, &mut paths, &plain, (seen, 2))?);
                is_all = by_chance > 0.0 && by_chance >= LEAST_BY_CHANCE * looked.useful;
            }
            looked.pays(stage, &mut paths)?.then(|| worth.guide(&plain, &mut arena)).transpose()?
        }
        None => None,
    };
    if is_all {
        drop((lines, paths));
        ["emission", "paths"].into_iter().for_each(|structure| memory.give_back(structure));
        return then(&mut ProgressivePhotons::<F>::new(stage, memory)?, memory);
    }
    let Some(emission) = emission else {
        drop(lines);
        memory.give_back("emission");
        return then(&mut paths, memory);
    };
    let pixels = f64::from(settings.width) * f64::from(settings.height);
    let each = ((PATHS_PER_SAMPLE * pixels) as usize).clamp(FEWEST_PATHS, MOST_PATHS);
    let wanted = (each * (MOST_SAMPLES / 2) as usize).min(MOST_PATHS).div_ceil(PATHS);
    let tasks = wanted.min(memory.available().saturating_sub(others) / 2 / of_task).max(1);
    let footprint = Photons::footprint(tasks * ROOM);
    let photons = [memory.take("photons", footprint)?, memory.take("photons", footprint)?];
    paths.caustics.used = true;
    let [wanted, given] = [wanted, tasks].map(|tasks| (tasks * PATHS) as u64);
    let map = MapUse { wanted, given, ..MapUse::default() };
    let used = PhotonUse { caustic: Some(map), ..PhotonUse::default() };
    then(&mut Joined { stage: *stage, paths, discs, emission, photons, each, used, kept: None }, memory)
}

/// A shooter of `paths` photons by `emission`, for what is left of `discs` at `sample`.
fn shooter<'a, F: Features>(
    stage: &Stage<'a>,
    emission: &'a Emission<'a>,
    paths: usize,
    (discs, sample): (Discs, u32),
) -> (CausticShooter<'a, F>, Discs) {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let pixels = FIRST_RADIUS * shrunk(sample / 2).sqrt();
    let discs = discs.of_pixels(pixels as f32);
    let max_depth = path_settings(settings).max_depth;
    let shot = ShootSettings { keep: Keep::Caustic, seed: settings.seed, paths: paths as u32, max_depth };
    let frame = (discs, [settings.width, settings.height]);
    (CausticShooter::new((scene, bvh, lights), emission, shot, frame, settings.level), discs)
}

/// What photons of `emission`, those of map `map`, are worth.
fn look<F: Features>(
    stage: &Stage,
    paths: &mut Paths<F>,
    emission: &Emission,
    ((discs, glimpses), map): ((Discs, &[Glimpse]), u32),
) -> Result<Vec<Find>, RenderError> {
    let workers = stage.workers;
    let scratch = &mut paths.scratch;
    let (shooter, _) = shooter::<F>(stage, emission, LOOK, (discs, 0));
    let mut finds = vec![Find::default(); LOOK];
    let shooter = shooter.with_glimpses(glimpses);
    let look = |task: usize, arena: &mut Arena, out: &mut [Find]| shooter.look(task, map, arena, out);
    workers.pass(&mut finds, PATHS, scratch, &|| false, &look)?;
    Ok(finds)
}

/// See the file.
struct Joined<'a, F> {
    stage: Stage<'a>,
    paths: Paths<'a, F>,
    /// Of one pixel.
    discs: Discs,
    emission: Emission<'a>,
    /// Of even and of odd samples.
    photons: [Vec<Line>; 2],
    /// Light paths of a map for each sample that it serves, as far as there is memory.
    each: usize,
    used: PhotonUse,
    /// The maps that are in the photons' memory.
    kept: Option<Kept>,
}

/// Maps that were made.
#[derive(Clone, Copy)]
struct Kept {
    block: Block,
    /// Photons that there is room for in each.
    room: usize,
    shapes: [MapShape; 2],
}

/// Samples that share their photons.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Block {
    first: u32,
    end: u32,
}

impl Block {
    /// The one of `sample`: of 2, 2, 4, and then always [`MOST_SAMPLES`].
    fn of(sample: u32) -> Self {
        let length = match sample {
            0..MOST_SAMPLES => (sample + 1).next_power_of_two().max(4) / 2,
            _ => MOST_SAMPLES,
        };
        let first = sample / length * length;
        Self { first, end: first.saturating_add(length) }
    }

    /// Samples of each map.
    fn samples(&self) -> u32 {
        (self.end - self.first) / 2
    }
}

impl<F: Features> Renderer for Joined<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { stage, paths, discs, emission, photons, each, used, kept } = self;
        let Paths { tracer, scratch, .. } = paths;
        let workers = stage.workers;
        while let Some(sample) = crew.next_in_mean() {
            let block = Block::of(sample);
            let most = used.caustic.map_or(0, |map| map.given as usize);
            let light_paths = (*each * block.samples() as usize).min(most);
            let (shooter, discs) = shooter::<F>(stage, emission, light_paths, (*discs, block.first));
            let room = shooter.tasks() * ROOM;
            let [even, odd] = &mut *photons;
            let maps = match *kept {
                Some(Kept { block: of, shapes, .. }) if of == block => {
                    let again = |shape: &MapShape, lines| {
                        PhotonMap::again(shape, room, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
                    };
                    [again(&shapes[0], even)?, again(&shapes[1], odd)?]
                }
                _ => {
                    *kept = None;
                    let start = Instant::now();
                    let open = |lines| Photons::new(room, &mut Arena::new(bytemuck::cast_slice_mut(lines)));
                    let mut maps = [open(even)?, open(odd)?];
                    for (map, half) in maps.iter_mut().zip(0..) {
                        let shoot = |task: usize, arena: &mut Arena, out: &mut [_]| {
                            shooter.run(task, block.first + half, arena, out)
                        };
                        if !crew.pass(map.as_mut_slice(), ROOM, scratch, &shoot)? {
                            return Ok(());
                        }
                    }
                    let maps = maps.map(|map| workers.build_photons(map, room));
                    *kept = Some(Kept { block, room, shapes: [maps[0].shape(), maps[1].shape()] });
                    used.maps += 2;
                    if let Some(used) = &mut used.caustic {
                        used.shot += 2 * light_paths as u64;
                        used.stored += maps.iter().map(|map| map.len() as u64).sum::<u64>();
                    }
                    used.seconds += start.elapsed().as_secs_f64();
                    maps
                }
            };
            let merging = Merging::new([&maps[0], &maps[1]], emission, discs, light_paths as u32);
            let tracer = tracer.with_caustics(merging);
            crew.tiles_in_mean(block.end, scratch, &|task, samples, arena, pixels| {
                tracer.run(task, samples, WAVE, arena, pixels)
            })?;
        }
        Ok(())
    }

    fn reuse(&self) -> Reuse {
        self.paths.reuse()
    }

    fn caustics(&self) -> CausticUse {
        self.paths.caustics
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        // The odd ones are the last that were made.
        let (Some(Kept { room, shapes, .. }), [_, odd]) = (self.kept, &mut self.photons) else {
            return Ok(None);
        };
        let map = PhotonMap::again(&shapes[1], room, &mut Arena::new(bytemuck::cast_slice_mut(odd)))?;
        Ok(Some(photon_view::look::<F>(&self.stage, None, Some(&map))?))
    }

    fn photons(&self) -> Option<PhotonUse> {
        Some(self.used)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_follow_each_other() {
        let mut next = 0;
        while next < 64 {
            let block = Block::of(next);
            assert!(block.first == next && block.samples() > 0 && block.end <= 8 || block.samples() == 4);
            assert!((block.first..block.end).all(|sample| Block::of(sample) == block), "{block:?}");
            next = block.end;
        }
    }
}
