//! Irradiance at many points by path tracing (Kajiya 1986): a film whose pixels are points, with caustic
//! photons where a pilot finds that they pay.

use super::caustics::{self, CausticPhotons, CausticSettings, CausticUse, PointReceivers, photons_that_pay};
use super::executor::Executor;
use super::{RenderContext, Round};
use crate::bsdf::Features;
use crate::film::PIXELS_PER_TILE;
use crate::findings::Findings;
use crate::light::LightSampler;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::scene::Scene;
use crate::transport::path::WAVE;
use crate::transport::{IrradiancePoint, LightEstimator, LightPart, PathIntegrator};

/// Receivers whose photon maps have room for the fewest light paths of a map.
const FEWEST_RECEIVERS: usize = 36 << 10;

/// Irradiance at the points of one scene. Pixel `i` of the film is point `i`.
pub struct IrradiancePoints<'a, F> {
    integrator: PathIntegrator<'a, F>,
    points: &'a [IrradiancePoint],
    part: LightPart,
    photons: Option<CausticPhotons<'a>>,
    caustics: CausticUse,
}

impl<'a, F: Features> IrradiancePoints<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        PointReceivers::<F>::scratch().or(caustics::scratch::<F>())
    }

    /// Memory of photons in `scene` for so many points.
    pub fn footprint(scene: &Scene, points: usize) -> Footprint {
        match caustics::are_possible(scene) {
            true => {
                let (lights, receivers) = (LightSampler::count_in(scene), points.max(FEWEST_RECEIVERS));
                PointReceivers::<F>::footprint(points).and(caustics::footprint(lights, receivers))
            }
            false => Footprint::default(),
        }
    }

    /// Path tracing of this part of the light at `points`, with `caustics` where they pay.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn new(
        context: &RenderContext<'a>,
        (points, part, caustics): (&'a [IrradiancePoint], LightPart, bool),
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        // Photons carry light that surfaces have scattered.
        let is_possible = caustics && part != LightPart::Direct && caustics::are_possible(context.scene);
        let footprint = PointReceivers::<F>::footprint(points.len());
        let (photons, caustics) = match is_possible && memory.has(footprint) {
            true => memory.lend("points", footprint, |memory, arena| {
                match PointReceivers::<F>::new(context, (points, part), arena, executor)? {
                    Some(mut receivers) => {
                        let settings = CausticSettings::default();
                        photons_that_pay(context, &mut receivers, settings, memory, executor)
                    }
                    None => Ok(Default::default()),
                }
            })?,
            false => (None, CausticUse { lacks_memory: is_possible, ..CausticUse::default() }),
        };
        Ok(Self { integrator: context.integrator(), points, part, photons, caustics })
    }

    /// Decisions and numbers of its photons.
    pub fn findings(&self) -> Findings {
        self.caustics.findings(self.photons.as_ref().map(CausticPhotons::statistics))
    }

    /// Samples of the tiles that are open.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn sample<E: Executor>(
        &mut self,
        round: &mut Round<E>,
        is_open: impl Fn(usize) -> bool + Copy + Send,
    ) -> Result<(), OutOfMemory> {
        let Self { integrator, points, part, photons, .. } = self;
        let Some(photons) = photons else {
            return sample(integrator, (points, *part), round, (u32::MAX, is_open));
        };
        let next = |round: &Round<E>| round.next_open_sample(is_open);
        photons.blocks::<F, E>(round, next, |round, merging, end| {
            sample(&integrator.with_caustics(merging), (points, *part), round, (end, is_open))
        })
    }
}

/// Brings the open tiles of `round` to `end` samples by `integrator`.
fn sample<F: Features, L: LightEstimator<F>>(
    integrator: &PathIntegrator<F, L>,
    (points, part): (&[IrradiancePoint], LightPart),
    round: &mut Round<impl Executor>,
    (end, is_open): (u32, impl Fn(usize) -> bool + Send),
) -> Result<(), OutOfMemory> {
    round.open_tiles(end, is_open, |tile, samples, scratch, pixels| {
        let of_tile = points.chunks(PIXELS_PER_TILE).nth(tile).unwrap_or(&[]);
        integrator.sample_irradiance((of_tile, part), samples, WAVE, scratch, pixels)
    })
}
