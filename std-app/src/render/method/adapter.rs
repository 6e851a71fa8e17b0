//! A method of the core on the threads of the program.

use super::photon_view::{self, PhotonView};
use super::{Method, RenderSetup, Renderer};
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
    setup: RenderSetup<'a>,
    method: M,
    scratch: Vec<Vec<Line>>,
    chosen: Method,
    features: PhantomData<F>,
}

impl<'a, F: Features, M: method::Method> Adapter<'a, F, M> {
    /// The method that `new` makes with `scratch` for each thread, besides the bytes that the audit will take.
    pub(super) fn boxed<'s: 'a>(
        setup: &RenderSetup<'s>,
        memory: &mut Memory<'a>,
        (chosen, scratch): (Method, Footprint),
        new: impl FnOnce(&mut Memory<'a>, &mut Threads, usize) -> Result<M, OutOfMemory>,
    ) -> Result<Box<dyn Renderer + 'a>, RenderError>
    where
        M: 'a,
    {
        let mut scratch = memory.take_each("paths", scratch, setup.workers.count())?;
        let reserve = Audit::bytes::<F>(setup, chosen.is_biased());
        let method = new(memory, &mut Threads::new(setup.workers, &mut scratch), reserve)?;
        Ok(Box::new(Self::with(setup, (chosen, scratch), method)))
    }

    /// A method that is set up.
    pub(super) fn with(
        setup: &RenderSetup<'a>,
        (chosen, scratch): (Method, Vec<Vec<Line>>),
        method: M,
    ) -> Self {
        Self { setup: *setup, method, scratch, chosen, features: PhantomData }
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
        Ok(photon_view::render::<F>(&self.setup, &self.method.last_maps()?)?)
    }

    fn findings(&self) -> Findings {
        self.method.findings()
    }
}
