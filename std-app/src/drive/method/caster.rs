//! Photons of caustics for a picture: which light is looked for (`Caster::new`), and the maps of it. Photons are shot anew for
//! every few samples, into two maps, of even and of odd ones, so that the halves of the film stay independent; and discs
//! shrink from one to the next as those of progressive photon mapping do, so that the blur vanishes.

use super::caustic_look::Alone;
use super::photon_view::{self, PhotonView};
use super::{Borrower, Stage};
use crate::drive::RenderError;
use crate::drive::crew::{Crew, Task};
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::workers::Workers;
use halflight_core::bsdf::Features;
use halflight_core::light::EmissionSampler;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::method::{MapUse, PhotonUse};
use halflight_core::photon::{MapShape, Photon, PhotonMap, Photons};
use halflight_core::transport::caustics::tracer::{CausticPhotonTracer, PATHS, ROOM};
use halflight_core::transport::path::WAVE;
use halflight_core::transport::photon_mapping::deposit::{PhotonFilter, PhotonTracerSettings};
use halflight_core::transport::{CausticMerging, Estimator, PathIntegrator, RadiusSchedule, Sharing};
use std::time::Instant;

/// Radius of the discs of the first sample, in pixels, where photons are not what is noisy.
pub(super) const FIRST_RADIUS: f64 = 1.0;

/// Light paths of a map for each pixel of the picture and each sample that the map serves, there, but no fewer and no more
/// than these.
const PATHS_PER_SAMPLE: f64 = 0.5;
const FEWEST_PATHS: usize = 16 * PATHS;
const MOST_PATHS: usize = 4096 * PATHS;

/// Samples that share their photons, even ones and odd ones apart, at most: less would not fill the waves of a tile.
pub(super) const MOST_SAMPLES: u32 = 8;

/// Radius of the discs where rays gather for records, in pixels: they see the mean of what these blur.
const RECORD_RADIUS: f32 = 3.0;

/// Their maps have one in so many of the light paths of a picture's, and numbers that no picture's has.
const RECORD_PART: usize = 4;
const RECORD_MAP: u32 = 1 << 30;

/// How photons are to be shot.
pub(super) struct Cast<'a> {
    pub(super) emission: EmissionSampler<'a>,
    /// Of one pixel.
    pub(super) discs: RadiusSchedule,
    /// So many times the light paths, for discs so many times as wide.
    pub(super) plenty: f64,
    /// What paths leave without photons.
    pub(super) alone: Alone,
}

/// See the file.
pub(super) struct Caster<'a> {
    stage: Stage<'a>,
    cast: Cast<'a>,
    beside_records: bool,
    /// Of even and of odd samples.
    photons: [Vec<Line>; 2],
    /// Light paths of a map for each sample that it serves, as far as there is memory.
    each: usize,
    pub(super) used: PhotonUse,
    /// The maps that are in the photons' memory.
    kept: Option<Kept>,
}

/// Maps that were made.
struct Kept {
    block: Block,
    /// Photons that there is room for in each.
    room: usize,
    shapes: [MapShape; 2],
    /// What they were shot for.
    discs: RadiusSchedule,
    paths: u32,
}

impl Kept {
    /// They, from the memory that they are in.
    fn maps<'m>(&self, photons: [&'m mut Vec<Line>; 2]) -> Result<[PhotonMap<'m>; 2], OutOfMemory> {
        let [even, odd] = photons;
        let again = |shape, lines: &'m mut Vec<Line>| {
            PhotonMap::again(shape, self.room, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
        };
        Ok([again(&self.shapes[0], even)?, again(&self.shapes[1], odd)?])
    }
}

/// A map of photons for rays that gather.
pub(super) struct ForRecords<'m> {
    map: PhotonMap<'m>,
    emission: &'m EmissionSampler<'m>,
    discs: RadiusSchedule,
    paths: u32,
}

impl ForRecords<'_> {
    pub(super) fn merging(&self) -> CausticMerging<'_> {
        CausticMerging::new([&self.map; 2], self.emission, self.discs, self.paths).beside_records(true)
    }
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

