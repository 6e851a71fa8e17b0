//! Bidirectional path tracing (Lafortune and Willems 1993; Veach 1997, chapter 10) with a cache of light vertices
//! (Davidovič et al. 2014), and light tracing as the choice without connections.
//!
//! For each sample of the picture light paths are traced anew: the camera sees their vertices as splats, and each vertex
//! of a camera path is connected to a few of them. Even and odd samples have light paths of their own, so that the
//! halves of the film stay independent.

use super::executor::{Executor, Passed};
use super::{Method, RenderContext, Round};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Splat, Tile, add_strip, strip_length};
use crate::light::EmissionSampler;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::light_pass::{LightPass, ROOM, TaskOutput};
use crate::transport::bidirectional::mis::Counts;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::{Counters, bidirectional::light_pass::PATHS};

/// Pixels for each light path, where their number is left open.
const PIXELS_PER_LIGHT_PATH: usize = 2;

/// Light paths of a sample at most.
const MOST_TASKS: usize = 1024;

/// Number of the pass that measures how many vertices light paths have.
const PILOT: u32 = 1 << 30;

/// How often each technique is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BidirectionalSettings {
    /// Light paths for each sample of the picture, in tasks of 1024; `None`: half as many as pixels.
    pub light_paths: Option<u32>,
    /// Light vertices that a camera vertex is connected to; 0 is light tracing.
    pub connections: u32,
}

impl Default for BidirectionalSettings {
    fn default() -> Self {
        Self { light_paths: None, connections: 1 }
    }
}

/// A picture by bidirectional path tracing.
pub struct Bidirectional<'a, F> {
    context: RenderContext<'a>,
    emission: EmissionSampler<'a>,
    counts: Counts,
    connections: u32,
    vertices: &'a mut [LightVertex],
    splats: &'a mut [Splat],
    outputs: &'a mut [TaskOutput],
    /// Splats of the sample, in the order of the film.
    picture: &'a mut [[f32; 3]],
    /// The sample whose light paths are stored, and their vertices.
    traced: Option<(u32, usize)>,
    /// Light paths traced and vertices stored so far.
    totals: [u64; 2],
    features: core::marker::PhantomData<F>,
}

impl<'a, F: Features> Bidirectional<'a, F> {
    /// Working memory of a worker.
    pub fn scratch(settings: &BidirectionalSettings) -> Footprint {
        LightPass::<F>::scratch().or(CameraPaths::<F>::scratch(settings.connections))
    }

    /// Memory of `tasks` of light paths.
    fn footprint(tasks: usize, connections: u32) -> Footprint {
        let vertices = if connections > 0 { tasks * ROOM } else { 0 };
        Footprint::default()
            .slice::<LightVertex>(vertices)
            .slice::<Splat>(tasks * ROOM)
            .slice::<TaskOutput>(tasks)
    }

    /// Bidirectional path tracing of `context`, with fewer light paths where memory is short, leaving `others` bytes.
    ///
    /// # Errors
    /// [`OutOfMemory`] where there is no memory for 1024 light paths, or too little scratch.
    pub fn new(
        context: &RenderContext<'a>,
        settings: &BidirectionalSettings,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
        others: usize,
    ) -> Result<Self, OutOfMemory> {
        let RenderContext { scene, bvh, lights, settings: paths, .. } = *context;
        let footprint = EmissionSampler::footprint(lights);
        let emission =
            EmissionSampler::build(scene, lights, &bvh.bounds(), &mut memory.take("emission", footprint)?)?;
        let pixels = Tile::count(paths.width, paths.height) * PIXELS_PER_TILE;
        let picture = Footprint::default().slice::<[f32; 3]>(pixels);
        let picture = memory.take("splats", picture)?.slice(pixels)?;
        let wanted =
            settings.light_paths.map_or(context.pixels() / PIXELS_PER_LIGHT_PATH, |paths| paths as usize);
        let wanted = if lights.is_empty() { 0 } else { wanted.div_ceil(PATHS).clamp(1, MOST_TASKS) };
        let each = Self::footprint(1, settings.connections).bytes();
        let tasks = wanted.min(memory.available().saturating_sub(others) / each).max(wanted.min(1));
        let mut arena = memory.take("light paths", Self::footprint(tasks, settings.connections))?;
        let stored = if settings.connections > 0 { tasks * ROOM } else { 0 };
        let mut method = Self {
            context: *context,
            emission,
            counts: Counts { light_paths: (tasks * PATHS) as f32, connections: 0.0, light_samples: 1.0 },
            connections: settings.connections,
            vertices: arena.slice(stored)?,
            splats: arena.slice(tasks * ROOM)?,
            outputs: arena.slice(tasks)?,
            picture,
            traced: None,
            totals: [0; 2],
            features: core::marker::PhantomData,
        };
        if method.connections > 0 && tasks > 0 {
            method.measure(executor)?;
        }
        Ok(method)
    }

