//! Path tracing with next-event estimation and multiple importance sampling (Kajiya 1986; Veach 1997, chapter
//! 9), and path reuse among neighbouring pixels (Bekaert et al. 2002) where a pilot finds that it pays.

use super::executor::Executor;
use super::{PilotSize, RenderContext, RenderMethod, Round, pilot};
use crate::bsdf::Features;
use crate::findings::Decision::{LeftOut, Used};
use crate::findings::{Finding, Findings, Value};
use crate::memory::{Footprint, OutOfMemory};
use crate::scene::Material;
use crate::transport::{PathIntegrator, PathReuse, Pilot, path::WAVE};

/// Use of path reuse among neighbouring pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reuse {
    /// True if neighbouring pixels share paths.
    pub used: bool,
    /// Samples of a few tiles with reuse and without; `None` where the caller has decided.
    pub pilot: Option<Pilot>,
}

impl Reuse {
    /// Finding on path reuse; `None` where the caller left it out.
    pub fn finding(&self) -> Option<Finding> {
        let Some(pilot) = self.pilot else {
            return self.used.then_some(Finding::new("path_reuse", Used, "requested"));
        };
        let finding = match self.used {
            true => Finding::new("path_reuse", Used, "it pays by a pilot"),
            false => Finding::new("path_reuse", LeftOut, "it costs more than it gains by a pilot"),
        };
        let [gain, cost] = [pilot.gain(), pilot.cost()].map(|value| Value::Number(value.into()));
        Some(finding.with("gain", gain).with("cost", cost))
    }
}

/// Path tracing of one picture.
#[derive(Clone, Copy)]
pub struct PathTracing<'a, F> {
    integrator: PathIntegrator<'a, F>,
    pilots: PilotSize,
    reuse: Reuse,
    /// Mean radiance of the picture, once it was measured.
    mean: Option<f32>,
}

impl<'a, F: Features> PathTracing<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch_with::<(), PathReuse>(WAVE)
    }

    /// Path tracing of `context`, with path `reuse` or without; `None` where a pilot decides. Scenes with
    /// tinted panes have none.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    pub fn new(
        context: &RenderContext<'a>,
        reuse: Option<bool>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let (integrator, pilots) = (context.integrator::<F>(), context.pilots);
        // The factor of a pane belongs to the path that has passed it, and not to those that share its light.
        let is_coloured = context.scene.materials.iter().any(Material::is_tinted_pane);
        let reuse = if is_coloured { Some(false) } else { reuse };
        let (reuse, mean) = match reuse {
            Some(false) => (Reuse::default(), None),
            Some(true) => {
                let mean = pilot::mean_radiance(&integrator, pilots, executor)?;
                (Reuse { used: true, pilot: None }, Some(mean))
            }
            None => {
                let mean = pilot::mean_radiance(&integrator, pilots, executor)?;
                let pilot = pilot::variance(&integrator, (mean, pilots), executor)?;
                (Reuse { used: pilot.pays(), pilot: Some(pilot) }, Some(mean))
            }
        };
        Ok(Self { integrator, pilots, reuse, mean })
    }

    /// The same without reuse and without a pilot, for measurements before another method's picture.
    pub fn plain(context: &RenderContext<'a>) -> Self {
        let (integrator, pilots) = (context.integrator(), context.pilots);
        Self { integrator, pilots, reuse: Reuse::default(), mean: None }
    }

    /// Its path tracer, without reuse.
    pub fn integrator(&self) -> &PathIntegrator<'a, F> {
        &self.integrator
    }

    /// Its path tracer with reuse, where pixels reuse paths.
    pub fn reusing(&self) -> Option<PathIntegrator<'a, F, (), PathReuse>> {
        let mean = self.mean.unwrap_or_default();
        self.reuse.used.then(|| self.integrator.with_reuse().with_firefly_limit(mean))
    }

    /// Use of path reuse, and its pilot.
    pub fn reuse(&self) -> Reuse {
        self.reuse
    }

    /// The mean radiance of the picture by its pilot, which runs if it has not.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    pub fn mean_radiance(&mut self, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        let mean = match self.mean {
            Some(mean) => mean,
            None => pilot::mean_radiance(&self.integrator, self.pilots, executor)?,
        };
        self.mean = Some(mean);
        Ok(mean)
    }

    /// Size of its pilots.
    pub fn pilots(&self) -> PilotSize {
        self.pilots
    }

    /// Variance and work of the samples of a picture of about `mean` radiance.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    pub fn variance(&self, mean: f32, executor: &mut impl Executor) -> Result<Pilot, OutOfMemory> {
        let measured = (mean, self.pilots);
        self.reuse.pilot.map_or_else(|| pilot::variance(&self.integrator, measured, executor), Ok)
    }
}

impl<F: Features> RenderMethod for PathTracing<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        if let Some(integrator) = self.reusing() {
            return round.tiles(u32::MAX, |tile, samples, scratch, pixels| {
                integrator.run(tile, samples, WAVE, scratch, pixels)
            });
        }
        let integrator = &self.integrator;
        round.tiles(u32::MAX, |tile, samples, scratch, pixels| {
            integrator.run(tile, samples, WAVE, scratch, pixels)
        })
    }

    fn findings(&self) -> Findings {
        Findings::default().and(self.reuse.finding())
    }
}
