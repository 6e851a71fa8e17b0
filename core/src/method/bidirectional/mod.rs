//! Bidirectional path tracing (Lafortune and Willems 1993; Veach 1997, chapter 10) with a cache of light
//! vertices (Davidovič et al. 2014), light tracing as the choice without connections, and vertex connection
//! and merging (Georgiev et al. 2012) as the one with all techniques.
//!
//! For each sample of the picture light paths are traced anew: the camera sees their vertices as splats,
//! each vertex of a camera path is connected to a few of them, and some are merged with those around them
//! (`transport/bidirectional/merging.rs`). The radii of merges shrink with samples as those of progressive
//! photon mapping do. Even and odd samples have light paths of their own, so that the halves of the film
//! stay independent.

mod setup;

use super::executor::{Executor, Passed};
use super::splats::{add_splats, splats_of_tile};
use super::{MethodKind, PhotonMapStore, RenderContext, RenderMethod, Round, light_vertices};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Splat};
use crate::light::EmissionSampler;
use crate::memory::{Footprint, OutOfMemory};
use crate::transport::bidirectional::Counts;
use crate::transport::bidirectional::camera_paths::{CameraPaths, Connections};
use crate::transport::bidirectional::light_pass::{LightPass, TaskOutput, VERTICES_PER_TASK};
use crate::transport::bidirectional::merge_photons::{MergeRadii, Merging};
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::{Counters, RadiusSchedule};

/// Radius of merges of the first sample, in pixels, at least.
pub(in crate::method) const FIRST_RADIUS: f64 = 1.25;

/// Number of the first sample of the pilot, which no picture has.
const FIRST_SAMPLE_OF_PILOT: u32 = 1 << 30;

/// Sample counts of the techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BidirectionalSettings {
    /// Light paths for each sample of the picture, in tasks of 1024; `None`: half as many as pixels, or as
    /// many if vertices are merged.
    pub light_paths: Option<u32>,
    /// Light vertices that a camera vertex is connected to; 0 is light tracing. `None`: 1.
    pub connections: Option<u32>,
    /// True if vertices are merged; `None`: if the scene has caustics.
    pub merging: Option<bool>,
}

impl BidirectionalSettings {
    /// Light tracing: neither connections nor merges.
    pub const LIGHT_TRACING: Self = Self { light_paths: None, connections: Some(0), merging: Some(false) };

    /// True if no count is left open.
    pub fn is_complete(&self) -> bool {
        self.light_paths.is_some() && self.connections.is_some() && self.merging.is_some()
    }

    /// The counts of the method of `kind`; others are open.
    pub(super) fn of(&self, kind: MethodKind) -> Self {
        match kind {
            MethodKind::LightTracing => Self { light_paths: self.light_paths, ..Self::LIGHT_TRACING },
            MethodKind::Bidirectional => Self { merging: Some(false), ..*self },
            _ => *self,
        }
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
    /// The light subpaths that are stored.
    traced: Option<LightSubpaths>,
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

/// The light subpaths of a sample.
#[derive(Clone, Copy)]
struct LightSubpaths {
    sample: u32,
    /// Their vertices.
    stored: usize,
}

impl VertexMerging<'_> {
    /// Radii of `sample`, which has `light_paths`; those of the pilot are the first.
    fn radii(&self, sample: u32, light_paths: f32) -> MergeRadii {
        let radii = self.radii.after(self.first_radius, sample % FIRST_SAMPLE_OF_PILOT / 2);
        MergeRadii { radii, light_paths, emphasis: 1.0 }
    }
}

impl<F: Features> RenderMethod for Bidirectional<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            let Some(light) = self.light_paths_of(sample, round)? else { return Ok(()) };
            let (camera_paths, splats) = self.camera_paths(light)?;
            round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                camera_paths.run(tile, samples, splats_of_tile(splats, tile), scratch, pixels)
            })?;
        }
        Ok(())
    }
}

impl<F: Features> Bidirectional<'_, F> {
    /// Working memory of a worker.
    pub fn scratch(settings: &BidirectionalSettings) -> Footprint {
        let paths = CameraPaths::<F>::scratch(settings.connections());
        LightPass::<F>::scratch().or(paths.slice::<Pixel>(2 * PIXELS_PER_TILE))
    }

    /// The light paths of `sample`: splats, stored vertices, and the photons of these. `None` where the round
    /// is over.
    fn light_paths_of<E: Executor>(
        &mut self,
        sample: u32,
        round: &mut Round<E>,
    ) -> Result<Option<LightSubpaths>, OutOfMemory> {
        // A round that ended within a sample has left its light paths.
        if self.traced.is_some_and(|traced| traced.sample == sample) {
            return Ok(self.traced);
        }
        self.traced = None;
        let traced =
            round.executor.timed("light paths", |executor| self.trace_light_paths(sample, executor))?;
        let Some((light, counters)) = traced else { return Ok(None) };
        round.state.counters += counters;
        self.totals = [self.totals[0] + self.counts.light_paths as u64, self.totals[1] + light.stored as u64];
        self.traced = Some(light);
        Ok(self.traced)
    }

    /// Camera paths that are connected to the stored light vertices and merged with their photons, and the
    /// splats, in the order of the film.
    fn camera_paths(
        &mut self,
        LightSubpaths { sample, stored }: LightSubpaths,
    ) -> Result<(CameraPaths<'_, F>, &[[f32; 3]]), OutOfMemory> {
        let Self { context, emission, counts, connections, vertices, picture, merging, .. } = self;
        let vertices = &vertices[..stored];
        let merging = match merging {
            Some(merging) => {
                let radii = merging.radii(sample, counts.light_paths);
                merging.photons.map()?.map(|photons| Merging { photons, vertices, radii })
            }
            None => None,
        };
        let connections = Connections { vertices, count: *connections };
        let paths =
            CameraPaths::new(context.scene_context(), emission, context.settings, *counts, connections);
        Ok((paths.with_merging(merging), picture))
    }

    /// Traces the light paths of `sample` and adds up their splats. The work as well; `None` where the
    /// executor is over.
    fn trace_light_paths(
        &mut self,
        sample: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<(LightSubpaths, Counters)>, OutOfMemory> {
        let Self { context, emission, counts, vertices, splats, outputs, picture, merging, .. } = self;
        let scene = context.scene_context::<F>();
        let radii = merging.as_ref().map(|merging| merging.radii(sample, counts.light_paths));
        let pass = LightPass::new(scene, emission, context.settings, *counts, radii);
        let rooms = vertices.chunks_mut(VERTICES_PER_TASK).map(Some).chain(core::iter::repeat_with(|| None));
        let tasks = splats.chunks_mut(VERTICES_PER_TASK).zip(outputs.iter_mut()).zip(rooms);
        let Passed { counters, is_complete } =
            executor.pass(tasks, |task, ((splats, output), vertices), worker| {
                let vertices = vertices.unwrap_or_default();
                pass.run((task, sample), &mut worker.scratch, vertices, splats, output)
            })?;
        if !is_complete {
            return Ok(None);
        }
        let (splats, outputs) = (&**splats, &**outputs);
        let lists = splats.chunks(VERTICES_PER_TASK).zip(outputs.iter().map(TaskOutput::offsets));
        if !add_splats(executor, picture, lists)? {
            return Ok(None);
        }
        let stored = light_vertices::compact(vertices, outputs);
        if let Some(VertexMerging { photons, .. }) = merging
            && !light_vertices::map(photons, executor, &scene, &vertices[..stored])?.is_complete
        {
            return Ok(None);
        }
        Ok(Some((LightSubpaths { sample, stored }, counters)))
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
