//! A method of the core on the threads of the program.

use super::photon_view::{self, PhotonView};
use super::{Method, Renderer, Stage};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::memory::Memory;
use crate::render::threads::{ThreadedRound, Threads};
use core::marker::PhantomData;
use halflight_core::bsdf::Features;
use halflight_core::findings::Findings;
use halflight_core::memory::{Footprint, Line, OutOfMemory};
use halflight_core::method;

/// A method with working memory for each thread.
pub(super) struct Adapter<'a, F, M> {
    stage: Stage<'a>,
    method: M,
    scratch: Vec<Vec<Line>>,
    chosen: Method,
    features: PhantomData<F>,
}

impl<'a, F: Features, M: method::Method> Adapter<'a, F, M> {
    /// The method that `new` makes with `scratch` for each thread, beside the bytes that the audit will take.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        (chosen, scratch): (Method, Footprint),
        new: impl FnOnce(&mut Memory<'a>, &mut Threads, usize) -> Result<M, OutOfMemory>,
    ) -> Result<Self, RenderError> {
        let mut scratch = memory.take_each("paths", scratch, stage.workers.count())?;
        let reserve = Audit::bytes::<F>(stage, chosen.is_biased());
        let method = new(memory, &mut Threads::new(stage.workers, &mut scratch), reserve)?;
        Ok(Self::with(stage, (chosen, scratch), method))
    }

    /// A method that is set up.
    pub(super) fn with(stage: &Stage<'a>, (chosen, scratch): (Method, Vec<Vec<Line>>), method: M) -> Self {
        Self { stage: *stage, method, scratch, chosen, features: PhantomData }
    }
}

impl<F: Features, M: method::Method> Renderer for Adapter<'_, F, M> {
    fn chosen(&self) -> Method {
        self.chosen
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        Ok(round.run(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(photon_view::render::<F>(&self.stage, &self.method.last_maps()?)?)
    }

    fn findings(&self) -> Findings {
        self.method.findings()
    }
}