impl<'a> Caster<'a> {
    /// Of photons as `cast` has them. `others` is what is to be left of the memory; beside records so is half of the rest.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory,
        cast: Cast<'a>,
        beside_records: bool,
        others: usize,
    ) -> Result<Self, RenderError> {
        let Stage { settings, .. } = *stage;
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let each = ((cast.plenty * PATHS_PER_SAMPLE * pixels) as usize).clamp(FEWEST_PATHS, MOST_PATHS);
        let wanted = (each * (MOST_SAMPLES / 2) as usize).min(MOST_PATHS).div_ceil(PATHS);
        let maps = if beside_records { 4 } else { 2 };
        let of_task = Photons::footprint(ROOM).bytes();
        let tasks = wanted.min(memory.available().saturating_sub(others) / maps / of_task).max(1);
        let footprint = Photons::footprint(tasks * ROOM);
        let photons = [memory.take("photons", footprint)?, memory.take("photons", footprint)?];
        let used = PhotonUse { caustic: Some(MapUse::of_tasks(wanted, tasks)), ..PhotonUse::default() };
        Ok(Self { stage: *stage, cast, beside_records, photons, each, used, kept: None })
    }

    /// Whether `tracer` leaves less variance for its work with the photons of the first samples than paths do `alone`.
    pub(super) fn pays<F: Features>(
        &mut self,
        (tracer, shared): (&PathIntegrator<F>, bool),
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let Self { stage, cast, beside_records, photons, each, used, kept } = self;
        let Cast { emission, discs, plenty, alone } = cast;
        let most = used.caustic.map_or(0, |map| map.given as usize);
        let (block, light_paths) = (Block::of(0), (*each).min(most));
        let from = (discs.of_pixels(*plenty as f32), block.first);
        let (shooter, discs) = shooter::<F>(stage, emission, light_paths, from, *beside_records);
        let [even, odd] = &mut *photons;
        let mut rays = 0;
        let pass: Pass = &mut |photons, scratch, run| {
            let (counters, done) = stage.workers.pass(photons, ROOM, scratch, &|| false, run)?;
            rays += counters.rays;
            Ok(done)
        };
        let workers = stage.workers;
        let Some(even) = shoot(&shooter, block.first, even, scratch, (pass, workers), used)? else {
            return Ok(false);
        };
        let Some(odd) = shoot(&shooter, block.first + 1, odd, scratch, (pass, workers), used)? else {
            return Ok(false);
        };
        let (shapes, paths) = ([even.shape(), odd.shape()], light_paths as u32);
        let merging =
            CausticMerging::new([&even, &odd], emission, discs, paths).beside_records(*beside_records);
        let pilot = workers.pilot(&tracer.with_caustics(merging), alone.mean, scratch)?;
        let pixels = f64::from(stage.settings.width) * f64::from(stage.settings.height);
        *kept = Some(Kept { block, room: shooter.tasks() * ROOM, shapes, discs, paths });
        Ok(alone.is_worse_than(&pilot, shared, rays as f64 / (2.0 * pixels)))
    }

    /// Brings the tiles of `crew` to their targets by `tracer`, joined with photons; less where the round is cut.
    pub(super) fn round<F: Features, E: Estimator<F, State = ()>, R: Sharing>(
        &mut self,
        tracer: &PathIntegrator<F, E, R>,
        scratch: &mut [Vec<Line>],
        crew: &mut Crew,
    ) -> Result<(), RenderError> {
        let Self { stage, cast, beside_records, photons, each, used, kept } = self;
        let Cast { emission, discs, plenty, .. } = cast;
        let discs = discs.of_pixels(*plenty as f32);
        while let Some(sample) = crew.next_sample() {
            let block = Block::of(sample);
            let most = used.caustic.map_or(0, |map| map.given as usize);
            let light_paths = (*each * block.samples() as usize).min(most);
            let from = (discs, block.first);
            let (shooter, discs) = shooter::<F>(stage, emission, light_paths, from, *beside_records);
            let room = shooter.tasks() * ROOM;
            let [even, odd] = &mut *photons;
            let maps = match kept {
                Some(kept) if kept.block == block => kept.maps([even, odd])?,
                _ => {
                    *kept = None;
                    let workers = crew.workers;
                    let pass: Pass = &mut |photons, scratch, run| Ok(crew.pass(photons, ROOM, scratch, run)?);
                    let Some(even) = shoot(&shooter, block.first, even, scratch, (pass, workers), used)?
                    else {
                        return Ok(());
                    };
                    let Some(odd) = shoot(&shooter, block.first + 1, odd, scratch, (pass, workers), used)?
                    else {
                        return Ok(());
                    };
                    let (shapes, paths) = ([even.shape(), odd.shape()], light_paths as u32);
                    *kept = Some(Kept { block, room, shapes, discs, paths });
                    [even, odd]
                }
            };
            let merging = CausticMerging::new([&maps[0], &maps[1]], emission, discs, light_paths as u32);
            let tracer = tracer.with_caustics(merging.beside_records(*beside_records));
            crew.tiles(block.end, scratch, &|task, samples, arena, pixels| {
                tracer.run(task, samples, WAVE, arena, pixels)
            })?;
        }
        Ok(())
    }

    /// Photons for rays that gather for cache number 0 or 1; `None` where the round is over.
    pub(super) fn for_records<F: Features>(
        &mut self,
        half: u32,
        scratch: &mut [Vec<Line>],
        crew: &mut Crew,
    ) -> Result<Option<ForRecords<'_>>, RenderError> {
        let Self { stage, cast: Cast { emission, discs, .. }, photons, used, kept, .. } = self;
        *kept = None;
        let paths = used.caustic.map_or(0, |map| map.given as usize).div_ceil(RECORD_PART);
        let from = (discs.of_pixels(RECORD_RADIUS), half);
        let (shooter, discs) = shooter::<F>(stage, emission, paths, from, true);
        let [even, odd] = photons;
        let lines = if half == 0 { even } else { odd };
        let workers = crew.workers;
        let pass: Pass = &mut |photons, scratch, run| Ok(crew.pass(photons, ROOM, scratch, run)?);
        let map = shoot(&shooter, RECORD_MAP + half, lines, scratch, (pass, workers), used)?;
        Ok(map.map(|map| ForRecords { map, emission, discs, paths: paths as u32 }))
    }

    /// Lends `then` the last maps, if there are any.
    pub(super) fn lend(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        let Some(kept) = &self.kept else { return then(None) };
        let maps = kept.maps(self.photons.each_mut())?;
        let merging = CausticMerging::new([&maps[0], &maps[1]], &self.cast.emission, kept.discs, kept.paths);
        then(Some(merging.beside_records(self.beside_records)))
    }

    /// The last maps, as the camera sees them.
    pub(super) fn view<F: Features>(&mut self) -> Result<Option<PhotonView>, RenderError> {
        let Some(kept) = &self.kept else { return Ok(None) };
        // The odd ones are the last that were made.
        let [_, odd] = kept.maps(self.photons.each_mut())?;
        Ok(Some(photon_view::look::<F>(&self.stage, None, Some(&odd))?))
    }
}

