//! Pilot of counts: a small picture by all techniques, with random numbers of its own. Each sample is
//! weighted once by the counts of the pilot, and once more with each class counted twice, which shows the
//! share of the class.
//!
//! The small picture has as many light paths for each pixel as a large one would, and merges in discs of as
//! many pixels, so that weights are the same. Noise is relative to the light of blocks of 8 × 8 pixels.

mod blocks;

use self::blocks::weigh;
use super::prediction::{CANDIDATES, CHOSEN, Candidate, Weighed, Work};
use super::rarity::{Rarity, RaritySums};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Splat, Tile};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::method::bidirectional::FIRST_RADIUS;
use crate::method::executor::{Executor, Passed, Worker};
use crate::method::{PhotonMapStore, RenderContext, light_vertices};
use crate::photon::PhotonMap;
use crate::transport::bidirectional::Counts;
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::contribution::Contribution;
use crate::transport::bidirectional::light_pass::{LightPass, PATHS_PER_TASK, TaskOutput, VERTICES_PER_TASK};
use crate::transport::bidirectional::merge_photons::{MergeRadii, Merging};
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::{Counters, PathSettings};
use bytemuck::{Pod, Zeroable};

/// Pixels of the small picture, at most.
const PIXELS: usize = 16 * PIXELS_PER_TILE;

/// Pixels of the picture for each of the small one, where nothing else is said.
pub const PART: usize = 8;

/// Samples of a pixel, each with light paths of its own.
const SAMPLES: u32 = 2;
const SAMPLE: f32 = 1.0 / SAMPLES as f32;

/// Connections of a camera vertex, and pixels for each light path; one where vertices are merged.
const CONNECTIONS: u32 = 2;
const PIXELS_PER_LIGHT_PATH: usize = 2;

/// Contributions to a tile by one sample that there is room for: more than camera paths of ten vertices
/// have.
const LIST: usize = 16 * PIXELS_PER_TILE;

/// Ways to weigh a sample: by the counts, and with each chosen class counted twice.
const WEIGHTINGS: usize = 1 + CHOSEN.len();

/// Pixels of a block, and blocks of a tile.
const BLOCK: usize = 64;
const BLOCKS: usize = PIXELS_PER_TILE / BLOCK;

/// Rests of light: beside caustic photons alone, beside records of irradiance, and beside those of lobes.
/// There are caustic photons beside records, too.
pub const RESTS: usize = 3;

/// Ways to find light: by the counts of each candidate, and by path tracing each of the rests, and emitters
/// that are seen.
const WAYS: usize = CANDIDATES + RESTS + 1;

/// Values of the pixels of a tile by each way, one sample less the other.
const SUMS: usize = WAYS * PIXELS_PER_TILE;

/// Result of a pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Noise with the counts of each candidate, in their order.
    pub candidates: [Rarity; CANDIDATES],
    /// Noise of path tracing, for each of the rests.
    pub rests: [Rarity; RESTS],
    /// Relative variance of emitters that are seen: that of their edges in large pixels, for all candidates.
    pub edges: f32,
    /// Work of its techniques.
    pub work: Work,
    /// Fraction of the light that merges bring.
    pub merged: f32,
}

/// Sums over the pixels of a block.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Block {
    /// Pixels, and their light.
    pixels: f32,
    light: f32,
    merged: f32,
    /// Shadow rays of connections.
    connections: f32,
    /// Variance and light by each way.
    ways: [RaritySums; WAYS],
    /// Second moment by each way.
    square: [f32; WAYS],
}

/// The light paths of a pass with the weights of one way.
struct Weighting<'m> {
    counts: Counts,
    radii: Option<MergeRadii>,
    vertices: &'m mut [LightVertex],
    splats: &'m mut [Splat],
    outputs: &'m mut [TaskOutput],
    stored: usize,
}

/// Working memory of a worker.
pub fn scratch<F: Features>() -> Footprint {
    let lists = Footprint::default().slice::<Contribution>(WEIGHTINGS * LIST).slice::<Weighed>(LIST);
    lists.and(CameraPaths::<F>::scratch(CONNECTIONS)).or(LightPass::<F>::scratch())
}

/// The small picture, with one pixel for each `part` of that of `settings`.
fn small(settings: PathSettings, part: usize) -> PathSettings {
    let PathSettings { width, height, seed, .. } = settings;
    let pixels = width as usize * height as usize;
    let part = (pixels as f32 / PIXELS as f32).max(part as f32);
    let scale = 1.0 / libm::sqrtf(part);
    let scaled = |pixels: u32| ((pixels as f32 * scale) as u32).max(1);
    // Numbers that the picture does not have.
    PathSettings { width: scaled(width), height: scaled(height), seed: !seed, ..settings }
}

