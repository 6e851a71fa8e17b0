//! A deliberately biased method: the right half of the picture is a tenth too bright, like a cache with 10 %
//! too much irradiance. Its noise does not reveal the bias.

use super::Renderer;
use crate::render::memory::Memory;
use crate::render::setup::RenderSetup;
use crate::render::threads::ThreadedRound;
use crate::render::{Method, RenderError};
use core::ops::Range;
use halflight_core::audit::AuditedMethod;
use halflight_core::bsdf::Features;
use halflight_core::film::{Dropped, PIXELS_PER_TILE, Pixel, Tile};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::{Counters, PathIntegrator, path::WAVE};

pub(in crate::render) const FACTOR: f32 = 1.1;

pub(super) struct Wrong<'a, F> {
    tracer: PathIntegrator<'a, F>,
    scratch: Vec<Vec<Line>>,
    size: [u32; 2],
}

impl<'a, F: Features> Wrong<'a, F> {
    pub(super) fn new(setup: &RenderSetup<'a>, memory: &mut Memory) -> Result<Self, RenderError> {
        let RenderSetup { settings, workers, .. } = *setup;
        let scratch = memory.take_each("paths", PathIntegrator::<F>::scratch(WAVE), workers.count())?;
        let tracer = setup.paths::<F>(settings.seed);
        Ok(Self { tracer, scratch, size: [settings.width, settings.height] })
    }
}

impl<F: Features> AuditedMethod<F> for Wrong<'_, F> {}

impl<F: Features> Renderer<F> for Wrong<'_, F> {
    fn chosen(&self) -> Method {
        Method::ClampedInstantRadiosity
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        let Self { tracer, scratch, size: [width, height] } = self;
        let sample = |task: usize, samples: Range<u32>, arena: &mut Arena, pixels: &mut [Pixel]| {
            let tile = Tile::new(*width, *height, task);
            let mut counters = Counters::default();
            for sample in samples {
                let mut one = [Pixel::default(); PIXELS_PER_TILE];
                counters += tracer.run(task, sample..sample + 1, WAVE, arena, &mut one)?;
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    if let Some((x, _)) = tile.pixel(i) {
                        let factor = if 2 * x >= *width { FACTOR } else { 1.0 };
                        pixel.add(sample, factor * one[i].mean(), &mut Dropped::default());
                    }
                }
            }
            Ok(counters)
        };
        Ok(round.run(scratch, |round| round.tiles(u32::MAX, sample))?)
    }
}
