//! The light pass of a sample of the picture: light paths whose vertices are stored for connections, and
//! splatted where the camera sees them (Veach 1997, section 10.2; Dutré et al. 1993).

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::film::Splat;
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::bidirectional::merge_photons::MergeRadii;
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, Vertex, Visitor,
};
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::walk::splats::SplatQueue;
use crate::transport::walk::subpath::{Vertex as Arrived, Walk};
use crate::transport::walk::sums::{Arrival, Counts, Sums};
use crate::transport::walk::techniques::LightEnd;
use crate::transport::walk::vertex::Scatterer;
use glam::Vec3;

pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};
pub use crate::transport::walk::splats::TaskOutput;

/// Dimensions of the sampler at a vertex of a light path.
pub(super) const DIMENSIONS: u32 = 5;

/// Distinguishes the random numbers of light paths from others.
pub(super) const SEED: u64 = 0x6269_6469_7265_6374;

/// Shadow rays to the camera that are traced together.
const SHADOW_RAYS: usize = 1024;

/// The pixel of a marked splat, and the records that do not supply its light.
pub fn marked(pixel: u32) -> (u32, Rest) {
    (ShadowTag(pixel).pixel(), ShadowTag(pixel).rest())
}

/// Traces the light paths of a sample.
#[derive(Clone, Copy)]
pub struct LightPass<'a, F> {
    context: SceneContext<'a, F>,
    emission: &'a EmissionSampler<'a>,
    settings: PathSettings,
    counts: Counts,
    merging: Option<MergeRadii>,
    /// Light paths of the pass.
    paths: u32,
    /// True if splats are marked ([`marked`]).
    is_marking: bool,
}

