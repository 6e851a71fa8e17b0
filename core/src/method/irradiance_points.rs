//! Irradiance at many points by path tracing (Kajiya 1986): a film whose pixels are points.

use super::executor::Executor;
use super::{RenderContext, Round};
use crate::bsdf::Features;
use crate::film::PIXELS_PER_TILE;
use crate::memory::{Footprint, OutOfMemory};
use crate::transport::path::WAVE;
use crate::transport::{IrradiancePoint, LightPart, PathIntegrator};

/// Irradiance at the points of one scene. Pixel `i` of the film is point `i`.
#[derive(Clone, Copy)]
pub struct IrradiancePoints<'a, F> {
    integrator: PathIntegrator<'a, F>,
    points: &'a [IrradiancePoint],
    part: LightPart,
}

impl<'a, F: Features> IrradiancePoints<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch(WAVE)
    }

    /// Path tracing of this part of the light at `points`.
    pub fn new(context: &RenderContext<'a>, points: &'a [IrradiancePoint], part: LightPart) -> Self {
        Self { integrator: context.integrator(), points, part }
    }

    /// Samples of the tiles that are open.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn sample<E: Executor>(
        &self,
        round: &mut Round<E>,
        is_open: impl Fn(usize) -> bool + Send,
    ) -> Result<(), OutOfMemory> {
        let Self { integrator, points, part } = self;
        round.open_tiles(u32::MAX, is_open, |tile, samples, scratch, pixels| {
            let of_tile = points.chunks(PIXELS_PER_TILE).nth(tile).unwrap_or(&[]);
            integrator.sample_irradiance((of_tile, *part), samples, WAVE, scratch, pixels)
        })
    }
}
