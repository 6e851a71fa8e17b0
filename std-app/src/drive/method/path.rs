//! Path tracing for the program.

use super::{CausticUse, Renderer, Stage};
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::threads::Threads;
use crate::drive::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::{Footprint, Line};
use halflight_core::method::Method as _;
use halflight_core::method::path::PathTracing;
use halflight_core::transport::{PathIntegrator, Pilot};

/// See the file.
pub(super) struct Paths<'a, F> {
    pub(super) method: PathTracing<'a, F>,
    pub(super) scratch: Vec<Vec<Line>>,
    /// Where photons of caustics were looked for in vain.
    pub(super) caustics: CausticUse,
}

impl<'a, F: Features> Paths<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        Self::with_scratch(stage, memory, PathTracing::<F>::scratch())
    }

    /// With working memory for more than paths.
    pub(super) fn with_scratch(
        stage: &Stage<'a>,
        memory: &mut Memory,
        scratch: Footprint,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let mut executor = Threads::new(workers, &mut scratch);
        let method = PathTracing::new(&stage.context(), settings.reuse, &mut executor)?;
        Ok(Self { method, scratch, caustics: CausticUse::default() })
    }

    /// Paths that share nothing, for looks before a picture that another method makes.
    pub(super) fn alone(stage: &Stage<'a>, scratch: Vec<Vec<Line>>) -> Self {
        Self { method: PathTracing::plain(&stage.context()), scratch, caustics: CausticUse::default() }
    }

    pub(super) fn tracer(&self) -> &PathIntegrator<'a, F> {
        self.method.integrator()
    }

    /// About the mean radiance of the picture.
    pub(super) fn mean(&mut self, stage: &Stage) -> Result<f32, RenderError> {
        Ok(self.method.mean_radiance(&mut Threads::new(stage.workers, &mut self.scratch))?)
    }

    /// A pilot of the picture, which is of `mean` radiance; and whether its pixels share.
    pub(super) fn pilot(&mut self, stage: &Stage, mean: f32) -> Result<(Pilot, bool), RenderError> {
        let pilot = self.method.variance(mean, &mut Threads::new(stage.workers, &mut self.scratch))?;
        Ok((pilot, self.method.reuse().used))
    }

    /// About the relative variance of a sample of the picture, which is of `mean` radiance.
    pub(super) fn noise(&mut self, stage: &Stage, mean: f32) -> Result<f64, RenderError> {
        let (pilot, shared) = self.pilot(stage, mean)?;
        Ok(pilot.noise(shared))
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