/// Bytes of a pilot with `tasks` of light paths in a picture of `tiles`.
fn footprint(tasks: usize, tiles: usize, merging: bool) -> Footprint {
    let mut footprint = Footprint::default().slice::<Block>(tiles * BLOCKS).slice::<f32>(tiles * SUMS);
    for _ in 0..WEIGHTINGS {
        footprint = footprint
            .slice::<LightVertex>(tasks * VERTICES_PER_TASK)
            .slice::<Splat>(tasks * VERTICES_PER_TASK)
            .slice::<TaskOutput>(tasks);
    }
    let photons =
        if merging { PhotonMapStore::footprint(tasks * VERTICES_PER_TASK) } else { Footprint::default() };
    footprint.and(photons)
}

/// Settings of a pilot.
#[derive(Clone, Copy, Debug)]
pub struct PilotSettings {
    /// Pixels of the picture for each of the pilot.
    pub part: usize,
    /// Whether vertices merge: merges show what other techniques hardly find, even where no candidate has
    /// them.
    pub merging: bool,
    /// Whether the rests have caustic photons beside them.
    pub has_photons: bool,
}

/// Runs the pilot of a picture of `context` for `candidates`, whose light paths are those of `emission`.
/// `None` where memory is short or the executor is over.
///
/// # Errors
/// [`OutOfMemory`] where the scratch of the executor is smaller than [`scratch`].
pub fn run<'a, F: Features>(
    context: &RenderContext,
    emission: &EmissionSampler,
    (candidates, settings): (&[Candidate; CANDIDATES], PilotSettings),
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<Option<Found>, OutOfMemory> {
    let PilotSettings { part, merging, has_photons } = settings;
    let context = RenderContext { settings: small(context.settings, part), ..*context };
    let PathSettings { width, height, .. } = context.settings;
    let pixels_per_path = if merging { 1 } else { PIXELS_PER_LIGHT_PATH };
    let tasks = (context.pixels() / pixels_per_path).div_ceil(PATHS_PER_TASK).max(1);
    let footprint = footprint(tasks, Tile::count(width, height), merging);
    if !memory.has(footprint) {
        return Ok(None);
    }
    let light_paths = (tasks * PATHS_PER_TASK) as f32 / context.pixels() as f32;
    let counts = Candidate { light_paths, connections: CONNECTIONS, merging: true };
    let features = core::marker::PhantomData;
    let pilot = Pilot::<F> { context, emission, tasks, counts, candidates, has_photons, features };
    memory.lend("pilot", footprint, |_, arena| pilot.run(merging, arena, executor))
}

struct Pilot<'p, 'a, F> {
    context: RenderContext<'a>,
    emission: &'p EmissionSampler<'p>,
    tasks: usize,
    /// Its counts.
    counts: Candidate,
    candidates: &'p [Candidate; CANDIDATES],
    has_photons: bool,
    features: core::marker::PhantomData<F>,
}

impl<F: Features> Pilot<'_, '_, F> {
    fn run(
        &self,
        merging: bool,
        arena: &mut Arena,
        executor: &mut impl Executor,
    ) -> Result<Option<Found>, OutOfMemory> {
        let PathSettings { width, height, .. } = self.context.settings;
        let light_paths = (self.tasks * PATHS_PER_TASK) as f32;
        let tiles = Tile::count(width, height);
        let blocks = arena.slice::<Block>(tiles * BLOCKS)?;
        let sums = arena.slice::<f32>(tiles * SUMS)?;
        blocks.fill(Block::zeroed());
        sums.fill(0.0);
        let radii =
            MergeRadii { radii: self.context.radii().after(FIRST_RADIUS, 0), light_paths, emphasis: 1.0 };
        let counts = Counts { light_paths, connections: 1.0, light_samples: 1.0 };
        let mut weighting = || -> Result<_, OutOfMemory> {
            Ok(Weighting {
                counts,
                radii: merging.then_some(radii),
                vertices: arena.slice(self.tasks * VERTICES_PER_TASK)?,
                splats: arena.slice(self.tasks * VERTICES_PER_TASK)?,
                outputs: arena.slice(self.tasks)?,
                stored: 0,
            })
        };
        let [mut base, mut splats, mut connections, mut merges] =
            [weighting()?, weighting()?, weighting()?, weighting()?];
        // The mean number of vertices, by which a connection counts.
        if self.light_pass(0, &mut base, executor)?.is_none() {
            return Ok(None);
        }
        base.counts.connections = CONNECTIONS as f32 * light_paths / base.stored.max(1) as f32;
        splats.counts = Counts { light_paths: 2.0 * light_paths, ..base.counts };
        connections.counts = Counts { connections: 2.0 * base.counts.connections, ..base.counts };
        merges.counts = base.counts;
        merges.radii = base.radii.map(|radii| MergeRadii { emphasis: 2.0, ..radii });
        let mut weightings = [base, splats, connections, merges];
        let (mut light, mut camera) = (Counters::default(), Counters::default());
        let mut store = PhotonMapStore::over(arena.scratch());
        let scene = self.context.scene_context::<F>();
        for sample in 0..SAMPLES {
            for (i, weighting) in weightings.iter_mut().enumerate() {
                let Some(counters) = self.light_pass(sample, weighting, executor)? else { return Ok(None) };
                light += if i == 0 { counters } else { Counters::default() };
            }
            // All weightings have the same vertices, and photons.
            let base = &weightings[0].vertices[..weightings[0].stored];
            if merging && !light_vertices::map(&mut store, executor, &scene, base)?.is_complete {
                return Ok(None);
            }
            let (map, weightings) = (store.map()?, &weightings);
            let pieces = blocks.chunks_mut(BLOCKS).zip(sums.chunks_mut(SUMS));
            let Passed { counters, is_complete } =
                executor.pass(pieces, |tile, (blocks, sums), worker| {
                    self.tile((tile, sample), weightings, map.as_ref(), (blocks, sums), worker)
                })?;
            if !is_complete {
                return Ok(None);
            }
            camera += counters;
        }
        Ok(Some(self.sum(blocks, &light, &camera)))
    }

