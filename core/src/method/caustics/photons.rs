//! Caustic photon maps of one picture. Photons are traced anew for every few samples, into one map for the
//! even and one for the odd samples, so that the halves of the film stay independent. Radii shrink from one
//! pair of maps to the next as those of progressive photon mapping do (Knaus and Zwicker 2011), so that the
//! blur vanishes.

use super::benefit::PATHS_PER_SAMPLE;
use super::emission::{CausticEmission, CausticSettings, FIRST_RADIUS, least_footprint, photon_tracer};
use super::receivers::Receivers;
use crate::bsdf::Features;
use crate::light::EmissionSampler;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::executor::{Executor, Passed};
use crate::method::{MapUse, PhotonMapPair, PhotonMapStore, PhotonUse, RenderContext, Round};
use crate::photon::PhotonMap;
use crate::transport::caustics::tracer::{PATHS_PER_TASK, PHOTONS_PER_TASK};
use crate::transport::{CausticMerging, LightEstimator, PathIntegrator, RadiusSchedule, Sharing, path::WAVE};

/// Light paths of a map for each sample that it serves, at least and at most.
const FEWEST_PATHS: usize = 16 * PATHS_PER_TASK;
const MOST_PATHS: usize = 4096 * PATHS_PER_TASK;

/// Fraction of the work of a picture for its first maps, and their number: of the first samples of paths;
/// beside records a pair for samples, one for records of irradiance and one for view-bound records. And rays
/// whose time a light path takes, with its photons in a map.
const FIRST_SHARE: f64 = 0.2;
const FIRST_MAPS: f64 = 4.0;
const FIRST_MAPS_BESIDE_RECORDS: f64 = 6.0;
const RAYS_PER_PATH: f64 = 16.0;

/// Samples that share a pair of maps, at most: fewer would not fill the wavefront of a tile.
const MOST_SAMPLES: u32 = 8;

/// Radius of the discs in which gather rays look for photons, in pixels. Records are means over many rays,
/// and the blur does not show in them.
const RECORD_RADIUS: f32 = 3.0;

/// Maps for records have one in so many of the light paths of a map for the picture, and numbers of their
/// own.
const RECORD_PART: usize = 4;
const RECORD_MAP: u32 = 1 << 30;

/// Caustic photons of one picture.
pub struct CausticPhotons<'a> {
    context: RenderContext<'a>,
    emission: CausticEmission<'a>,
    beside_records: bool,
    stores: PhotonMapPair<'a>,
    /// Light paths of a map for each sample that it serves.
    paths_per_sample: usize,
    /// Light paths of a map that there is memory for.
    most_paths: usize,
    statistics: PhotonUse,
    /// Samples and discs of the last maps; `None` without maps.
    made: Option<Made>,
}

/// Samples, discs and light paths of a pair of maps.
#[derive(Clone, Copy)]
struct Made {
    block: Block,
    radii: RadiusSchedule,
    paths: u32,
}

/// A photon map for gather rays of records.
pub struct RecordPhotons<'m> {
    map: PhotonMap<'m>,
    sampler: &'m EmissionSampler<'m>,
    radii: RadiusSchedule,
    paths: u32,
}

impl RecordPhotons<'_> {
    /// The photons, for [`PathIntegrator::with_caustics`].
    pub fn merging(&self) -> CausticMerging<'_> {
        CausticMerging::new([&self.map; 2], self.sampler, self.radii, self.paths).beside_records(true)
    }
}

/// Consecutive samples that share a pair of maps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Block {
    first: u32,
    end: u32,
}

