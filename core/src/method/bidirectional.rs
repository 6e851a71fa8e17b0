//! Bidirectional path tracing (Lafortune and Willems 1993; Veach 1997, chapter 10) with a cache of light
//! vertices (Davidovič et al. 2014), light tracing as the choice without connections, and vertex connection
//! and merging (Georgiev et al. 2012) as the one with all techniques.
//!
//! For each sample of the picture light paths are traced anew: the camera sees their vertices as splats,
//! each vertex of a camera path is connected to a few of them, and some are merged with those around them
//! (`transport/bidirectional/merging.rs`). The radii of merges shrink with samples as those of progressive
//! photon mapping do. Even and odd samples have light paths of their own, so that the halves of the film
//! stay independent.

use super::emission_guide::{EmissionGuide, GuideSettings, Target};
use super::executor::{Executor, Passed};
use super::splats::{add_splats, splats_of_tile};
use super::{Method, PhotonMapStore, RenderContext, Round, caustics, light_vertices};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use crate::light::{EmissionSampler, luminance};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::light_pass::{LightPass, ROOM, TaskOutput};
use crate::transport::bidirectional::merge_photons::{MergeRadii, Merging};
use crate::transport::bidirectional::mis::Counts;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::photon_mapping::deposit::PhotonFilter;
use crate::transport::{Counters, RadiusSchedule, bidirectional::light_pass::PATHS};

/// Pixels for each light path, where their number is left open; one where vertices are merged.
const PIXELS_PER_LIGHT_PATH: usize = 2;

/// Light paths of a sample at most.
const MOST_TASKS: usize = 1024;

/// Radius of merges of the first sample, in pixels: at least, and at most where they bring nearly all light.
pub(in crate::method) const FIRST_RADIUS: f64 = 1.25;
const WIDEST_RADIUS: f64 = 4.0;

/// Ratio of the light of merges and splats to all other from which on radii grow.
const WIDENING_RATIO: f64 = 0.8;

/// Tiles that show this ratio.
const PILOT_TILES: usize = 16;

/// Number of the pass that measures how many vertices light paths have.
const PILOT: u32 = 1 << 30;

/// How often each technique is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BidirectionalSettings {
    /// Light paths for each sample of the picture, in tasks of 1024; `None`: half as many as pixels, or as
    /// many where vertices are merged.
    pub light_paths: Option<u32>,
    /// Light vertices that a camera vertex is connected to; 0 is light tracing. `None`: 1.
    pub connections: Option<u32>,
    /// Whether vertices are merged; `None`: where the scene has caustics.
    pub merging: Option<bool>,
}

impl BidirectionalSettings {
    /// Light tracing: neither connections nor merges.
    pub const LIGHT_TRACING: Self = Self { light_paths: None, connections: Some(0), merging: Some(false) };

    /// Whether nothing is left open.
    pub fn is_complete(&self) -> bool {
        self.light_paths.is_some() && self.connections.is_some() && self.merging.is_some()
    }

    fn connections(&self) -> u32 {
        self.connections.unwrap_or(1)
    }
}

/// A picture by bidirectional path tracing.
pub struct Bidirectional<'a, F> {
    context: RenderContext<'a>,
    emission: EmissionSampler<'a>,
    counts: Counts,
    connections: u32,
    merging: Option<VertexMerging<'a>>,
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

/// Radii of one pixel, and photons of a sample.
struct VertexMerging<'a> {
    radii: RadiusSchedule,
    /// Radius for the first sample, pixels.
    first_radius: f64,
    photons: PhotonMapStore<'a>,
}

impl VertexMerging<'_> {
    /// Radii of `sample`, which has `light_paths`; those of the pilot are the first.
    fn radii(&self, sample: u32, light_paths: f32) -> MergeRadii {
        let radii = self.radii.after(self.first_radius, sample % PILOT / 2);
        MergeRadii { radii, light_paths, emphasis: 1.0 }
    }
}

impl<'a, F: Features> Bidirectional<'a, F> {
    /// Working memory of a worker.
    pub fn scratch(settings: &BidirectionalSettings) -> Footprint {
        let paths = CameraPaths::<F>::scratch(settings.connections());
        LightPass::<F>::scratch().or(paths.slice::<Pixel>(2 * PIXELS_PER_TILE))
    }

