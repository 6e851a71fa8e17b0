//! Receivers of caustic photons: the pixels of a picture. `points.rs` has points whose irradiance is
//! estimated.

use super::emission::FIRST_RADIUS;
use crate::bsdf::Features;
use crate::light::EmissionSampler;
use crate::memory::{Arena, OutOfMemory};
use crate::method::path::PathTracing;
use crate::method::{Executor, RenderContext, pilot};
use crate::photon::PhotonMap;
use crate::transport::{CausticMerging, Pilot, RadiusSchedule, SuppliedLobes};

/// Receivers of caustic photons, and pilots of the paths that find the rest of their light. Light is the
/// radiance of a surface.
pub trait Receivers<'a, F: Features> {
    /// Kernel radii of one receiver.
    fn radii(&self, context: &RenderContext<'a>) -> RadiusSchedule;

    /// Radius in receivers of the discs of the first sample: the disc has the area of the receivers that
    /// share a photon.
    fn first_radius(&self) -> f64;

    /// Points that receive the light; `None` for the camera.
    fn points(&self) -> Option<&PhotonMap<'_>>;

    /// Emission of photons by power.
    ///
    /// # Errors
    /// Insufficient memory in `arena`.
    fn emission<'m>(
        &self,
        context: &RenderContext<'a>,
        arena: &mut Arena<'m>,
    ) -> Result<EmissionSampler<'m>, OutOfMemory>;

    /// Mean light of all receivers.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    fn mean(&mut self, executor: &mut impl Executor) -> Result<f32, OutOfMemory>;

    /// Mean light beside photons, with the weights of `merging`.
    ///
    /// # Errors
    /// Those of [`Receivers::mean`].
    fn mean_beside(&self, merging: CausticMerging, executor: &mut impl Executor) -> Result<f32, OutOfMemory>;

    /// Relative variance of a sample by paths in a mean light, with the flag of light that records do not
    /// supply.
    ///
    /// # Errors
    /// Those of [`Receivers::mean`].
    fn noise(&self, light: (f32, bool), executor: &mut impl Executor) -> Result<f64, OutOfMemory>;

    /// Variance and work of samples with these photons, or by paths alone.
    ///
    /// # Errors
    /// Those of [`Receivers::mean`].
    fn variance(
        &self,
        photons: Option<CausticMerging>,
        mean: f32,
        executor: &mut impl Executor,
    ) -> Result<Pilot, OutOfMemory>;

    /// True if receivers share paths.
    fn has_reuse(&self) -> bool;
}

impl<'a, F: Features> Receivers<'a, F> for PathTracing<'a, F> {
    fn radii(&self, context: &RenderContext<'a>) -> RadiusSchedule {
        context.radii()
    }

    fn first_radius(&self) -> f64 {
        FIRST_RADIUS
    }

    fn points(&self) -> Option<&PhotonMap<'_>> {
        None
    }

    fn emission<'m>(
        &self,
        context: &RenderContext<'a>,
        arena: &mut Arena<'m>,
    ) -> Result<EmissionSampler<'m>, OutOfMemory> {
        context.emission(arena)
    }

    fn mean(&mut self, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        self.mean_radiance(executor)
    }

    fn mean_beside(&self, merging: CausticMerging, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        let integrator = self.integrator().with_caustics(merging);
        pilot::mean_radiance_without_photons(&integrator, self.pilots(), executor)
    }

    fn noise(
        &self,
        (mean, beside_records): (f32, bool),
        executor: &mut impl Executor,
    ) -> Result<f64, OutOfMemory> {
        if !beside_records {
            return Ok(PathTracing::variance(self, mean, executor)?.noise(self.reuse().used));
        }
        let paths = self.integrator().without_cached_light(SuppliedLobes::default());
        Ok(pilot::variance(&paths, (mean, self.pilots()), executor)?.noise(false))
    }

    fn variance(
        &self,
        photons: Option<CausticMerging>,
        mean: f32,
        executor: &mut impl Executor,
    ) -> Result<Pilot, OutOfMemory> {
        match photons {
            None => PathTracing::variance(self, mean, executor),
            Some(photons) => {
                let integrator = self.integrator().with_caustics(photons);
                pilot::variance(&integrator, (mean, self.pilots()), executor)
            }
        }
    }

    fn has_reuse(&self) -> bool {
        self.reuse().used
    }
}