impl Block {
    /// The block of `sample`. Blocks have 2, 2, 4 and then always [`MOST_SAMPLES`] samples.
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

/// Light paths of a map for each sample that it serves, with `budget` times the usual photons; within
/// `most_rays` of a limited picture. Beside records there are more maps.
fn paths_per_sample(pixels: usize, budget: f64, beside_records: bool, most_rays: Option<f64>) -> usize {
    let paths = budget * PATHS_PER_SAMPLE * pixels as f64;
    let maps = if beside_records { FIRST_MAPS_BESIDE_RECORDS } else { FIRST_MAPS };
    let in_time = most_rays.map(|rays| rays * FIRST_SHARE / (maps * RAYS_PER_PATH));
    let paths = in_time.map_or(paths, |most| paths.min(most));
    (paths as usize).clamp(FEWEST_PATHS, MOST_PATHS)
}

/// Tasks of a map for so many light paths of a sample.
fn tasks(paths_per_sample: usize) -> usize {
    (paths_per_sample * (MOST_SAMPLES / 2) as usize).min(MOST_PATHS).div_ceil(PATHS_PER_TASK)
}

/// Memory of both maps with the usual photons for each of so many pixels.
pub(in crate::method) fn footprint(pixels: usize) -> Footprint {
    let paths = (PATHS_PER_SAMPLE * pixels as f64) as usize;
    let map = PhotonMapStore::footprint(tasks(paths.clamp(1, MOST_PATHS)) * PHOTONS_PER_TASK);
    map.and(map)
}

impl<'a> CausticPhotons<'a> {
    /// Memory for photons of `emission`, as many as there is memory for beside what is reserved; beside
    /// records, half as many. `None` where there is none.
    ///
    /// # Errors
    /// Those of [`MemorySource::take`].
    pub fn new(
        context: &RenderContext<'a>,
        emission: CausticEmission<'a>,
        settings: CausticSettings,
        memory: &mut impl MemorySource<'a>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let CausticSettings { beside_records, reserved, most_rays } = settings;
        let budget = emission.benefit.photon_budget();
        let paths_per_sample = paths_per_sample(context.pixels(), budget, beside_records, most_rays);
        let wanted = tasks(paths_per_sample);
        if !memory.has(least_footprint()) {
            return Ok(None);
        }
        let shares = if beside_records { 4 } else { 2 };
        let available = memory.available().saturating_sub(reserved) / shares;
        let tasks = wanted.min(available / PhotonMapStore::footprint(PHOTONS_PER_TASK).bytes()).max(1);
        Ok(Some(Self {
            context: *context,
            emission,
            beside_records,
            stores: PhotonMapPair::new(tasks * PHOTONS_PER_TASK, memory)?,
            paths_per_sample,
            most_paths: tasks * PATHS_PER_TASK,
            statistics: PhotonUse { caustic: Some(MapUse::of_tasks(wanted, tasks)), ..PhotonUse::default() },
            made: None,
        }))
    }

    /// Statistics of the maps so far.
    pub fn statistics(&self) -> PhotonUse {
        self.statistics
    }

    /// True if the photons of the first samples leave less variance for the work than paths alone. They are
    /// then the photons of the first samples of `receivers`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`](super::scratch).
    pub fn pays<F: Features>(
        &mut self,
        receivers: &impl Receivers<'a, F>,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let Passed { counters, is_complete } = self.make::<F>(Block::of(0), executor)?;
        if !is_complete {
            return Ok(false);
        }
        let (benefit, has_reuse) = (self.emission.benefit, receivers.has_reuse());
        let mean = benefit.mean as f32;
        let alone = benefit.path_tracing(&receivers.variance(None, mean, executor)?, has_reuse);
        let joined = self.lend(|photons| receivers.variance(photons, mean, executor))??;
        let light_rays = counters.rays as f64 / (2.0 * self.context.pixels() as f64);
        Ok(alone.exceeds(&joined, has_reuse, light_rays))
    }

    /// A round of `integrator` joined with the photons.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`](super::scratch).
    pub fn round<F: Features, E: LightEstimator<F, State = ()>, R: Sharing>(
        &mut self,
        integrator: &PathIntegrator<F, E, R>,
        round: &mut Round<impl Executor>,
    ) -> Result<(), OutOfMemory> {
        self.blocks::<F, _>(
            round,
            |round| round.next_sample(),
            |round, photons, end| {
                let integrator = integrator.with_caustics(photons);
                round.tiles(end, |tile, samples, scratch, pixels| {
                    integrator.run(tile, samples, WAVE, scratch, pixels)
                })
            },
        )
    }

    /// Calls `add` with the photons of each block of samples of `round` and the end of the block, from the
    /// sample on that is `next`.
    ///
    /// # Errors
    /// Those of [`CausticPhotons::round`] and of `add`.
    pub fn blocks<F: Features, X: Executor>(
        &mut self,
        round: &mut Round<X>,
        next: impl Fn(&Round<X>) -> Option<u32>,
        add: impl Fn(&mut Round<X>, CausticMerging, u32) -> Result<(), OutOfMemory>,
    ) -> Result<(), OutOfMemory> {
        while let Some(sample) = next(round) {
            let block = Block::of(sample);
            if self.made.is_none_or(|made| made.block != block) {
                let passed = self.make::<F>(block, round.executor)?;
                if !round.count(passed) {
                    return Ok(());
                }
            }
            self.lend(|photons| photons.map_or(Ok(()), |photons| add(round, photons, block.end)))??;
        }
        Ok(())
    }

