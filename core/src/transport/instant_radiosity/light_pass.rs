//! Light paths whose vertices become virtual lights: a pass whose tasks make one set each.

use super::caustic_splats::CausticSplats;
use super::lights::{VirtualLight, holds_virtual_lights};
use crate::bsdf::{BsdfSample, Features};
use crate::film::{Splat, StripOffsets};
use crate::light::{EmissionSampler, LightType};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, Vertex, Visitor,
};
use bytemuck::{Pod, Zeroable};

pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};

/// The outcome of a task beside its virtual lights and splats.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct SetOutput {
    /// Virtual lights.
    pub lights: u32,
    offsets: StripOffsets,
}

impl SetOutput {
    /// The splats of each strip in the task's list.
    pub fn offsets(&self) -> &StripOffsets {
        &self.offsets
    }
}

/// True if some caustics are found by light paths alone: those of lights without extent by mirrors and smooth
/// glass.
pub fn has_hidden_caustics<F: Features>(context: &SceneContext<F>) -> bool {
    context.has_mirrors && context.lights.has_delta_lights()
}

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
        LightWalk::<F>::scratch().and(CausticSplats::footprint())
    }

    /// Makes set number `task` of pass number `pass` in `lights`, which has room for [`VERTICES_PER_TASK`],
    /// and the splats of hidden caustics, sorted by strips, in `splats`, with room for [`PATHS_PER_TASK`];
    /// none where that is empty. Each set by itself stands for all light, all splats together do.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`LightPass::scratch`].
    pub fn run(
        &self,
        (task, pass): (usize, u32),
        scratch: &mut Arena,
        lights: &mut [VirtualLight],
        splats: &mut [Splat],
        output: &mut SetOutput,
    ) -> Result<Counters, OutOfMemory> {
        let Self { context, emission, settings, .. } = *self;
        let mut arena = scratch.scratch();
        let has_splats = !splats.is_empty();
        let caustics = if has_splats { Some(CausticSplats::new(&mut arena)?) } else { None };
        let (sets, count) = (self.sets as f32, 0);
        let mut writer = Writer { pass: self, lights, count, sets, caustics };
        let walk = LightWalk {
            context,
            emission,
            seed: settings.seed,
            paths: (self.sets * PATHS_PER_TASK) as u32,
            max_depth: settings.max_depth,
        };
        let mut counters = walk.follow(task, pass, &mut arena, &mut writer)?;
        let lights = writer.count as u32;
        let finish = |caustics: CausticSplats| caustics.finish((&context, &settings), splats, &mut counters);
        let offsets = writer.caustics.map(finish).unwrap_or_default();
        *output = SetOutput { lights, offsets };
        Ok(counters)
    }
}

/// Writes the virtual lights of a task.
struct Writer<'w, F> {
    pass: &'w LightPass<'w, F>,
    lights: &'w mut [VirtualLight],
    count: usize,
    sets: f32,
    caustics: Option<CausticSplats<'w>>,
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
        let LightPass { context, emission, settings, .. } = self.pass;
        // Mirrors and smooth glass alone have led it here.
        let is_hidden = state.from_caster == 1
            && !vertex.bsdf.is_delta()
            && emission.light_type(&context.lights, state.light) == LightType::Delta;
        if is_hidden && let Some(caustics) = &mut self.caustics {
            let _ = caustics.add((context, settings), state, vertex);
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