    /// Memory of `tasks` of light paths, with room for `vertices`.
    fn footprint(tasks: usize, vertices: usize) -> Footprint {
        Footprint::default()
            .slice::<LightVertex>(vertices)
            .slice::<Splat>(tasks * ROOM)
            .slice::<TaskOutput>(tasks)
    }

    /// Bidirectional path tracing of `context`, with fewer light paths where memory is short, leaving
    /// `others` bytes.
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
        let RenderContext { scene, lights, settings: paths, .. } = *context;
        let pixels = Tile::count(paths.width, paths.height) * PIXELS_PER_TILE;
        let picture = Footprint::default().slice::<[f32; 3]>(pixels);
        let picture = memory.take("splats", picture)?.slice(pixels)?;
        let merges = settings.merging.unwrap_or_else(|| caustics::are_possible(scene));
        let pixels_per_path = if merges { 1 } else { PIXELS_PER_LIGHT_PATH };
        let wanted = settings.light_paths.map_or(context.pixels() / pixels_per_path, |paths| paths as usize);
        let wanted = if lights.is_empty() { 0 } else { wanted.div_ceil(PATHS).clamp(1, MOST_TASKS) };
        let has_vertices = settings.connections() > 0 || merges;
        let stored = |tasks: usize| if has_vertices { tasks * ROOM } else { 0 };
        let bytes = |tasks: usize| {
            let photons = if merges { PhotonMapStore::footprint(tasks * ROOM).bytes() } else { 0 };
            Self::footprint(tasks, stored(tasks)).bytes() + photons
        };
        let reserve = others.saturating_add(bytes(1));
        let emission = Self::emission(context, (merges, reserve), memory, executor)?;
        let available = memory.available().saturating_sub(others);
        let mut tasks = wanted.min(available / bytes(1)).max(wanted.min(1));
        while tasks > 1 && bytes(tasks) > available {
            tasks -= 1;
        }
        let stored = stored(tasks);
        let mut arena = memory.take("light paths", Self::footprint(tasks, stored))?;
        let merging = match merges && tasks > 0 {
            true => Some(VertexMerging {
                radii: context.radii(),
                first_radius: FIRST_RADIUS,
                photons: PhotonMapStore::new(stored, memory)?,
            }),
            false => None,
        };
        let mut method = Self {
            context: *context,
            emission,
            counts: Counts { light_paths: (tasks * PATHS) as f32, connections: 0.0, light_samples: 1.0 },
            connections: settings.connections(),
            merging,
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
        if method.merging.is_some() {
            method.widen(executor)?;
        }
        Ok(method)
    }

    /// Widens merges where light paths bring most of the light: photons are most of the noise there.
    fn widen(&mut self, executor: &mut impl Executor) -> Result<(), OutOfMemory> {
        let Some((stored, _)) = self.light_pass(PILOT + 1, executor)? else { return Ok(()) };
        let share = self.share_of_light_paths(stored, executor)?;
        if let Some(merging) = &mut self.merging {
            let widened = FIRST_RADIUS * share / (WIDENING_RATIO * (1.0 - share));
            merging.first_radius = widened.clamp(FIRST_RADIUS, WIDEST_RADIUS);
        }
        Ok(())
    }

