//! Path tracing: no structure beyond the hierarchy, so a round is its tiles.

use super::{CausticUse, Renderer, Stage};
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::{Footprint, Line};
use halflight_core::transport::{PathIntegrator, Pilot, path::WAVE};

/// See the file.
pub(super) struct Paths<'a, F> {
    pub(super) tracer: PathIntegrator<'a, F>,
    pub(super) scratch: Vec<Vec<Line>>,
    reuse: Reuse,
    /// The mean radiance of the picture by a first look, where there was one.
    mean: Option<f32>,
    /// Where photons of caustics were looked for in vain.
    pub(super) caustics: CausticUse,
}

impl<'a, F: Features> Paths<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        Self::with_scratch(stage, memory, PathIntegrator::<F>::scratch(WAVE))
    }

    /// With working memory for more than paths.
    pub(super) fn with_scratch(
        stage: &Stage<'a>,
        memory: &mut Memory,
        scratch: Footprint,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let tracer = stage.paths::<F>(settings.seed);
        let (reuse, mean) = match settings.reuse {
            Some(used) => {
                let mean = if used { Some(workers.pilot_mean(&tracer, &mut scratch)?) } else { None };
                (Reuse { used, pilot: None }, mean)
            }
            None => {
                let mean = workers.pilot_mean(&tracer, &mut scratch)?;
                let pilot = workers.pilot(&tracer, mean, &mut scratch)?;
                (Reuse { used: pilot.pays(), pilot: Some(pilot) }, Some(mean))
            }
        };
        let tracer = tracer.with_reuse(reuse.used).with_flashes(mean.unwrap_or_default());
        let caustics = CausticUse::default();
        Ok(Self { tracer, scratch, reuse, mean, caustics })
    }

    /// Paths that share nothing, for looks before a picture that another method makes.
    pub(super) fn alone(stage: &Stage<'a>, scratch: Vec<Vec<Line>>) -> Self {
        let Stage { settings, .. } = *stage;
        let tracer = stage.paths::<F>(settings.seed);
        Self { tracer, scratch, reuse: Reuse::default(), mean: None, caustics: CausticUse::default() }
    }

    /// About the mean radiance of the picture.
    pub(super) fn mean(&mut self, stage: &Stage) -> Result<f32, RenderError> {
        if self.mean.is_none() {
            // What neighbours share is not in their paths.
            let tracer = self.tracer.with_reuse(false);
            self.mean = Some(stage.workers.pilot_mean(&tracer, &mut self.scratch)?);
        }
        Ok(self.mean.unwrap_or_default())
    }

    /// A pilot of the picture, which is of `mean` radiance; and whether its pixels share.
    pub(super) fn pilot(&mut self, stage: &Stage, mean: f32) -> Result<(Pilot, bool), RenderError> {
        let pilot = match self.reuse.pilot {
            Some(pilot) => pilot,
            None => stage.workers.pilot(&self.tracer, mean, &mut self.scratch)?,
        };
        Ok((pilot, self.reuse.used))
    }

    /// About the relative variance of a sample of the picture, which is of `mean` radiance.
    pub(super) fn noise(&mut self, stage: &Stage, mean: f32) -> Result<f64, RenderError> {
        let (pilot, shared) = self.pilot(stage, mean)?;
        Ok(pilot.noise(shared))
    }
}

impl<F: Features> Renderer for Paths<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { tracer, scratch, .. } = self;
        crew.tiles(u32::MAX, scratch, &|task, samples, arena, pixels| {
            tracer.run(task, samples, WAVE, arena, pixels)
        })?;
        Ok(())
    }

    fn reuse(&self) -> Reuse {
        self.reuse
    }

    fn caustics(&self) -> CausticUse {
        self.caustics
    }
}
