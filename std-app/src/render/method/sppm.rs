//! Stochastic progressive photon mapping in the program.

use super::photon_view::{self, PhotonView};
use super::{Method, Renderer, Stage};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::crew::Crew;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::sppm::ProgressivePhotonMapping;
use halflight_core::method::{Method as _, PhotonUse};

/// Stochastic progressive photon mapping at work.
pub(super) struct ProgressivePhotons<'a, F> {
    stage: Stage<'a>,
    method: ProgressivePhotonMapping<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> ProgressivePhotons<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory<'a>) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let scratch = ProgressivePhotonMapping::<F>::scratch();
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let reserve = Audit::bytes::<F>(stage, Method::ProgressivePhotons.is_biased());
        let mut executor = Threads::new(workers, &mut scratch);
        let method = ProgressivePhotonMapping::new(
            &stage.context(),
            settings.photons,
            reserve,
            memory,
            &mut executor,
        )?;
        Ok(Self { stage: *stage, method, scratch })
    }
}

impl<F: Features> Renderer for ProgressivePhotons<'_, F> {
    fn chosen(&self) -> Option<Method> {
        Some(Method::ProgressivePhotons)
    }

    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        let Some(map) = self.method.map()? else { return Ok(None) };
        Ok(Some(photon_view::look::<F>(&self.stage, Some(&map), None)?))
    }

    fn photons(&self) -> Option<PhotonUse> {
        Some(self.method.photons())
    }
}