    /// Traces the light paths of `sample`. Their work; `None` where the executor is over.
    fn light_pass(
        &self,
        sample: u32,
        weighting: &mut Weighting,
        executor: &mut impl Executor,
    ) -> Result<Option<Counters>, OutOfMemory> {
        let Weighting { counts, radii, vertices, splats, outputs, stored } = weighting;
        let scene = self.context.scene_context::<F>();
        let light_paths = Counts { light_paths: (self.tasks * PATHS_PER_TASK) as f32, ..*counts };
        let pass = LightPass::new(scene, self.emission, self.context.settings, light_paths, *radii)
            .weighted_by(*counts, *radii);
        let tasks = vertices
            .chunks_mut(VERTICES_PER_TASK)
            .zip(splats.chunks_mut(VERTICES_PER_TASK))
            .zip(outputs.iter_mut());
        let Passed { counters, is_complete } =
            executor.pass(tasks, |task, ((vertices, splats), output), worker| {
                pass.run((task, sample), &mut worker.scratch, vertices, splats, output)
            })?;
        *stored = light_vertices::compact(vertices, outputs);
        Ok(is_complete.then_some(counters))
    }

    /// One sample of a tile, into its blocks and sums. The work of one weighting.
    #[inline(never)]
    fn tile(
        &self,
        (tile, sample): (usize, u32),
        weightings: &[Weighting; WEIGHTINGS],
        map: Option<&PhotonMap>,
        (blocks, sums): (&mut [Block], &mut [f32]),
        worker: &mut Worker,
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = worker.scratch.scratch();
        let lists = arena.slice::<Contribution>(WEIGHTINGS * LIST)?;
        let weighed = arena.slice::<Weighed>(LIST)?;
        let (mut counters, mut fewest) = (Counters::default(), LIST);
        for (i, (weighting, list)) in weightings.iter().zip(lists.chunks_mut(LIST)).enumerate() {
            let paths = self.camera_paths(weighting, map);
            let recorded = paths.contributions(tile, sample, list, &mut arena)?;
            fewest = fewest.min(recorded.contributions);
            if i == 0 {
                counters += recorded.counters;
                blocks[0].connections += recorded.connections as f32;
            }
        }
        let weighed = weigh(lists, fewest, weighed);
        self.add_camera_paths(weighed, (sample, sums), blocks);
        for (task, output) in weightings[0].outputs.iter().enumerate() {
            for i in 0..output.offsets().count().min(VERTICES_PER_TASK) {
                self.add_splat(tile, weightings, task * VERTICES_PER_TASK + i, blocks);
            }
        }
        if sample + 1 == SAMPLES {
            let PathSettings { width, height, .. } = self.context.settings;
            let pixels = Tile::new(width, height, tile);
            for place in (0..PIXELS_PER_TILE).filter(|place| pixels.pixel(*place).is_some()) {
                let block = &mut blocks[place / BLOCK];
                block.pixels += 1.0;
                for (way, sums) in block.ways.iter_mut().zip(sums.chunks(PIXELS_PER_TILE)) {
                    way.add_often(0.5 * sums[place] * sums[place]);
                }
            }
        }
        Ok(counters)
    }

    fn camera_paths<'w>(
        &'w self,
        weighting: &'w Weighting,
        map: Option<&'w PhotonMap<'w>>,
    ) -> CameraPaths<'w, F> {
        let vertices = &weighting.vertices[..weighting.stored];
        let connections = Connections { vertices, count: CONNECTIONS };
        let merging =
            map.zip(weighting.radii).map(|(photons, radii)| Merging { photons: *photons, vertices, radii });
        let scene = self.context.scene_context::<F>();
        CameraPaths::new(scene, self.emission, self.context.settings, weighting.counts, connections)
            .with_merging(merging)
    }
}