    /// Mean fraction of a pixel's light that merges and splats bring, on a few tiles, by the `stored`
    /// vertices of the pilot.
    fn share_of_light_paths(
        &mut self,
        stored: usize,
        executor: &mut impl Executor,
    ) -> Result<f64, OutOfMemory> {
        let Self { context, emission, counts, connections, vertices, picture, merging, .. } = self;
        let Some(merging) = merging else { return Ok(0.0) };
        let radii = merging.radii(PILOT, counts.light_paths);
        let Some(photons) = &merging.photons.map()? else { return Ok(0.0) };
        let vertices = &vertices[..stored];
        let connections = Connections { vertices, count: *connections };
        let (scene, settings) = (context.scene_context::<F>(), context.settings);
        let paths = CameraPaths::new(scene, emission, settings, *counts, connections);
        let paths_with = |vertices| paths.with_merging(Some(Merging { photons, vertices, radii }));
        // A merge with a vertex that is not there brings nothing.
        let (all, others) = (paths_with(vertices), paths_with(&[]));
        let mut shares = [(0.0, 0u32); PILOT_TILES];
        let tiles = Tile::count(settings.width, settings.height);
        let _ = executor.pass(shares.iter_mut().take(tiles), |number, share, worker| {
            let tile = number * tiles / PILOT_TILES.min(tiles);
            let mut arena = worker.scratch.scratch();
            let pixels: &mut [Pixel] = arena.slice(2 * PIXELS_PER_TILE)?;
            pixels.fill(Pixel::default());
            let (of_all, of_others) = pixels.split_at_mut(PIXELS_PER_TILE);
            let mut counters = all.run(tile, 0..1, splats_of_tile(picture, tile), &mut arena, of_all)?;
            counters += others.run(tile, 0..1, &[], &mut arena, of_others)?;
            for (all, others) in of_all.iter().zip(of_others) {
                let [all, others] = [all, others].map(|pixel| f64::from(luminance(pixel.even.sum())));
                if all > 0.0 {
                    *share = (share.0 + (1.0 - others / all).max(0.0), share.1 + 1);
                }
            }
            Ok(counters)
        })?;
        let (sum, pixels) = shares.iter().fold((0.0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
        Ok(sum / f64::from(pixels.max(1)))
    }

    /// The emission of light paths, guided to visible surfaces, or to caustics where vertices are merged,
    /// leaving `reserve` bytes.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small for lights by power, or the executor's scratch
    /// for light paths.
    pub fn emission(
        context: &RenderContext,
        (merges, reserve): (bool, usize),
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<EmissionSampler<'a>, OutOfMemory> {
        let guide = GuideSettings {
            filter: if merges { PhotonFilter::Caustic } else { PhotonFilter::Reflected },
            max_depth: context.settings.max_depth,
            target: Target::Visible(FIRST_RADIUS as f32),
            reserve,
        };
        Ok(EmissionGuide::learn::<F>(context, guide, memory, executor)?.emission)
    }

    /// Measures the mean number of vertices of a pass, M̄, and fixes the count of connections by it: C L /
    /// M̄.
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

    /// Traces the light paths of `sample` and adds up their splats. The vertices stored, and the work;
    /// `None` where the executor is over.
    fn light_pass(
        &mut self,
        sample: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<(usize, Counters)>, OutOfMemory> {
        let Self { context, emission, counts, vertices, splats, outputs, picture, merging, .. } = self;
        let scene = context.scene_context::<F>();
        let radii = merging.as_ref().map(|merging| merging.radii(sample, counts.light_paths));
        let pass = LightPass::new(scene, emission, context.settings, *counts, radii);
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
        let lists = splats.chunks(ROOM).zip(outputs.iter().map(TaskOutput::offsets));
        if !add_splats(executor, picture, lists)? {
            return Ok(None);
        }
        let stored = light_vertices::compact(vertices, outputs);
        if let Some(VertexMerging { photons, .. }) = merging
            && !light_vertices::map(photons, executor, &scene, &vertices[..stored])?.is_complete
        {
            return Ok(None);
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
            let Self { context, emission, counts, connections, vertices, picture, merging, .. } = self;
            let vertices = &vertices[..stored];
            let radii = merging.as_ref().map(|merging| merging.radii(sample, counts.light_paths));
            let map = merging.as_mut().map(|merging| merging.photons.map()).transpose()?.flatten();
            let merging =
                map.as_ref().zip(radii).map(|(photons, radii)| Merging { photons, vertices, radii });
            let connections = Connections { vertices, count: *connections };
            let (scene, emission) = (context.scene_context::<F>(), &*emission);
            let paths = CameraPaths::new(scene, emission, context.settings, *counts, connections)
                .with_merging(merging);
            round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                paths.run(tile, samples, splats_of_tile(picture, tile), scratch, pixels)
            })?;
        }
        Ok(())
    }
}
