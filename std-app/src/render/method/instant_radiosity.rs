//! Instant radiosity in the program.

use super::{Method, Renderer, Stage, VirtualLightUse};
use crate::render::audit::Audit;
use crate::render::crew::Crew;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use crate::render::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::Method as _;
use halflight_core::method::instant_radiosity::InstantRadiosity;

/// Instant radiosity at work.
pub(super) struct VirtualLights<'a, F> {
    method: InstantRadiosity<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> VirtualLights<'a, F> {
    /// Sets up `method`, which finds or omits the light that the bound cuts.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        method: Method,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", InstantRadiosity::<F>::scratch(), workers.count())?;
        let others = Audit::bytes::<F>(stage, method.is_biased());
        let mut executor = Threads::new(workers, &mut scratch);
        let form = (method == Method::ClampedInstantRadiosity, settings.reuse);
        let (context, settings) = (stage.context(), &settings.virtual_lights);
        let method = InstantRadiosity::new(&context, settings, form, memory, &mut executor, others)?;
        Ok(Self { method, scratch })
    }
}

impl<F: Features> Renderer for VirtualLights<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn reuse(&self) -> Reuse {
        self.method.reuse()
    }

    fn virtual_lights(&self) -> Option<VirtualLightUse> {
        Some(self.method.used())
    }
}