    /// Measures the mean number of vertices of a pass, M̄, and fixes the count of connections by it: C L / M̄.
    fn measure(&mut self, executor: &mut impl Executor) -> Result<(), OutOfMemory> {
        self.counts.connections = 1.0;
        let stored = self.light_pass(PILOT, executor)?.map(|(stored, _)| stored);
        let mean = stored.unwrap_or(0);
        self.counts.connections = match mean {
            0 => 0.0,
            _ => self.connections as f32 * self.counts.light_paths / mean as f32,
        };
        Ok(())
    }

    /// Traces the light paths of `sample` and adds up their splats. The vertices stored, and the work; `None` where the
    /// executor is over.
    fn light_pass(
        &mut self,
        sample: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<(usize, Counters)>, OutOfMemory> {
        let Self { context, emission, counts, vertices, splats, outputs, picture, .. } = self;
        let pass = LightPass::<F>::new(context.scene_context(), emission, context.settings, *counts);
        let rooms = vertices.chunks_mut(ROOM).map(Some).chain(core::iter::repeat_with(|| None));
        let tasks = splats.chunks_mut(ROOM).zip(outputs.iter_mut()).zip(rooms);
        let Passed { counters, is_complete } =
            executor.pass(tasks, |task, ((splats, output), vertices), worker| {
                let vertices = vertices.unwrap_or_default();
                pass.run((task, sample), &mut worker.scratch, vertices, splats, output)
            })?;
        if !is_complete {
            return Ok(None);
        }
        let (splats, outputs) = (&**splats, &**outputs);
        let length = strip_length(picture.len());
        let added = executor.pass(picture.chunks_mut(length), |strip, pixels, _| {
            let tasks = splats.chunks(ROOM).zip(outputs.iter().map(TaskOutput::offsets));
            add_strip(strip, length, tasks, pixels);
            Ok(Counters::default())
        })?;
        if !added.is_complete {
            return Ok(None);
        }
        // The vertices of all tasks, one after the other.
        let mut stored = 0;
        for (task, output) in outputs.iter().enumerate() {
            let first = task * ROOM;
            let count = output.vertices as usize;
            if count > 0 {
                vertices.copy_within(first..first + count, stored);
            }
            stored += count;
        }
        Ok(Some((stored, counters)))
    }

    /// Light paths of a sample.
    pub fn light_paths(&self) -> u32 {
        self.counts.light_paths as u32
    }

    /// Light paths traced and light vertices stored so far.
    pub fn totals(&self) -> [u64; 2] {
        self.totals
    }
}

impl<F: Features> Method for Bidirectional<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            // A round that ended within a sample has left its light paths.
            if self.traced.is_none_or(|(traced, _)| traced != sample) {
                self.traced = None;
                let traced =
                    round.executor.timed("light paths", |executor| self.light_pass(sample, executor))?;
                let Some((stored, counters)) = traced else { return Ok(()) };
                round.state.counters += counters;
                self.totals =
                    [self.totals[0] + self.counts.light_paths as u64, self.totals[1] + stored as u64];
                self.traced = Some((sample, stored));
            }
            let stored = self.traced.map_or(0, |(_, stored)| stored);
            let Self { context, emission, counts, connections, vertices, picture, .. } = &*self;
            let connections = Connections { vertices: &vertices[..stored], count: *connections };
            let paths = CameraPaths::<F>::new(
                context.scene_context(),
                emission,
                context.settings,
                *counts,
                connections,
            );
            round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                let first = tile * PIXELS_PER_TILE;
                let splats = picture.get(first..first + PIXELS_PER_TILE).unwrap_or_default();
                paths.run(tile, samples, splats, scratch, pixels)
            })?;
        }
        Ok(())
    }
}