/// Runs a task for each [`ROOM`] photons, or less where the round is over; whether all are done.
type Pass<'p> =
    &'p mut dyn FnMut(&mut [Photon], &mut [Vec<Line>], &Task<Photon>) -> Result<bool, RenderError>;

/// Shoots the photons of map `number` into `lines`; `None` where the round is over.
fn shoot<'m, F: Features>(
    shooter: &CausticPhotonTracer<F>,
    number: u32,
    lines: &'m mut [Line],
    scratch: &mut [Vec<Line>],
    (pass, workers): (Pass, &Workers),
    used: &mut PhotonUse,
) -> Result<Option<PhotonMap<'m>>, RenderError> {
    let start = Instant::now();
    let room = shooter.tasks() * ROOM;
    let mut photons = Photons::new(room, &mut Arena::new(bytemuck::cast_slice_mut(lines)))?;
    let run = |task: usize, arena: &mut Arena, out: &mut [_]| shooter.run(task, number, arena, out);
    if !pass(photons.as_mut_slice(), scratch, &run)? {
        return Ok(None);
    }
    let map = workers.build_photons(photons, room);
    used.maps += 1;
    if let Some(used) = &mut used.caustic {
        used.shot += u64::from(shooter.paths());
        used.stored += map.len() as u64;
    }
    workers.spent("photons", start.elapsed().as_secs_f64());
    Ok(Some(map))
}

/// A shooter of `paths` photons by `emission`, for what is left of `discs` at `sample`; of those beside records, if so.
pub(super) fn shooter<'a, F: Features>(
    stage: &Stage<'a>,
    emission: &'a EmissionSampler<'a>,
    paths: usize,
    (discs, sample): (RadiusSchedule, u32),
    beside_records: bool,
) -> (CausticPhotonTracer<'a, F>, RadiusSchedule) {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let discs = discs.after(FIRST_RADIUS, sample / 2);
    let max_depth = path_settings(settings).max_depth;
    let shot = PhotonTracerSettings {
        keep: PhotonFilter::Caustic,
        seed: settings.seed,
        paths: paths as u32,
        max_depth,
    };
    let frame = (discs, [settings.width, settings.height]);
    let shooter = CausticPhotonTracer::new((scene, bvh, lights), emission, shot, frame, settings.level);
    (shooter.beside_records(beside_records), discs)
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