    /// Photons for the gather rays of the cache of even samples, `half` 0, or of odd ones, 1; `None` where
    /// the round is over.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`](super::scratch).
    pub fn for_records<F: Features, E: Executor>(
        &mut self,
        half: u32,
        round: &mut Round<E>,
    ) -> Result<Option<RecordPhotons<'_>>, OutOfMemory> {
        self.made = None;
        let paths = self.most_paths.div_ceil(RECORD_PART);
        let radii = self.emission.radii.of_pixels(RECORD_RADIUS).after(FIRST_RADIUS, 0);
        let passed = self.trace::<F>(RECORD_MAP + half, paths, radii, round.executor)?;
        if !round.count(passed) {
            return Ok(None);
        }
        let Self { emission: CausticEmission { sampler, .. }, stores, .. } = self;
        let store = if half == 0 { &mut stores.even } else { &mut stores.odd };
        Ok(store.map()?.map(|map| RecordPhotons { map, sampler, radii, paths: paths as u32 }))
    }

    /// Lends `work` the photons that the picture has at the moment, if there are any.
    ///
    /// # Errors
    /// Those of [`PhotonMapStore::map`].
    pub fn lend<T>(&mut self, work: impl FnOnce(Option<CausticMerging>) -> T) -> Result<T, OutOfMemory> {
        let Self { emission: CausticEmission { sampler, .. }, beside_records, stores, made, .. } = self;
        let (Some(made), Some(maps)) = (made, stores.maps()?) else { return Ok(work(None)) };
        let merging = CausticMerging::new([&maps[0], &maps[1]], sampler, made.radii, made.paths);
        Ok(work(Some(merging.beside_records(*beside_records))))
    }

    /// The last map for samples of the picture, if there is one.
    ///
    /// # Errors
    /// Those of [`PhotonMapStore::map`].
    pub fn last_map(&mut self) -> Result<Option<PhotonMap<'_>>, OutOfMemory> {
        if self.made.is_none() { Ok(None) } else { self.stores.odd.map() }
    }

    /// Makes the pair of maps of `block`. They are there if both passes are complete.
    fn make<F: Features>(
        &mut self,
        block: Block,
        executor: &mut impl Executor,
    ) -> Result<Passed, OutOfMemory> {
        self.made = None;
        let CausticEmission { radii, benefit, .. } = self.emission;
        let paths = (self.paths_per_sample * block.samples() as usize).min(self.most_paths);
        let radii = radii.of_pixels(benefit.photon_budget() as f32).after(FIRST_RADIUS, block.first / 2);
        let mut passed = self.trace::<F>(block.first, paths, radii, executor)?;
        if passed.is_complete {
            let odd = self.trace::<F>(block.first + 1, paths, radii, executor)?;
            passed.counters += odd.counters;
            passed.is_complete = odd.is_complete;
        }
        self.made = passed.is_complete.then_some(Made { block, radii, paths: paths as u32 });
        Ok(passed)
    }

    /// Makes map `number` of `paths` light paths, among those of even or of odd samples.
    fn trace<F: Features>(
        &mut self,
        number: u32,
        paths: usize,
        radii: RadiusSchedule,
        executor: &mut impl Executor,
    ) -> Result<Passed, OutOfMemory> {
        let Self { context, emission, beside_records, stores, statistics, .. } = self;
        let tracer = photon_tracer::<F>(context, &emission.sampler, paths, radii, *beside_records);
        let store = if number.is_multiple_of(2) { &mut stores.even } else { &mut stores.odd };
        let size = (tracer.tasks() * PHOTONS_PER_TASK, PHOTONS_PER_TASK);
        let passed = executor.timed("photons", |executor| {
            store.fill(executor, size, |task, scratch, photons| tracer.run(task, number, scratch, photons))
        })?;
        if let (Some(map), Some(caustic)) = (store.map()?, &mut statistics.caustic) {
            statistics.maps += 1;
            caustic.add(paths, map.len());
        }
        Ok(passed)
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
