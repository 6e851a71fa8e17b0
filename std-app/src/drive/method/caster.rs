//! Photons of caustics for a picture: which light is looked for (`Caster::new`), and the maps of it. Photons are shot anew for
//! every few samples, into two maps, of even and of odd ones, so that the halves of the film stay independent; and discs
//! shrink from one to the next as those of progressive photon mapping do, so that the blur vanishes.

use super::Stage;
use super::photon_view::{self, PhotonView};
use super::photons::{MapUse, PhotonUse};
use super::sppm::shrunk;
use crate::drive::RenderError;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use halflight_core::bsdf::Features;
use halflight_core::light::Emission;
use halflight_core::memory::{Arena, Line};
use halflight_core::photon::{MapShape, PhotonMap, Photons};
use halflight_core::transport::caustics::{CausticShooter, PATHS, ROOM};
use halflight_core::transport::shoot::{Keep, ShootSettings};
use halflight_core::transport::{Discs, Merging, PathTracer, path::WAVE};
use std::time::Instant;

/// Radius of the discs of the first sample, in pixels.
pub(super) const FIRST_RADIUS: f64 = 1.0;

/// Light paths of a map for each pixel of the picture and each sample that the map serves, but no fewer and no more
/// than these.
const PATHS_PER_SAMPLE: f64 = 0.5;
const FEWEST_PATHS: usize = 16 * PATHS;
const MOST_PATHS: usize = 4096 * PATHS;

/// Samples that share their photons, even ones and odd ones apart, at most: less would not fill the waves of a tile.
const MOST_SAMPLES: u32 = 8;

/// Radius of the discs where rays gather for records, in pixels: they see the mean of what these blur.
const RECORD_RADIUS: f32 = 3.0;

/// Their maps have one in so many of the light paths of a picture's, and numbers that no picture's has.
const RECORD_PART: usize = 4;
const RECORD_MAP: u32 = 1 << 30;

/// See the file.
pub(super) struct Caster<'a> {
    stage: Stage<'a>,
    /// Of one pixel.
    discs: Discs,
    emission: Emission<'a>,
    is_beside: bool,
    /// Of even and of odd samples.
    photons: [Vec<Line>; 2],
    /// Light paths of a map for each sample that it serves, as far as there is memory.
    each: usize,
    pub(super) used: PhotonUse,
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

/// A map of photons for rays that gather.
pub(super) struct ForRecords<'m> {
    map: PhotonMap<'m>,
    emission: &'m Emission<'m>,
    discs: Discs,
    paths: u32,
}

