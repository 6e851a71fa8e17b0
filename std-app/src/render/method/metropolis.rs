//! Metropolis light transport in the program.

use super::{Method, Renderer, Stage};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::crew::Crew;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::Method as _;
use halflight_core::method::metropolis::{ChainUse, Metropolis};

/// Metropolis light transport at work.
pub(super) struct Chains<'a, F> {
    method: Metropolis<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> Chains<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory<'a>) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", Metropolis::<F>::scratch(), workers.count())?;
        let others = Audit::bytes::<F>(stage, Method::Metropolis.is_biased());
        let mut executor = Threads::new(workers, &mut scratch);
        let method = Metropolis::new(&stage.context(), &settings.metropolis, memory, &mut executor, others)?;
        Ok(Self { method, scratch })
    }
}

impl<F: Features> Renderer for Chains<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn chains(&self) -> Option<ChainUse> {
        Some(self.method.chains())
    }
}