impl<'a, F: Features> LightPass<'a, F> {
    /// A pass with the light paths of `counts`, for merges where there are some.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        counts: Counts,
        merging: Option<MergeRadii>,
    ) -> Self {
        Self {
            context,
            emission,
            settings,
            counts,
            merging,
            paths: counts.light_paths as u32,
            is_marking: false,
        }
    }

    /// The same paths with the weights of other counts, and with marked splats ([`marked`]).
    pub fn weighted_by(self, counts: Counts, merging: Option<MergeRadii>) -> Self {
        Self { counts, merging, is_marking: true, ..self }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch().and(SplatQueue::footprint(VERTICES_PER_TASK, SHADOW_RAYS))
    }

    /// Traces the paths of `task` for sample number `sample`: their vertices into `vertices`, splats sorted
    /// by strips into `splats`, each with room for [`VERTICES_PER_TASK`].
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`LightPass::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        (task, sample): (usize, u32),
        scratch: &mut Arena,
        vertices: &mut [LightVertex],
        splats: &mut [Splat],
        output: &mut TaskOutput,
    ) -> Result<Counters, OutOfMemory> {
        let Self { context, emission, settings, counts, paths, .. } = *self;
        let PathSettings { seed, max_depth, width, height } = settings;
        let mut arena = scratch.scratch();
        let mut writer = Writer {
            pass: self,
            walk: Walk { context, emission, size: [width, height], counts },
            vertices,
            stored: 0,
            splats: SplatQueue::new((VERTICES_PER_TASK, SHADOW_RAYS), &mut arena)?,
        };
        let walk = LightWalk { context, emission, seed, paths, max_depth };
        let mut counters = walk.follow(task, sample, &mut arena, &mut writer)?;
        let Writer { stored, splats: queue, .. } = writer;
        let offsets = queue.finish((&context, [width, height]), splats, &mut counters);
        *output = TaskOutput { vertices: stored as u32, offsets };
        Ok(counters)
    }

    /// Tasks of a pass.
    pub fn tasks(&self) -> usize {
        (self.paths as usize).div_ceil(PATHS_PER_TASK)
    }
}

/// Stores and splats the vertices of a task.
struct Writer<'w, F> {
    pass: &'w LightPass<'w, F>,
    walk: Walk<'w, F>,
    vertices: &'w mut [LightVertex],
    stored: usize,
    splats: SplatQueue<'w>,
}

impl<F: Features> Writer<'_, F> {
    /// The vertex of the light path at `vertex`, with the sums of `state`.
    #[inline]
    fn vertex<'v>(state: &LightPathState, &Vertex { point, bsdf, to_light, .. }: &Vertex<'v>) -> Arrived<'v> {
        let at = Scatterer { point, bsdf };
        Arrived { sums: state.sums, ..Arrived::new(at, -to_light) }
    }

    /// η at a rough vertex and the way by which light comes there, if it may be merged. `None` at a caster.
    #[inline]
    fn merge(&self, state: &LightPathState, vertex: &Vertex) -> Option<(f32, Option<Arrival>)> {
        if vertex.bsdf.is_caustic_caster() {
            return None;
        }
        let position = vertex.point.position;
        let Some(radii) = self.pass.merging else { return Some((0.0, None)) };
        let eta_vcm = radii.eta_vcm(vertex.bsdf, position);
        if eta_vcm == 0.0 || state.segments == 1 {
            return Some((0.0, None));
        }
        let squared = position.distance_squared(state.position.into());
        let arrival = Arrival::of(state.from_caster == 1, squared, radii.near(eta_vcm));
        Some((if arrival.is_some() { eta_vcm } else { 0.0 }, arrival))
    }

    #[inline]
    fn store(&mut self, state: &LightPathState, vertex: &Vertex, counters: &mut Counters) {
        if self.pass.counts.connections == 0.0 && self.pass.merging.is_none() {
            return;
        }
        let merge = self.merge(state, vertex);
        let Some(slot) = self.vertices.get_mut(self.stored) else {
            counters.dropped.unfinished += 1;
            return;
        };
        *slot = LightVertex {
            position: vertex.point.position.to_array(),
            triangle: vertex.point.triangle,
            power: state.power,
            segments: state.segments.min(u32::from(u16::MAX)) as u16,
            to_light: vertex.to_light.to_array(),
            barycentric: vertex.barycentric,
            sums: Sums {
                pending_merge: merge.map_or(state.sums.pending_merge, |(eta_vcm, _)| eta_vcm),
                ..state.sums
            },
            ..LightVertex::default()
        }
        .with_arrival(merge.and_then(|(_, arrival)| arrival), state.history.rest());
        self.stored += 1;
    }

    /// Sends a shadow ray from the vertex to the lens, if the picture has a pixel there.
    #[inline]
    fn splat(&mut self, state: &LightPathState, vertex: &Vertex, arrived: Arrived, counters: &mut Counters) {
        // Light samples find direct light with less noise.
        if state.segments == 1 || state.segments + 1 > self.pass.settings.max_depth {
            return;
        }
        let merge = |reverse| match self.merge(state, vertex) {
            None => state.sums.pending_merge * reverse,
            Some((eta_vcm, Some(arrival))) if arrival.is_merged(1) => eta_vcm,
            Some(_) => 0.0,
        };
        let (power, path_sums) = (Rgb::from(state.power), Sums::default());
        let end = LightEnd { vertex: arrived, power, factor: 1.0, path_sums };
        if let Some(sample) = self.walk.splat(&end, || vertex.visitor_pair(), merge) {
            let rest = if self.pass.is_marking { state.history.rest() } else { Rest::NONE };
            self.splats.push(sample, rest, &self.walk.context, counters);
        }
    }
}

/// The way a light path goes on from `bsdf`: mirrors and dielectrics store nothing, and have no limit.
pub(super) fn continuation(bsdf: &Bsdf) -> Continuation {
    Continuation { most: if bsdf.is_delta() { 1.0 } else { MAX_CONTINUATION }, specular_only: false }
}

impl<F: Features> Visitor for Writer<'_, F> {
    const DIMENSIONS: u32 = DIMENSIONS;
    const SEED: u64 = SEED;

    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let mut arrived = Self::vertex(state, vertex);
        if arrived.is_bent {
            return None;
        }
        let origin = (state.light, state.origin.into());
        state.sums = match state.segments {
            1 => self.walk.sums_from_light(origin, &arrived),
            _ => self.walk.sums_from(&state.sums, state.position.into(), &arrived),
        };
        arrived.sums = state.sums;
        state.history = state.history.on_light_path(vertex.bsdf);
        if !vertex.bsdf.is_delta() {
            self.store(state, vertex, counters);
            self.splat(state, vertex, arrived, counters);
        }
        Some(continuation(vertex.bsdf))
    }

    fn leave(&self, state: &mut LightPathState, vertex: &Vertex, _: Vec3, (sample, _): (&BsdfSample, bool)) {
        let point = vertex.point;
        let eta_vcm = self.merge(state, vertex).map(|(eta_vcm, _)| eta_vcm);
        let step = (sample, point.frame.to_world(sample.direction));
        let arrived = Self::vertex(state, vertex);
        let sums = [(&self.pass.counts, &state.sums)];
        [state.sums] = self.walk.sums_behind(&arrived, step, sums, eta_vcm);
        state.from_caster = u32::from(sample.delta || vertex.bsdf.is_caustic_caster());
        state.position = point.position.to_array();
    }
}