impl ForRecords<'_> {
    pub(super) fn merging(&self) -> Merging<'_> {
        Merging::new([&self.map; 2], self.emission, self.discs, self.paths).beside_records()
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
    /// Of photons that go by `emission`, which have half of the memory at most where they are beside records. `others` is what
    /// is to be left of it.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory,
        (emission, discs): (Emission<'a>, Discs),
        is_beside: bool,
        others: usize,
    ) -> Result<Self, RenderError> {
        let Stage { settings, .. } = *stage;
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let each = ((PATHS_PER_SAMPLE * pixels) as usize).clamp(FEWEST_PATHS, MOST_PATHS);
        let wanted = (each * (MOST_SAMPLES / 2) as usize).min(MOST_PATHS).div_ceil(PATHS);
        let maps = if is_beside { 4 } else { 2 };
        let of_task = Photons::footprint(ROOM).bytes();
        let tasks = wanted.min(memory.available().saturating_sub(others) / maps / of_task).max(1);
        let footprint = Photons::footprint(tasks * ROOM);
        let photons = [memory.take("photons", footprint)?, memory.take("photons", footprint)?];
        let [wanted, given] = [wanted, tasks].map(|tasks| (tasks * PATHS) as u64);
        let map = MapUse { wanted, given, ..MapUse::default() };
        let used = PhotonUse { caustic: Some(map), ..PhotonUse::default() };
        Ok(Self { stage: *stage, discs, emission, is_beside, photons, each, used, kept: None })
    }

    /// Brings the tiles of `crew` to their targets by `tracer`, joined with photons; less where the round is cut.
    pub(super) fn round<F: Features>(
        &mut self,
        tracer: &PathTracer<F>,
        scratch: &mut [Vec<Line>],
        crew: &mut Crew,
    ) -> Result<(), RenderError> {
        let Self { stage, discs, emission, is_beside, photons, each, used, kept } = self;
        let workers = stage.workers;
        while let Some(sample) = crew.next_in_mean() {
            let block = Block::of(sample);
            let most = used.caustic.map_or(0, |map| map.given as usize);
            let light_paths = (*each * block.samples() as usize).min(most);
            let from = (*discs, block.first);
            let (shooter, discs) = shooter::<F>(stage, emission, light_paths, from, *is_beside);
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
            let tracer = tracer.with_caustics(if *is_beside { merging.beside_records() } else { merging });
            crew.tiles_in_mean(block.end, scratch, &|task, samples, arena, pixels| {
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
        let Self { stage, discs, emission, photons, used, kept, .. } = self;
        *kept = None;
        let start = Instant::now();
        let paths = used.caustic.map_or(0, |map| map.given as usize).div_ceil(RECORD_PART);
        let from = (discs.of_pixels(RECORD_RADIUS), 0);
        let (shooter, discs) = shooter::<F>(stage, emission, paths, from, true);
        let room = shooter.tasks() * ROOM;
        let lines = &mut photons[half as usize & 1];
        let mut map = Photons::new(room, &mut Arena::new(bytemuck::cast_slice_mut(lines)))?;
        let number = RECORD_MAP + half;
        let shoot = |task: usize, arena: &mut Arena, out: &mut [_]| shooter.run(task, number, arena, out);
        if !crew.pass(map.as_mut_slice(), ROOM, scratch, &shoot)? {
            return Ok(None);
        }
        let map = stage.workers.build_photons(map, room);
        used.maps += 1;
        if let Some(used) = &mut used.caustic {
            used.shot += paths as u64;
            used.stored += map.len() as u64;
        }
        used.seconds += start.elapsed().as_secs_f64();
        Ok(Some(ForRecords { map, emission, discs, paths: paths as u32 }))
    }

    /// The last maps, as the camera sees them.
    pub(super) fn view<F: Features>(&mut self) -> Result<Option<PhotonView>, RenderError> {
        // The odd ones are the last that were made.
        let (Some(Kept { room, shapes, .. }), [_, odd]) = (self.kept, &mut self.photons) else {
            return Ok(None);
        };
        let map = PhotonMap::again(&shapes[1], room, &mut Arena::new(bytemuck::cast_slice_mut(odd)))?;
        Ok(Some(photon_view::look::<F>(&self.stage, None, Some(&map))?))
    }
}

/// A shooter of `paths` photons by `emission`, for what is left of `discs` at `sample`; of those beside records, if so.
pub(super) fn shooter<'a, F: Features>(
    stage: &Stage<'a>,
    emission: &'a Emission<'a>,
    paths: usize,
    (discs, sample): (Discs, u32),
    is_beside: bool,
) -> (CausticShooter<'a, F>, Discs) {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let pixels = FIRST_RADIUS * shrunk(sample / 2).sqrt();
    let discs = discs.of_pixels(pixels as f32);
    let max_depth = path_settings(settings).max_depth;
    let shot = ShootSettings { keep: Keep::Caustic, seed: settings.seed, paths: paths as u32, max_depth };
    let frame = (discs, [settings.width, settings.height]);
    let shooter = CausticShooter::new((scene, bvh, lights), emission, shot, frame, settings.level);
    (if is_beside { shooter.beside_records() } else { shooter }, discs)
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
