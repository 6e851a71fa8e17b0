//! Path tracing in the program.

use super::{CausticUse, Renderer, Stage};
use crate::render::crew::Crew;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use crate::render::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::Method as _;
use halflight_core::method::path::PathTracing;

/// Path tracing at work.
pub(super) struct Paths<'a, F> {
    pub(super) method: PathTracing<'a, F>,
    pub(super) scratch: Vec<Vec<Line>>,
    /// Finding of the prepass that rejected caustic photons.
    pub(super) caustics: CausticUse,
}

impl<'a, F: Features> Paths<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", PathTracing::<F>::scratch(), workers.count())?;
        let mut executor = Threads::new(workers, &mut scratch);
        let method = PathTracing::new(&stage.context(), settings.reuse, &mut executor)?;
        Ok(Self { method, scratch, caustics: CausticUse::default() })
    }
}

impl<F: Features> Renderer for Paths<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn reuse(&self) -> Reuse {
        self.method.reuse()
    }

    fn caustics(&self) -> CausticUse {
        self.caustics
    }
}
