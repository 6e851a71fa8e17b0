//! Path tracing: no structure beyond the hierarchy, so a round is its tiles.

use super::{Renderer, Stage};
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::transport::{PathTracer, path::WAVE};

/// See the file.
pub(super) struct Paths<'a, F> {
    tracer: PathTracer<'a, F>,
    scratch: Vec<Vec<Line>>,
    reuse: Reuse,
}

impl<'a, F: Features> Paths<'a, F> {
    pub(super) fn new(stage: &Stage<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, settings, workers } = *stage;
        let mut scratch = memory.take_each("paths", PathTracer::<F>::scratch(WAVE), workers.count())?;
        let tracer = PathTracer::<F>::new(scene, bvh, lights, path_settings(settings), settings.level);
        let reuse = match settings.reuse {
            Some(used) => Reuse { used, pilot: None },
            None => {
                let pilot = workers.pilot(&tracer, &mut scratch)?;
                Reuse { used: pilot.pays(), pilot: Some(pilot) }
            }
        };
        Ok(Self { tracer: tracer.with_reuse(reuse.used), scratch, reuse })
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
}
