//! Bidirectional path tracing and light tracing for the program.

use super::{Method, Renderer, Stage};
use crate::render::RenderError;
use crate::render::audit::Audit;
use crate::render::crew::Crew;
use crate::render::memory::Memory;
use crate::render::threads::Threads;
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::Method as _;
use halflight_core::method::bidirectional::{Bidirectional, BidirectionalSettings};

/// See the file.
pub(super) struct BidirectionalPaths<'a, F> {
    method: Bidirectional<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> BidirectionalPaths<'a, F> {
    /// With connections, or with splats alone.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        has_connections: bool,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let connections = if has_connections { settings.bidirectional.connections } else { 0 };
        let bidirectional = BidirectionalSettings { connections, ..settings.bidirectional };
        let scratch = Bidirectional::<F>::scratch(&bidirectional);
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let others = Audit::bytes::<F>(stage, Method::Bidirectional.is_biased());
        let mut executor = Threads::new(workers, &mut scratch);
        let method = Bidirectional::new(&stage.context(), &bidirectional, memory, &mut executor, others)?;
        Ok(Self { method, scratch })
    }
}

impl<F: Features> Renderer for BidirectionalPaths<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        Ok(crew.round(&mut self.scratch, |round| self.method.round(round))?)
    }
}
