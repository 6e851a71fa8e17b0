//! Light paths whose vertices become virtual lights: a pass whose tasks make one set each.
//!
//! No camera path meets a light without extent, and no light sample passes a mirror. So caustics of points,
//! spots and directional lights are splatted to the camera with the weight 1 (Dutré et al. 1993).

use super::lights::{VirtualLight, holds_virtual_lights};
use crate::bsdf::{BsdfSample, Features};
use crate::film::Splat;
use crate::light::{EmissionSampler, LightType};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, Vertex, Visitor,
};
use crate::transport::walk::splats::SplatQueue;
use crate::transport::walk::subpath::{Vertex as Arrived, Walk};
use crate::transport::walk::sums::{Counts, Sums};
use crate::transport::walk::techniques::LightEnd;
use crate::transport::walk::vertex::Scatterer;

pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};
pub use crate::transport::walk::splats::TaskOutput;

/// Traces light paths.
#[derive(Clone, Copy)]
pub struct LightPass<'a, F> {
    context: SceneContext<'a, F>,
    emission: &'a EmissionSampler<'a>,
    settings: PathSettings,
    sets: usize,
}

impl<'a, F: Features> LightPass<'a, F> {
    /// A pass that makes `sets` sets.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        sets: usize,
    ) -> Self {
        Self { context, emission, settings, sets }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch().and(SplatQueue::footprint(PATHS_PER_TASK, PATHS_PER_TASK))
    }

    /// Makes set number `task` of pass number `pass` in `lights`, which has room for [`VERTICES_PER_TASK`],
    /// and the splats of hidden caustics, sorted by strips, in `splats`, with room for [`PATHS_PER_TASK`];
    /// none where that is empty. Each set by itself stands for all light, all splats together do.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`LightPass::scratch`].
    #[inline(never)]
    pub fn run(
        &self,
        (task, pass): (usize, u32),
        scratch: &mut Arena,
        lights: &mut [VirtualLight],
        splats: &mut [Splat],
        output: &mut TaskOutput,
    ) -> Result<Counters, OutOfMemory> {
        let Self { context, emission, settings, .. } = *self;
        let mut arena = scratch.scratch();
        let PathSettings { seed, max_depth, width, height } = settings;
        let queue = match splats.is_empty() {
            true => None,
            false => Some(SplatQueue::new((PATHS_PER_TASK, PATHS_PER_TASK), &mut arena)?),
        };
        let (sets, count) = (self.sets as f32, 0);
        let mut writer = Writer { pass: self, lights, count, sets, splats: queue };
        let paths = (self.sets * PATHS_PER_TASK) as u32;
        let walk = LightWalk { context, emission, seed, paths, max_depth };
        let mut counters = walk.follow(task, pass, &mut arena, &mut writer)?;
        let vertices = writer.count as u32;
        let size = [width, height];
        let finish = |queue: SplatQueue| queue.finish((&context, size), splats, &mut counters);
        let offsets = writer.splats.map(finish).unwrap_or_default();
        *output = TaskOutput { vertices, offsets };
        Ok(counters)
    }
}

/// Writes the virtual lights of a task.
struct Writer<'w, F> {
    pass: &'w LightPass<'w, F>,
    lights: &'w mut [VirtualLight],
    count: usize,
    sets: f32,
    splats: Option<SplatQueue<'w>>,
}

impl<F: Features> Writer<'_, F> {
    /// Splats light that nothing else finds.
    fn splat(&mut self, state: &LightPathState, vertex: &Vertex, counters: &mut Counters) {
        let LightPass { context, emission, settings, .. } = *self.pass;
        let Some(queue) = self.splats.as_mut().filter(|_| state.segments < settings.max_depth) else {
            return;
        };
        let counts = Counts { light_paths: 1.0, connections: 0.0, light_samples: 0.0 };
        let walk = Walk { context, emission, size: [settings.width, settings.height], counts };
        let at = Scatterer { point: vertex.point, bsdf: vertex.bsdf };
        let end = LightEnd {
            vertex: Arrived::new(at, -vertex.to_light),
            power: state.power.into(),
            factor: 1.0,
            path_sums: Sums::default(),
        };
        if let Some(sample) = walk.splat(&end, || vertex.visitor_pair(), |_| 0.0) {
            queue.push(sample, Rest::NONE, &context, counters);
        }
    }
}

impl<F: Features> Visitor for Writer<'_, F> {
    const DIMENSIONS: u32 = 5;
    const SEED: u64 = 0x7669_7274_7561_6c21;

    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let LightPass { context, emission, .. } = self.pass;
        // Mirrors and smooth glass alone have led it here.
        let is_hidden = state.from_caster == 1
            && !vertex.bsdf.is_delta()
            && emission.light_type(&context.lights, state.light) == LightType::Delta;
        if is_hidden {
            self.splat(state, vertex, counters);
        }
        if holds_virtual_lights(vertex.bsdf) {
            match self.lights.get_mut(self.count) {
                Some(slot) => {
                    *slot = VirtualLight::new(state, vertex, self.sets, is_hidden);
                    self.count += 1;
                }
                None => counters.dropped.unfinished += 1,
            }
        }
        Some(Continuation { most: MAX_CONTINUATION, specular_only: false })
    }

    fn has_densities(&self, _: &LightPathState, _: &Vertex) -> bool {
        false
    }

    fn leave(&self, state: &mut LightPathState, _: &Vertex, _: glam::Vec3, (sample, _): (&BsdfSample, bool)) {
        let is_mirrored = sample.delta && (state.segments == 1 || state.from_caster == 1);
        state.from_caster = u32::from(is_mirrored);
    }
}
