//! Samples of a few tiles before the picture: its mean radiance, and what path reuse would bring.

use super::executor::Executor;
use crate::bsdf::Features;
use crate::memory::{Arena, OutOfMemory};
use crate::transport::{
    Counters, LightEstimator, PathIntegrator, Pilot, path::WAVE, path::reuse_pilot::PILOT_TILES,
};

/// The mean radiance of the picture.
///
/// # Errors
/// [`OutOfMemory`] where scratch has less than [`PathIntegrator::scratch_with`] bytes.
pub fn mean_radiance<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    executor: &mut impl Executor,
) -> Result<f32, OutOfMemory> {
    mean(integrator, executor, |tile, arena| integrator.pilot_mean(tile, WAVE, arena))
}

/// The mean radiance without what the photons of [`PathIntegrator::with_caustics`] bring.
///
/// # Errors
/// Those of [`mean_radiance`].
pub fn mean_radiance_without_photons<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    executor: &mut impl Executor,
) -> Result<f32, OutOfMemory> {
    mean(integrator, executor, |tile, arena| integrator.pilot_rest(tile, WAVE, arena))
}

fn mean<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    executor: &mut impl Executor,
    of_tile: impl Fn(usize, &mut Arena) -> Result<f32, OutOfMemory> + Sync,
) -> Result<f32, OutOfMemory> {
    let mut means = [None; PILOT_TILES];
    for_each_tile(integrator, executor, &mut means, of_tile)?;
    let count = means.iter().flatten().count();
    Ok(means.iter().flatten().sum::<f32>() / count.max(1) as f32)
}

/// Variance and work of samples with path reuse and without, in a picture of about `mean` radiance.
///
/// # Errors
/// Those of [`mean_radiance`].
pub fn variance<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    mean: f32,
    executor: &mut impl Executor,
) -> Result<Pilot, OutOfMemory> {
    let mut pilots = [None; PILOT_TILES];
    for_each_tile(integrator, executor, &mut pilots, |tile, arena| {
        integrator.pilot(tile, mean, WAVE, arena)
    })?;
    let mut pilot = Pilot::default();
    pilots.into_iter().flatten().for_each(|tile| pilot += tile);
    Ok(pilot)
}

/// Fills `out` with the values of the pilot's tiles; those that the executor did not come to stay `None`.
fn for_each_tile<F: Features, E: LightEstimator<F>, T: Send>(
    integrator: &PathIntegrator<F, E>,
    executor: &mut impl Executor,
    out: &mut [Option<T>; PILOT_TILES],
    of_tile: impl Fn(usize, &mut Arena) -> Result<T, OutOfMemory> + Sync,
) -> Result<(), OutOfMemory> {
    let tiles = integrator.pilot_tasks().zip(out.iter_mut());
    let _ = executor.pass(tiles, |_, (tile, out), worker| {
        *out = Some(of_tile(tile, &mut worker.scratch)?);
        Ok(Counters::default())
    })?;
    Ok(())
}
