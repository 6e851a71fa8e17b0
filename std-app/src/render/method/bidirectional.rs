//! Bidirectional path tracing, light tracing, and vertex connection and merging in the program.

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

/// One of these methods at work.
pub(super) struct BidirectionalPaths<'a, F> {
    method: Bidirectional<'a, F>,
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> BidirectionalPaths<'a, F> {
    /// Sets up the techniques of `chosen`.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        chosen: Method,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let BidirectionalSettings { light_paths, connections, merging } = settings.bidirectional;
        let bidirectional = match chosen {
            Method::LightTracing => {
                BidirectionalSettings { light_paths, ..BidirectionalSettings::LIGHT_TRACING }
            }
            Method::Bidirectional => BidirectionalSettings { light_paths, connections, merging: Some(false) },
            _ => BidirectionalSettings { light_paths, connections, merging },
        };
        let scratch = Bidirectional::<F>::scratch(&bidirectional);
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;
        let others = Audit::bytes::<F>(stage, chosen.is_biased());
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
