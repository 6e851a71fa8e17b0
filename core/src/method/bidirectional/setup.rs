//! Setup of bidirectional path tracing: memory by the settings and what is left, emission of light paths, and
//! a pilot that measures the number of light vertices and the radius of merges.

use super::{
    Bidirectional, BidirectionalSettings, FIRST_RADIUS, FIRST_SAMPLE_OF_PILOT, LightSubpaths, VertexMerging,
};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use crate::light::{EmissionSampler, luminance};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::emission_guide::{EmissionGuide, GuideSettings, Target};
use crate::method::pilot::PILOT_TILES;
use crate::method::splats::splats_of_tile;
use crate::method::{Executor, PhotonMapStore, RenderContext, caustics};
use crate::scene::Scene;
use crate::transport::bidirectional::Counts;
use crate::transport::bidirectional::light_pass::{PATHS_PER_TASK, TaskOutput, VERTICES_PER_TASK};
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::photon_mapping::deposit::PhotonFilter;

/// Pixels for each light path, where their number is left open; one where vertices are merged.
const PIXELS_PER_LIGHT_PATH: usize = 2;

/// Tasks of light paths of a sample at most.
const MOST_TASKS: usize = 1024;

/// Greatest radius of merges of the first sample, in pixels: where they bring 72 % of the light or more.
const WIDEST_RADIUS: f64 = 4.0;

/// Ratio of the light of merges and splats to all other from which on radii grow.
const WIDENING_RATIO: f64 = 0.8;

impl BidirectionalSettings {
    /// Tasks of light paths of a sample, for a picture of so many pixels.
    fn tasks(&self, pixels: usize, merges: bool) -> usize {
        let pixels_per_path = if merges { 1 } else { PIXELS_PER_LIGHT_PATH };
        let wanted = self.light_paths.map_or(pixels / pixels_per_path, |paths| paths as usize);
        wanted.div_ceil(PATHS_PER_TASK).clamp(1, MOST_TASKS)
    }

    /// Light vertices that `tasks` of light paths may store.
    fn stored(&self, tasks: usize, merges: bool) -> usize {
        if self.connections() > 0 || merges { tasks * VERTICES_PER_TASK } else { 0 }
    }
}

impl<'a, F: Features> Bidirectional<'a, F> {
    /// Memory of `tasks` of light paths, with room for `vertices`.
    fn footprint(tasks: usize, vertices: usize) -> Footprint {
        Footprint::default()
            .slice::<LightVertex>(vertices)
            .slice::<Splat>(tasks * VERTICES_PER_TASK)
            .slice::<TaskOutput>(tasks)
    }

    /// Memory of `tasks` of light paths and of their photons.
    fn footprint_of(tasks: usize, settings: &BidirectionalSettings, merges: bool) -> Footprint {
        let photons = if merges { tasks * VERTICES_PER_TASK } else { 0 };
        let photons = if merges { PhotonMapStore::footprint(photons) } else { Footprint::default() };
        Self::footprint(tasks, settings.stored(tasks, merges)).and(photons)
    }

    /// Memory of splats and light paths for a picture of `size` of `scene`.
    pub(in crate::method) fn usual_footprint(
        scene: &Scene,
        [width, height]: [u32; 2],
        settings: &BidirectionalSettings,
    ) -> Footprint {
        let merges = settings.merging.unwrap_or_else(|| caustics::are_possible(scene));
        let tasks = settings.tasks(width as usize * height as usize, merges);
        let splats = Footprint::default().slice::<[f32; 3]>(Tile::count(width, height) * PIXELS_PER_TILE);
        splats.and(Self::footprint_of(tasks, settings, merges))
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
        let RenderContext { scene, ref lights, settings: paths, .. } = *context;
        let pixels = Tile::count(paths.width, paths.height) * PIXELS_PER_TILE;
        let picture = Footprint::default().slice::<[f32; 3]>(pixels);
        let picture = memory.take("splats", picture)?.slice(pixels)?;
        let merges = settings.merging.unwrap_or_else(|| caustics::are_possible(scene));
        let wanted = if lights.is_empty() { 0 } else { settings.tasks(context.pixels(), merges) };
        let stored = |tasks: usize| settings.stored(tasks, merges);
        let bytes = |tasks: usize| Self::footprint_of(tasks, settings, merges).bytes();
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
            counts: Counts {
                light_paths: (tasks * PATHS_PER_TASK) as f32,
                connections: 0.0,
                light_samples: 1.0,
            },
            connections: settings.connections(),
            merging,
            vertices: arena.slice(stored)?,
            splats: arena.slice(tasks * VERTICES_PER_TASK)?,
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
        let Some((light, _)) = self.trace_light_paths(FIRST_SAMPLE_OF_PILOT + 1, executor)? else {
            return Ok(());
        };
        let share = self.share_of_light_paths(light, executor)?;
        if let Some(merging) = &mut self.merging {
            let widened = FIRST_RADIUS * share / (WIDENING_RATIO * (1.0 - share));
            merging.first_radius = widened.clamp(FIRST_RADIUS, WIDEST_RADIUS);
        }
        Ok(())
    }

    /// Mean fraction of a pixel's light that merges and splats bring, on a few tiles, by the light subpaths
    /// of the pilot.
    fn share_of_light_paths(
        &mut self,
        light: LightSubpaths,
        executor: &mut impl Executor,
    ) -> Result<f64, OutOfMemory> {
        let settings = self.context.settings;
        let (all, picture) = self.camera_paths(light)?;
        let Some(others) = all.without_light_of_merges() else { return Ok(0.0) };
        let mut shares = [(0.0, 0u32); PILOT_TILES];
        let tiles = Tile::spread_over(settings.width, settings.height, PILOT_TILES);
        let _ = executor.pass(tiles.zip(shares.iter_mut()), |_, (tile, share), worker| {
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
        let traced = self.trace_light_paths(FIRST_SAMPLE_OF_PILOT, executor)?;
        self.counts.connections = match traced.map_or(0, |(light, _)| light.stored) {
            0 => 0.0,
            mean => self.connections as f32 * self.counts.light_paths / mean as f32,
        };
        Ok(())
    }
}
